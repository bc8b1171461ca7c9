//! Two ends on this machine, one of which may not play along.

use std::net::TcpListener;

use super::*;
use crate::driver::vrpn::message::{Placement, SensorPose};

/// Both ends of a connection.
pub(in crate::driver::vrpn) fn pair() -> (TcpStream, TcpStream) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let one = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    (one, listener.accept().unwrap().0)
}

/// What comes within a while, until there is as much as wanted.
pub(in crate::driver::vrpn) fn messages(endpoint: &mut Endpoint, wanted: usize) -> Vec<Message> {
    let begun = Instant::now();
    let mut messages = Vec::new();
    while messages.len() < wanted && begun.elapsed().as_secs() < 20 {
        endpoint.flush().unwrap();
        endpoint
            .receive(Duration::from_millis(5), |event| {
                if let Event::Message { message, .. } = event {
                    messages.push(message);
                }
            })
            .unwrap();
    }
    messages
}

fn pose(x: f64) -> Message {
    Message::PosQuat(SensorPose {
        sensor: 0,
        at: Placement {
            position: [x, 0.0, 0.0],
            rotation: [0.0, 0.0, 0.0, 1.0],
        },
    })
}

fn udp_port(endpoint: &Endpoint) -> u16 {
    let datagrams = endpoint.datagrams.as_ref().unwrap();
    datagrams.socket.local_addr().unwrap().port()
}

#[test]
fn messages_go_both_ways_with_and_without_datagrams() {
    for with_datagrams in [false, true] {
        let (one, other) = pair();
        let mut one = Endpoint::new(one, with_datagrams).unwrap();
        let mut other = Endpoint::new(other, with_datagrams).unwrap();
        one.describe("Hand0", Kind::ALL);
        other.describe("Hand0", Kind::ALL);
        one.send(Service::Reliable, &Message::Ping);
        one.flush().unwrap();
        assert_eq!(messages(&mut other, 1), [Message::Ping]);
        other.send(Service::Reliable, &Message::Pong);
        other.flush().unwrap();
        assert_eq!(messages(&mut one, 1), [Message::Pong]);
        assert_eq!(one.version(), Some("07.38"));
        // More than one datagram holds.
        let poses: Vec<Message> = (0..40).map(|k| pose(f64::from(k))).collect();
        for pose in &poses {
            one.send(Service::Newest, pose);
        }
        one.flush().unwrap();
        assert_eq!(messages(&mut other, 40), poses);
        let took_datagrams = other.datagrams.as_ref().is_some_and(|d| d.is_heard);
        assert_eq!(took_datagrams, with_datagrams);
    }
}

#[test]
fn datagram_that_makes_no_sense_is_left_out_and_the_link_goes_on() {
    let (one, other) = pair();
    let mut one = Endpoint::new(one, true).unwrap();
    let mut other = Endpoint::new(other, true).unwrap();
    other.describe("Hand0", Kind::ALL);
    other.send(Service::Reliable, &Message::Pong);
    other.flush().unwrap();
    assert_eq!(messages(&mut one, 1), [Message::Pong]);
    let anybody = UdpSocket::bind("127.0.0.1:0").unwrap();
    let to = SocketAddr::from(([127, 0, 0, 1], udp_port(&one)));
    for bytes in [b"nonsense".as_slice(), &[0; 24], &[0xff; 1400], b""] {
        anybody.send_to(bytes, to).unwrap();
    }
    other.send(Service::Reliable, &pose(0.5));
    other.flush().unwrap();
    assert_eq!(messages(&mut one, 1), [pose(0.5)]);
}

#[test]
fn datagrams_go_to_the_address_of_the_connection_alone() {
    let (one, other) = pair();
    let mut one = Endpoint::new(one, true).unwrap();
    let mut other = Endpoint::new(other, false).unwrap();
    // The other side names a third one.
    let mut lie = Vec::new();
    other.ours.describe_udp(4711, "192.0.2.1", &mut lie);
    other.waiting.extend(lie);
    other.describe("Hand0", Kind::ALL);
    other.send(Service::Reliable, &Message::Pong);
    other.flush().unwrap();
    messages(&mut one, 1);
    let to = one.datagrams.as_ref().unwrap().to;
    assert_eq!(to, Some(SocketAddr::from(([127, 0, 0, 1], 4711))));
}

#[test]
fn other_side_that_does_not_read_costs_a_bounded_memory_and_then_the_link() {
    let (one, _other) = pair();
    let mut one = Endpoint::new(one, false).unwrap();
    let begun = Instant::now();
    let mut was_congested = false;
    let broken = loop {
        assert!(begun.elapsed().as_secs() < 20);
        let waiting = one.waiting.len();
        one.send(Service::Newest, &pose(0.0));
        // Until the system takes no more, which it may do again for a moment.
        if one.is_congested() {
            was_congested = true;
            assert_eq!(one.waiting.len(), waiting, "a newer one will follow");
            std::thread::sleep(Duration::from_millis(1));
        }
        if let Err(broken) = one.flush() {
            break broken;
        }
    };
    assert!(was_congested);
    assert_eq!(broken, Broken::Stuck);
    let waiting = one.waiting.len();
    assert!(waiting < WAITING_MAX);
    one.send(Service::Reliable, &Message::Ping);
    assert!(one.waiting.len() > waiting, "this one must arrive");
    // Leaving does not wait for ever either.
    one.leave(Duration::from_millis(20));
}

#[test]
fn what_came_before_the_end_is_heard_and_the_end_is_told() {
    let (one, other) = pair();
    let mut one = Endpoint::new(one, false).unwrap();
    let mut other = Endpoint::new(other, false).unwrap();
    other.describe("Hand0", Kind::ALL);
    other.send(Service::Reliable, &pose(0.25));
    let reader = std::thread::spawn(move || {
        let mut last = None;
        loop {
            let result = one.receive(Duration::from_millis(5), |event| {
                if let Event::Message { message, .. } = event {
                    last = Some(message);
                }
            });
            if let Err(broken) = result {
                return (last, broken);
            }
        }
    });
    // Returns when the other side has read it all and closed, long before this time.
    other.leave(Duration::from_secs(20));
    assert_eq!(reader.join().unwrap(), (Some(pose(0.25)), Broken::Closed));
}

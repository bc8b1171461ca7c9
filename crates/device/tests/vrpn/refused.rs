//! Servers and clients that are none, or of another version, or that send what cannot be.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::thread::JoinHandle;
use std::time::Duration;

use device::driver::Unavailable;
use device::driver::vrpn::Server;
use device::driver::vrpn::message::{ForceField, Kind, Message, Placement, SensorPose};
use device::driver::vrpn::peer::{Event, Ours, Peer};
use device::driver::vrpn::wire::{COOKIE, Decoder, Timestamp};
use glam::DVec3;

use crate::bench::{Serving, force, hand_at, open, read, wait_for_message, wait_until};

/// A server of the test's own: takes one connection and does as told.
fn serve_once(act: impl FnOnce(TcpStream) + Send + 'static) -> (SocketAddr, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let thread = std::thread::spawn(move || act(listener.accept().unwrap().0));
    (address, thread)
}

fn refusal(name: &str) -> Unavailable {
    device::driver::open(name).unwrap_err()
}

fn read_to_end(mut stream: TcpStream) -> Vec<u8> {
    let mut bytes = Vec::new();
    stream
        .set_read_timeout(Some(Duration::from_secs(20)))
        .unwrap();
    // An end by reset is an end.
    let _end = stream.read_to_end(&mut bytes);
    bytes
}

#[test]
fn server_of_another_version_is_named_with_its_version() {
    let (address, thread) = serve_once(|mut stream| {
        stream.write_all(b"vrpn: ver. 06.99  0\0\0\0\0\0").unwrap();
        read_to_end(stream);
    });
    let refused = refusal(&format!("vrpn:Hand0@{address}"));
    assert!(matches!(refused, Unavailable::WrongVersion { .. }));
    let text = refused.to_string();
    assert!(text.contains("06.99") && text.contains("07.xx"), "{text}");
    assert!(text.contains(&address.to_string()), "{text}");
    thread.join().unwrap();
}

#[test]
fn other_servers_and_silent_ones_are_no_vrpn_servers() {
    let (web, web_thread) = serve_once(|mut stream| {
        stream
            .write_all(b"HTTP/1.1 400 Bad Request\r\n\r\n")
            .unwrap();
        read_to_end(stream);
    });
    let refused = refusal(&format!("vrpn:Hand0@{web}")).to_string();
    assert!(refused.contains("HTTP/1.1 400"), "{refused}");
    let (closing, closing_thread) = serve_once(drop);
    let refused = refusal(&format!("vrpn:Hand0@{closing}")).to_string();
    assert!(refused.contains("check host and port"), "{refused}");
    let (silent, silent_thread) = serve_once(|stream| {
        read_to_end(stream);
    });
    let refused = refusal(&format!("vrpn:Hand0@{silent}")).to_string();
    assert!(refused.contains("says nothing"), "{refused}");
    for thread in [web_thread, closing_thread, silent_thread] {
        thread.join().unwrap();
    }
}

#[test]
fn nobody_at_the_port_is_not_there_with_host_and_port() {
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    for way in ["", "udp://"] {
        let refused = refusal(&format!("vrpn:{way}Hand0@{free}"));
        assert!(matches!(refused, Unavailable::NotThere { .. }));
        let text = refused.to_string();
        assert!(text.contains(&free.to_string()), "{text}");
        assert!(text.contains("start the server"), "{text}");
    }
    // No name of a host: nobody need be asked about it.
    let refused = refusal("vrpn:Hand0@no..host").to_string();
    assert!(refused.contains("the host is not known"), "{refused}");
}

/// Greeting, descriptions and one pose.
fn welcome(ours: &mut Ours) -> Vec<u8> {
    let mut out = COOKIE.to_vec();
    ours.describe("Hand0", Kind::ALL, &mut out);
    ours.pack(&pose(), Timestamp::now(), &mut out);
    out
}

fn pose() -> Message {
    Message::PosQuat(SensorPose {
        sensor: 0,
        at: Placement {
            position: [0.01, 0.0, 0.0],
            rotation: [0.0, 0.0, 0.0, 1.0],
        },
    })
}

/// Reads until the client's loop has begun.
fn wait_for_field(stream: &mut TcpStream) {
    let (mut decoder, mut peer) = (Decoder::new(), Peer::default());
    let mut is_sent = false;
    let mut byte = [0];
    while !is_sent {
        stream.read_exact(&mut byte).unwrap();
        decoder
            .push(&byte, |frame| {
                if let Event::Message { message, .. } = peer.read(&frame)? {
                    is_sent |= message.kind() == Kind::ForceField;
                }
                Ok(())
            })
            .unwrap();
    }
}

#[test]
fn message_of_a_wrong_size_from_the_server_ends_the_link_with_its_name() {
    let (address, thread) = serve_once(|mut stream| {
        let mut ours = Ours::default();
        stream.write_all(&welcome(&mut ours)).unwrap();
        let mut frame = Vec::new();
        ours.pack(&pose(), Timestamp::now(), &mut frame);
        // Eight bytes less than a pose has.
        frame[3] -= 8;
        frame.truncate(frame.len() - 8);
        wait_for_field(&mut stream);
        stream.write_all(&frame).unwrap();
        read_to_end(stream);
    });
    let mut opened = open(&format!("vrpn:Hand0@{address}"));
    let message = wait_for_message(&opened, "is lost");
    assert!(message.contains("vrpn_Tracker Pos_Quat"), "{message}");
    wait_until("silence", || read(&mut opened).is_none());
    drop(opened);
    thread.join().unwrap();
}

#[test]
fn server_without_poses_is_not_ready() {
    let (address, thread) = serve_once(|mut stream| {
        let mut out = COOKIE.to_vec();
        Ours::default().describe("Hand0", Kind::ALL, &mut out);
        stream.write_all(&out).unwrap();
        read_to_end(stream);
    });
    let refused = refusal(&format!("vrpn:Hand0@{address}"));
    assert!(matches!(refused, Unavailable::NotReady { .. }));
    assert!(refused.to_string().contains("no poses"), "{refused}");
    thread.join().unwrap();
}

#[test]
fn server_that_stops_reading_and_sending_is_lost_after_a_while() {
    let (end, ended) = std::sync::mpsc::channel::<()>();
    let (address, thread) = serve_once(move |mut stream| {
        stream.write_all(&welcome(&mut Ours::default())).unwrap();
        let _told = ended.recv();
    });
    let mut opened = open(&format!("vrpn:Hand0@{address}"));
    let message = wait_for_message(&opened, "is lost");
    assert!(message.contains("nothing came"), "{message}");
    wait_until("silence", || read(&mut opened).is_none());
    end.send(()).unwrap();
    drop(opened);
    thread.join().unwrap();
}

/// A client of the test's own.
struct Client {
    stream: TcpStream,
    ours: Ours,
}

impl Client {
    fn greet(server: &Serving) -> Self {
        let mut client = Self {
            stream: TcpStream::connect(server.address).unwrap(),
            ours: Ours::default(),
        };
        let mut out = COOKIE.to_vec();
        client.ours.describe("Hand0", Kind::ALL, &mut out);
        client.stream.write_all(&out).unwrap();
        client
    }

    fn send(&mut self, message: &Message) {
        let mut out = Vec::new();
        self.ours.pack(message, Timestamp::now(), &mut out);
        self.stream.write_all(&out).unwrap();
    }
}

fn field(x: f32) -> Message {
    Message::ForceField(ForceField {
        origin: [0.01, 0.0, 0.0],
        force: [x, 0.0, 0.0],
        radius: 0.5,
        ..ForceField::OFF
    })
}

#[test]
fn client_that_falls_silent_or_dies_leaves_no_force_behind() {
    let hand = hand_at(0.01);
    let server = Serving::start(&hand);
    let mut client = Client::greet(&server);
    wait_until("force", || {
        client.send(&field(2.0));
        force(&hand).x > 1.9
    });
    // Silent, but there.
    wait_until("no force", || force(&hand) == DVec3::ZERO);
    wait_until("force again", || {
        client.send(&field(2.0));
        force(&hand).x > 1.9
    });
    drop(client);
    wait_until("no force", || force(&hand) == DVec3::ZERO);
    let report = server.end();
    assert!(report.silences >= 1, "{report:?}");
    assert_eq!(report.guests, 1);
}

#[test]
fn fields_beyond_the_device_are_cut_and_those_that_are_none_refused() {
    let hand = hand_at(0.01);
    let server = Serving::start(&hand);
    let mut client = Client::greet(&server);
    wait_until("the device's peak", || {
        client.send(&field(1e30));
        (force(&hand).x - 35.0).abs() < 1e-9
    });
    wait_until("no force", || {
        client.send(&field(f32::NAN));
        force(&hand) == DVec3::ZERO
    });
    let report = server.end();
    assert!(report.fields_refused >= 1);
    assert!(report.safety.wrenches_clamped >= 1);
}

#[test]
fn clients_that_are_none_are_turned_away_and_the_server_goes_on() {
    let hand = hand_at(0.01);
    let server = Serving::start(&hand);
    for greeting in [
        b"vrpn: ver. 06.99  0\0\0\0\0\0".as_slice(),
        b"vrpn: ver. 07.38  9\0\0\0\0\0",
        b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
    ] {
        let mut stream = TcpStream::connect(server.address).unwrap();
        stream.write_all(greeting).unwrap();
        // The server's own greeting comes first, then the end.
        assert_eq!(read_to_end(stream), COOKIE);
    }
    let mut client = Client::greet(&server);
    // Its descriptions follow its greeting: now the client is a guest.
    client.stream.read_exact(&mut [0; 64]).unwrap();
    let mut frame = Vec::new();
    client.ours.pack(&field(1.0), Timestamp::now(), &mut frame);
    frame[3] -= 8;
    frame.truncate(frame.len() - 8);
    client.stream.write_all(&frame).unwrap();
    read_to_end(client.stream);
    // Requests that are none, from anybody.
    let asking = UdpSocket::bind("127.0.0.1:0").unwrap();
    for request in [b"".as_slice(), b"nonsense", b"127.0.0.1 80\0", &[0xff; 500]] {
        asking.send_to(request, server.address).unwrap();
    }

    let mut opened = open(&server.name("", ""));
    wait_until("pose", || read(&mut opened).is_some());
    drop(opened);
    let report = server.end();
    assert_eq!((report.guests, report.refused, report.faults), (2, 3, 4));
}

#[test]
fn server_says_why_it_cannot_listen() {
    let first = Server::bind("127.0.0.1:0", "Hand0").unwrap();
    let busy = Server::bind(first.local_addr(), "Hand0").unwrap_err();
    assert!(matches!(busy, Unavailable::Busy { .. }), "{busy}");
    let long = "x".repeat(100);
    for name in ["", "a@b", "a\nb", &long] {
        let refused = Server::bind("127.0.0.1:0", name).unwrap_err();
        assert!(matches!(refused, Unavailable::UnknownName { .. }));
    }
}

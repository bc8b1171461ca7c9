//! The recorded servers played back to our client, at the recorded times.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use device::driver::vrpn::peer::{Event, Peer};
use device::driver::vrpn::wire::{Decoder, HEAD_LEN};
use glam::DVec3;

use crate::bench::{open, read, wait_until};
use crate::recording::{Recording, Sent};

/// A server that plays a recording back to whoever connects, greeting first.
fn play_back(session: &'static str) -> (SocketAddr, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let thread = std::thread::spawn(move || {
        play(
            &Recording::load(session, "server_to_client"),
            listener.accept().unwrap().0,
        );
    });
    (address, thread)
}

/// The same, but it waits to be asked and calls back.
fn play_back_when_asked(session: &'static str) -> (SocketAddr, JoinHandle<()>) {
    let requests = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = requests.local_addr().unwrap();
    let thread = std::thread::spawn(move || {
        let mut request = [0; 64];
        let (count, _) = requests.recv_from(&mut request).unwrap();
        let text = std::str::from_utf8(&request[..count]).unwrap();
        let (host, port) = text.strip_suffix('\0').unwrap().split_once(' ').unwrap();
        let client = TcpStream::connect(format!("{host}:{port}")).unwrap();
        play(&Recording::load(session, "server_to_client"), client);
    });
    (address, thread)
}

fn play(recording: &Recording, mut client: TcpStream) {
    client.set_nodelay(true).unwrap();
    let datagrams = UdpSocket::bind("127.0.0.1:0").unwrap();
    client.write_all(&recording.stream[..HEAD_LEN]).unwrap();
    let has_datagrams = recording.datagrams().next().is_some();
    let datagrams_to = has_datagrams.then(|| port_for_datagrams(&mut client));
    let begun = Instant::now();
    for segment in &recording.segments {
        let at = Duration::from_secs_f64(segment.time_s);
        std::thread::sleep(at.saturating_sub(begun.elapsed()));
        match &segment.sent {
            Sent::Stream(range) => {
                let range = range.start.max(HEAD_LEN)..range.end.max(HEAD_LEN);
                if client.write_all(&recording.stream[range]).is_err() {
                    // It has seen enough.
                    return;
                }
            }
            Sent::Datagram(bytes) => {
                let to = SocketAddr::from(([127, 0, 0, 1], datagrams_to.unwrap()));
                datagrams.send_to(bytes, to).unwrap();
            }
        }
    }
    // What the client sends is not read until the end: it must not depend on that.
    client
        .set_read_timeout(Some(Duration::from_secs(20)))
        .unwrap();
    let mut sent = Vec::new();
    let _end = client.read_to_end(&mut sent);
}

/// Reads the client's words up to the port where it takes datagrams.
fn port_for_datagrams(client: &mut TcpStream) -> u16 {
    let mut decoder = Decoder::new();
    let mut peer = Peer::default();
    let mut found = None;
    let mut byte = [0];
    while found.is_none() {
        client.read_exact(&mut byte).unwrap();
        decoder
            .push(&byte, |frame| {
                if let Event::Udp { port, .. } = peer.read(&frame)? {
                    found = Some(port);
                }
                Ok(())
            })
            .unwrap();
    }
    found.unwrap()
}

fn follow(address: SocketAddr, way: &str, session: &str) {
    let mut opened = open(&format!("vrpn:{way}Hand0@{address}"));
    // Workspace as recorded, asked for by the recorded client.
    let half = opened.device.limits().workspace_half_extents;
    assert!((half - DVec3::new(0.08, 0.06, 0.035)).length() < 1e-12);

    let recording = Recording::load(session, "server_to_client");
    let poses: Vec<DVec3> = recording
        .messages
        .iter()
        .filter(|message| message["type"] == "vrpn_Tracker Pos_Quat")
        .map(|message| {
            let pos = &message["payload"]["pos"];
            DVec3::from([0, 1, 2].map(|axis| pos[axis].as_f64().unwrap()))
        })
        .collect();
    let last = *poses.last().unwrap();
    let (mut tripped, mut pressed, mut seen) = (false, false, 0);
    let mut told = Vec::new();
    let mut before = DVec3::NAN;
    wait_until("the last pose", || {
        told.extend(opened.messages.try_iter());
        let Some(state) = read(&mut opened) else {
            return false;
        };
        let position = state.pose.translation;
        assert!(poses.contains(&position), "{position} was never sent");
        if position != before {
            seen += 1;
            before = position;
        }
        // At 100 Hz a hand's motion; the recorded one stays below a metre a second.
        assert!(state.linear_velocity.length() < 1.0);
        tripped |= matches!(state.readiness, device::Readiness::Tripped(_));
        pressed |= state.buttons & 1 == 1;
        position == last
    });
    assert!(seen > 10, "{seen} poses of {}", poses.len());
    assert!(tripped && pressed, "{tripped} {pressed}");
    let told = told.join("\n");
    assert!(told.contains("motor temperature high"), "{told}");
    assert!(told.contains("the server has cut the force"), "{told}");
    drop(opened);
}

#[test]
fn recorded_force_device_is_followed_over_tcp() {
    let (address, server) = play_back("simforce-tcp");
    follow(address, "tcp://", "simforce-tcp");
    server.join().unwrap();
}

#[test]
fn recorded_force_device_is_followed_by_datagrams() {
    let (address, server) = play_back_when_asked("simforce-udp");
    follow(address, "udp://", "simforce-udp");
    server.join().unwrap();
}

#[test]
fn stock_servers_tracker_without_forces_is_followed() {
    let (address, server) = play_back_when_asked("stock-udp");
    let mut opened = open(&format!("vrpn:udp://Spin0@{address}"));
    let says_so = |note: &String| note.contains("nothing will be felt");
    assert!(opened.notes.iter().any(says_so), "{:?}", opened.notes);
    wait_until("the tracker turns", || {
        read(&mut opened).is_some_and(|state| state.angular_velocity.y.abs() > 0.1)
    });
    drop(opened);
    server.join().unwrap();
}

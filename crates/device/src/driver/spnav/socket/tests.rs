//! Events by their words, and the link over a daemon of the test's own: its death, its return, and strangers.

use std::collections::VecDeque;
use std::io::Write;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::time::Instant;

use super::*;
use crate::driver::spnav::chosen_socket;

fn event(words: [i32; 8]) -> [u8; EVENT] {
    let mut bytes = [0; EVENT];
    for (chunk, word) in bytes.chunks_exact_mut(4).zip(words) {
        chunk.copy_from_slice(&word.to_ne_bytes());
    }
    bytes
}

/// All the way to the right, half turned about the daemon's y (up).
const RIGHT: [i32; 8] = [0, 350, 0, 0, 0, 178, 0, 16];

/// Bytes that come in given pieces; between them the socket has nothing.
struct Pieces(VecDeque<Vec<u8>>);

impl Read for Pieces {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let Some(piece) = self.0.front_mut() else {
            return Err(io::ErrorKind::WouldBlock.into());
        };
        let length = piece.len().min(into.len());
        into[..length].copy_from_slice(&piece[..length]);
        piece.drain(..length);
        if piece.is_empty() {
            self.0.pop_front();
        }
        Ok(length)
    }
}

fn daemon(pieces: &[&[u8]]) -> Daemon<Pieces> {
    Daemon::new(Pieces(pieces.iter().map(|p| p.to_vec()).collect()))
}

/// Source of the frame: the daemon swaps the device's y and z and their signs, so it has x right, y up, z away.
#[test]
fn motion_comes_out_in_a_frame_with_z_up() {
    let axes = [0, 350, -350, 178, 350, 178, -350, 16];
    let mut daemon = daemon(&[&event(axes)]);
    daemon.read_all(0.0).unwrap();
    let input = daemon.input(0.0);
    let half = (178.0 - DEAD) / (FULL - DEAD);
    assert_eq!(input.linear, DVec3::new(1.0, half, -1.0));
    assert_eq!(input.angular, DVec3::new(1.0, -1.0, half));
}

#[test]
fn events_that_come_in_pieces_are_put_together() {
    let bytes = [event(RIGHT), event([1, 4, 0, 0, 0, 0, 0, 0])].concat();
    for length in [1, 3, 31, 33, 64] {
        let pieces: Vec<&[u8]> = bytes.chunks(length).collect();
        let mut daemon = daemon(&pieces);
        daemon.read_all(0.0).unwrap();
        let input = daemon.input(0.0);
        assert_eq!(input.linear, DVec3::X, "{length}");
        assert_eq!(input.buttons, 1 << 4, "{length}");
    }
}

#[test]
fn buttons_are_bits_and_absurd_numbers_are_left_out() {
    let button = |kind, number| event([kind, number, 0, 0, 0, 0, 0, 0]);
    let mut daemon = daemon(&[
        &button(1, 0),
        &button(1, 31),
        &button(1, 32),
        &button(1, -1),
        &button(1, i32::MAX),
        &button(2, 32),
        &button(2, 7),
    ]);
    daemon.read_all(0.0).unwrap();
    assert_eq!(daemon.input(0.0).buttons, 1 | 1 << 31);
}

#[test]
fn silence_is_rest_and_absurd_deflections_are_full_ones() {
    let mut daemon = daemon(&[&event([0, i32::MAX, i32::MIN, 3, 0, 0, 0, 0])]);
    daemon.read_all(1.0).unwrap();
    assert_eq!(daemon.input(1.2).linear, DVec3::new(1.0, 0.0, -1.0));
    assert_eq!(daemon.input(1.3).linear, DVec3::ZERO);
}

#[test]
fn strangers_are_told_from_the_daemon_and_other_events_are_let_pass() {
    for kind in [3, 4, 6, 15] {
        let mut daemon = daemon(&[&event([kind, 1, 2, 3, 4, 5, 6, 7])]);
        assert_eq!(daemon.read_all(0.0), Ok(()));
    }
    for bytes in [*b"HTTP/1.1 400 Bad Request\r\n\r\n    ", event([-1; 8])] {
        let refused = daemon(&[&bytes]).read_all(0.0).unwrap_err();
        assert!(matches!(refused, DeviceError::Gone { .. }));
    }
}

/// Whatever 32 bytes come, all numbers stay within the full deflection.
#[test]
fn any_words_give_deflections_within_the_full_one() {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut taken = 0;
    for _ in 0..100_000 {
        let mut words = [0; 8];
        for word in &mut words {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            *word = state as i32;
        }
        words[0] &= 7;
        let mut daemon = daemon(&[&event(words)]);
        taken += u32::from(daemon.read_all(0.0).is_ok());
        let input = daemon.input(0.0);
        assert!(input.linear.abs().max_element() <= 1.0);
        assert!(input.angular.abs().max_element() <= 1.0);
    }
    assert_eq!(taken, 100_000);
}

#[test]
fn socket_is_the_environments_or_the_usual_one() {
    assert_eq!(chosen_socket(None), "/var/run/spnav.sock");
    assert_eq!(chosen_socket(Some(String::new())), "/var/run/spnav.sock");
    assert_eq!(chosen_socket(Some("/tmp/a".to_owned())), "/tmp/a");
}

#[test]
fn refusals_of_the_system_are_told_apart() {
    let of = |kind: io::ErrorKind| refusal("/run/s", &kind.into());
    let start = "systemctl start spacenavd";
    let missing = of(io::ErrorKind::NotFound);
    assert!(missing.to_string().contains(start), "{missing}");
    let ended = of(io::ErrorKind::ConnectionRefused);
    assert!(ended.to_string().contains("nobody listens"), "{ended}");
    assert!(matches!(
        of(io::ErrorKind::PermissionDenied),
        Unavailable::PermissionDenied { .. }
    ));
    assert!(matches!(
        of(io::ErrorKind::Other),
        Unavailable::Failed { .. }
    ));
}

#[test]
fn no_daemon_a_dead_one_and_an_impossible_path_say_why() {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("s");
    let why = |path: &Path| {
        connect(path.to_str().unwrap())
            .map(|_| ())
            .unwrap_err()
            .to_string()
    };
    assert!(why(&socket).contains("does not run"));
    // What a daemon that was killed leaves behind.
    drop(UnixListener::bind(&socket).unwrap());
    assert!(why(&socket).contains("nobody listens"));
    let long = folder.path().join("x".repeat(200));
    assert!(why(&long).contains("could not be opened"));
}

/// Waits until it holds, for ten seconds at most: a lost link is tried again once a second.
fn wait_until(mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed().as_secs() < 10, "it never came to be");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn wait_for_message(opened: &Opened, part: &str) {
    loop {
        let told = opened.messages.recv_timeout(Duration::from_secs(10));
        if told.expect("the message never came").contains(part) {
            return;
        }
    }
}

/// A daemon that dies in the middle of an event while the puck is held, and comes back.
#[test]
fn daemon_that_dies_is_told_and_found_again_where_the_handle_was() {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("spnav.sock");
    let path = socket.to_str().unwrap().to_owned();
    let listener = UnixListener::bind(&socket).unwrap();
    let settings = RateSettings {
        speed: 0.1,
        turn: 1.0,
    };
    let mut opened = open(path.clone(), settings).unwrap();
    let (mut client, _) = listener.accept().unwrap();
    assert!(opened.notes.iter().any(|n| n.contains("100 mm/s")));

    let say = |client: &mut UnixStream, until: &mut dyn FnMut() -> bool| {
        wait_until(|| {
            client.write_all(&event(RIGHT)).unwrap();
            until()
        });
    };
    say(&mut client, &mut || {
        opened.device.read(0.0).is_ok_and(|s| {
            s.pose.translation.x > 2e-3
                && s.linear_velocity == DVec3::new(0.1, 0.0, 0.0)
                && s.angular_velocity.z > 0.4
        })
    });

    client.write_all(&event(RIGHT)[..17]).unwrap();
    drop(client);
    drop(listener);
    std::fs::remove_file(&socket).unwrap();
    wait_for_message(&opened, "closed the connection");
    wait_until(|| opened.device.read(0.0).is_err());

    let listener = UnixListener::bind(&socket).unwrap();
    let (mut client, _) = listener.accept().unwrap();
    wait_until(|| opened.device.read(0.0).is_ok());
    let back = opened.device.read(0.0).unwrap();
    // The half event of before is forgotten, and so is the deflection; the handle has kept its place.
    assert!(back.pose.translation.x > 2e-3);
    assert_eq!(back.linear_velocity, DVec3::ZERO);
    let from = back.pose.translation.x;
    say(&mut client, &mut || {
        opened
            .device
            .read(0.0)
            .is_ok_and(|s| s.pose.translation.x > from)
    });
}

#[test]
fn family_opens_the_socket_of_its_place() {
    use crate::driver::Family;
    use crate::driver::spnav::Spnav;

    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("s");
    let place = format!("{}?speed=0.2", socket.display());
    let refused = Spnav.open(&place).unwrap_err();
    assert!(matches!(refused, Unavailable::NotThere { .. }));
    let listener = UnixListener::bind(&socket).unwrap();
    let opened = Spnav.open(&place).unwrap();
    assert!(opened.device.name().contains("spacenavd"));
    assert_eq!(opened.device.limits().peak_force, 0.0);
    listener.accept().unwrap();
    assert!(Spnav.list().iter().all(|l| l.name.starts_with("spnav")));
}

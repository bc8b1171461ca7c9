//! Finding the service and its devices, and what is no such service.

use std::net::TcpListener;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::mock::{Manner, Mock, wait_until};
use super::{ID, UP, push_until_rendered, recording};
use crate::driver::haply::{Haply, Place, connect, socket};
use crate::driver::{Family, Listing, Unavailable};

#[test]
fn events_channel_that_is_not_there_is_a_note() {
    let mock = Mock::start(Manner::default());
    let place = format!("{ID}@127.0.0.1:{},{}", mock.port, free_port());
    let mut opened = Haply.open(&place).unwrap();
    let note = opened.notes.last().unwrap();
    assert!(
        note.contains("events of the service are not heard"),
        "{note}"
    );
    push_until_rendered(&mut opened, &mock, UP);
}

/// A port where nobody listens.
fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().port()
}

#[test]
fn nobody_there_is_told_with_the_address_and_the_mend() {
    let port = free_port();
    let place = Place::parse(&format!("@127.0.0.1:{port}")).unwrap();
    let listed = connect::list(&place);
    let opened = Haply.open(&format!("@127.0.0.1:{port}")).unwrap_err();
    let [Listing { name, status }] = &listed[..] else {
        panic!("{listed:?}");
    };
    assert_eq!(name, "haply");
    for error in [status.clone().unwrap_err(), opened] {
        assert!(matches!(error, Unavailable::NotThere { .. }), "{error:?}");
        let text = error.to_string();
        assert!(text.contains(&format!("ws://127.0.0.1:{port}")), "{text}");
        assert!(text.contains("start the Haply Inverse Service"), "{text}");
    }
}

#[test]
fn every_device_is_listed_with_its_state_and_opened_by_its_identifier() {
    let mut inventory = recording::inventory();
    let mut second = inventory["inverse3"][0].clone();
    second["device_id"] = json!("B7");
    second["config"]["type"] = json!("minverse");
    second["status"]["ready"] = json!(false);
    inventory["inverse3"].as_array_mut().unwrap().push(second);
    let mut answer = recording::answer();
    answer["inverse3"][0]["device_id"] = json!("B7");
    let mock = Mock::start(Manner {
        inventory: Some(inventory),
        answer,
        ..Manner::default()
    });
    let listed = connect::list(&Place::parse(&mock.place("")).unwrap());
    let lines: Vec<(&str, &str)> = listed
        .iter()
        .map(|line| (line.name.as_str(), line.status.as_deref().unwrap()))
        .collect();
    let at = format!("@127.0.0.1:{},{}", mock.port, mock.events_port);
    assert_eq!(
        lines,
        [
            (
                format!("haply:049D{at}").as_str(),
                "Inverse3, version 7.4, ready"
            ),
            (
                format!("haply:B7{at}").as_str(),
                "Minverse, version 7.4, the service does not say that the device is ready"
            ),
        ]
    );
    // Listing registers no session and commands nothing.
    wait_until(|| mock.seen(|seen| seen.ended == 1));
    assert_eq!(mock.seen(|seen| seen.frames.len()), 0);

    let opened = crate::driver::open(lines[1].0).unwrap();
    assert_eq!(opened.device.name(), "Haply Minverse B7");
    assert_eq!(opened.device.limits().workspace_half_extents.x, 0.04);
    assert!(
        opened
            .notes
            .iter()
            .any(|note| note == "several devices: 049D, B7; opened B7")
    );
    let refused = Haply.open(&mock.place("FFFF")).unwrap_err().to_string();
    assert!(
        refused.contains("has no device FFFF; it lists 049D, B7"),
        "{refused}"
    );
}

#[test]
fn service_without_a_device_and_services_of_another_kind_are_told_apart() {
    let open_with = |inventory: Option<Value>| {
        let mock = Mock::start(Manner {
            inventory,
            ..Manner::default()
        });
        let listed = connect::list(&Place::parse(&mock.place("")).unwrap());
        assert_eq!(listed.len(), 1);
        let error = Haply.open(&mock.place("")).unwrap_err();
        let listed = listed[0].status.clone().unwrap_err();
        assert_eq!(
            std::mem::discriminant(&listed),
            std::mem::discriminant(&error)
        );
        error
    };
    let none = open_with(Some(json!({"session_id": 1, "inverse3": []})));
    assert!(
        none.to_string().contains("lists no Inverse3; plug one in"),
        "{none}"
    );
    assert!(matches!(none, Unavailable::NotThere { .. }));
    let other = open_with(Some(json!({"jsonrpc": "2.0"})));
    assert!(matches!(other, Unavailable::WrongVersion { .. }), "{other}");
    let silent = open_with(None);
    assert!(silent.to_string().contains("says nothing"), "{silent}");
    let huge = open_with(Some(
        json!({"session_id": "x".repeat(2 * socket::MESSAGE_MAX)}),
    ));
    assert!(
        huge.to_string().contains("ended the conversation"),
        "{huge}"
    );
}

#[test]
fn listener_that_is_no_websocket_is_told_so() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let place = Place::parse(&format!("@127.0.0.1:{port}")).unwrap();
    // One that takes the connection and says nothing.
    let error = connect::list(&place)[0]
        .status
        .clone()
        .unwrap_err()
        .to_string();
    assert!(error.contains("does not greet back"), "{error}");
    // One that talks of other things.
    let talker = std::thread::spawn(move || {
        // The first is the one that was listed and given up.
        for _ in 0..2 {
            let (mut stream, _) = listener.accept().unwrap();
            let _gone =
                std::io::Write::write_all(&mut stream, b"220 mail.example.org ESMTP\r\n\r\n");
        }
    });
    let error = connect::list(&place)[0]
        .status
        .clone()
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("is not the Haply Inverse Service"),
        "{error}"
    );
    talker.join().unwrap();
}

#[test]
fn message_that_drips_does_not_hold_the_link() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let dripping = std::thread::spawn(move || {
        let (stream, _) = listener.accept().unwrap();
        let mut web = tungstenite::accept(stream).unwrap();
        // The head of a text of 50 000 bytes, then one of them every millisecond.
        let stream = web.get_mut();
        let mut drip = |bytes: &[u8]| std::io::Write::write_all(stream, bytes);
        let mut result = drip(&[0x81, 126, 0xC3, 0x50]);
        while result.is_ok() {
            std::thread::sleep(Duration::from_millis(1));
            result = drip(b"x");
        }
    });
    let second = Duration::from_secs(1);
    let mut socket = socket::Socket::open("127.0.0.1", port, second).unwrap();
    for _ in 0..5 {
        let until = Instant::now() + Duration::from_millis(5);
        assert_eq!(socket.read_until(until), Ok(None));
        assert_eq!(socket.read_now(), Ok(None));
    }
    drop(socket);
    dripping.join().unwrap();
}

//! The recorded frames, and frames that no service should send.

use super::*;
use crate::driver::haply::tests::recording::{Direction, decoded, recorded};

#[test]
fn recorded_answers_are_read_as_the_makers_client_read_them() {
    let mut decoded = decoded().into_iter();
    let mut is_after_force = false;
    let mut compared = 0;
    for (n, (direction, text)) in recorded().iter().enumerate() {
        if *direction == Direction::ToService {
            is_after_force = text.contains("set_cursor_force");
            continue;
        }
        let frame = Frame::decode(text).unwrap();
        assert_eq!((frame.devices.len(), frame.grips.len()), (1, 1), "{n}");
        if n > 0 && !is_after_force {
            continue;
        }
        let Some(expected) = decoded.next() else {
            break;
        };
        let device = frame
            .device(expected["device_id"].as_str().unwrap())
            .unwrap();
        for (name, ours) in [
            ("pos", device.position),
            ("vel", device.velocity),
            ("force", device.felt),
        ] {
            // The client's numbers have single precision.
            let theirs = &expected[name];
            let theirs = DVec3::from_array([0, 1, 2].map(|i| theirs[i].as_f64().unwrap()));
            assert!((ours.unwrap() - theirs).length() < 1e-7, "{n} {name}");
        }
        assert_eq!(device.status.ready, expected["ready"].as_bool());
        compared += 1;
    }
    assert_eq!(compared, 6);
}

#[test]
fn recorded_inventory_is_read_whole() {
    let frame = Frame::decode(&recorded()[0].1).unwrap();
    let device = &frame.devices[0];
    let config = device.config.as_ref().unwrap();
    assert_eq!(config.kind, "inverse3");
    assert_eq!(config.version.as_deref(), Some("7.4"));
    assert_eq!(config.gate, Some(0.3));
    assert!(config.damping.unwrap().is_zero());
    assert_eq!(config.basis.as_deref(), Some("XYZ"));
    assert_eq!(config.preset.as_deref(), Some("defaults"));
    assert!(config.is_from_3_5 && !config.is_moved && !device.is_moved);
    let all = Status {
        calibrated: Some(true),
        ready: Some(true),
        power: Some(true),
        in_use: Some(true),
    };
    assert_eq!(device.status, all);
    let body = device.body.unwrap();
    assert!((body.length() - 1.0).abs() < 1e-12);
    assert!((body.w - 0.7047).abs() < 1e-3 && (body.y - 0.709).abs() < 1e-3);
    let grip = &frame.grips[0];
    assert_eq!((grip.id.as_str(), grip.buttons), ("1102", 0));
    assert!(grip.is_awake && (grip.battery.unwrap() - 0.816).abs() < 1e-12);
}

#[test]
fn our_frames_have_the_members_of_the_makers_client() {
    let theirs: Vec<Value> = recorded()
        .iter()
        .filter(|(direction, _)| *direction == Direction::ToService)
        .map(|(_, text)| serde_json::from_str(text).unwrap())
        .collect();
    let ours: Value = serde_json::from_str(&session_frame()).unwrap();
    let configure = &theirs[0]["session"]["configure"];
    assert_eq!(ours["session"]["configure"]["basis"], configure["basis"]);
    assert!(ours["session"]["configure"]["profile"]["name"].is_string());
    assert!(configure["profile"]["name"].is_string());

    let pushed = theirs
        .iter()
        .find(|frame| frame["inverse3"][0]["commands"]["set_cursor_force"]["vector"]["x"] == 0.1)
        .unwrap();
    let ours: Value = serde_json::from_str(&force_frame(
        "049D",
        DVec3::new(0.1, -0.25, 1.5),
        Form::Vector,
    ))
    .unwrap();
    assert_eq!(
        ours["inverse3"][0]["device_id"],
        pushed["inverse3"][0]["device_id"]
    );
    assert_eq!(
        ours["inverse3"][0]["commands"]["set_cursor_force"]["vector"],
        pushed["inverse3"][0]["commands"]["set_cursor_force"]["vector"]
    );
    // Nothing but the force: no second command, no settings in each frame.
    assert_eq!(
        ours["inverse3"][0]["commands"].as_object().unwrap().len(),
        1
    );
    assert_eq!(ours["inverse3"][0].as_object().unwrap().len(), 2);

    let ours: Value = serde_json::from_str(&configure_frame("049D", Form::Values)).unwrap();
    let settings = &ours["inverse3"][0]["configure"];
    assert_eq!(settings["force_gate"]["gain"], 1.0);
    assert_eq!(settings["damping"]["scalar"], 0.0);
    let force = &ours["inverse3"][0]["commands"]["set_cursor_force"];
    assert_eq!(*force, json!({"values": {"x": 0.0, "y": 0.0, "z": 0.0}}));
}

#[test]
fn identifier_with_quotes_stays_one_text() {
    let text = force_frame("a\"b\\", DVec3::ZERO, Form::Vector);
    let value: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(value["inverse3"][0]["device_id"], "a\"b\\");
}

/// A device entry with these members of its state.
fn with_state(state: &str) -> Inverse {
    let text = format!(r#"{{"inverse3":[{{"device_id":"1","state":{state}}}]}}"#);
    Frame::decode(&text).unwrap().devices.remove(0)
}

#[test]
fn missing_members_are_absent_and_not_zero() {
    let device = with_state("{}");
    assert_eq!(device.position, None);
    assert_eq!(device.status, Status::default());
    assert!(!device.is_moved && device.config.is_none());
    let device = with_state(r#"{"cursor_position":{"x":0.1,"y":0.2}}"#);
    assert_eq!(device.position, None, "a lacking coordinate is not 0");
    // A device without an identifier cannot be spoken to.
    let frame = Frame::decode(r#"{"inverse3":[{}, 3, null, {"device_id":7}]}"#).unwrap();
    assert_eq!(frame, Frame::default());
    assert_eq!(Frame::decode(r#"{"session_id":1}"#), Ok(Frame::default()));
}

#[test]
fn numbers_that_cannot_be_are_absent() {
    for position in [
        r#"{"x":1e300,"y":0,"z":0}"#,
        r#"{"x":2.5,"y":0,"z":0}"#,
        r#"{"x":"0","y":0,"z":0}"#,
        r#"{"x":null,"y":0,"z":0}"#,
        "[0,0,0]",
        "7",
    ] {
        let device = with_state(&format!(r#"{{"cursor_position":{position}}}"#));
        assert_eq!(device.position, None, "{position}");
    }
    for (orientation, is_taken) in [
        (r#"{"w":0,"x":0,"y":0,"z":0}"#, false),
        (r#"{"w":1,"x":1,"y":0,"z":0}"#, false),
        (r#"{"w":1.004,"x":0,"y":0,"z":0}"#, true),
        (r#"{"w":1e200,"x":0,"y":0,"z":0}"#, false),
        (r#"{"x":0,"y":0,"z":1}"#, false),
    ] {
        let device = with_state(&format!(r#"{{"body_orientation":{orientation}}}"#));
        assert_eq!(device.body.is_some(), is_taken, "{orientation}");
        assert!(device.body.is_none_or(|q| (q.length() - 1.0).abs() < 1e-12));
    }
    // A number that no double holds makes the whole frame unreadable.
    assert!(Frame::decode(r#"{"inverse3":[{"device_id":"1","state":{"a":1e999}}]}"#).is_err());
}

#[test]
fn transform_without_its_identity_members_is_the_identity() {
    for (transform, is_moved) in [
        ("{}", false),
        (r#"{"position":{"x":0,"y":0,"z":0}}"#, false),
        (
            r#"{"scale":{"x":1,"y":1,"z":1},"rotation":{"w":1,"x":0,"y":0,"z":0}}"#,
            false,
        ),
        (r#"{"rotation":{"w":-1,"x":0,"y":0,"z":0}}"#, false),
        (r#"{"position":{"x":0,"y":0.1,"z":0}}"#, true),
        (r#"{"scale":{"x":2,"y":2,"z":2}}"#, true),
        (
            r#"{"rotation":{"w":0.70710678,"x":0.70710678,"y":0,"z":0}}"#,
            true,
        ),
        (r#"{"scale":"of another version"}"#, true),
    ] {
        let device = with_state(&format!(r#"{{"transform":{transform}}}"#));
        assert_eq!(device.is_moved, is_moved, "{transform}");
    }
}

#[test]
fn grip_listed_twice_is_one_and_each_kind_has_its_buttons() {
    let frame = Frame::decode(
        r#"{"inverse3":[],
            "verse_grip":[{"device_id":"W","state":{"button":true}}],
            "wireless_verse_grip":[{"device_id":"R","state":{"buttons":{"a":false,"b":true,"c":true}},
                                    "status":{"connected":true,"awake":false}}],
            "custom_verse_grip":[{"device_id":"R","state":{"buttons":{"a":true}}},
                                 {"device_id":"C","state":{"buttons":{"button_0":true,"button_2":true}}}]}"#,
    )
    .unwrap();
    let told: Vec<(&str, u32, bool)> = frame
        .grips
        .iter()
        .map(|grip| (grip.id.as_str(), grip.buttons, grip.is_awake))
        .collect();
    assert_eq!(
        told,
        [("W", 0b001, true), ("R", 0b110, false), ("C", 0b101, true)]
    );
}

#[test]
fn what_is_no_frame_is_refused() {
    let deep = "[".repeat(100_000);
    let deep_inside = format!(
        r#"{{"inverse3":{}1{}}}"#,
        "[".repeat(1000),
        "]".repeat(1000)
    );
    for text in [
        "",
        "nothing",
        "[]",
        "3",
        "null",
        "{}",
        r#"{"devices":[]}"#,
        &deep,
        &deep_inside,
    ] {
        assert!(
            Frame::decode(text).is_err(),
            "{}",
            &text[..text.len().min(40)]
        );
    }
}

#[test]
fn many_and_odd_entries_are_bounded() {
    let entries = vec![r#"{"device_id":"1"}"#; 5000].join(",");
    let frame = Frame::decode(&format!(r#"{{"inverse3":[{entries}]}}"#)).unwrap();
    assert_eq!(frame.devices.len(), ENTRIES_MAX);
    let long = "x".repeat(1000);
    for id in [long.as_str(), "", "with space", "é"] {
        let text = format!(r#"{{"inverse3":[{{"device_id":"{id}"}}]}}"#);
        assert_eq!(Frame::decode(&text).unwrap().devices, [], "{id}");
    }
}

//! The family against a stand-in for the service.

use std::time::{Duration, Instant};

use glam::DVec3;
use serde_json::{Value, json};

use super::*;
use crate::error::DeviceError;
use crate::haptic_device::{Command, HandleState, Readiness};
use crate::wrench::Wrench;
use mock::{Manner, Mock, NUMBERED, PATIENCE, Settings, wait_until};

mod finding;
mod mock;
pub(super) mod recording;

const ID: &str = "049D";
const UP: DVec3 = DVec3::new(0.5, -0.25, 2.0);

fn open(mock: &Mock) -> Opened {
    Haply.open(&mock.place(ID)).unwrap()
}

fn push(force: DVec3) -> Command {
    Wrench::new(force, DVec3::ZERO).into()
}

/// Writes a force until it is rendered.
fn push_until_rendered(opened: &mut Opened, mock: &Mock, force: DVec3) {
    wait_until(|| {
        opened.device.write(&push(force)).unwrap();
        mock.seen(|seen| (seen.rendered - force).length() < 1e-12)
    });
}

fn read(opened: &mut Opened) -> Option<HandleState> {
    opened.device.read(0.0).ok()
}

/// The messages until one has this text.
fn message_with(opened: &Opened, text: &str) -> String {
    let begun = Instant::now();
    loop {
        let left = PATIENCE.saturating_sub(begun.elapsed());
        let message = opened.messages.recv_timeout(left);
        let message = message.unwrap_or_else(|_| panic!("no message with \"{text}\""));
        if message.contains(text) {
            return message;
        }
    }
}

#[test]
fn conversation_has_its_order_its_form_and_one_frame_in_flight() {
    // Longer than one exchange waits, shorter than what counts as late.
    let mock = Mock::start(Manner {
        pause: Duration::from_millis(12),
        ..Manner::default()
    });
    let mut opened = open(&mock);
    push_until_rendered(&mut opened, &mock, UP);
    drop(opened);
    wait_until(|| mock.seen(|seen| seen.ended == 1));
    mock.seen(|seen| {
        assert_eq!(seen.early, 0, "a frame came before the last was answered");
        assert_eq!(seen.goodbyes, 1);
        // The session first and once, the settings second and once, then forces alone.
        let session = &seen.frames[0]["session"]["configure"];
        assert_eq!(session["profile"]["name"], "snapin");
        assert_eq!(session["basis"]["permutation"], "XYZ");
        let settings = &seen.frames[1]["inverse3"][0]["configure"];
        assert_eq!(settings["force_gate"]["gain"], 1.0);
        assert_eq!(settings["damping"]["scalar"], 0.0);
        for frame in &seen.frames[2..] {
            assert_eq!(frame.as_object().unwrap().len(), 1);
            let entry = frame["inverse3"][0].as_object().unwrap();
            assert_eq!((entry.len(), &entry["device_id"]), (2, &json!(ID)));
            assert!(entry["commands"]["set_cursor_force"]["vector"]["z"].is_f64());
        }
        let forces = seen.forces();
        assert_eq!(forces[0], DVec3::ZERO, "the settings come with no force");
        assert!(forces.contains(&UP));
        assert_eq!(forces.last(), Some(&DVec3::ZERO), "the last word is zero");
    });
}

#[test]
fn recorded_answers_arrive_as_the_makers_client_read_them() {
    // The recorded answers to the first five forces, the last of them again and again.
    let recorded = recording::recorded();
    let answers: Vec<String> = recorded
        .windows(2)
        .filter(|pair| pair[0].1.contains("set_cursor_force"))
        .map(|pair| pair[1].1.clone())
        .take(5)
        .collect();
    let setup = recorded[2].1.clone();
    let mock = Mock::start(Manner {
        script: [vec![setup.clone(), setup], answers].concat(),
        ..Manner::default()
    });
    let mut opened = open(&mock);
    let last = recording::decoded().pop().unwrap();
    let expect = |name: &str| DVec3::from_array([0, 1, 2].map(|i| last[name][i].as_f64().unwrap()));
    wait_until(|| {
        let state = read(&mut opened);
        state.is_some_and(|state| (state.pose.translation - expect("pos")).length() < 1e-7)
    });
    // On a machine with other work an answer may be late, which trips for a second.
    wait_until(|| read(&mut opened).is_some_and(|state| state.readiness == Readiness::Ready));
    let state = read(&mut opened).unwrap();
    assert!((state.linear_velocity - expect("vel")).length() < 1e-7);
    // The orientation is the grip's.
    let frame = frame::Frame::decode(&recorded[2].1).unwrap();
    let grip = frame.grips[0].orientation.unwrap();
    assert!(state.pose.rotation.angle_between(grip) < 1e-6);
    assert_eq!(opened.device.name(), "Haply Inverse3 049D");
    assert_eq!(opened.device.limits().peak_force, 10.0);
    assert_eq!(opened.device.limits().peak_torque, 0.0);
}

#[test]
fn settings_of_the_service_are_told_with_what_became_of_them() {
    let mut inventory = recording::inventory();
    inventory["inverse3"][0]["config"]["filters"]["damping"] = json!({"scalar": 1.5});
    let manner = Manner {
        inventory: Some(inventory),
        ..Manner::default()
    };
    for (settings, outcome) in [
        (Settings::Taken, "session"),
        (Settings::Refused, "forces will differ from those computed"),
        (Settings::PassedOver, "does not confirm it"),
    ] {
        let mock = Mock::start(Manner {
            settings,
            ..manner.clone()
        });
        let opened = open(&mock);
        let note = |name: &str| {
            opened
                .notes
                .iter()
                .find(|note| note.starts_with(name))
                .unwrap()
        };
        let gate = note("force_gate");
        assert!(
            gate.contains("was 0.3, set to 1") && gate.ends_with(outcome),
            "{gate}"
        );
        let damping = note("damping");
        assert!(
            damping.contains("was 1.5, set to 0") && damping.ends_with(outcome),
            "{damping}"
        );
        assert!(note("Haply Inverse Service").contains(&format!("ws://127.0.0.1:{}", mock.port)));
        assert!(note("origin").ends_with("defaults"));
        assert_eq!(opened.notes.len(), 4, "{:?}", opened.notes);
    }
}

#[test]
fn service_that_weakens_the_force_all_the_same_is_found_out() {
    let mock = Mock::start(Manner {
        settings: Settings::PassedOver,
        ..Manner::default()
    });
    let mut opened = open(&mock);
    let begun = Instant::now();
    let told = loop {
        opened.device.write(&push(UP)).unwrap();
        if let Some(told) = opened
            .messages
            .try_iter()
            .find(|text| text.contains("are felt"))
        {
            break told;
        }
        assert!(begun.elapsed() < PATIENCE);
        std::thread::sleep(Duration::from_millis(1));
    };
    assert!(told.contains("N sent only"), "{told}");
}

#[test]
fn older_service_gets_the_force_in_its_form() {
    let mut inventory = recording::inventory();
    let config = inventory["inverse3"][0]["config"].as_object_mut().unwrap();
    for newer in ["filters", "preset", "basis", "mount"] {
        config.remove(newer);
    }
    let mock = Mock::start(Manner {
        inventory: Some(inventory),
        takes: "values",
        gate: 1.0,
        settings: Settings::PassedOver,
        ..Manner::default()
    });
    let mut opened = open(&mock);
    assert!(opened.notes[0].contains("before 3.5"), "{:?}", opened.notes);
    push_until_rendered(&mut opened, &mock, UP);
    drop(opened);
    wait_until(|| mock.seen(|seen| seen.rendered == DVec3::ZERO));
    mock.seen(|seen| {
        let has_vector = |frame: &Value| {
            frame["inverse3"][0]["commands"]["set_cursor_force"]
                .get("vector")
                .is_some()
        };
        assert!(!seen.frames.iter().any(has_vector));
    });
}

#[test]
fn safety_events_cut_the_force_reach_the_loop_and_are_told() {
    let mock = Mock::start(Manner::default());
    let mut opened = open(&mock);
    wait_until(|| mock.hears_of_events());
    let about =
        |kind: &str| json!({"device_family": "inverse", "device_id": ID, "safety_type": kind});
    for (kind, level, end) in [
        (
            "ebrake_triggered",
            "error",
            Some(("ebrake_released", "notice")),
        ),
        (
            "fod_stage_changed",
            "warning",
            Some(("fod_stage_changed", "info")),
        ),
        ("stall_detected", "warning", None),
        ("stability_ceiling", "warning", None),
    ] {
        push_until_rendered(&mut opened, &mock, UP);
        mock.send_event("device-safety-triggered", level, about(kind));
        let told = message_with(&opened, kind);
        assert!(told.contains("own words"), "{told}");
        wait_until(|| {
            opened.device.write(&push(UP)).unwrap();
            let is_tripped = read(&mut opened)
                .is_some_and(|state| matches!(state.readiness, Readiness::Tripped(_)));
            is_tripped && mock.seen(|seen| seen.rendered == DVec3::ZERO)
        });
        if let Some((end, level)) = end {
            mock.send_event("device-safety-triggered", level, about(end));
        }
    }
    mock.send_event(
        "device-battery-low",
        "warning",
        json!({"device_id": "1102"}),
    );
    message_with(&opened, "device-battery-low");
}

#[test]
fn events_that_end_are_told_and_the_force_goes_on() {
    let mock = Mock::start(Manner::default());
    let mut opened = open(&mock);
    wait_until(|| mock.hears_of_events());
    mock.tell(|manner| manner.is_without_events = true);
    message_with(&opened, "events of the service ended");
    push_until_rendered(&mut opened, &mock, UP);
    assert_eq!(mock.seen(|seen| seen.connections), 1);
}

#[test]
fn device_that_is_not_calibrated_waits_without_force() {
    let mut manner = Manner::default();
    manner.answer["inverse3"][0]["status"]["calibrated"] = json!(false);
    manner.inventory.as_mut().unwrap()["inverse3"][0]["status"]["calibrated"] = json!(false);
    let mock = Mock::start(manner);
    let mut opened = open(&mock);
    assert!(
        opened
            .notes
            .iter()
            .any(|note| note == "no force yet: the device is not calibrated")
    );
    wait_until(|| read(&mut opened).is_some());
    mock.forget();
    wait_until(|| {
        opened.device.write(&push(UP)).unwrap();
        mock.seen(|seen| seen.frames.len() > 20)
    });
    let waits = Readiness::Waiting("the device is not calibrated");
    wait_until(|| read(&mut opened).is_some_and(|state| state.readiness == waits));
    mock.seen(|seen| assert!(seen.forces().iter().all(|force| *force == DVec3::ZERO)));
    mock.tell(|manner| manner.answer = recording::answer());
    push_until_rendered(&mut opened, &mock, UP);
}

#[test]
fn service_killed_in_contact_is_silent_told_and_found_again() {
    let mock = Mock::start(Manner::default());
    let mut opened = open(&mock);
    push_until_rendered(&mut opened, &mock, UP);
    mock.tell(|manner| manner.is_down = true);
    message_with(&opened, "is lost");
    wait_until(|| matches!(opened.device.read(0.0), Err(DeviceError::Silent { .. })));
    // It stays so while nobody answers.
    opened.device.write(&push(UP)).unwrap();
    assert!(opened.device.read(0.0).is_err());
    mock.forget();
    mock.tell(|manner| manner.is_down = false);
    message_with(&opened, "is back");
    wait_until(|| read(&mut opened).is_some());
    push_until_rendered(&mut opened, &mock, UP);
    mock.seen(|seen| {
        // A new session begins as the first one did.
        assert!(seen.frames[0]["session"]["configure"]["profile"].is_object());
        assert!(seen.frames[1]["inverse3"][0]["configure"].is_object());
    });
}

#[test]
fn mute_service_gets_one_zero_and_the_loop_hears_of_it() {
    let mock = Mock::start(Manner::default());
    let mut opened = open(&mock);
    push_until_rendered(&mut opened, &mock, UP);
    mock.tell(|manner| manner.is_mute = true);
    wait_until(|| {
        opened.device.write(&push(UP)).unwrap();
        mock.seen(|seen| seen.rendered == DVec3::ZERO)
    });
    wait_until(|| opened.device.read(0.0).is_err());
    message_with(&opened, "did not answer");
    // The force in flight, the zero after it, and no more.
    opened.device.write(&push(UP)).unwrap();
    std::thread::sleep(Duration::from_millis(30));
    mock.seen(|seen| {
        assert_eq!(seen.unanswered, 2);
        assert_eq!(seen.last_force(), Some(DVec3::ZERO));
    });
    // It is given up after a second and found again.
    mock.tell(|manner| manner.is_mute = false);
    wait_until(|| mock.seen(|seen| seen.connections >= 2));
    push_until_rendered(&mut opened, &mock, UP);
}

#[test]
fn loop_that_stops_writing_leaves_no_force() {
    let mock = Mock::start(Manner::default());
    let mut opened = open(&mock);
    push_until_rendered(&mut opened, &mock, UP);
    wait_until(|| mock.seen(|seen| seen.rendered == DVec3::ZERO));
    push_until_rendered(&mut opened, &mock, UP);
    opened.device.stop();
    wait_until(|| mock.seen(|seen| seen.rendered == DVec3::ZERO));
}

#[test]
fn disconnected_device_is_lost_and_found_again_by_its_identifier() {
    let mock = Mock::start(Manner::default());
    let mut opened = Haply.open(&mock.place("")).unwrap();
    push_until_rendered(&mut opened, &mock, UP);
    wait_until(|| mock.hears_of_events());
    // Another one is first in the list when it is looked for again.
    mock.tell(|manner| {
        let inventory = manner.inventory.as_mut().unwrap();
        let mut other = inventory["inverse3"][0].clone();
        other["device_id"] = json!("AAAA");
        inventory["inverse3"]
            .as_array_mut()
            .unwrap()
            .insert(0, other);
    });
    mock.send_event("device-disconnected", "warning", json!({"device_id": ID}));
    assert!(message_with(&opened, "is lost").contains("was disconnected"));
    mock.seen(|seen| assert_eq!(seen.last_force(), Some(DVec3::ZERO)));
    message_with(&opened, "is back");
    mock.forget();
    push_until_rendered(&mut opened, &mock, UP);
    mock.seen(|seen| {
        let entry = &seen.frames.last().unwrap()["inverse3"][0];
        assert_eq!(entry["device_id"], ID);
    });
}

#[test]
fn states_that_nobody_asked_for_do_not_pile_up() {
    let mock = Mock::start(Manner {
        unasked: 1,
        is_numbered: true,
        ..Manner::default()
    });
    let mut opened = open(&mock);
    push_until_rendered(&mut opened, &mock, UP);
    message_with(&opened, "than it is asked for");
    // Each answer has its number in it: that of the newest is read, not one from a queue that grows.
    wait_until(|| mock.seen(|seen| seen.frames.len()) > 400);
    wait_until(|| {
        let newest = mock.seen(|seen| seen.frames.len());
        let read = read(&mut opened).map_or(0.0, |state| state.pose.translation.x / NUMBERED);
        read > newest as f64 - 10.0
    });
}

#[test]
fn answers_that_are_nonsense_end_the_link_and_not_the_program() {
    let mock = Mock::start(Manner::default());
    let mut opened = open(&mock);
    push_until_rendered(&mut opened, &mock, UP);
    for nonsense in [
        r#"{"inverse3":{"device_id":3}}"#,
        &"[".repeat(socket::MESSAGE_MAX / 2),
    ] {
        mock.tell(|manner| manner.script = vec![nonsense.to_owned()]);
        message_with(&opened, "is lost");
        wait_until(|| opened.device.read(0.0).is_err());
        mock.tell(|manner| manner.script.clear());
        message_with(&opened, "is back");
        push_until_rendered(&mut opened, &mock, UP);
    }
}

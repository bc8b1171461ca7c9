//! Haption Virtuose.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use device::driver::virtuose::Virtuose;
use device::driver::{Family, Opened, Unavailable};
use device::{HandPresence, Readiness, Wrench};
use glam::{DQuat, DVec3};

use crate::stub::{
    LIMIT, Stub, drive_until, is_silent_about, message, push, read_until, wait_until,
};

/// The family through the stand-in, with motors that start at once.
fn family(stub: &Stub) -> Virtuose {
    Virtuose {
        motor_start: Duration::ZERO,
        patience: LIMIT,
        ..Virtuose::with_library(Some(stub.file.clone()))
    }
}

fn open(stub: &Stub) -> Opened {
    family(stub).open("").unwrap()
}

/// 3 N, -4 N, 5 N and 0.1 N m, -0.2 N m, 0.3 N m.
fn wrench() -> Wrench {
    push([3.0, -4.0, 5.0], [0.1, -0.2, 0.3])
}

/// Commands the wrench until the library is given all of it.
fn drive(stub: &Stub, opened: &mut Opened) {
    drive_until(opened, wrench(), "the whole wrench", |_| {
        stub.newest("virtSetForce").is_some_and(|n| n[0] == 3.0)
    });
}

/// Is the library given no force?
fn is_zero(stub: &Stub) -> bool {
    stub.is_at_zero("virtSetForce")
}

#[test]
fn arm_is_made_ready_in_the_makers_order_and_left_with_zero_force() {
    let stub = Stub::of("virtuose");
    let mut opened = family(&stub).open("10.0.0.7#53210").unwrap();
    assert_eq!(
        opened.device.name(),
        "Haption Virtuose 6D, serial 17, controller 2.05"
    );
    assert_eq!(opened.notes, ["Virtuose API 3.98"]);
    drive(&stub, &mut opened);
    drop(opened);
    let calls = stub.calls();
    let begun = [
        "virtOpen 10.0.0.7#53210",
        "virtSetIndexingMode 3",
        "virtSetForceFactor 1",
        "virtSetSpeedFactor 1",
        "virtSetTimeStep 0.001",
        "virtSetBaseFrame 0 0 0 0 0 0 1",
        "virtSetObservationFrame 0 0 0 0 0 0 1",
        "virtSetCommandType 3",
        "virtSaturateTorque 35 3.1",
        "virtSetForce 0 0 0 0 0 0",
        "virtEnableForceFeedback 1",
        "virtSetPowerOn 1",
        "virtSetForce 0 0 0 0 0 0",
    ];
    assert_eq!(calls[..begun.len()], begun);
    let ended = [
        "virtSetForce 0 0 0 0 0 0",
        "virtSetPowerOn 0",
        "virtDetachVO",
        "virtClose",
    ];
    assert_eq!(calls[calls.len() - ended.len()..], ended);
}

#[test]
fn pose_velocity_buttons_and_wrench_are_those_of_the_library() {
    let stub = Stub::of("virtuose");
    stub.set("buttons", 5.0);
    let mut opened = open(&stub);
    let state = read_until(&mut opened, "a sample", |s| s.buttons == 5);
    assert!((state.pose.translation - DVec3::new(0.1, -0.2, 0.3)).length() < 1e-7);
    let turn = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    assert!(state.pose.rotation.angle_between(turn) < 1e-6);
    assert!((state.linear_velocity - DVec3::new(0.01, 0.02, 0.03)).length() < 1e-8);
    assert!((state.angular_velocity - DVec3::new(0.4, 0.5, 0.6)).length() < 1e-7);
    assert_eq!(
        (state.hand, state.readiness),
        (HandPresence::Present, Readiness::Ready)
    );
    drive(&stub, &mut opened);
    // Single precision, and the gate that opens slowly scales all six alike.
    let last = stub.newest("virtSetForce").unwrap();
    let expected = wrench().to_array();
    assert!(
        last.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6),
        "{last:?}"
    );
}

#[test]
fn wrench_beyond_the_limits_keeps_its_direction_and_none_is_not_finite() {
    let stub = Stub::of("virtuose");
    let mut opened = open(&stub);
    let huge = push([3e200, 0.0, -4e200], [0.0, 1e9, 0.0]);
    drive_until(&mut opened, huge, "the largest wrench", |_| {
        stub.newest("virtSetForce").is_some_and(|n| n[0] == 21.0)
    });
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for i in 0..6 {
            let mut numbers = [0.0; 6];
            numbers[i] = bad;
            assert!(
                opened
                    .device
                    .write(&Wrench::from_array(&numbers).into())
                    .is_err()
            );
        }
    }
    drop(opened);
    for sent in stub.numbers("virtSetForce") {
        let wrench = Wrench::from_array(&sent.as_slice().try_into().unwrap());
        assert!(wrench.is_finite(), "{sent:?}");
        assert!(wrench.force.length() < 35.0 + 1e-4 && wrench.torque.length() < 3.1 + 1e-6);
        assert!(
            wrench.force.x == 0.0 || (wrench.force.z / wrench.force.x + 4.0 / 3.0).abs() < 1e-6
        );
    }
}

#[test]
fn no_force_goes_out_while_the_motors_start() {
    let stub = Stub::of("virtuose");
    let mut opened = Virtuose {
        motor_start: Duration::from_secs(3600),
        ..family(&stub)
    }
    .open("")
    .unwrap();
    let mut samples = 0;
    drive_until(&mut opened, wrench(), "many exchanges", |state| {
        if let Some(state) = state {
            assert_eq!(
                state.readiness,
                Readiness::Waiting("the motors are starting")
            );
            samples += 1;
        }
        samples > 50 && stub.count("virtSetForce") > 50
    });
    assert!(
        stub.numbers("virtSetForce")
            .iter()
            .flatten()
            .all(|n| *n == 0.0)
    );
}

#[test]
fn released_handle_and_clutch_take_the_force_to_zero_and_back() {
    let stub = Stub::of("virtuose");
    let mut opened = open(&stub);
    for (knob, released, held) in [("dead man", 0.0, 1.0), ("shift", 1.0, 0.0)] {
        drive(&stub, &mut opened);
        stub.set(knob, released);
        let state = drive_until(&mut opened, wrench(), "the release", |state| {
            state.is_some_and(|s| s.hand == HandPresence::Absent || s.readiness != Readiness::Ready)
        });
        assert_eq!(
            state.unwrap().hand == HandPresence::Absent,
            knob == "dead man"
        );
        drive_until(&mut opened, wrench(), "zero force", |_| is_zero(&stub));
        stub.set(knob, held);
    }
    drive(&stub, &mut opened);
}

#[test]
fn emergency_stop_is_told_and_power_comes_back_only_to_an_empty_handle() {
    let stub = Stub::of("virtuose");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    stub.set("chain", 0.0);
    stub.set("power", 0.0);
    message(&opened, "the emergency stop is pressed");
    let stopped = drive_until(&mut opened, wrench(), "the stop", |state| {
        state.is_some_and(|s| s.readiness == Readiness::Tripped("the emergency stop is pressed"))
    });
    assert!(stopped.is_some());
    drive_until(&mut opened, wrench(), "zero force", |_| is_zero(&stub));
    stub.set("chain", 1.0);
    drive_until(&mut opened, wrench(), "waiting for power", |state| {
        state.is_some_and(|s| matches!(s.readiness, Readiness::Waiting(_)))
    });
    let begun = Instant::now();
    drive_until(
        &mut opened,
        wrench(),
        "some time with the hand on the handle",
        |_| begun.elapsed() > Duration::from_millis(1200),
    );
    assert_eq!(stub.count("virtSetPowerOn 1"), 1);
    stub.set("dead man", 0.0);
    drive_until(&mut opened, wrench(), "power", |_| {
        stub.count("virtSetPowerOn 1") == 2
    });
    stub.set("dead man", 1.0);
    drive(&stub, &mut opened);
    let calls = stub.calls();
    let on = stub.last("virtSetPowerOn 1");
    assert_eq!(calls[on - 1], "virtSetForce 0 0 0 0 0 0");
}

#[test]
fn alarms_and_failures_of_the_controller_are_told_once() {
    let stub = Stub::of("virtuose");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    stub.set("alarm", f64::from(0x4000));
    message(&opened, "too hot");
    // The device goes on: it weakens the force by itself.
    drive(&stub, &mut opened);
    stub.set("failure", f64::from(0b10_0001));
    message(&opened, "failure of a motor: 1, 6");
    drive_until(&mut opened, wrench(), "zero force", |state| {
        is_zero(&stub) && state.is_some_and(|s| matches!(s.readiness, Readiness::Tripped(_)))
    });
    assert!(is_silent_about(&opened, "motor"));
}

#[test]
fn call_that_fails_once_is_told_and_the_next_exchange_goes_on() {
    let stub = Stub::of("virtuose");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    for call in [
        "virtSetForce",
        "virtGetPosition",
        "virtGetSpeed",
        "virtGetDeadMan",
        "virtGetEmergencyStop",
    ] {
        let before = stub.lines();
        stub.set(&format!("fail:{call}"), 1.0);
        let text = message(&opened, call);
        assert!(text.contains("stub says no"), "{text}");
        // The wrench comes back from zero, slowly.
        drive_until(&mut opened, wrench(), "zero force", |_| {
            stub.has_zero_since(before, "virtSetForce")
        });
        drive(&stub, &mut opened);
        assert!(stub.has_risen_slowly_to(3.0, before, "virtSetForce"));
        assert_eq!(stub.count("virtOpen"), 1);
    }
}

#[test]
fn pose_that_is_none_is_told_and_gets_no_force() {
    let stub = Stub::of("virtuose");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    for scale in [f64::NAN, f64::INFINITY, 0.0, 1.5] {
        let before = stub.lines();
        stub.set("scale", scale);
        message(&opened, "no pose");
        stub.wait_for_zeros(&mut opened, wrench(), before, "virtSetForce", "virtClose");
        stub.set("scale", 1.0);
        drive(&stub, &mut opened);
        let state = read_until(&mut opened, "a sample", |_| true);
        assert!(state.is_finite());
    }
}

#[test]
fn library_that_blocks_is_told_and_the_force_comes_back_from_zero() {
    let stub = Stub::of("virtuose");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    let before = stub.lines();
    stub.set("block:virtGetPosition", 150.0);
    drive_until(&mut opened, wrench(), "silence", |state| state.is_none());
    message(&opened, "was busy for");
    drive_until(&mut opened, wrench(), "zero force", |_| {
        stub.has_zero_since(before, "virtSetForce")
    });
    drive(&stub, &mut opened);
}

#[test]
fn library_that_goes_on_failing_is_left_with_zero_force_and_opened_again() {
    let stub = Stub::of("virtuose");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    stub.set("dead", 1.0);
    assert!(message(&opened, "is lost").contains("stub says no"));
    wait_until("closing", || stub.count("virtClose") == 1);
    let close = stub.last("virtClose");
    assert_eq!(
        stub.calls()[close - 3..=close],
        [
            "virtSetForce 0 0 0 0 0 0",
            "virtSetPowerOn 0",
            "virtDetachVO",
            "virtClose"
        ]
    );
    wait_until("another try", || stub.count("virtOpen") >= 2);
    stub.set("dead", 0.0);
    message(&opened, "is back");
    drive(&stub, &mut opened);
}

#[test]
fn arm_that_cannot_be_made_ready_is_closed_all_the_same() {
    for call in [
        "virtSetTimeStep",
        "virtSetCommandType",
        "virtSetPowerOn",
        "virtEnableForceFeedback",
    ] {
        let stub = Stub::of("virtuose");
        stub.set(&format!("fail:{call}"), 1.0);
        let error = family(&stub).open("").unwrap_err();
        assert!(error.to_string().contains(call), "{error}");
        let calls = stub.calls();
        assert_eq!(
            calls[calls.len() - 3..],
            ["virtSetPowerOn 0", "virtDetachVO", "virtClose"]
        );
        assert!(calls[calls.len() - 4].starts_with("virtSetForce 0 "));
    }
}

#[test]
fn arm_of_another_model_gets_little_force_and_a_note() {
    let stub = Stub::of("virtuose");
    stub.set("model", 1.0);
    stub.set("fail:virtSaturateTorque", 1.0);
    let opened = open(&stub);
    let limits = opened.device.limits();
    assert_eq!((limits.peak_force, limits.peak_torque), (5.0, 0.0));
    let notes = opened.notes.join("\n");
    assert!(
        notes.contains("not known here") && notes.contains("own limit of the force is not set"),
        "{notes}"
    );
}

#[test]
fn refused_connection_says_why_and_how_to_mend_it() {
    let stub = Stub::of("virtuose");
    for (code, word) in [
        (2, "switch the controller off and on"),
        (20, "delivered with the device"),
        (1, "stub says no"),
    ] {
        stub.set("error", code.into());
        stub.set("fail:virtOpen", 1.0);
        let error = family(&stub).open("").unwrap_err();
        let kind = match code {
            2 => matches!(error, Unavailable::NotThere { .. }),
            20 => matches!(error, Unavailable::WrongVersion { .. }),
            _ => matches!(error, Unavailable::Failed { .. }),
        };
        assert!(kind && error.to_string().contains(word), "{code}: {error}");
    }
    assert_eq!(stub.count("virtClose"), 0);
    // Nothing of that keeps the library busy.
    drop(open(&stub));
}

#[test]
fn library_without_a_function_or_of_another_version_is_refused_by_name() {
    let stub = Stub::with("virtuose", Some("without_set_force"));
    let error = family(&stub).open("").unwrap_err();
    assert!(matches!(error, Unavailable::WrongVersion { .. }), "{error}");
    assert!(
        error.to_string().contains("without virtSetForce"),
        "{error}"
    );

    let stub = Stub::of("virtuose");
    stub.set("major", 2.0);
    for error in [
        family(&stub).open("").unwrap_err(),
        family(&stub).list().remove(0).status.unwrap_err(),
    ] {
        assert!(matches!(error, Unavailable::WrongVersion { .. }), "{error}");
        assert!(error.to_string().contains("2.98"), "{error}");
    }
    assert_eq!(stub.calls(), Vec::<String>::new());
}

#[test]
fn library_that_is_not_there_is_named_with_its_source() {
    let absent = Virtuose::with_library(Some(PathBuf::from("/nowhere/libvirtuose.so")));
    for error in [
        absent.open("").unwrap_err(),
        absent.list().remove(0).status.unwrap_err(),
    ] {
        let text = error.to_string();
        assert!(matches!(error, Unavailable::NoLibrary { .. }), "{text}");
        assert!(
            text.contains("/nowhere/libvirtuose.so") && text.contains("Haption"),
            "{text}"
        );
    }
}

#[test]
fn second_device_of_one_library_is_refused_until_the_first_is_closed() {
    let stub = Stub::of("virtuose");
    let opened = open(&stub);
    let error = family(&stub).open("").unwrap_err();
    assert!(matches!(error, Unavailable::Busy { .. }), "{error}");
    let listed = family(&stub).list().remove(0).status.unwrap_err();
    assert!(matches!(listed, Unavailable::Busy { .. }), "{listed}");
    assert_eq!(stub.count("virtOpen"), 1);
    drop(opened);
    drop(open(&stub));
}

#[test]
fn list_names_the_arm_and_closes_it() {
    let stub = Stub::of("virtuose");
    let listing = family(&stub).list().remove(0);
    assert_eq!(listing.name, "virtuose:127.0.0.1#5000");
    let text = listing.status.unwrap();
    assert!(
        text.contains("Virtuose 6D, serial 17") && text.contains("API 3.98"),
        "{text}"
    );
    assert_eq!(stub.calls(), ["virtOpen 127.0.0.1#5000", "virtClose"]);
}

#[test]
fn library_that_does_not_come_back_holds_neither_the_list_nor_the_opening() {
    let stub = Stub::of("virtuose");
    stub.set("hold:virtOpen", 1.0);
    let listing = family(&stub).list().remove(0);
    assert_eq!(listing.name, "virtuose");
    assert!(matches!(listing.status, Err(Unavailable::NotThere { .. })));
    // The call is still in the library: nothing else may go there.
    let error = family(&stub).open("").unwrap_err();
    assert!(matches!(error, Unavailable::Busy { .. }), "{error}");
    assert_eq!(stub.count("virtClose"), 0);
    stub.set("hold:virtOpen", 0.0);
    wait_until("the end of the call", || stub.count("virtClose") == 1);
    wait_until("an opening", || family(&stub).open("").is_ok());

    let stub = Stub::of("virtuose");
    stub.set("hold:virtOpen", 1.0);
    let impatient = Virtuose {
        patience: Duration::from_millis(50),
        ..family(&stub)
    };
    let error = impatient.open("").unwrap_err().to_string();
    assert!(error.contains("did not come back within"), "{error}");
    stub.set("hold:virtOpen", 0.0);
    wait_until("the arm is closed when the library comes back", || {
        stub.count("virtClose") == 1
    });
    let calls = stub.calls();
    assert_eq!(
        calls[calls.len() - 3..],
        ["virtSetPowerOn 0", "virtDetachVO", "virtClose"]
    );
}

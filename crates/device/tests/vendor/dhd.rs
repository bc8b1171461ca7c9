//! Force Dimension.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use device::driver::dhd::Dhd;
use device::driver::{Family, Opened, Unavailable};
use device::{HandPresence, Readiness, Wrench};
use glam::{DQuat, DVec3};

use crate::stub::{
    LIMIT, Stub, drive_until, is_silent_about, message, push, read_until, wait_until,
};

fn family(stub: &Stub) -> Dhd {
    Dhd {
        patience: LIMIT,
        ..Dhd::with_library(Some(stub.file.clone()))
    }
}

fn open(stub: &Stub) -> Opened {
    family(stub).open("").unwrap()
}

/// 3 N, -4 N, 5 N and 0.1 N m, -0.05 N m, 0.02 N m.
fn wrench() -> Wrench {
    push([3.0, -4.0, 5.0], [0.1, -0.05, 0.02])
}

/// Commands the wrench until the library is given all of its force.
fn drive(stub: &Stub, opened: &mut Opened) {
    drive_until(opened, wrench(), "the whole force", |_| {
        stub.newest("dhdSetForce") == Some(vec![3.0, -4.0, 5.0])
    });
}

fn is_zero(stub: &Stub) -> bool {
    stub.is_at_zero("dhdSetForce")
}

#[test]
fn device_is_made_ready_in_order_and_left_with_zero_force_and_brakes() {
    let stub = Stub::of("dhd");
    let mut opened = family(&stub).open("2").unwrap();
    assert_eq!(opened.device.name(), "Force Dimension omega.3, serial 421");
    assert_eq!(opened.notes, ["Force Dimension SDK 3.17.6"]);
    drive(&stub, &mut opened);
    drop(opened);
    let calls = stub.calls();
    let begun = [
        "dhdOpenID 2",
        "dhdEnableExpertMode",
        "dhdSetWatchdog 160 @2",
        "dhdDisableExpertMode",
        "dhdSetGravityCompensation 1 @2",
        "dhdSetForce 0 0 0 @2",
        "dhdEnableForce 1 @2",
        "dhdSetForce 0 0 0 @2",
    ];
    assert_eq!(calls[..begun.len()], begun);
    let ended = [
        "dhdSetForce 0 0 0 @2",
        "dhdSetBrakes 1 @2",
        "dhdStop @2",
        "dhdClose @2",
    ];
    assert_eq!(calls[calls.len() - ended.len()..], ended);
    // The device's own limit of velocity is left as it is.
    assert_eq!(stub.count("dhdSetVelocityThreshold"), 0);
}

#[test]
fn first_free_device_is_called_by_the_number_it_was_given() {
    let stub = Stub::of("dhd");
    drop(open(&stub));
    let calls = stub.calls();
    assert_eq!(calls[0], "dhdOpen");
    assert_eq!(calls.last().unwrap(), "dhdClose @5");
    assert!(
        calls
            .iter()
            .all(|line| !line.contains('@') || line.ends_with("@5"))
    );
}

#[test]
fn pose_velocity_and_buttons_are_those_of_the_library() {
    let stub = Stub::of("dhd");
    stub.set("buttons", 3.0);
    stub.set("wrist", 1.0);
    let mut opened = open(&stub);
    let state = read_until(&mut opened, "a sample", |s| s.readiness == Readiness::Ready);
    assert_eq!(state.pose.translation, DVec3::new(0.01, -0.02, 0.03));
    // Row by row: x becomes y, and not y becomes x.
    let turn = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    assert!(state.pose.rotation.angle_between(turn) < 1e-7);
    assert_eq!(state.linear_velocity, DVec3::new(0.01, 0.02, 0.03));
    assert_eq!(state.angular_velocity, DVec3::new(0.4, 0.5, 0.6));
    assert_eq!((state.buttons, state.hand), (3, HandPresence::Unknown));
}

#[test]
fn torque_goes_only_to_a_wrist_with_motors() {
    let stub = Stub::of("dhd");
    stub.set("wrist", 1.0);
    let mut opened = open(&stub);
    assert_eq!(opened.device.limits().peak_torque, 0.0);
    drive(&stub, &mut opened);
    assert_eq!(stub.count("dhdSetForceAndTorque"), 0);

    let stub = Stub::of("dhd");
    stub.set("wrist", 2.0);
    stub.set("type", 104.0);
    let mut opened = open(&stub);
    assert_eq!(opened.device.limits().peak_torque, 0.2);
    drive_until(&mut opened, wrench(), "the whole wrench", |_| {
        stub.newest("dhdSetForceAndTorque") == Some(wrench().to_array().to_vec())
    });
    drop(opened);
    assert_eq!(stub.count("dhdSetForce"), 0);
    let brakes = stub.last("dhdSetBrakes");
    assert_eq!(
        stub.calls()[brakes - 1],
        "dhdSetForceAndTorque 0 0 0 0 0 0 @5"
    );
}

#[test]
fn wrench_beyond_the_limits_keeps_its_direction_and_none_is_not_finite() {
    let stub = Stub::of("dhd");
    let mut opened = open(&stub);
    let huge = push([3e200, 0.0, -4e200], [0.0; 3]);
    drive_until(&mut opened, huge, "the largest force", |_| {
        stub.newest("dhdSetForce")
            .is_some_and(|n| (n[0] - 7.2).abs() < 1e-9)
    });
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let not_finite = push([0.0, bad, 0.0], [0.0; 3]);
        assert!(opened.device.write(&not_finite.into()).is_err());
    }
    drop(opened);
    for sent in stub.numbers("dhdSetForce") {
        let force = DVec3::from_slice(&sent);
        assert!(
            force.is_finite() && force.length() < 12.0 + 1e-9,
            "{sent:?}"
        );
    }
}

#[test]
fn forces_are_not_switched_on_before_the_device_is_calibrated() {
    let stub = Stub::of("dhd");
    stub.set("calibrated", 0.0);
    let mut opened = open(&stub);
    assert!(
        opened.notes.join("\n").contains("not calibrated"),
        "{:?}",
        opened.notes
    );
    let mut samples = 0;
    drive_until(&mut opened, wrench(), "many exchanges", |state| {
        samples += usize::from(state.is_some_and(|s| matches!(s.readiness, Readiness::Waiting(_))));
        samples > 20 && stub.count("dhdSetForce") > 20
    });
    assert_eq!(stub.count("dhdEnableForce"), 0);
    assert!(
        stub.numbers("dhdSetForce")
            .iter()
            .flatten()
            .all(|n| *n == 0.0)
    );
    stub.set("calibrated", 1.0);
    drive(&stub, &mut opened);
    assert_eq!(stub.count("dhdEnableForce 1"), 1);
}

#[test]
fn cut_force_is_told() {
    for (cause, word) in [
        (3.0, "no command"),
        (4.0, "by software"),
        (5.0, "USB"),
        (99.0, "not known"),
    ] {
        let stub = Stub::of("dhd");
        let mut opened = open(&stub);
        drive(&stub, &mut opened);
        trip(&stub, &mut opened, cause, word);
    }
}

/// Has the device cut the force.
fn trip(stub: &Stub, opened: &mut Opened, cause: f64, word: &str) {
    stub.set("cause", cause);
    stub.set("force", 0.0);
    message(opened, word);
    drive_until(opened, wrench(), "the trip", |state| {
        is_zero(stub) && state.is_some_and(|s| matches!(s.readiness, Readiness::Tripped(_)))
    });
}

#[test]
fn cut_force_comes_back_only_when_the_handle_rests() {
    let stub = Stub::of("dhd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    stub.set("speed", 0.8);
    trip(&stub, &mut opened, 2.0, "too fast");
    let begun = Instant::now();
    drive_until(&mut opened, wrench(), "a while in motion", |_| {
        begun.elapsed() > Duration::from_millis(1200)
    });
    assert_eq!(stub.count("dhdEnableForce 1"), 1);
    stub.set("speed", 0.0);
    drive(&stub, &mut opened);
    let on = stub.last("dhdEnableForce 1");
    assert_eq!(stub.calls()[on - 1], "dhdSetForce 0 0 0 @5");
}

#[test]
fn force_button_and_deadman_are_left_to_the_hand() {
    let stub = Stub::of("dhd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    stub.set("cause", 1.0);
    stub.set("force", 0.0);
    let begun = Instant::now();
    drive_until(
        &mut opened,
        wrench(),
        "a while with the forces off",
        |state| {
            begun.elapsed() > Duration::from_millis(1200)
                && state.is_some_and(
                    |s| matches!(s.readiness, Readiness::Waiting(why) if why.contains("button")),
                )
        },
    );
    assert_eq!(stub.count("dhdEnableForce 1"), 1);
    stub.set("force", 1.0);
    drive(&stub, &mut opened);
    stub.set("cause", 6.0);
    stub.set("force", 0.0);
    drive_until(&mut opened, wrench(), "the released handle", |state| {
        state.is_some_and(|s| s.hand == HandPresence::Absent) || stub.count("dhdEnableForce 1") > 1
    });
}

#[test]
fn numbers_above_zero_are_no_failures() {
    for returned in [1.0, 2.0] {
        let stub = Stub::of("dhd");
        stub.set("returned", returned);
        let mut opened = open(&stub);
        drive(&stub, &mut opened);
        assert!(is_silent_about(&opened, "stub says no"));
    }
}

#[test]
fn call_that_fails_once_is_told_and_the_next_exchange_goes_on() {
    let stub = Stub::of("dhd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    for call in [
        "dhdSetForce",
        "dhdGetPositionAndOrientationFrame",
        "dhdGetLinearVelocity",
        "dhdGetStatus",
    ] {
        let before = stub.lines();
        stub.set(&format!("fail:{call}"), 1.0);
        let text = message(&opened, call);
        assert!(text.contains("stub says no"), "{text}");
        drive_until(&mut opened, wrench(), "zero force", |_| {
            stub.has_zero_since(before, "dhdSetForce")
        });
        drive(&stub, &mut opened);
        assert!(stub.has_risen_slowly_to(3.0, before, "dhdSetForce"));
        assert_eq!(stub.count("dhdOpen"), 1);
    }
}

#[test]
fn pose_or_velocity_that_is_none_is_told_and_gets_no_force() {
    let stub = Stub::of("dhd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    for (knob, bad, good) in [
        ("scale", f64::NAN, 1.0),
        ("scale", 0.0, 1.0),
        ("scale", -1.0, 1.0),
        ("speed", f64::NAN, 0.0),
    ] {
        let before = stub.lines();
        stub.set(knob, bad);
        message(&opened, "no pose");
        stub.wait_for_zeros(&mut opened, wrench(), before, "dhdSetForce", "dhdClose");
        stub.set(knob, good);
        drive(&stub, &mut opened);
        assert!(read_until(&mut opened, "a sample", |_| true).is_finite());
    }
}

#[test]
fn library_that_blocks_is_told_and_the_force_comes_back_from_zero() {
    let stub = Stub::of("dhd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    let before = stub.lines();
    stub.set("block:dhdSetForce", 150.0);
    drive_until(&mut opened, wrench(), "silence", |state| state.is_none());
    message(&opened, "was busy for");
    drive_until(&mut opened, wrench(), "zero force", |_| {
        stub.has_zero_since(before, "dhdSetForce")
    });
    drive(&stub, &mut opened);
}

#[test]
fn library_that_goes_on_failing_is_left_with_zero_force_and_opened_again() {
    let stub = Stub::of("dhd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    stub.set("dead", 1.0);
    assert!(message(&opened, "is lost").contains("stub says no"));
    wait_until("closing", || stub.count("dhdClose") == 1);
    let close = stub.last("dhdClose");
    assert_eq!(
        stub.calls()[close - 3..=close],
        [
            "dhdSetForce 0 0 0 @5",
            "dhdSetBrakes 1 @5",
            "dhdStop @5",
            "dhdClose @5"
        ]
    );
    wait_until("another try", || stub.count("dhdOpen") >= 2);
    stub.set("dead", 0.0);
    message(&opened, "is back");
    drive(&stub, &mut opened);
}

#[test]
fn settings_that_are_refused_are_noted_and_needed_ones_close_the_device() {
    let stub = Stub::of("dhd");
    stub.set("fail:dhdSetWatchdog", 1.0);
    stub.set("fail:dhdSetGravityCompensation", 1.0);
    stub.set("threshold", 0.0);
    stub.set("type", 63.0);
    let opened = open(&stub);
    let notes = opened.notes.join("\n");
    for word in [
        "watchdog is not set",
        "weight of the handle",
        "limit of velocity",
        "not known here",
    ] {
        assert!(notes.contains(word), "{word}: {notes}");
    }
    assert_eq!(opened.device.limits().peak_force, 4.0);

    let stub = Stub::of("dhd");
    stub.set("fail:dhdEnableForce", 1.0);
    let error = family(&stub).open("").unwrap_err();
    assert!(error.to_string().contains("dhdEnableForce"), "{error}");
    let calls = stub.calls();
    assert_eq!(
        calls[calls.len() - 3..],
        ["dhdSetBrakes 1 @5", "dhdStop @5", "dhdClose @5"]
    );
}

#[test]
fn refused_device_says_why_and_how_to_mend_it() {
    let stub = Stub::of("dhd");
    for (code, count, kind) in [
        (3, 1, "Busy"),
        (20, 1, "Busy"),
        (5, 0, "NotThere"),
        (2, 0, "Failed"),
        (1, 1, "Failed"),
    ] {
        stub.set("error", code.into());
        stub.set("count", count.into());
        stub.set("fail:dhdOpen", 1.0);
        let error = family(&stub).open("").unwrap_err();
        let found = match &error {
            Unavailable::Busy { .. } => "Busy",
            Unavailable::NotThere { .. } => "NotThere",
            Unavailable::Failed { .. } => "Failed",
            _ => "other",
        };
        assert_eq!(found, kind, "{code}: {error}");
        assert!(error.to_string().contains("stub says no"), "{error}");
    }
    if cfg!(target_os = "linux") {
        stub.set("error", 2.0);
        stub.set("fail:dhdOpen", 1.0);
        let error = family(&stub).open("").unwrap_err();
        assert!(
            matches!(error, Unavailable::PermissionDenied { .. }),
            "{error}"
        );
        assert!(
            error.to_string().contains("ATTRS{idVendor}==\"1451\""),
            "{error}"
        );
    }
    assert_eq!(stub.count("dhdClose"), 0);
    drop(open(&stub));
}

#[test]
fn library_without_a_function_or_of_another_version_or_absent_is_refused_by_name() {
    let stub = Stub::with("dhd", Some("without_expert_mode"));
    let error = family(&stub).open("").unwrap_err();
    assert!(matches!(error, Unavailable::WrongVersion { .. }), "{error}");
    assert!(
        error.to_string().contains("without dhdEnableExpertMode"),
        "{error}"
    );

    let stub = Stub::of("dhd");
    stub.set("major", 4.0);
    for error in [
        family(&stub).open("").unwrap_err(),
        family(&stub).list().remove(0).status.unwrap_err(),
    ] {
        assert!(matches!(error, Unavailable::WrongVersion { .. }), "{error}");
        assert!(error.to_string().contains("4.17.6"), "{error}");
    }
    assert_eq!(stub.calls(), Vec::<String>::new());

    let absent = Dhd::with_library(Some(PathBuf::from("/nowhere/libdhd.so")));
    let error = absent.list().remove(0).status.unwrap_err();
    assert!(matches!(error, Unavailable::NoLibrary { .. }), "{error}");
    assert!(error.to_string().contains("Force Dimension SDK"), "{error}");
}

#[test]
fn list_names_each_device_and_why_one_is_not_to_be_had() {
    let stub = Stub::of("dhd");
    stub.set("count", 2.0);
    stub.set("taken", 1.0);
    stub.set("error", 20.0);
    let listings = family(&stub).list();
    assert_eq!(listings.len(), 2);
    assert_eq!(
        (listings[0].name.as_str(), listings[1].name.as_str()),
        ("dhd:0", "dhd:1")
    );
    let text = listings[0].status.as_ref().unwrap();
    assert!(
        text.contains("omega.3, serial 421") && text.contains("3.17.6"),
        "{text}"
    );
    assert!(matches!(listings[1].status, Err(Unavailable::Busy { .. })));
    assert_eq!(stub.calls(), ["dhdOpenID 0", "dhdClose @0", "dhdOpenID 1"]);

    stub.set("count", 0.0);
    let none = family(&stub).list();
    assert!(matches!(none[0].status, Err(Unavailable::NotThere { .. })));
    // A library that counts nonsense does not make the list endless.
    stub.set("count", 1e9);
    assert!(family(&stub).list().len() <= 16);
    stub.set("count", -1.0);
    assert!(family(&stub).list()[0].status.is_err());
}

#[test]
fn list_tells_what_it_has_found_where_the_library_does_not_come_back() {
    let stub = Stub::of("dhd");
    stub.set("count", 2.0);
    stub.set("hold:dhdOpenID 1", 1.0);
    let listings = family(&stub).list();
    stub.set("hold:dhdOpenID 1", 0.0);
    assert_eq!(listings.len(), 2);
    assert!(listings[0].name == "dhd:0" && listings[0].status.is_ok());
    assert!(matches!(
        listings[1].status,
        Err(Unavailable::NotThere { .. })
    ));
}

#[test]
fn second_device_of_one_library_is_refused_until_the_first_is_closed() {
    let stub = Stub::of("dhd");
    let opened = open(&stub);
    let error = family(&stub).open("1").unwrap_err();
    assert!(matches!(error, Unavailable::Busy { .. }), "{error}");
    let listed = family(&stub).list();
    assert!(matches!(listed[0].status, Err(Unavailable::Busy { .. })));
    drop(opened);
    drop(open(&stub));
}

//! 3D Systems, OpenHaptics.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use device::driver::hd::Hd;
use device::driver::{Family, Opened, Unavailable};
use device::{HandPresence, Readiness, Wrench};
use glam::{DQuat, DVec3};

use crate::stub::{LIMIT, Stub, drive_until, message, push, read_until, wait_until};

const FORCE: &str = "hdSetDoublev 0x2700";
const TORQUE: &str = "hdSetDoublev 0x2701";

fn family(stub: &Stub) -> Hd {
    Hd {
        patience: LIMIT,
        ..Hd::with_library(Some(stub.file.clone()))
    }
}

fn open(stub: &Stub) -> Opened {
    family(stub).open("").unwrap()
}

/// 1 N, -2 N, 1.5 N and 0.1 N m, -0.05 N m, 0.02 N m.
fn wrench() -> Wrench {
    push([1.0, -2.0, 1.5], [0.1, -0.05, 0.02])
}

/// Commands the wrench until the library is given all of its force.
fn drive(stub: &Stub, opened: &mut Opened) {
    drive_until(opened, wrench(), "the whole force", |_| {
        stub.newest(FORCE) == Some(vec![1.0, -2.0, 1.5])
    });
}

fn is_zero(stub: &Stub) -> bool {
    stub.is_at_zero(FORCE)
}

/// Nothing was done out of a frame that belongs into one, and nothing was asked that is not known.
fn assert_orderly(stub: &Stub) {
    let calls = stub.calls();
    let odd: Vec<&String> = calls
        .iter()
        .filter(|line| line.contains("a frame") || line.starts_with("hdGet"))
        .collect();
    assert!(odd.is_empty(), "{odd:?}");
}

#[test]
fn device_is_made_ready_in_order_and_left_with_zero_force() {
    let stub = Stub::of("hd");
    let mut opened = family(&stub).open("Left Device").unwrap();
    assert_eq!(opened.device.name(), "3D Systems Touch, serial 0814");
    assert_eq!(opened.notes, ["OpenHaptics 3.4.0"]);
    drive(&stub, &mut opened);
    drop(opened);
    let calls = stub.calls();
    let begun = [
        "hdInitDevice Left Device",
        "hdMakeCurrentDevice 7",
        "hdEnable 0x4001",
        "hdEnable 0x4002",
        "hdEnable 0x4000",
        "hdScheduleAsynchronous 65535",
        "hdStartScheduler",
        "hdMakeCurrentDevice 7",
        "hdSetDoublev 0x2700 0 0 0",
    ];
    assert_eq!(calls[..begun.len()], begun);
    let ended = [
        "hdUnschedule 99",
        "hdStopScheduler",
        "hdDisable 0x4000",
        "hdDisableDevice 7",
    ];
    let first = calls.len() - ended.len();
    assert_eq!(calls[first..], ended);
    assert!(stub.is_zero_before(first, FORCE) && stub.is_zero_before(first - 1, FORCE));
    assert_orderly(&stub);
}

#[test]
fn millimetres_become_metres_and_columns_a_frame() {
    let stub = Stub::of("hd");
    stub.set("buttons", 2.0);
    let mut opened = open(&stub);
    let state = read_until(&mut opened, "a sample", |s| s.buttons == 2);
    assert!((state.pose.translation - DVec3::new(0.010, -0.020, 0.030)).length() < 1e-15);
    let turn = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    assert!(state.pose.rotation.angle_between(turn) < 1e-7);
    assert!((state.linear_velocity - DVec3::new(0.010, 0.020, 0.030)).length() < 1e-15);
    assert_eq!(
        (state.angular_velocity, state.hand),
        (DVec3::ZERO, HandPresence::Unknown)
    );
    let limits = opened.device.limits();
    assert_eq!(
        (
            limits.peak_force,
            limits.continuous_force,
            limits.peak_torque
        ),
        (3.3, 0.88, 0.0)
    );
    assert_eq!(
        (limits.max_stiffness, limits.max_damping),
        (Some(500.0), Some(3.0))
    );
    assert!((limits.workspace_half_extents - DVec3::new(0.080, 0.060, 0.035)).length() < 1e-15);
}

#[test]
fn torque_goes_only_to_a_device_that_pushes_in_six_directions() {
    let stub = Stub::of("hd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    assert_eq!(stub.count(TORQUE), 0);

    let stub = Stub::of("hd");
    stub.set("freedoms", 6.0);
    let mut opened = open(&stub);
    assert!((opened.device.limits().peak_torque - 0.188).abs() < 1e-12);
    drive_until(&mut opened, wrench(), "the whole torque, in N mm", |_| {
        stub.newest(TORQUE).is_some_and(|n| {
            n.iter()
                .zip([100.0, -50.0, 20.0])
                .all(|(a, b)| (a - b).abs() < 1e-9)
        })
    });
    // A library that refuses it is asked no more.
    stub.set("no torque", 1.0);
    message(&opened, "no torque is rendered");
    let count = stub.count(TORQUE);
    let frames = stub.count(FORCE);
    drive_until(&mut opened, wrench(), "more frames", |_| {
        stub.count(FORCE) > frames + 20
    });
    assert_eq!(stub.count(TORQUE), count);
}

#[test]
fn wrench_beyond_the_limits_keeps_its_direction_and_none_is_not_finite() {
    let stub = Stub::of("hd");
    let mut opened = open(&stub);
    let huge = push([3e200, 0.0, -4e200], [1e300; 3]);
    drive_until(&mut opened, huge, "the largest force", |_| {
        stub.newest(FORCE)
            .is_some_and(|n| (n[0] - 1.98).abs() < 1e-9)
    });
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let not_finite = push([0.0, bad, 0.0], [0.0; 3]);
        assert!(opened.device.write(&not_finite.into()).is_err());
    }
    drop(opened);
    for sent in stub.numbers(FORCE) {
        let force = DVec3::from_slice(&sent);
        assert!(force.is_finite() && force.length() < 3.3 + 1e-9, "{sent:?}");
    }
}

#[test]
fn absurd_limit_is_replaced_and_noted() {
    for bad in [f64::NAN, -3.0, 1e9] {
        let stub = Stub::of("hd");
        stub.set("largest force", bad);
        let opened = open(&stub);
        assert_eq!(opened.device.limits().peak_force, 0.88);
        assert!(
            opened.notes.join("\n").contains("largest force"),
            "{:?}",
            opened.notes
        );
    }
}

#[test]
fn stylus_in_its_well_gets_no_force() {
    let stub = Stub::of("hd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    stub.set("out of the well", 0.0);
    let state = drive_until(&mut opened, wrench(), "the well", |state| {
        is_zero(&stub) && state.is_some_and(|s| s.hand == HandPresence::Absent)
    });
    assert!(matches!(state.unwrap().readiness, Readiness::Waiting(_)));
    stub.set("out of the well", 1.0);
    drive(&stub, &mut opened);
    // Where a device has no well, its switch says nothing.
    let stub = Stub::of("hd");
    stub.set("style", 2.0);
    stub.set("out of the well", 0.0);
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    assert_orderly(&stub);
}

#[test]
fn calibration_is_updated_without_force_and_waited_for() {
    let stub = Stub::of("hd");
    stub.set("calibration", f64::from(0x5001));
    let mut opened = open(&stub);
    assert_eq!(stub.count("hdUpdateCalibration 4"), 1);
    drive(&stub, &mut opened);
    // One that is asked for later, and does not succeed at once.
    stub.set("can calibrate", 0.0);
    stub.set("calibration", f64::from(0x5001));
    drive_until(
        &mut opened,
        wrench(),
        "waiting for the calibration",
        |state| {
            is_zero(&stub) && state.is_some_and(|s| matches!(s.readiness, Readiness::Waiting(_)))
        },
    );
    drive_until(&mut opened, wrench(), "an update", |_| {
        stub.count("hdUpdateCalibration") > 1
    });
    let update = stub.last("hdUpdateCalibration");
    assert!(stub.calls()[update - 1].starts_with(FORCE));
    stub.set("can calibrate", 1.0);
    drive(&stub, &mut opened);
    stub.set("calibration", f64::from(0x5002));
    drive_until(&mut opened, wrench(), "the maker's setup", |state| {
        state.is_some_and(
            |s| matches!(s.readiness, Readiness::Waiting(why) if why.contains("setup")),
        )
    });
}

#[test]
fn cut_force_is_told() {
    for (code, word) in [
        (0x0200, "too warm"),
        (0x0201, "too large"),
        (0x0202, "too fast"),
        (0x0204, "cut the force"),
    ] {
        let stub = Stub::of("hd");
        let mut opened = open(&stub);
        drive(&stub, &mut opened);
        trip(&stub, &mut opened, code, word);
    }
}

/// Has the library report an error of the force.
fn trip(stub: &Stub, opened: &mut Opened, code: u32, word: &str) {
    stub.set("frame error", code.into());
    stub.set("fail:frame", 1.0);
    let text = message(opened, word);
    assert!(text.contains("stub says no"), "{text}");
    drive_until(opened, wrench(), "the trip", |state| {
        is_zero(stub) && state.is_some_and(|s| matches!(s.readiness, Readiness::Tripped(_)))
    });
}

#[test]
fn cut_force_comes_back_only_when_the_handle_rests() {
    let stub = Stub::of("hd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    stub.set("speed", 800.0);
    trip(&stub, &mut opened, 0x0203, "moved too fast");
    let begun = Instant::now();
    drive_until(&mut opened, wrench(), "a while in motion", |_| {
        begun.elapsed() > Duration::from_millis(1200)
    });
    assert_eq!(stub.count("hdEnable 0x4000"), 1);
    stub.set("speed", 0.0);
    drive(&stub, &mut opened);
    assert_eq!(stub.count("hdEnable 0x4000"), 2);
}

#[test]
fn frame_that_fails_once_is_told_and_the_next_goes_on() {
    let stub = Stub::of("hd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    let before = stub.lines();
    stub.set("fail:frame", 1.0);
    let text = message(&opened, "stub says no");
    assert!(text.contains("0x0302"), "{text}");
    drive_until(&mut opened, wrench(), "zero force", |_| {
        stub.has_zero_since(before, FORCE)
    });
    drive(&stub, &mut opened);
    assert!(stub.has_risen_slowly_to(1.0, before, FORCE));
    assert_eq!(stub.count("hdInitDevice"), 1);
}

#[test]
fn pose_or_velocity_that_is_none_is_told_and_gets_no_force() {
    let stub = Stub::of("hd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    for (knob, bad, good) in [
        ("scale", f64::NAN, 1.0),
        ("scale", 0.0, 1.0),
        ("speed", f64::NAN, 0.0),
    ] {
        let before = stub.lines();
        stub.set(knob, bad);
        message(&opened, "no pose");
        stub.wait_for_zeros(&mut opened, wrench(), before, FORCE, "hdDisableDevice");
        stub.set(knob, good);
        drive(&stub, &mut opened);
        assert!(read_until(&mut opened, "a sample", |_| true).is_finite());
    }
}

#[test]
fn scheduler_that_blocks_is_told_and_the_force_comes_back_from_zero() {
    let stub = Stub::of("hd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    let before = stub.lines();
    stub.set("block:hdBeginFrame", 150.0);
    drive_until(&mut opened, wrench(), "silence", |state| state.is_none());
    message(&opened, "has not run for");
    drive_until(&mut opened, wrench(), "zero force", |_| {
        stub.has_zero_since(before, FORCE)
    });
    drive(&stub, &mut opened);
    assert_eq!(stub.count("hdInitDevice"), 1);
}

#[test]
fn library_that_goes_on_failing_is_left_with_zero_force_and_opened_again() {
    let stub = Stub::of("hd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    // The errors never end: they are fetched a few at a time.
    stub.set("endless errors", 1.0);
    assert!(message(&opened, "is lost").contains("stub says no"));
    wait_until("closing", || stub.count("hdDisableDevice") == 1);
    let calls = stub.calls();
    let end = stub.last("hdDisableDevice");
    assert_eq!(
        calls[end - 3..=end],
        [
            "hdUnschedule 99",
            "hdStopScheduler",
            "hdDisable 0x4000",
            "hdDisableDevice 7"
        ]
    );
    assert!(stub.is_zero_before(end - 3, FORCE));
    stub.set("endless errors", 0.0);
    message(&opened, "is back");
    drive(&stub, &mut opened);
    assert_orderly(&stub);
}

#[test]
fn scheduler_that_has_died_does_not_hold_the_end() {
    let stub = Stub::of("hd");
    let mut opened = open(&stub);
    drive(&stub, &mut opened);
    // Longer than the end waits for the last frames; the stub's scheduler is joined when it is stopped.
    stub.set("block:hdBeginFrame", 600.0);
    drive_until(&mut opened, wrench(), "silence", |state| state.is_none());
    drop(opened);
    wait_until("the end", || stub.count("hdDisableDevice") == 1);
    let calls = stub.calls();
    let end = calls.len();
    assert_eq!(calls[end - 2..], ["hdDisable 0x4000", "hdDisableDevice 7"]);
}

#[test]
fn scheduler_that_does_not_start_and_device_that_does_not_answer_are_told() {
    let stub = Stub::of("hd");
    stub.set("fail:hdStartScheduler", 1.0);
    let error = family(&stub).open("").unwrap_err();
    assert!(error.to_string().contains("scheduler"), "{error}");
    assert_eq!(stub.calls().last().unwrap(), "hdDisableDevice 7");

    let stub = Stub::of("hd");
    for (code, kind) in [
        (0x0301, "Busy"),
        (0x0300, "NotThere"),
        (0x0302, "NotThere"),
        (0x0600, "Failed"),
    ] {
        stub.set("init error", code.into());
        for list in [false, true] {
            stub.set("fail:hdInitDevice", 1.0);
            let error = if list {
                family(&stub).list().remove(0).status.unwrap_err()
            } else {
                family(&stub).open("").unwrap_err()
            };
            let found = match &error {
                Unavailable::Busy { .. } => "Busy",
                Unavailable::NotThere { .. } => "NotThere",
                Unavailable::Failed { .. } => "Failed",
                _ => "other",
            };
            assert_eq!(found, kind, "{code:#x}: {error}");
            assert!(error.to_string().contains("stub says no"), "{error}");
        }
    }
    // Motors that are warm from before are no reason not to begin.
    stub.set("init error", f64::from(0x0200));
    stub.set("error at init", 1.0);
    drop(open(&stub));
}

#[test]
fn library_without_a_function_or_of_another_version_or_absent_is_refused_by_name() {
    let stub = Stub::with("hd", Some("without_unschedule"));
    let error = family(&stub).open("").unwrap_err();
    assert!(matches!(error, Unavailable::WrongVersion { .. }), "{error}");
    assert!(
        error.to_string().contains("without hdUnschedule"),
        "{error}"
    );

    let stub = Stub::of("hd");
    stub.set("major", 2.0);
    for list in [false, true] {
        let error = if list {
            family(&stub).list().remove(0).status.unwrap_err()
        } else {
            family(&stub).open("").unwrap_err()
        };
        assert!(matches!(error, Unavailable::WrongVersion { .. }), "{error}");
        assert!(error.to_string().contains("2.0.1"), "{error}");
        assert_eq!(stub.calls().last().unwrap(), "hdDisableDevice 7");
    }

    let absent = Hd::with_library(Some(PathBuf::from("/nowhere/libHD.so")));
    let error = absent.list().remove(0).status.unwrap_err();
    assert!(matches!(error, Unavailable::NoLibrary { .. }), "{error}");
    assert!(error.to_string().contains("OpenHaptics"), "{error}");
}

#[test]
fn list_names_the_default_device_and_disables_it() {
    let stub = Stub::of("hd");
    let listing = family(&stub).list().remove(0);
    assert_eq!(listing.name, "hd");
    let text = listing.status.unwrap();
    assert!(
        text.contains("Touch, serial 0814") && text.contains("3.4.0"),
        "{text}"
    );
    assert_eq!(
        stub.calls(),
        [
            "hdInitDevice default",
            "hdMakeCurrentDevice 7",
            "hdDisableDevice 7"
        ]
    );

    let opened = open(&stub);
    let listed = family(&stub).list().remove(0).status.unwrap_err();
    assert!(matches!(listed, Unavailable::Busy { .. }), "{listed}");
    drop(opened);
    drop(open(&stub));
}

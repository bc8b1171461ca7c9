//! Two handles, one on each body.

use device::{HandSettings, Limits, Simulated, SimulatedHand, SimulatedSettings};
use glam::DVec3;

use super::*;

/// A tool that stands askew beside a part, each held at a point of its own.
fn held(holds: Holds) -> (Held, Held) {
    let tool_pose = DPose3::new(DVec3::new(0.01, 0.02, -0.03), DVec3::new(0.3, -0.8, 0.5));
    let of = |holds, grip| Held {
        holds,
        grip,
        tool_pose,
    };
    let other = match holds {
        Holds::Tool => Holds::Part,
        Holds::Part => Holds::Tool,
    };
    let (first, second) = (DVec3::new(2e-3, 0.0, 1e-3), DVec3::new(0.0, 4e-3, -3e-3));
    (of(holds, first), of(other, second))
}

fn device(start: DPose3) -> Simulated {
    let hand = SimulatedHand::resting(HandSettings::default(), start, 1e-3).unwrap();
    Simulated::new(SimulatedSettings::default(), hand).unwrap()
}

fn other(device: &mut Simulated, held: Held) -> Other<'_> {
    let hand = SecondHand {
        device,
        held,
        mapping: None,
        safety: SafetySettings::for_limits(&Limits::virtuose_6d()),
    };
    Other::new(hand, 1e-3).unwrap()
}

fn report(tool_pose: DPose3) -> StepReport {
    let mut report = StepReport::at(&tool_pose);
    report.contact_wrench_on_tool = [1.0, -2.0, 3.0, 0.01, 0.02, -0.03];
    report.coupling_wrench_on_tool = report.contact_wrench_on_tool.map(|x| -x);
    report
}

fn near(a: Wrench, b: Wrench) {
    assert!((a.force - b.force).length() < 1e-13, "{a:?} {b:?}");
    assert!((a.torque - b.torque).length() < 1e-13, "{a:?} {b:?}");
}

#[test]
fn the_other_hand_at_rest_changes_nothing_for_the_first() {
    for holds in [Holds::Tool, Holds::Part] {
        let (first, second) = held(holds);
        let mut device = device(second.start());
        let other = other(&mut device, second);
        let handle = first.along(DVec3::new(1e-3, -2e-3, 5e-4));
        let (target, alone) = (other.target(&first, &handle), first.target(&handle));
        assert!((target.translation - alone.translation).length() < 1e-15);
        assert!(target.rotation.angle_between(alone.rotation) < 1e-7);
        let report = report(alone);
        let single = first.wrench_on_handle(&handle, &report);
        near(other.wrenches(&first, &handle, &report).0, single);
    }
}

#[test]
fn both_hands_moved_alike_feel_the_same_turned() {
    let moved = DPose3::new(DVec3::new(0.2, -0.1, 0.4), DVec3::new(-0.7, 0.2, 1.1));
    for holds in [Holds::Tool, Holds::Part] {
        let (first, second) = held(holds);
        let mut device = device(second.start());
        let mut other = other(&mut device, second);
        let handle = first.along(DVec3::new(1e-3, -2e-3, 5e-4));
        let target = other.target(&first, &handle);
        let report = report(target);
        let (on_first, on_second) = other.wrenches(&first, &handle, &report);
        other.handle = moved * other.handle;
        let again = other.target(&first, &(moved * handle));
        assert!((again.translation - target.translation).length() < 1e-15);
        let turned = other.wrenches(&first, &(moved * handle), &report);
        let turn = |w: Wrench| Wrench::new(moved.rotation * w.force, moved.rotation * w.torque);
        near(turned.0, turn(on_first));
        near(turned.1, turn(on_second));
    }
}

#[test]
fn what_the_two_hands_feel_balances() {
    for holds in [Holds::Tool, Holds::Part] {
        let (first, second) = held(holds);
        let mut device = device(second.start());
        let other = other(&mut device, second);
        let handle = first.along(DVec3::new(1e-3, -2e-3, 5e-4));
        let report = report(first.target(&handle));
        let (on_first, on_second) = other.wrenches(&first, &handle, &report);
        let about = DVec3::new(0.3, 0.1, -0.2);
        let sum = on_first.about(handle.translation, about)
            + on_second.about(other.handle.translation, about);
        near(sum, Wrench::ZERO);
        let expected = if holds == Holds::Tool { 1.0 } else { -1.0 };
        assert!((on_first.force.x - expected).abs() < 1e-13);
    }
}

#[test]
fn its_device_is_given_its_force_and_let_go_at_the_end() {
    let (first, second) = held(Holds::Tool);
    let mut device = device(second.start());
    let mut other = other(&mut device, second);
    let handle = first.start();
    let report = report(first.target(&handle));
    // Nothing before there is a pose.
    other.write(&first, &handle, &report);
    for k in 0..10 {
        other.read(1e-3 * f64::from(k));
        other.write(&first, &handle, &report);
    }
    assert_eq!(other.report(), SecondReport::default());
    // The hand gives way, and the force turns with the part.
    let (felt, expected) = (other.guard.last_wrench().force, -DVec3::new(1.0, -2.0, 3.0));
    assert!((felt.length() - expected.length()).abs() < 1e-12);
    assert!(felt.angle_between(expected) < 0.05, "{felt}");
    other.release();
    assert_eq!(other.guard.last_wrench(), Wrench::ZERO);
    drop(other);
    assert_eq!(device.rendered(), Wrench::ZERO);
}

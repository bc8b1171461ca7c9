//! The simulated hardware: rounding, limits, heat, walls, and time that misbehaves.

use super::*;
use crate::hand::HandSettings;
use crate::script::{Insertion, Script};

const T: f64 = 1e-3;

fn insertion() -> Insertion {
    Insertion {
        start: DPose3::IDENTITY,
        direction: DVec3::NEG_Z,
        speed: 0.1,
        travel: 0.02,
        hold_s: 100.0,
        retract: false,
    }
}

fn device(insertion: &Insertion, settings: SimulatedSettings) -> Simulated {
    let script = Script::new(insertion).unwrap();
    let hand = SimulatedHand::new(HandSettings::default(), script, T).unwrap();
    Simulated::new(settings, hand).unwrap()
}

fn resting() -> Simulated {
    let still = Insertion {
        travel: 0.0,
        ..insertion()
    };
    device(&still, SimulatedSettings::default())
}

fn force(x: f64, y: f64, z: f64) -> Wrench {
    Wrench::new(DVec3::new(x, y, z), DVec3::ZERO)
}

#[test]
fn first_read_is_the_start_and_a_second_at_the_same_time_is_equal() {
    let mut device = device(&insertion(), SimulatedSettings::default());
    let first = device.read(5.0).unwrap();
    assert_eq!(first.pose, DPose3::IDENTITY);
    assert_eq!(first.time_s, 5.0);
    assert_eq!(device.read(5.0).unwrap(), first);
    assert!(device.read(5.0 + 100.0 * T).unwrap().pose.translation.z < -1e-4);
}

#[test]
fn force_is_rendered_in_steps_of_the_resolution() {
    let mut device = resting();
    device.write(&force(1.09, -0.31, 0.05).into()).unwrap();
    let rendered = device.rendered().force;
    assert!((rendered - DVec3::new(1.0, -0.4, 0.0)).length() < 1e-12);
    assert_eq!(device.events(), SimulatedEvents::default());
}

#[test]
fn force_and_torque_beyond_the_peak_are_limited_in_their_direction() {
    let mut device = resting();
    for direction in [DVec3::X, DVec3::ONE, DVec3::new(-1.0, 2.0, 0.3)] {
        let wanted = direction.normalize() * 500.0;
        device.write(&Wrench::new(wanted, wanted).into()).unwrap();
        let rendered = device.rendered();
        assert!(rendered.force.length() <= 35.0 * (1.0 + 1e-12));
        assert!(rendered.force.length() > 34.0);
        // One step of 0.2 N per axis at 35 N turns the force by less than 0.01 rad.
        assert!(rendered.force.angle_between(wanted) < 0.01);
        assert!((rendered.torque.length() - 3.1).abs() < 1e-12);
    }
    assert_eq!(device.events().peak_limited, 3);
    assert_eq!(device.events().torque_limited, 3);
}

#[test]
fn force_is_taken_back_to_the_continuous_one_when_the_window_is_full() {
    let settings = SimulatedSettings {
        thermal_window_s: 1.0,
        ..SimulatedSettings::default()
    };
    let still = Insertion {
        travel: 0.0,
        ..insertion()
    };
    let mut device = device(&still, settings);
    let mut last = 35.0;
    for k in 0..5000 {
        device.read(f64::from(k) * T).unwrap();
        device.write(&force(35.0, 0.0, 0.0).into()).unwrap();
        let rendered = device.rendered().force.x;
        // Never up, and down by a few steps of the resolution at a time.
        assert!(rendered <= last && last - rendered < 4.0);
        last = rendered;
    }
    // The rule settles between 0.9 and 1 of the continuous force squared, here at its end.
    assert!((9.0..=10.4).contains(&last), "{last}");
    assert!(device.events().thermally_limited > 4000);
    assert_eq!(device.events().peak_limited, 0);
    // The continuous force itself is never limited.
    let mut cool = self::device(&still, settings);
    for k in 0..10_000 {
        cool.read(f64::from(k) * T).unwrap();
        cool.write(&force(10.0, 0.0, 0.0).into()).unwrap();
        assert_eq!(cool.rendered().force.x, 10.0);
    }
}

#[test]
fn orientation_and_position_are_read_in_steps_of_their_resolution() {
    let mut settings = SimulatedSettings::default();
    settings.limits.position_resolution = 1e-5;
    let turned = Insertion {
        start: DPose3::new(DVec3::ZERO, DVec3::new(0.5, 0.1234567, -0.3)),
        ..insertion()
    };
    let mut device = device(&turned, settings);
    device.read(0.0).unwrap();
    let state = device.read(0.05).unwrap();
    let is_multiple = |x: f64, step: f64| ((x / step) - (x / step).round()).abs() < 1e-6;
    for x in rotation_vector(state.pose.rotation).to_array() {
        assert!(is_multiple(x, 3e-5), "{x}");
    }
    for x in state.pose.translation.to_array() {
        assert!(is_multiple(x, 1e-5), "{x}");
    }
    let truth = device.hand().state().pose;
    assert!((truth.translation - state.pose.translation).length() <= 1e-5);
    assert!(truth.rotation.angle_between(state.pose.rotation) <= 3e-5);
    assert_ne!(truth.translation, state.pose.translation);
}

#[test]
fn non_finite_wrench_is_refused_and_not_rendered() {
    let mut device = resting();
    device.write(&force(1.0, 0.0, 0.0).into()).unwrap();
    let error = device.write(&force(f64::NAN, 0.0, 0.0).into()).unwrap_err();
    assert!(matches!(error, DeviceError::NonFiniteWrench { .. }));
    assert_eq!(device.rendered().force.x, 1.0);
}

#[test]
fn wrench_fades_to_zero_when_no_write_comes() {
    let mut device = resting();
    device.read(0.0).unwrap();
    device.write(&force(20.0, 0.0, 0.0).into()).unwrap();
    let mut last = 20.0;
    for k in 1..=100 {
        device.read(f64::from(k) * T).unwrap();
        let felt = device.felt().force.x;
        // Smooth: never up, at most 1.5/ramp per second down.
        assert!(felt <= last && last - felt <= 20.0 * 1.6 * T / 0.05);
        last = felt;
    }
    assert_eq!(last, 0.0);
    assert!(device.events().fading > 0);
    device.write(&force(20.0, 0.0, 0.0).into()).unwrap();
    device.read(0.101).unwrap();
    assert_eq!(device.felt().force.x, 20.0);
    device.stop();
    assert_eq!(device.rendered(), Wrench::ZERO);
    // After a stop another loop may begin at its own zero.
    device.read(0.0).unwrap();
    device.read(T).unwrap();
    assert_eq!(device.felt(), Wrench::ZERO);
}

#[test]
fn time_that_goes_back_or_jumps_is_an_error_and_then_goes_on() {
    let mut device = device(&insertion(), SimulatedSettings::default());
    device.read(0.0).unwrap();
    let before = device.read(0.1).unwrap();
    assert!(matches!(
        device.read(0.05),
        Err(DeviceError::TimeWentBack { .. })
    ));
    assert!(matches!(
        device.read(f64::NAN),
        Err(DeviceError::TimeWentBack { .. })
    ));
    assert!(matches!(
        device.read(1e6),
        Err(DeviceError::TimeJump { .. })
    ));
    let after = device.read(1e6 + T).unwrap();
    let moved = (after.pose.translation - before.pose.translation).length();
    // One period at no more than 0.1 m/s, whatever the clock did.
    assert!(moved > 0.0 && moved <= 0.11 * T);
}

#[test]
fn handle_stops_at_the_wall_of_the_workspace() {
    let still = Insertion {
        travel: 0.0,
        ..insertion()
    };
    let settings = SimulatedSettings {
        workspace_centre: Some(DVec3::new(-0.199, 0.0, 0.0)),
        ..SimulatedSettings::default()
    };
    let mut device = device(&still, settings);
    for k in 0..200 {
        device.read(f64::from(k) * T).unwrap();
        device.write(&force(20.0, 0.0, 0.0).into()).unwrap();
    }
    let state = device.read(0.2).unwrap();
    assert!((state.pose.translation.x - 0.001).abs() < 1e-12);
    assert_eq!(state.linear_velocity.x, 0.0);
    assert!(device.events().at_workspace_wall > 50);
}

#[test]
fn script_beyond_the_workspace_is_refused() {
    let script = Script::new(&Insertion {
        travel: 0.25,
        ..insertion()
    })
    .unwrap();
    let hand = SimulatedHand::new(HandSettings::default(), script, T).unwrap();
    match Simulated::new(SimulatedSettings::default(), hand) {
        Err(DeviceError::LeavesWorkspace { beyond, axis }) => {
            assert_eq!(axis, 'z');
            assert!((beyond - 0.05).abs() < 1e-12);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn limits_out_of_range_are_refused_by_name() {
    let refused = |change: fn(&mut SimulatedSettings)| {
        let mut settings = SimulatedSettings::default();
        change(&mut settings);
        let script = Script::new(&insertion()).unwrap();
        let hand = SimulatedHand::new(HandSettings::default(), script, T).unwrap();
        match Simulated::new(settings, hand) {
            Err(DeviceError::InvalidSetting { name, .. }) => name,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(|s| s.limits.peak_force = 5.0), "peak_force");
    assert_eq!(refused(|s| s.limits.peak_torque = -1.0), "peak_torque");
    assert_eq!(
        refused(|s| s.limits.workspace_half_extents.y = 0.0),
        "workspace_half_extents"
    );
    assert_eq!(
        refused(|s| s.limits.force_resolution = f64::NAN),
        "force_resolution"
    );
    assert_eq!(refused(|s| s.thermal_window_s = 0.0), "thermal_window_s");
}

#[test]
fn device_for_input_alone_renders_nothing_and_works() {
    let mut settings = SimulatedSettings::default();
    settings.limits.peak_force = 0.0;
    settings.limits.continuous_force = 0.0;
    settings.limits.peak_torque = 0.0;
    let mut device = device(&insertion(), settings);
    for k in 0..50 {
        assert!(device.read(f64::from(k) * T).unwrap().is_finite());
        let wanted = Wrench::new(DVec3::X * 5.0, DVec3::Y);
        device.write(&wanted.into()).unwrap();
        assert_eq!(device.rendered(), Wrench::ZERO);
    }
}

#[test]
fn body_out_of_range_is_refused_by_name() {
    let refused = |change: fn(&mut SimulatedSettings, &mut BodySettings)| {
        let mut settings = SimulatedSettings::default();
        let mut body = MODELS[0].body;
        change(&mut settings, &mut body);
        settings.body = Some(body);
        let script = Script::new(&insertion()).unwrap();
        let hand = SimulatedHand::new(HandSettings::default(), script, T).unwrap();
        match Simulated::new(settings, hand) {
            Err(DeviceError::InvalidSetting { name, .. }) => name,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(|_, b| b.mass = 0.0), "mass");
    assert_eq!(refused(|_, b| b.inertia = f64::NAN), "inertia");
    assert_eq!(
        refused(|_, b| b.rotational_damping = -1.0),
        "rotational_damping"
    );
    assert_eq!(refused(|_, b| b.delay_s = 1e3), "delay_s");
    assert_eq!(refused(|_, b| b.jitter_s = -1.0), "jitter_s");
    assert_eq!(
        refused(|_, b| b.velocity_window_s = 0.0),
        "velocity_window_s"
    );
    assert_eq!(refused(|s, _| s.limits.damping = Some(-1.0)), "damping");
    assert_eq!(
        refused(|s, _| s.limits.coulomb_friction = Some(f64::NAN)),
        "coulomb_friction"
    );
}

/// A limited force whose length is an ulp beyond the limit was divided by a resolution of 0: no number went to the hand.
#[test]
fn force_beyond_the_limit_of_a_device_without_resolution_stays_a_number() {
    for model in MODELS {
        let hand = SimulatedHand::resting(HandSettings::default(), DPose3::IDENTITY, 1e-3).unwrap();
        let mut device = Simulated::of_model(model, hand).unwrap();
        for k in 0..2000 {
            let angle = f64::from(k);
            device.read(1e-3 * angle).unwrap();
            let direction = DVec3::new(angle.sin(), (0.7 * angle).cos(), (1.3 * angle).sin());
            let beyond = 1.5 * model.limits.peak_force * direction;
            device
                .write(&Wrench::new(beyond, DVec3::ZERO).into())
                .unwrap();
            let rendered = device.rendered();
            assert!(rendered.is_finite(), "{}: {beyond}", model.key);
            assert!(rendered.force.length() <= model.limits.peak_force * (1.0 + 1e-15));
        }
    }
}

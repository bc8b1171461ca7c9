//! Each guard provoked, with time as a number.

use super::*;
use glam::{DQuat, DVec3};
use glamx::DPose3;

use crate::haptic_device::Limits;

const T: f64 = 1e-3;

fn safety() -> Safety {
    Safety::new(SafetySettings::for_limits(&Limits::virtuose_6d())).unwrap()
}

fn sample(x: f64, time_s: f64) -> HandleState {
    HandleState {
        time_s,
        ..HandleState::at_rest(DPose3::from_translation(DVec3::new(x, 0.0, 0.0)))
    }
}

/// A guard with a good sample at x = 0, time 0.
fn ready() -> Safety {
    let mut safety = safety();
    assert!(
        safety
            .accept_sample(Some(&sample(0.0, 0.0)), 0.0, T)
            .is_some()
    );
    safety
}

fn force(x: f64, y: f64) -> Wrench {
    Wrench::new(DVec3::new(x, y, 0.0), DVec3::ZERO)
}

#[test]
fn wrench_beyond_the_limits_is_shortened_in_its_direction() {
    let mut safety = ready();
    let huge = Wrench::new(DVec3::new(3e200, 4e200, 0.0), DVec3::new(0.0, 0.0, -9.0));
    let let_through = safety.accept_wrench(&huge, 1.0);
    assert!((let_through.force - DVec3::new(21.0, 28.0, 0.0)).length() < 1e-12);
    assert!((let_through.torque - DVec3::new(0.0, 0.0, -3.1)).length() < 1e-15);
    assert_eq!(safety.events().wrenches_clamped, 1);
}

#[test]
fn wrench_within_the_limits_passes_bit_for_bit() {
    let mut safety = ready();
    let wanted = Wrench::new(DVec3::new(1.1, -2.2, 3.3), DVec3::new(0.1, 0.2, -0.3));
    assert_eq!(safety.accept_wrench(&wanted, T), wanted);
    assert_eq!(safety.events(), SafetyEvents::default());
}

#[test]
fn jump_of_the_wrench_takes_the_time_of_the_rate() {
    let mut safety = ready();
    // 35 N within 2 ms.
    assert_eq!(
        safety.accept_wrench(&force(35.0, 0.0), T).force.x.round(),
        18.0
    );
    assert_eq!(safety.accept_wrench(&force(35.0, 0.0), T).force.x, 35.0);
    let back = safety.accept_wrench(&force(-35.0, 0.0), T).force.x;
    assert!((back - 17.5).abs() < 1e-12);
    assert_eq!(safety.events().wrenches_rate_limited, 2);
    // No time, no change.
    assert_eq!(safety.accept_wrench(&force(0.0, 0.0), 0.0).force.x, back);
    assert_eq!(safety.accept_wrench(&force(0.0, 0.0), -1.0).force.x, back);
}

#[test]
fn non_finite_wrench_decays_to_zero_smoothly_and_is_counted() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut safety = ready();
        safety.accept_wrench(&force(30.0, 0.0), 1.0);
        let mut last = 30.0;
        for _ in 0..50 {
            let now = safety.accept_wrench(&force(1.0, bad), T);
            assert!(now.is_finite() && now.force.y == 0.0);
            assert!(now.force.x <= last && last - now.force.x < 0.71);
            last = now.force.x;
        }
        assert_eq!(last, 0.0);
        assert_eq!(safety.events().wrenches_non_finite, 50);
    }
}

#[test]
fn rejected_samples_hold_the_pose_and_let_the_wrench_go() {
    let mut safety = ready();
    safety.accept_wrench(&force(10.0, 0.0), 1.0);
    let held = safety.accept_sample(None, 0.5, T).unwrap();
    assert_eq!(held.pose, DPose3::IDENTITY);
    assert_eq!(held.time_s, 0.5);
    let after = safety.accept_wrench(&force(10.0, 0.0), T).force.x;
    assert!(after < 10.0 && after > 9.0);
    assert_eq!(safety.events().samples_missing, 1);
    // A good sample brings it back.
    safety
        .accept_sample(Some(&sample(0.0, 0.6)), 0.6, T)
        .unwrap();
    assert_eq!(safety.accept_wrench(&force(10.0, 0.0), T).force.x, 10.0);
}

#[test]
fn each_kind_of_bad_sample_is_rejected_and_counted() {
    let mut safety = ready();
    let bad = |change: fn(&mut HandleState)| {
        let mut state = sample(1e-4, 1.0);
        change(&mut state);
        state
    };
    let samples = [
        bad(|s| s.pose.translation.y = f64::NAN),
        bad(|s| s.pose.rotation.w = f64::INFINITY),
        bad(|s| s.linear_velocity.x = f64::NAN),
        bad(|s| s.time_s = f64::NAN),
        bad(|s| s.pose.rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.9)),
        bad(|s| s.pose.rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0)),
        bad(|s| s.pose.rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 1e200)),
        bad(|s| s.linear_velocity.x = 11.0),
        bad(|s| s.angular_velocity.x = 101.0),
        bad(|s| s.pose.translation.x = 5.0),
        bad(|s| s.pose.rotation = DQuat::from_rotation_x(2.0)),
        bad(|s| s.time_s = -1.0),
    ];
    for state in &samples {
        let held = safety.accept_sample(Some(state), 1.0, 0.1 * T).unwrap();
        assert_eq!(held.pose, DPose3::IDENTITY);
    }
    let events = safety.events();
    assert_eq!(events.samples_non_finite, 4);
    assert_eq!(events.samples_non_unit, 3);
    assert_eq!(events.samples_too_fast, 4);
    assert_eq!(events.samples_back_in_time, 1);
    assert_eq!(events.samples_rejected(), 12);
    // The good one is taken after all of them.
    let good = safety
        .accept_sample(Some(&sample(1e-4, 1.0)), 1.0, T)
        .unwrap();
    assert_eq!(good.pose.translation.x, 1e-4);
}

#[test]
fn handle_that_really_moved_far_is_taken_once_the_time_allows_it() {
    let mut safety = ready();
    let far = sample(0.035, 0.0);
    let taken = (1..=10)
        .position(|_| {
            safety
                .accept_sample(Some(&far), 0.0, T)
                .unwrap()
                .pose
                .translation
                .x
                == 0.035
        })
        .unwrap();
    // 35 mm at 10 m/s: the fourth period.
    assert_eq!(taken, 3);
}

#[test]
fn quaternion_slightly_off_unit_is_normalised() {
    let mut safety = safety();
    let mut state = sample(0.0, 0.0);
    state.pose.rotation = DQuat::from_xyzw(0.0, 0.0, 0.0, 1.0 + 1e-5);
    let good = safety.accept_sample(Some(&state), 0.0, T).unwrap();
    assert_eq!(good.pose.rotation, DQuat::IDENTITY);
}

#[test]
fn nothing_is_rendered_before_the_first_good_sample() {
    let mut safety = safety();
    assert_eq!(safety.accept_sample(None, 0.0, T), None);
    assert_eq!(safety.accept_wrench(&force(5.0, 0.0), T), Wrench::ZERO);
}

#[test]
fn wrench_after_a_stall_rises_from_zero_at_the_rate() {
    let mut safety = ready();
    safety.accept_wrench(&force(35.0, 0.0), 1.0);
    safety.after_gap(0.01);
    assert_eq!(safety.events().stalls, 0);
    safety.after_gap(0.2);
    assert_eq!(safety.events().stalls, 1);
    assert_eq!(safety.last_wrench(), Wrench::ZERO);
    let first = safety.accept_wrench(&force(35.0, 0.0), T).force.x;
    assert!((first - 17.5).abs() < 1e-12);
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let refused = |change: fn(&mut SafetySettings)| {
        let mut settings = SafetySettings::for_limits(&Limits::virtuose_6d());
        change(&mut settings);
        match Safety::new(settings) {
            Err(DeviceError::InvalidSetting { name, .. }) => name,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(|s| s.force_max = f64::INFINITY), "force_max");
    assert_eq!(refused(|s| s.torque_max = -1.0), "torque_max");
    assert_eq!(refused(|s| s.force_rate_max = 0.0), "force_rate_max");
    assert_eq!(refused(|s| s.torque_rate_max = f64::NAN), "torque_rate_max");
    assert_eq!(refused(|s| s.speed_max = 0.0), "speed_max");
    assert_eq!(refused(|s| s.angular_speed_max = 0.0), "angular_speed_max");
    assert_eq!(refused(|s| s.decay_s = 0.0), "decay_s");
    assert_eq!(refused(|s| s.stall_timeout_s = 0.0), "stall_timeout_s");
}

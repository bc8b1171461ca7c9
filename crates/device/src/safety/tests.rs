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

/// A live guard on a device with these limits, armed, with a good sample at x = 0 and time 0.
fn live(limits: &Limits) -> Safety {
    let mut safety = Safety::new(SafetySettings::live(limits).unwrap()).unwrap();
    for _ in 0..400 {
        look(&mut safety, 0.0);
        safety.accept_wrench(&Wrench::ZERO, T);
    }
    assert_eq!(safety.arming(), Arming::Armed);
    safety
}

fn look(safety: &mut Safety, x: f64) {
    safety.accept_sample(Some(&sample(x, 0.0)), 0.0, T).unwrap();
}

fn limits_of(peak_force: f64, peak_torque: f64) -> Limits {
    Limits {
        peak_force,
        continuous_force: peak_force,
        peak_torque,
        ..Limits::virtuose_6d()
    }
}

fn command(x: f64, stiffness: f64) -> Answer {
    Answer::from(Command {
        wrench: force(x, 0.0),
        stiffness: DMat3::IDENTITY * -stiffness,
    })
}

/// Periods until a force that rises to `top` and then vanishes is seen to have risen, and to have gone.
fn rise_and_fall(limits: &Limits, top: f64) -> (u32, u32) {
    let mut safety = live(limits);
    let mut until = |wanted: f64| {
        (1..1000)
            .find(|_| {
                look(&mut safety, 0.0);
                safety.accept_wrench(&force(wanted, 0.0), T).force.x == wanted
            })
            .unwrap()
    };
    (until(top), until(0.0))
}

#[test]
fn snap_of_10_newtons_is_felt_within_two_periods_and_rises_are_slower() {
    // Peak in 10 ms up, in 2 ms down: 35 N falls by 17.5 N a period, 12 N by 6 N, 10 N by 5 N.
    assert_eq!(rise_and_fall(&limits_of(35.0, 3.1), 10.0), (3, 1));
    assert_eq!(rise_and_fall(&limits_of(12.0, 0.0), 10.0), (9, 2));
    assert_eq!(rise_and_fall(&limits_of(10.0, 0.0), 10.0), (10, 2));
    // The whole force of a small device goes as fast.
    assert_eq!(rise_and_fall(&limits_of(3.3, 0.0), 3.3), (10, 2));
}

#[test]
fn live_guard_gives_no_force_before_it_is_armed_and_then_all_of_it() {
    let settings = SafetySettings::live(&Limits::virtuose_6d()).unwrap();
    let mut safety = Safety::new(settings).unwrap();
    assert_eq!(safety.arming(), Arming::Waiting(WaitsFor::Samples));
    look(&mut safety, 0.0);
    for _ in 0..1000 {
        look(&mut safety, 0.0);
        assert_eq!(safety.accept_wrench(&force(8.0, 0.0), T), Wrench::ZERO);
    }
    assert_eq!(safety.arming(), Arming::Waiting(WaitsFor::SmallForce));
    for _ in 0..400 {
        look(&mut safety, 0.0);
        assert_eq!(safety.accept_wrench(&Wrench::ZERO, T), Wrench::ZERO);
    }
    assert_eq!(safety.arming(), Arming::Armed);
    for _ in 0..5 {
        look(&mut safety, 0.0);
        safety.accept_wrench(&force(8.0, 0.0), T);
    }
    assert_eq!(safety.last_wrench(), force(8.0, 0.0));
}

#[test]
fn old_answer_is_gone_at_50_ms_and_comes_back_without_a_jump() {
    let mut safety = live(&Limits::virtuose_6d());
    let mut last = 0.0;
    for k in 0..100 {
        look(&mut safety, 0.0);
        let mut answer = command(10.0, 500.0);
        answer.age_s = (f64::from(k) - 30.0).max(0.0) * T;
        let out = safety.accept(&answer, T);
        if k > 10 && k <= 40 {
            assert_eq!((out.wrench.force.x, out.stiffness.x_axis.x), (10.0, -500.0));
        }
        if k > 40 {
            // Weakened together.
            assert!(out.wrench.force.x <= last);
            assert!((out.stiffness.x_axis.x + 50.0 * out.wrench.force.x).abs() < 1e-9);
        }
        if k >= 80 {
            assert_eq!(out, Command::ZERO);
        }
        last = out.wrench.force.x;
    }
    assert_eq!(safety.events().answers_stale, 59);
    for _ in 0..40 {
        look(&mut safety, 0.0);
        let now = safety.accept(&command(10.0, 500.0), T).wrench.force.x;
        assert!((0.0..0.26).contains(&(now - last)));
        last = now;
    }
    assert!((last - 10.0).abs() < 1e-12);
}

#[test]
fn stiffness_passes_with_its_force_and_goes_where_the_force_was_cut() {
    let mut safety = live(&Limits::virtuose_6d());
    let mut out = |answer: &Answer| {
        look(&mut safety, 0.0);
        safety.accept(answer, T)
    };
    assert_eq!(
        out(&command(2.0, 800.0)).stiffness,
        DMat3::IDENTITY * -800.0
    );
    // Held back by the rate, then beyond the peak.
    assert_eq!(out(&command(30.0, 800.0)).stiffness, DMat3::ZERO);
    for _ in 0..20 {
        assert_eq!(out(&command(40.0, 800.0)).stiffness, DMat3::ZERO);
    }
    assert_eq!(out(&command(3.0, f64::NAN)).stiffness, DMat3::ZERO);
    out(&command(1.0, 0.0));
    // More than the 5 kN/m where no maker states any.
    let stiff = out(&command(1.0, 1e6)).stiffness;
    assert!((stiff.x_axis.x + 5e3).abs() < 1e-9);
    assert_eq!(out(&command(1.0, 1e300)).stiffness, DMat3::ZERO);
    assert_eq!(safety.events().stiffness_limited, 2);
}

#[test]
fn scripted_guard_passes_a_stiffness_as_it_is() {
    let mut safety = ready();
    let out = safety.accept(&command(2.0, 1e7), T);
    assert_eq!(out.stiffness, DMat3::IDENTITY * -1e7);
    assert_eq!(safety.arming(), Arming::NotAsked);
}

#[test]
fn device_that_does_not_tell_its_velocity_trips_by_its_positions() {
    let mut safety = live(&Limits::virtuose_6d());
    let mut x = 0.0;
    for _ in 0..10 {
        look(&mut safety, x);
        safety.accept_wrench(&force(10.0, 0.0), T);
    }
    // 3 m/s against the force, reported as 0.
    for _ in 0..60 {
        x -= 3e-3;
        look(&mut safety, x);
        safety.accept_wrench(&force(10.0, 0.0), T);
    }
    assert_eq!(safety.events().trips_too_fast, 1);
    assert_eq!(safety.last_wrench(), Wrench::ZERO);
}

#[test]
fn force_that_pushes_the_handle_away_is_out_of_energy_before_it_is_too_fast() {
    let mut safety = live(&Limits::virtuose_6d());
    for k in 0..20 {
        look(&mut safety, 3e-3 * f64::from(k));
        safety.accept_wrench(&force(35.0, 0.0), T);
    }
    // 70 mJ of allowance, and at most two periods' 35 N over 3 mm.
    assert!(safety.lowest_energy().translation >= -0.28);
    assert!(safety.last_wrench().force.x < 1.0);
    assert!(safety.events().energy_limited > 5);
}

#[test]
fn stall_takes_the_force_away_until_it_is_armed_again() {
    let mut safety = live(&Limits::virtuose_6d());
    for _ in 0..10 {
        look(&mut safety, 0.0);
        safety.accept_wrench(&force(10.0, 0.0), T);
    }
    safety.after_gap(0.5);
    look(&mut safety, 0.0);
    assert_eq!(safety.accept_wrench(&force(10.0, 0.0), T), Wrench::ZERO);
    assert_eq!(safety.events().trips_stalled, 1);
    for _ in 0..400 {
        look(&mut safety, 0.0);
        safety.accept_wrench(&force(0.5, 0.0), T);
    }
    assert_eq!(safety.arming(), Arming::Armed);
    assert_eq!(safety.last_wrench(), force(0.5, 0.0));
}

#[test]
fn lost_samples_take_the_force_away_and_trip() {
    let mut safety = live(&Limits::virtuose_6d());
    for _ in 0..10 {
        look(&mut safety, 0.0);
        safety.accept_wrench(&force(20.0, 0.0), T);
    }
    for _ in 0..60 {
        safety.accept_sample(None, 1.0, T);
        safety.accept_wrench(&force(20.0, 0.0), T);
    }
    assert_eq!(safety.last_wrench(), Wrench::ZERO);
    assert_eq!(safety.events().trips_samples_lost, 1);
    assert_eq!(safety.arming(), Arming::Waiting(WaitsFor::Samples));
}

#[test]
fn force_is_held_to_the_continuous_one_after_a_while() {
    let mut safety = live(&Limits::virtuose_6d());
    for k in 0..20_000 {
        look(&mut safety, 0.0);
        let out = safety.accept_wrench(&force(35.0, 0.0), T).force.x;
        if (50..300).contains(&k) {
            assert_eq!(out, 35.0);
        }
    }
    assert!((9.5..10.2).contains(&safety.last_wrench().force.x));
    assert!(safety.events().heat_limited > 15_000);
}

#[test]
fn devices_without_force_or_torque_work_with_both_settings() {
    for limits in [limits_of(0.0, 0.0), limits_of(3.3, 0.0)] {
        for settings in [
            SafetySettings::for_limits(&limits),
            SafetySettings::live(&limits).unwrap(),
        ] {
            let mut safety = Safety::new(settings).unwrap();
            for k in 0..500 {
                look(&mut safety, 1e-5 * f64::from(k));
                let wanted = Wrench::new(DVec3::X * 0.1, DVec3::Y);
                let out = safety.accept_wrench(&wanted, T);
                assert!(out.force.length() <= limits.peak_force && out.torque == DVec3::ZERO);
            }
            // A device for input alone is armed too: nothing goes to it.
            assert!(!matches!(safety.arming(), Arming::Waiting(_)));
            safety.after_gap(1.0);
            assert!(safety.decay(T).is_finite());
        }
    }
}

#[test]
fn live_settings_refuse_limits_that_no_device_has() {
    let mut limits = Limits::virtuose_6d();
    limits.peak_torque = f64::NAN;
    match SafetySettings::live(&limits) {
        Err(DeviceError::InvalidSetting { name, .. }) => assert_eq!(name, "peak_torque"),
        other => panic!("{other:?}"),
    }
}

/// The guard of a scripted session as it was before there was a live one: recorded sessions must keep every bit.
#[test]
fn scripted_guard_is_the_clamp_and_the_rate_bit_for_bit() {
    let limits = Limits::virtuose_6d();
    let s = SafetySettings::for_limits(&limits);
    let mut safety = ready();
    let mut last = Wrench::ZERO;
    let towards = |from: DVec3, to: DVec3, step: f64| {
        let way = to - from;
        if way.length() <= step {
            to
        } else {
            from + crate::wrench::limit_length(way, step)
        }
    };
    let mut bits = 4711_u64;
    let mut random = || {
        bits ^= bits << 13;
        bits ^= bits >> 7;
        bits ^= bits << 17;
        (bits >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    for k in 0..20_000 {
        let scale = if k % 50 < 25 { 20.0 } else { 120.0 };
        let mut wanted = Wrench::new(
            DVec3::new(random(), random(), random()) * scale,
            DVec3::new(random(), random(), random()) * (0.1 * scale),
        );
        let is_bad = k % 97 == 0;
        if is_bad {
            wanted.torque.y = f64::NAN;
        }
        last = if is_bad {
            let share = T / s.decay_s;
            Wrench::new(
                towards(last.force, DVec3::ZERO, s.force_max * share),
                towards(last.torque, DVec3::ZERO, s.torque_max * share),
            )
        } else {
            let force = crate::wrench::limit_length(wanted.force, s.force_max);
            let torque = crate::wrench::limit_length(wanted.torque, s.torque_max);
            Wrench::new(
                towards(last.force, force, s.force_rate_max * T),
                towards(last.torque, torque, s.torque_rate_max * T),
            )
        };
        look(&mut safety, 0.0);
        let out = safety.accept_wrench(&wanted, T);
        assert_eq!(
            out.to_array().map(f64::to_bits),
            last.to_array().map(f64::to_bits)
        );
    }
}

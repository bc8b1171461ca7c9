//! What the window buys against one-tick differences, and what it must survive.

use glam::DQuat;
use proptest::prelude::*;

use super::*;
use crate::wrench::rotation_from_vector;

/// A pose at a position along x, m.
fn at(x: f64) -> DPose3 {
    DPose3::from_translation(DVec3::new(x, 0.0, 0.0))
}

/// Feeds a motion at 1 kHz for a time and returns the estimates with their times.
fn run(
    estimator: &mut VelocityEstimator,
    seconds: f64,
    pose: impl Fn(f64) -> DPose3,
) -> Vec<(f64, DVec3, DVec3)> {
    (0..(seconds * 1e3) as u32)
        .map(|tick| {
            let t = f64::from(tick) * 1e-3;
            let (v, w) = estimator.update(&pose(t), t);
            (t, v, w)
        })
        .collect()
}

/// Source: the bound D/W of the definition. Steps of 0.055 mm (a Touch's encoders) read at 1 kHz, while the hand
/// moves at 13.7 mm/s, which is no multiple of a step per tick.
#[test]
fn quantised_positions_give_a_twentieth_of_the_noise_of_one_tick() {
    const STEP: f64 = 0.055e-3;
    const SPEED: f64 = 13.7e-3;
    let position = |t: f64| (SPEED * t / STEP).round() * STEP;
    let mut estimator = VelocityEstimator::default();
    let estimates = run(&mut estimator, 2.0, |t| at(position(t)));

    let settled = estimates.iter().filter(|(t, ..)| *t > 0.05);
    let worst = settled
        .clone()
        .map(|(_, v, _)| (v.x - SPEED).abs())
        .fold(0.0, f64::max);
    let worst_of_one_tick = settled
        .map(|(t, ..)| ((position(*t) - position(t - 1e-3)) / 1e-3 - SPEED).abs())
        .fold(0.0, f64::max);
    assert!(worst <= 1.001 * STEP / 0.02, "{worst}");
    assert!(worst_of_one_tick > 0.9 * (STEP / 1e-3 - SPEED));
    assert!(worst_of_one_tick > 14.0 * worst);
}

/// A handle at rest whose encoder flickers between two steps.
#[test]
fn flickering_encoder_stays_below_a_step_per_window() {
    const STEP: f64 = 0.055e-3;
    let mut estimator = VelocityEstimator::default();
    let flicker = |t: f64| at(STEP * f64::from((t * 1e3) as u32 % 7 / 3));
    for (_, v, _) in run(&mut estimator, 0.5, flicker) {
        assert!(v.length() <= 2.001 * STEP / 0.02, "{v}");
    }
}

#[test]
fn constant_spin_is_exact_up_to_three_rad_per_window() {
    let axis = DVec3::new(0.3, -0.5, 0.8).normalize();
    let start = rotation_from_vector(DVec3::new(2.0, 1.0, -0.4));
    for speed in [0.1, 5.0, 100.0, 150.0] {
        let mut estimator = VelocityEstimator::default();
        let spin = |t: f64| DPose3::from_rotation(rotation_from_vector(axis * speed * t) * start);
        let estimates = run(&mut estimator, 0.2, spin);
        let (_, v, w) = estimates.last().unwrap();
        assert!((*w - axis * speed).length() < 1e-9 * speed, "{speed}: {w}");
        assert_eq!(*v, DVec3::ZERO);
    }
}

/// The other quaternion of the same rotation is the same motion.
#[test]
fn sign_of_the_quaternion_does_not_matter() {
    let mut estimator = VelocityEstimator::default();
    for tick in 0..60 {
        let t = f64::from(tick) * 1e-3;
        let q = rotation_from_vector(DVec3::new(0.0, 2.0 * t, 0.0));
        let q = if tick % 2 == 0 { q } else { -q };
        estimator.update(&DPose3::from_rotation(q), t);
    }
    assert!((estimator.angular() - DVec3::new(0.0, 2.0, 0.0)).length() < 1e-9);
}

#[test]
fn estimate_rises_to_its_value_while_the_window_fills() {
    let mut estimator = VelocityEstimator::default();
    let estimates = run(&mut estimator, 0.05, |t| at(0.1 * t));
    assert_eq!(estimates[0].1, DVec3::ZERO);
    assert!((estimates[5].1.x - 0.1 * 5.0 / 20.0).abs() < 1e-12);
    assert!((estimates[20].1.x - 0.1).abs() < 1e-12);
    assert!((estimates[49].1.x - 0.1).abs() < 1e-12);
}

#[test]
fn estimate_begins_anew_after_a_gap_and_after_another_clock() {
    let mut estimator = VelocityEstimator::default();
    run(&mut estimator, 0.1, |t| at(0.1 * t));
    // The handle was carried 30 cm away meanwhile: no velocity of that jump.
    let (v, _) = estimator.update(&at(0.3), 0.5);
    assert_eq!(v, DVec3::ZERO);
    for tick in 1..=30 {
        estimator.update(&at(0.3), 0.5 + f64::from(tick) * 1e-3);
    }
    assert_eq!(estimator.linear(), DVec3::ZERO);
    // The loop was begun anew: its time is 0 again. Nothing of the old clock holds the estimate.
    let estimates = run(&mut estimator, 0.1, |t| at(-0.2 * t));
    assert_eq!(estimates[0].1, DVec3::ZERO);
    assert!((estimates[99].1.x + 0.2).abs() < 1e-12);
}

#[test]
fn time_that_does_not_rise_and_poses_that_are_not_finite_change_nothing() {
    let mut estimator = VelocityEstimator::default();
    run(&mut estimator, 0.05, |t| at(0.1 * t));
    let before = (estimator.linear(), estimator.angular());
    let bad = [
        (at(9.0), 0.049),
        (at(9.0), 0.030),
        (at(f64::NAN), 0.0500),
        (at(f64::INFINITY), 0.0500),
        (at(9.0), f64::NAN),
        (
            DPose3::from_rotation(DQuat::from_xyzw(f64::NAN, 0.0, 0.0, 1.0)),
            0.05,
        ),
    ];
    for (pose, time_s) in bad {
        assert_eq!(estimator.update(&pose, time_s), before, "{pose:?} {time_s}");
    }
    let (v, _) = estimator.update(&at(0.1 * 0.05), 0.05);
    assert!((v.x - 0.1).abs() < 1e-12);
}

/// Slow servers: 60 Hz is one sample in 17 ms, 20 Hz one in 50 ms, longer than the window.
#[test]
fn any_rate_of_samples_gives_the_same_velocity() {
    for rate in [20.0, 60.0, 333.0, 1000.0, 4000.0, 100_000.0] {
        let mut estimator = VelocityEstimator::default();
        let n = (0.3 * rate) as u32;
        for tick in 0..=n {
            let t = f64::from(tick) / rate;
            estimator.update(&at(0.25 * t), t);
        }
        assert!((estimator.linear().x - 0.25).abs() < 1e-9, "{rate} Hz");
        assert!(estimator.len <= CAPACITY);
        // The window is at most one spacing or one sample longer than asked for.
        let newest = estimator.newest.unwrap().time_s;
        let span = newest - estimator.ring[estimator.first].time_s;
        assert!(span < 0.02 + (1.0 / rate).max(0.02 / 31.0) + 1e-9, "{span}");
    }
}

#[test]
fn windows_that_make_no_sense_are_refused() {
    for window_s in [0.0, -0.02, 2.0, f64::NAN, f64::INFINITY] {
        assert!(VelocityEstimator::new(window_s).is_err(), "{window_s}");
    }
    assert!(VelocityEstimator::new(0.01).is_ok());
}

proptest! {
    /// Whatever comes in, what comes out is finite.
    #[test]
    fn estimates_are_finite_for_any_input(
        samples in proptest::collection::vec((any::<[f64; 7]>(), -1.0..1.0_f64), 1..80),
    ) {
        let mut estimator = VelocityEstimator::default();
        let mut t = 0.0;
        for (p, step) in samples {
            t += 0.01 * step + 0.004;
            let pose = DPose3::from_parts(
                DVec3::new(p[0], p[1], p[2]),
                DQuat::from_xyzw(p[3], p[4], p[5], p[6]),
            );
            let (v, w) = estimator.update(&pose, t);
            prop_assert!(v.is_finite() && w.is_finite());
        }
    }
}

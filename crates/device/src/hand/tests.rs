//! The hand alone, on a body, and guided.

use super::*;
use crate::script::Insertion;

fn still() -> Script {
    Script::new(&Insertion {
        start: DPose3::IDENTITY,
        direction: DVec3::X,
        speed: 1.0,
        travel: 0.0,
        hold_s: 100.0,
        retract: false,
    })
    .unwrap()
}

fn hand(settings: HandSettings) -> SimulatedHand {
    SimulatedHand::new(settings, still(), 1e-3).unwrap()
}

#[test]
fn hand_under_constant_wrench_rests_at_wrench_over_stiffness() {
    // Statics: x = f/k = 4/2000 = 2 mm, angle = t/k_r = 0.4/20 = 0.02 rad.
    let mut hand = hand(HandSettings::default());
    let wrench = Wrench::new(DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 0.4, 0.0));
    for _ in 0..2000 {
        hand.step(&wrench);
    }
    let state = hand.state();
    assert!((state.pose.translation - DVec3::new(0.002, 0.0, 0.0)).length() < 1e-12);
    let angle = rotation_vector(state.pose.rotation);
    assert!((angle - DVec3::new(0.0, 0.02, 0.0)).length() < 1e-12);
    // At rest the hand carries what the device gives.
    let sum = hand.wrench_of_hand() + wrench;
    assert!(sum.force.length() < 1e-9 && sum.torque.length() < 1e-9);
    assert!((state.time_s - 2.0).abs() < 1e-12);
}

#[test]
fn hand_falls_freely_without_a_grip() {
    // m = 0.5 kg, f = 1 N: backward Euler gives x = a h² n(n+1)/2 exactly.
    let mut hand = hand(HandSettings {
        grip_stiffness: 0.0,
        grip_damping: 0.0,
        ..HandSettings::default()
    });
    for _ in 0..100 {
        hand.step(&Wrench::new(DVec3::Z, DVec3::ZERO));
    }
    let expected = 2.0 * 1e-6 * 100.0 * 101.0 / 2.0;
    assert!((hand.state().pose.translation.z - expected).abs() < 1e-15);
    assert!((hand.state().linear_velocity.z - 0.2).abs() < 1e-14);
}

#[test]
fn hand_with_an_extremely_stiff_grip_stays_bounded_and_finite() {
    let mut hand = hand(HandSettings {
        grip_stiffness: 1e12,
        grip_damping: 1e9,
        grip_rotational_stiffness: 1e12,
        grip_rotational_damping: 1e9,
        ..HandSettings::default()
    });
    for k in 0..1000 {
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        hand.step(&(Wrench::new(DVec3::ONE, DVec3::ONE) * (35.0 * sign)));
        let state = hand.state();
        assert!(state.is_finite());
        assert!(state.pose.translation.length() < 1e-9);
    }
}

#[test]
fn hand_follows_its_script_within_the_lag_of_its_inertia() {
    let script = Script::new(&Insertion {
        start: DPose3::IDENTITY,
        direction: DVec3::NEG_Z,
        speed: 0.05,
        travel: 0.02,
        hold_s: 0.3,
        retract: false,
    })
    .unwrap();
    let mut hand = SimulatedHand::new(HandSettings::default(), script, 1e-3).unwrap();
    // Largest wanted acceleration: 1.5 speed/ramp = 1.5 * 0.05/0.04 = 1.9 m/s²; lag <= m a/k.
    let bound = 1.2 * 0.5 * 1.9 / 2000.0;
    for _ in 0..script.periods(1e-3) {
        hand.step(&Wrench::ZERO);
        let wanted = script.target(hand.time_s()).pose.translation;
        assert!((hand.state().pose.translation - wanted).length() < bound);
    }
    assert!((hand.state().pose.translation.z + 0.02).abs() < 1e-6);
    assert_eq!(hand.phase(), Phase::Done);
}

#[test]
fn hand_with_the_same_wrenches_gives_the_same_bits() {
    let run = || {
        let mut hand = hand(HandSettings::default());
        for k in 0..500 {
            let x = f64::from(k);
            hand.step(&Wrench::new(
                DVec3::new(x.sin(), x.cos(), 0.1),
                DVec3::new(0.01, -0.02, 0.03) * x.sin(),
            ));
        }
        hand.state()
    };
    assert_eq!(run(), run());
}

#[test]
fn hand_refuses_each_bad_setting_by_name() {
    let refused = |change: fn(&mut HandSettings)| {
        let mut settings = HandSettings::default();
        change(&mut settings);
        match SimulatedHand::new(settings, still(), 1e-3) {
            Err(DeviceError::InvalidSetting { name, .. }) => name,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(|s| s.apparent_mass = 0.0), "apparent_mass");
    assert_eq!(refused(|s| s.grip_stiffness = -1.0), "grip_stiffness");
    assert_eq!(refused(|s| s.grip_damping = f64::NAN), "grip_damping");
    assert_eq!(refused(|s| s.apparent_inertia = -1.0), "apparent_inertia");
    assert_eq!(
        refused(|s| s.grip_rotational_stiffness = f64::INFINITY),
        "grip_rotational_stiffness"
    );
    assert_eq!(
        refused(|s| s.grip_rotational_damping = -1.0),
        "grip_rotational_damping"
    );
    assert!(SimulatedHand::new(HandSettings::default(), still(), 0.0).is_err());
}

/// A body with round figures.
const BODY: Body = Body {
    mass: 0.5,
    inertia: 1e-3,
    damping: 2.0,
    rotational_damping: 0.01,
    coulomb_friction: 0.5,
};

#[test]
fn hand_on_a_body_rests_where_its_grip_balances_the_wrench_less_friction() {
    let mut hand = hand(HandSettings::default());
    hand.take(&BODY).unwrap();
    let wrench = Wrench::new(DVec3::new(4.0, 0.0, 0.0), DVec3::new(0.0, 0.4, 0.0));
    for _ in 0..5000 {
        hand.step(&wrench);
    }
    let state = hand.state();
    // 0.5 N of friction at most are missing from 4 N on 2000 N/m; a turn has none.
    let x = state.pose.translation.x;
    assert!(
        (3.5 / 2000.0 - 1e-9..=4.0 / 2000.0 + 1e-9).contains(&x),
        "{x}"
    );
    let angle = rotation_vector(state.pose.rotation);
    assert!((angle - DVec3::new(0.0, 0.02, 0.0)).length() < 1e-9);
    assert!(state.linear_velocity.length() < 1e-9);
}

#[test]
fn body_that_nobody_holds_coasts_to_rest_by_its_own_damping_and_friction() {
    let (mut guide, mut hand) =
        SimulatedHand::guided(HandSettings::default(), DPose3::IDENTITY, 1e-3).unwrap();
    hand.take(&BODY).unwrap();
    guide.set_hand(HandPresence::Absent);
    // Friction alone holds 0.4 N.
    hand.step(&Wrench::new(DVec3::X * 0.4, DVec3::ZERO));
    assert!(hand.state().pose.translation.length() < 1e-15);
    hand.step(&Wrench::new(DVec3::X * 50.0, DVec3::Z * 0.1));
    assert_eq!(hand.state().hand, HandPresence::Absent);
    let pushed = hand.state().linear_velocity.x;
    // 49.5 N s/kg over 1 ms from 0.5 kg.
    assert!((pushed - 0.099).abs() < 3e-4);
    for _ in 0..500 {
        hand.step(&Wrench::ZERO);
    }
    assert!(hand.state().linear_velocity.length() < 1e-15);
    assert!(hand.state().pose.translation.x > 1e-3);
    // The turn has damping alone: J/b = 0.1 s.
    let spin = hand.state().angular_velocity.z;
    assert!(
        (spin / (0.1 * (-5.0_f64).exp()) - 1.0).abs() < 0.02,
        "{spin}"
    );
}

#[test]
fn guided_hand_goes_where_it_is_sent_without_a_jump() {
    for with_body in [false, true] {
        let (mut guide, mut hand) =
            SimulatedHand::guided(HandSettings::default(), DPose3::IDENTITY, 1e-3).unwrap();
        if with_body {
            hand.take(&BODY).unwrap();
        }
        assert_eq!(hand.state().hand, HandPresence::Unknown);
        let to = DPose3::new(DVec3::new(0.02, -0.01, 0.0), DVec3::new(0.0, 0.0, 0.5));
        guide.set_target(to).unwrap();
        guide.set_buttons(0b101);
        guide.set_hand(HandPresence::Present);
        let mut fastest = 0.0_f64;
        for _ in 0..1000 {
            hand.step(&Wrench::ZERO);
            fastest = fastest.max(hand.state().linear_velocity.length());
        }
        let state = hand.state();
        // Friction of 0.5 N holds the handle within 0.25 mm of 2000 N/m.
        let near = if with_body { 2.6e-4 } else { 1e-9 };
        assert!((state.pose.translation - to.translation).length() < near);
        assert!(state.pose.rotation.angle_between(to.rotation) < 1e-6);
        assert!(fastest < 0.0224 / 0.03, "{fastest}");
        assert_eq!((state.buttons, state.hand), (0b101, HandPresence::Present));
        assert_eq!(guide.target(), to);
    }
}

#[test]
fn guide_refuses_poses_that_cannot_be_and_keeps_the_last() {
    let (mut guide, mut hand) =
        SimulatedHand::guided(HandSettings::default(), DPose3::IDENTITY, 1e-3).unwrap();
    let mut bad = DPose3::IDENTITY;
    bad.translation.y = f64::NAN;
    assert!(guide.set_target(bad).is_err());
    bad = DPose3::IDENTITY;
    bad.rotation.w = 1.1;
    assert!(guide.set_target(bad).is_err());
    hand.step(&Wrench::ZERO);
    assert_eq!(hand.state().pose, DPose3::IDENTITY);
}

#[test]
fn hand_that_lets_go_pulls_no_more() {
    let (mut guide, mut hand) =
        SimulatedHand::guided(HandSettings::default(), DPose3::IDENTITY, 1e-3).unwrap();
    guide.set_hand(HandPresence::Absent);
    guide
        .set_target(DPose3::from_translation(DVec3::X * 0.1))
        .unwrap();
    for _ in 0..100 {
        hand.step(&Wrench::ZERO);
    }
    assert_eq!(hand.state().pose, DPose3::IDENTITY);
    assert_eq!(hand.wrench_of_hand(), Wrench::ZERO);
    guide.set_hand(HandPresence::Present);
    for _ in 0..100 {
        hand.step(&Wrench::ZERO);
    }
    assert!(hand.state().pose.translation.x > 0.05);
}

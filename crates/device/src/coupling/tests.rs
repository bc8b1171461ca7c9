//! The spring, its bounds, and the choice of its stiffness.

use super::*;
use crate::haptic_device::Limits;

fn target() -> DPose3 {
    DPose3::new(DVec3::new(0.1, -0.2, 0.3), DVec3::new(0.4, 1.0, -0.7))
}

#[test]
fn deviation_of_pose_from_deviation_is_the_deviation() {
    for scale in [0.0, 1e-9, 1e-3, 0.5, 1.0] {
        // |phi| = 3.04 < pi at scale 1.
        let e = [0.01, -0.02, 0.03, 2.0, -1.0, 2.06].map(|x| x * scale);
        let tool = VirtualCoupling::pose_from_deviation(&target(), &e);
        let back = VirtualCoupling::deviation(&target(), &tool);
        for (a, b) in e.iter().zip(back) {
            // Positions of 0.3 m carry 6e-17 m each, rotations of unit quaternions 2e-16 rad;
            // near pi the angle is the worst conditioned.
            assert!((a - b).abs() < 4e-15, "{e:?} {back:?}");
        }
    }
}

#[test]
fn deviation_turns_with_the_common_frame() {
    let world = DPose3::new(DVec3::new(1.0, 2.0, 3.0), DVec3::new(-0.3, 0.8, 0.1));
    let e = [0.01, 0.02, -0.01, 0.1, -0.2, 0.3];
    let tool = VirtualCoupling::pose_from_deviation(&target(), &e);
    let seen = VirtualCoupling::deviation(&(world * target()), &(world * tool));
    let d = world.rotation * DVec3::new(e[0], e[1], e[2]);
    let phi = world.rotation * DVec3::new(e[3], e[4], e[5]);
    let expected = [d.x, d.y, d.z, phi.x, phi.y, phi.z];
    for (a, b) in expected.iter().zip(seen) {
        assert!((a - b).abs() < 2e-15);
    }
}

#[test]
fn wrench_on_tool_pulls_back_and_balances_the_handle() {
    let coupling = VirtualCoupling::new(1000.0, 5.0).unwrap();
    let e = [0.001, 0.0, 0.0, 0.0, 0.0, 0.1];
    let on_tool = coupling.wrench_on_tool(&e);
    assert_eq!(on_tool.to_array(), [-1.0, 0.0, 0.0, 0.0, 0.0, -0.5]);
    let on_handle = coupling.wrench_on_handle(&e);
    assert_eq!(on_tool + on_handle, Wrench::ZERO);
}

#[test]
fn wrench_is_the_gradient_of_the_energy() {
    // V = k_t |d|^2 / 2 + k_r |phi|^2 / 2; a rotation of the tool by small a changes V by k_r phi.a.
    let coupling = VirtualCoupling::new(800.0, 3.0).unwrap();
    let energy = |e: &[f64; 6]| {
        400.0 * (e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
            + 1.5 * (e[3] * e[3] + e[4] * e[4] + e[5] * e[5])
    };
    let e = [0.01, -0.02, 0.005, 0.9, -1.1, 0.4];
    let tool = VirtualCoupling::pose_from_deviation(&target(), &e);
    let wrench = coupling.wrench_on_tool(&e).to_array();
    let h = 1e-6;
    for axis in 0..6 {
        let moved = |by: f64| {
            let mut step = [0.0; 6];
            step[axis] = by;
            let pose = VirtualCoupling::pose_from_deviation(&tool, &step);
            energy(&VirtualCoupling::deviation(&target(), &pose))
        };
        let slope = (moved(h) - moved(-h)) / (2.0 * h);
        assert!((slope + wrench[axis]).abs() < 1e-7, "axis {axis}");
    }
}

#[test]
fn compliance_inverts_stiffness_over_the_whole_range() {
    for k in [0.0, 1e-3, 1.0, 1e4, 1e12] {
        let coupling = VirtualCoupling::new(k, k).unwrap();
        let (stiff, soft) = (coupling.stiffness(), coupling.compliance());
        for (i, row) in stiff.iter().enumerate() {
            for (j, expected) in (0..6).map(|j| (j, if i == j { 1.0 } else { 0.0 })) {
                let product: f64 = row.iter().zip(&soft).map(|(k, c)| k * c[j]).sum();
                assert!((product - expected).abs() < 1e-15);
            }
        }
    }
}

#[test]
fn stiffness_outside_the_range_is_refused_by_name() {
    for bad in [-1.0, 2e12, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            VirtualCoupling::new(bad, 1.0),
            Err(DeviceError::InvalidSetting {
                name: "translational_stiffness",
                ..
            })
        ));
        assert!(matches!(
            VirtualCoupling::new(1.0, bad),
            Err(DeviceError::InvalidSetting {
                name: "rotational_stiffness",
                ..
            })
        ));
    }
}

#[test]
fn stability_bounds_have_their_textbook_values() {
    assert!((largest_stiffness_for_damping(5.0, 0.0, 1e-3) - 1e4).abs() < 1e-9);
    assert!((largest_stiffness_for_damping(5.0, -3.0, 1e-3) - 4e3).abs() < 1e-9);
    assert_eq!(largest_stiffness_for_damping(1.0, 2.0, 1e-3), 0.0);
    assert_eq!(largest_stiffness_for_damping(1.0, 0.0, 0.0), 0.0);
    assert_eq!(largest_stiffness_for_friction(0.5, 1e-4), 1e4);
    assert_eq!(largest_stiffness_for_friction(0.5, 0.0), f64::INFINITY);
}

fn bare() -> Limits {
    Limits {
        position_resolution: 5.5e-5,
        ..Limits::virtuose_6d()
    }
}

fn choose(limits: &Limits) -> ChosenCoupling {
    ChosenCoupling::for_device(limits, 1e-3, &CouplingWish::default()).unwrap()
}

#[test]
fn coupling_is_the_smallest_of_its_bounds_and_says_which() {
    let mut limits = bare();
    let wished = choose(&limits);
    assert_eq!((wished.translational, wished.rotational), (1e4, 9.0));
    assert_eq!(
        wished.reason,
        "10000 N/m: what is wished decides, not known: the device's largest stiffness, its damping, its dry \
         friction; 9 N m/rad: 10000 N/m at a lever of 30 mm decides (allowed by what is wished 20)"
    );
    limits.coulomb_friction = Some(0.26);
    let friction = choose(&limits);
    assert!((friction.translational - 2.0 * 0.26 / 5.5e-5).abs() < 1e-9);
    assert!(friction.reason.starts_with(
        "9455 N/m: its dry friction of 0.26 N over an encoder step of 0.055 mm decides"
    ));
    limits.damping = Some(0.5);
    let damping = choose(&limits);
    assert_eq!(damping.translational, 1000.0);
    assert!(
        damping
            .reason
            .contains("the device's damping of 0.5 N s/m at a period of 1 ms decides")
    );
    limits.max_stiffness = Some(400.0);
    let stated = choose(&limits);
    assert_eq!(stated.translational, 400.0);
    assert!((stated.rotational - 0.36).abs() < 1e-12);
    assert!(!stated.reason.contains("not known"), "{}", stated.reason);
    assert_eq!(stated.coupling().unwrap().translational_stiffness(), 400.0);
}

#[test]
fn rotation_follows_the_stated_stiffness_where_there_is_one() {
    let limits = Limits {
        max_rotational_stiffness: Some(0.3),
        ..bare()
    };
    assert_eq!(choose(&limits).rotational, 0.3);
    let without_torque = Limits {
        peak_torque: 0.0,
        ..bare()
    };
    assert!(
        choose(&without_torque)
            .reason
            .ends_with("the device renders no torque")
    );
}

#[test]
fn encoder_whose_step_is_not_stated_gives_no_bound() {
    let limits = Limits {
        coulomb_friction: Some(0.1),
        ..Limits::virtuose_6d()
    };
    let chosen = choose(&limits);
    assert_eq!(chosen.translational, 1e4);
    assert!(chosen.reason.contains("its encoder's step"));
}

#[test]
fn shorter_period_allows_a_stiffer_coupling_and_damping_a_softer_one() {
    let limits = Limits {
        damping: Some(2.0),
        ..bare()
    };
    let at = |period_s, virtual_damping| {
        let wish = CouplingWish {
            translational: 1e9,
            virtual_damping,
            ..CouplingWish::default()
        };
        ChosenCoupling::for_device(&limits, period_s, &wish)
            .unwrap()
            .translational
    };
    assert!((at(1e-3, 0.0) - 4e3).abs() < 1e-9);
    assert!((at(1e-4, 0.0) - 4e4).abs() < 1e-7);
    assert!((at(1e-3, 1.5) - 1e3).abs() < 1e-9);
    assert_eq!(at(1e-3, 3.0), 0.0);
}

#[test]
fn choice_refuses_what_makes_no_sense() {
    let good = CouplingWish::default();
    let refused = |limits: &Limits, period_s, wish: &CouplingWish| {
        ChosenCoupling::for_device(limits, period_s, wish).is_err()
    };
    assert!(refused(&bare(), 0.0, &good));
    assert!(refused(&bare(), f64::NAN, &good));
    let absurd = Limits {
        peak_force: f64::NAN,
        ..bare()
    };
    assert!(refused(&absurd, 1e-3, &good));
    for wish in [
        CouplingWish { lever: 0.0, ..good },
        CouplingWish {
            translational: -1.0,
            ..good
        },
        CouplingWish {
            rotational: f64::INFINITY,
            ..good
        },
        CouplingWish {
            virtual_damping: -1.0,
            ..good
        },
    ] {
        assert!(refused(&bare(), 1e-3, &wish));
    }
}

//! Limits that devices report, and some that none can have.

use super::*;

type Change = fn(&mut Limits);

fn refused(change: Change) -> Option<&'static str> {
    let mut limits = Limits::virtuose_6d();
    change(&mut limits);
    match limits.check() {
        Err(DeviceError::InvalidSetting { name, .. }) => Some(name),
        Err(other) => panic!("{other:?}"),
        Ok(()) => None,
    }
}

#[test]
fn limits_of_a_device_for_input_alone_pass() {
    assert_eq!(
        refused(|l| (l.peak_force, l.continuous_force, l.peak_torque) = (0.0, 0.0, 0.0)),
        None
    );
    assert_eq!(refused(|_| ()), None);
}

#[test]
fn each_absurd_limit_is_refused_by_its_name() {
    for bad in [
        (|l| l.workspace_half_extents.y = f64::NAN) as Change,
        |l| l.workspace_half_extents.z = 0.0,
        |l| l.workspace_half_extents.x = 1e9,
    ] {
        assert_eq!(refused(bad), Some("workspace_half_extents"));
    }
    for bad in [
        (|l| l.peak_force = f64::INFINITY) as Change,
        |l| l.peak_force = -35.0,
        |l| l.peak_force = 35_000.0,
    ] {
        assert_eq!(refused(bad), Some("peak_force"));
    }
    for bad in [
        (|l| l.continuous_force = f64::NAN) as Change,
        |l| l.continuous_force = 36.0,
        |l| l.continuous_force = 0.0,
        |l| l.peak_force = 0.0,
    ] {
        assert_eq!(refused(bad), Some("continuous_force"));
    }
    let named: [(&str, Change); 9] = [
        ("peak_torque", |l| l.peak_torque = -1.0),
        ("position_resolution", |l| l.position_resolution = 1.0),
        ("force_resolution", |l| l.force_resolution = f64::NAN),
        ("rotation_resolution", |l| l.rotation_resolution = -1e-5),
        ("max_stiffness", |l| l.max_stiffness = Some(f64::INFINITY)),
        ("max_rotational_stiffness", |l| {
            l.max_rotational_stiffness = Some(-1.0);
        }),
        ("max_damping", |l| l.max_damping = Some(f64::NAN)),
        ("damping", |l| l.damping = Some(-1.0)),
        ("coulomb_friction", |l| l.coulomb_friction = Some(1e6)),
    ];
    for (name, change) in named {
        assert_eq!(refused(change), Some(name));
    }
}

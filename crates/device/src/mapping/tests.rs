//! Power, anchors and the clutch.

use proptest::prelude::*;

use super::*;
use crate::haptic_device::{HandPresence, Readiness};
use crate::wrench::{rotation_from_vector, rotation_vector};

fn vector(limit: f64) -> impl Strategy<Value = DVec3> {
    proptest::array::uniform3(-limit..limit).prop_map(DVec3::from_array)
}

fn rotation() -> impl Strategy<Value = DQuat> {
    vector(3.0).prop_map(rotation_from_vector)
}

fn pose() -> impl Strategy<Value = DPose3> {
    (vector(0.5), rotation()).prop_map(|(x, q)| DPose3::from_parts(x, q))
}

fn settings() -> impl Strategy<Value = MappingSettings> {
    (rotation(), 1e-3..1e3_f64, any::<bool>()).prop_map(|(axes, scale, follows)| MappingSettings {
        axes,
        scale,
        rotation: if follows {
            Rotation::Follow
        } else {
            Rotation::Fixed
        },
    })
}

fn handle(pose: DPose3, time_s: f64) -> HandleState {
    HandleState {
        time_s,
        ..HandleState::at_rest(pose)
    }
}

fn command(force: DVec3, torque: DVec3) -> Command {
    Wrench::new(force, torque).into()
}

fn power(wrench: &Wrench, state: &HandleState) -> f64 {
    wrench.force.dot(state.linear_velocity) + wrench.torque.dot(state.angular_velocity)
}

fn assert_near(a: &DPose3, b: &DPose3, tolerance: f64) {
    let off = (a.translation - b.translation).length();
    let turn = rotation_vector(a.rotation * b.rotation.conjugate()).length();
    assert!(off <= tolerance && turn <= tolerance, "{a:?} {b:?}");
}

proptest! {
    /// Source: the definition of a passive two-port; the relation at the head of `Mapping`.
    #[test]
    fn power_is_the_same_on_both_sides(
        settings in settings(),
        start in pose(),
        first in pose(),
        second in pose(),
        velocities in (vector(1.0), vector(5.0)),
        wrench in (vector(30.0), vector(3.0)),
        is_clutched: bool,
    ) {
        let mut mapping = Mapping::new(settings, start).unwrap();
        mapping.to_world(&handle(first, 0.0), false);
        let device = HandleState {
            linear_velocity: velocities.0,
            angular_velocity: velocities.1,
            ..handle(second, 0.001)
        };
        let world = mapping.to_world(&device, is_clutched);
        let on_grip = command(wrench.0, wrench.1);
        let on_handle = mapping.to_device(&on_grip);
        let (of_world, of_device) = (power(&on_grip.wrench, &world), power(&on_handle.wrench, &device));
        let size = on_handle.wrench.force.length() * device.linear_velocity.length()
            + on_handle.wrench.torque.length() * device.angular_velocity.length();
        prop_assert!((of_world - of_device).abs() <= 1e-12 * size.max(1.0), "{of_world} {of_device}");
        prop_assert_eq!(is_clutched, on_handle == Command::ZERO);
    }

    /// The velocities are the rates of the poses: a short step in the device is that step in the world.
    #[test]
    fn velocities_are_the_rates_of_the_poses(
        settings in settings(),
        start in pose(),
        first in pose(),
        second in pose(),
        v in vector(1.0),
        w in vector(5.0),
    ) {
        const STEP_S: f64 = 1e-6;
        let mut mapping = Mapping::new(settings, start).unwrap();
        mapping.to_world(&handle(first, 0.0), false);
        let moving = HandleState { linear_velocity: v, angular_velocity: w, ..handle(second, 0.001) };
        let before = mapping.to_world(&moving, false);
        let next = DPose3::from_parts(
            second.translation + v * STEP_S,
            rotation_from_vector(w * STEP_S) * second.rotation,
        );
        let after = mapping.to_world(&handle(next, 0.002), false);
        let way = after.pose.translation - before.pose.translation;
        let turn = rotation_vector(after.pose.rotation * before.pose.rotation.conjugate());
        let size = before.pose.translation.length();
        prop_assert!((way / STEP_S - before.linear_velocity).length() < 1e-8 * size.max(1.0));
        prop_assert!((turn / STEP_S - before.angular_velocity).length() < 1e-7);
    }

    /// J_d is the derivative of F_d by the handle's position, for a linear spring in the world.
    #[test]
    fn stiffness_is_the_derivative_of_the_force(
        settings in settings(),
        rows in proptest::array::uniform3(vector(2000.0)),
        step in vector(1e-2),
    ) {
        let j = DMat3::from_cols(rows[0], rows[1], rows[2]);
        let mut mapping = Mapping::new(settings, DPose3::IDENTITY).unwrap();
        let origin = mapping.to_world(&handle(DPose3::IDENTITY, 0.0), false);
        let there = mapping.to_world(&handle(DPose3::from_translation(step), 0.001), false);
        let on_grip = Command {
            wrench: Wrench::new(j * (there.pose.translation - origin.pose.translation), DVec3::ZERO),
            stiffness: j,
        };
        let on_handle = mapping.to_device(&on_grip);
        let predicted = on_handle.stiffness * step;
        let size = on_handle.wrench.force.length();
        prop_assert!((predicted - on_handle.wrench.force).length() <= 1e-9 * size.max(1e-9));
    }

    /// The first good sample is the scene's start, wherever the handle is then.
    #[test]
    fn first_sample_is_the_start_of_the_scene(settings in settings(), start in pose(), first in pose()) {
        let mut mapping = Mapping::new(settings, start).unwrap();
        let world = mapping.to_world(&handle(first, 3.0), false);
        assert_near(&world.pose, &start, 1e-14);
        prop_assert_eq!(world.linear_velocity, DVec3::ZERO);
    }

    /// Any sequence of clutching: the grip moves by what the handle moved unclutched, and never jumps.
    #[test]
    fn clutch_never_moves_the_grip(
        settings in settings(),
        start in pose(),
        steps in proptest::collection::vec((vector(1e-3), vector(1e-2), any::<bool>()), 1..60),
    ) {
        let mut mapping = Mapping::new(settings, start).unwrap();
        let mut device = DPose3::from_parts(DVec3::new(0.1, 0.2, 0.3), DQuat::IDENTITY);
        let mut last = mapping.to_world(&handle(device, 0.0), false);
        let mut time_s = 0.0;
        for (way, turn, is_clutched) in steps {
            time_s += 1e-3;
            device = DPose3::from_parts(
                device.translation + way,
                (rotation_from_vector(turn) * device.rotation).normalize(),
            );
            let world = mapping.to_world(&handle(device, time_s), is_clutched);
            let moved = world.pose.translation - last.pose.translation;
            let turned = rotation_vector(world.pose.rotation * last.pose.rotation.conjugate());
            if is_clutched {
                prop_assert_eq!(world.pose, last.pose);
                prop_assert_eq!((world.linear_velocity, world.angular_velocity), (DVec3::ZERO, DVec3::ZERO));
            } else {
                let expected = settings.axes * way * settings.scale;
                prop_assert!((moved - expected).length() <= 1e-12 * settings.scale.max(1.0));
                let expected = match settings.rotation {
                    Rotation::Follow => settings.axes * turn,
                    Rotation::Fixed => DVec3::ZERO,
                };
                prop_assert!((turned - expected).length() <= 1e-12);
            }
            last = world;
        }
    }
}

/// A device whose x points to the world's -y (a delta: x to the operator), half size.
#[test]
fn axes_and_scale_by_an_example_by_hand() {
    let settings = MappingSettings {
        axes: DQuat::from_rotation_z(-std::f64::consts::FRAC_PI_2),
        scale: 0.5,
        rotation: Rotation::Follow,
    };
    let start = DPose3::from_translation(DVec3::new(0.0, 0.0, 0.1));
    let mut mapping = Mapping::new(settings, start).unwrap();
    mapping.to_world(
        &handle(DPose3::from_translation(DVec3::splat(1.0)), 0.0),
        false,
    );
    let there = DPose3::from_translation(DVec3::new(1.2, 1.0, 1.0));
    let world = mapping.to_world(&handle(there, 0.001), false);
    let expected = DVec3::new(0.0, -0.1, 0.1);
    assert!((world.pose.translation - expected).length() < 1e-15);
    // 8 N against that way in the world are 4 N along -x on the handle; the torque keeps its size.
    let on_grip = command(DVec3::new(0.0, 8.0, 0.0), DVec3::new(0.0, 0.3, 0.0));
    let on_handle = mapping.to_device(&on_grip).wrench;
    assert!((on_handle.force - DVec3::new(-4.0, 0.0, 0.0)).length() < 1e-14);
    assert!((on_handle.torque - DVec3::new(-0.3, 0.0, 0.0)).length() < 1e-15);
}

#[test]
fn fixed_rotation_turns_nothing_and_gives_no_torque() {
    let settings = MappingSettings {
        rotation: Rotation::Fixed,
        ..MappingSettings::default()
    };
    let start = DPose3::from_rotation(DQuat::from_rotation_x(0.7));
    let mut mapping = Mapping::new(settings, start).unwrap();
    mapping.to_world(&handle(DPose3::IDENTITY, 0.0), false);
    let turned = HandleState {
        angular_velocity: DVec3::X,
        ..handle(DPose3::from_rotation(DQuat::from_rotation_y(1.0)), 0.001)
    };
    let world = mapping.to_world(&turned, false);
    assert_near(&world.pose, &start, 1e-15);
    assert_eq!(world.angular_velocity, DVec3::ZERO);
    let on_handle = mapping.to_device(&command(DVec3::X, DVec3::Y));
    assert_eq!(on_handle.wrench, Wrench::new(DVec3::X, DVec3::ZERO));
}

/// The hand lets the clutch go while the grip is held in a contact of 10 N.
#[test]
fn force_comes_back_slowly_after_the_clutch() {
    let mut mapping = Mapping::new(MappingSettings::default(), DPose3::IDENTITY).unwrap();
    let on_grip = Command {
        wrench: Wrench::new(DVec3::new(10.0, 0.0, 0.0), DVec3::ZERO),
        stiffness: DMat3::from_diagonal(DVec3::splat(-500.0)),
    };
    let mut time_s = 0.0;
    let mut felt = |mapping: &mut Mapping, is_clutched: bool| {
        time_s += 1e-3;
        mapping.to_world(&handle(DPose3::IDENTITY, time_s), is_clutched);
        let on_handle = mapping.to_device(&on_grip);
        // The stiffness fades with the force, or the device's own loop would render it.
        let share = on_handle.wrench.force.x / 10.0;
        assert!((on_handle.stiffness.x_axis.x + 500.0 * share).abs() < 1e-9);
        on_handle.wrench.force.x
    };
    assert_eq!(felt(&mut mapping, false), 10.0);
    assert_eq!(felt(&mut mapping, true), 0.0);
    assert_eq!(felt(&mut mapping, true), 0.0);
    let forces: Vec<f64> = (0..300).map(|_| felt(&mut mapping, false)).collect();
    assert_eq!(forces[0], 0.0);
    assert!(
        forces
            .windows(2)
            .all(|f| f[1] >= f[0] && f[1] - f[0] < 0.06)
    );
    assert!((forces[100] - 5.0).abs() < 0.1);
    assert_eq!(forces[250], 10.0);
}

#[test]
fn device_that_comes_back_elsewhere_goes_on_from_the_same_grip() {
    let start = DPose3::from_translation(DVec3::X);
    let mut mapping = Mapping::new(MappingSettings::default(), start).unwrap();
    mapping.to_world(&handle(DPose3::IDENTITY, 0.0), false);
    let at = |x: f64| DPose3::from_translation(DVec3::new(x, 0.0, 0.0));
    let before = mapping.to_world(&handle(at(0.01), 0.1), false);
    mapping.recentre();
    let after = mapping.to_world(&handle(at(0.2), 0.2), false);
    assert_eq!(after.pose, before.pose);
    let moved = mapping.to_world(&handle(at(0.21), 0.3), false);
    assert!((moved.pose.translation.x - 1.02).abs() < 1e-15);
}

#[test]
fn samples_that_cannot_be_leave_the_grip_at_rest_where_it_was() {
    let start = DPose3::from_translation(DVec3::X);
    let doubled = MappingSettings {
        scale: 2.0,
        ..MappingSettings::default()
    };
    let mut mapping = Mapping::new(doubled, start).unwrap();
    let nan = handle(DPose3::from_translation(DVec3::NAN), 0.0);
    assert_eq!(mapping.to_world(&nan, false).pose, start);

    let moving = HandleState {
        linear_velocity: DVec3::X,
        ..handle(DPose3::IDENTITY, 0.1)
    };
    mapping.to_world(&moving, false);
    let off_unit = DPose3::from_rotation(DQuat::from_xyzw(0.0, 0.0, 0.0, 1.2));
    let bad = [
        handle(DPose3::from_translation(DVec3::INFINITY), 0.2),
        handle(off_unit, 0.2),
        handle(DPose3::from_rotation(DQuat::from_array([0.0; 4])), 0.2),
        handle(DPose3::IDENTITY, f64::NAN),
        // Finite, but not once it is doubled.
        handle(DPose3::from_translation(DVec3::splat(f64::MAX)), 0.2),
    ];
    for state in bad {
        for is_clutched in [false, true] {
            let mut mapping = mapping.clone();
            let world = mapping.to_world(&state, is_clutched);
            assert!(world.is_finite());
            assert_eq!(world.pose, start);
            assert_eq!(world.linear_velocity, DVec3::ZERO);
        }
    }
}

#[test]
fn buttons_hand_readiness_and_time_pass_through() {
    let mut mapping = Mapping::new(MappingSettings::default(), DPose3::IDENTITY).unwrap();
    let state = HandleState {
        buttons: 5,
        hand: HandPresence::Absent,
        readiness: Readiness::Tripped("hot"),
        ..handle(DPose3::IDENTITY, 7.5)
    };
    for is_clutched in [false, true] {
        let world = mapping.to_world(&state, is_clutched);
        assert_eq!(world.buttons, 5);
        assert_eq!(world.hand, HandPresence::Absent);
        assert_eq!(world.readiness, Readiness::Tripped("hot"));
        assert_eq!(world.time_s, 7.5);
    }
}

#[test]
fn settings_that_make_no_sense_are_refused_by_name() {
    let with = |settings| Mapping::new(settings, DPose3::IDENTITY).unwrap_err();
    for scale in [0.0, -1.0, 1e-9, 1e9, f64::NAN, f64::INFINITY] {
        let settings = MappingSettings {
            scale,
            ..MappingSettings::default()
        };
        assert!(with(settings).to_string().starts_with("scale is"));
    }
    for axes in [
        DQuat::from_array([0.0; 4]),
        DQuat::NAN,
        DQuat::IDENTITY * 2.0,
    ] {
        let settings = MappingSettings {
            axes,
            ..MappingSettings::default()
        };
        assert!(with(settings).to_string().starts_with("axes is"));
    }
    for start in [
        DPose3::from_translation(DVec3::new(f64::NAN, 0.0, 0.0)),
        DPose3::from_translation(DVec3::new(0.0, f64::INFINITY, 0.0)),
        DPose3::from_rotation(DQuat::IDENTITY * 0.5),
    ] {
        let refused = Mapping::new(MappingSettings::default(), start).unwrap_err();
        assert!(refused.to_string().starts_with("start is"), "{refused}");
    }
}

#[test]
fn a_grip_that_slips_stays_where_it_was_put_and_follows_from_there() {
    let mut mapping = Mapping::new(MappingSettings::default(), DPose3::IDENTITY).unwrap();
    let at = |x: f64| DPose3::from_translation(DVec3::new(x, 0.0, 0.0));
    mapping.to_world(&handle(at(0.0), 0.0), false);
    let ahead = mapping.to_world(&handle(at(0.03), 0.1), false);
    assert_near(&ahead.pose, &at(0.03), 1e-15);
    mapping.slip(DVec3::new(-0.01, 0.0, 0.0));
    let held = mapping.to_world(&handle(at(0.03), 0.2), false);
    assert_near(&held.pose, &at(0.02), 1e-15);
    mapping.slip(DVec3::new(f64::NAN, 0.0, 0.0));
    let on = mapping.to_world(&handle(at(0.04), 0.3), false);
    assert_near(&on.pose, &at(0.03), 1e-15);
}

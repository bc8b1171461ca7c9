//! The account of the energy, the damping, and the bound.

use glam::DQuat;

use super::*;

const T: f64 = 1e-3;

fn settings() -> PassivitySettings {
    let port = PortSettings {
        effort_max: 10.0,
        damping_max: 4.0,
        speed_min: 2e-3,
        allowance: 0.02,
        store: 0.05,
    };
    PassivitySettings {
        translation: port,
        rotation: PortSettings {
            effort_max: 1.0,
            damping_max: 0.1,
            speed_min: 0.02,
            allowance: 0.01,
            store: 0.05,
        },
        bleed_s: 1e12,
        delay_s: 0.0,
    }
}

/// At x (m) and angle about z (rad), with the velocity along x.
fn at(x: f64, angle: f64, velocity: f64) -> HandleState {
    HandleState {
        linear_velocity: DVec3::X * velocity,
        ..HandleState::at_rest(DPose3::from_parts(
            DVec3::X * x,
            DQuat::from_rotation_z(angle),
        ))
    }
}

fn push(x: f64) -> Wrench {
    Wrench::new(DVec3::X * x, DVec3::ZERO)
}

/// A period in which a wrench went out, and where the handle then was.
fn went(passivity: &mut Passivity, out: &Wrench, handle: &HandleState) {
    passivity.sent(out);
    passivity.observe(handle, T);
}

fn passivity() -> Passivity {
    let mut passivity = Passivity::new(&settings()).unwrap();
    went(&mut passivity, &Wrench::ZERO, &at(0.0, 0.0, 0.0));
    passivity
}

#[test]
fn energy_is_force_times_way_with_the_sign_of_what_goes_in() {
    let mut passivity = passivity();
    // The hand pushes against 5 N over 2 mm: 10 mJ go in. Back under 3 N: 6 mJ come out.
    went(&mut passivity, &push(5.0), &at(-2e-3, 0.0, 0.0));
    assert!((passivity.energy().translation - 10e-3).abs() < 1e-12);
    went(&mut passivity, &push(3.0), &at(0.0, 0.0, 0.0));
    assert!((passivity.energy().translation - 4e-3).abs() < 1e-12);
    assert_eq!(passivity.energy().rotation, 0.0);
    assert_eq!(passivity.lowest(), ObservedEnergy::default());
}

#[test]
fn force_and_torque_have_accounts_of_their_own() {
    let mut passivity = passivity();
    let turn = Wrench::new(DVec3::ZERO, DVec3::Z * 0.5);
    // 0.5 N m over 0.01 rad comes out: 5 mJ of debt in rotation alone.
    went(&mut passivity, &turn, &at(0.0, 0.01, 0.3));
    let energy = passivity.energy();
    assert_eq!(energy.translation, 0.0);
    assert!((energy.rotation + 5e-3).abs() < 1e-9);
    let mut events = SafetyEvents::default();
    let wanted = Wrench::new(DVec3::X * 10.0, DVec3::Z);
    let passed = passivity.pass(&wanted, T, &mut events);
    // The force passes; the torque is halved with its allowance.
    assert_eq!(passed.force, wanted.force);
    assert!((passed.torque.z - 0.5).abs() < 1e-9);
    assert_eq!((events.energy_limited, events.passivity_damped), (1, 0));
}

#[test]
fn debt_is_damped_by_what_takes_it_back_in_a_period_and_no_more_than_the_device_can() {
    let mut passivity = passivity();
    let mut events = SafetyEvents::default();
    // A debt of 0.1 mJ at 0.5 m/s: alpha = 1e-4/(1e-3 0.25) = 0.4 N s/m, so 0.2 N.
    went(&mut passivity, &push(1.0), &at(1e-4, 0.0, 0.5));
    let passed = passivity.pass(&push(3.0), T, &mut events);
    assert!((passed.force.x - 2.8).abs() < 1e-12);
    // A debt of 10 mJ asks for 40 N s/m: 4 is the most.
    went(&mut passivity, &push(9.9), &at(1e-3 + 1e-4, 0.0, 0.5));
    let passed = passivity.pass(&push(3.0), T, &mut events);
    assert!((passed.force.x - 1.0).abs() < 1e-12);
    assert_eq!(events.passivity_damped, 2);
}

#[test]
fn nothing_is_damped_near_standstill_or_without_debt() {
    let mut passivity = passivity();
    let mut events = SafetyEvents::default();
    went(&mut passivity, &push(1.0), &at(1e-4, 0.0, 1.9e-3));
    assert_eq!(passivity.pass(&push(3.0), T, &mut events), push(3.0));
    went(&mut passivity, &push(5.0), &at(0.0, 0.0, -0.1));
    assert!(passivity.energy().translation > 0.0);
    assert_eq!(passivity.pass(&push(30.0), T, &mut events), push(30.0));
    assert_eq!(events, SafetyEvents::default());
}

#[test]
fn work_is_done_by_the_force_that_has_arrived() {
    let mut settings = settings();
    settings.delay_s = 2.0 * T;
    let mut passivity = Passivity::new(&settings).unwrap();
    let mut x = 0.0;
    for (out, expected) in [
        (1.0, 0.0),
        (2.0, 0.0),
        (3.0, -1e-3),
        (4.0, -3e-3),
        (0.0, -6e-3),
    ] {
        went(&mut passivity, &push(out), &at(x, 0.0, 0.0));
        assert!((passivity.energy().translation - expected).abs() < 1e-12);
        x += 1e-3;
    }
    // A longer one than is remembered is the longest.
    settings.delay_s = 1.0;
    let mut passivity = Passivity::new(&settings).unwrap();
    for k in 0..40 {
        went(
            &mut passivity,
            &push(1.0),
            &at(1e-4 * f64::from(k), 0.0, 0.0),
        );
    }
    assert!((passivity.energy().translation + 9e-4).abs() < 1e-12);
    assert!(passivity.arrived(0.0).is_finite());
}

#[test]
fn what_is_stored_is_no_more_than_the_store_and_is_forgotten() {
    let mut settings = settings();
    settings.bleed_s = 10.0;
    let mut passivity = Passivity::new(&settings).unwrap();
    went(&mut passivity, &Wrench::ZERO, &at(0.0, 0.0, 0.0));
    went(&mut passivity, &push(10.0), &at(-0.1, 0.0, 0.0));
    assert_eq!(passivity.energy().translation, 0.05);
    for _ in 0..10_000 {
        went(&mut passivity, &push(10.0), &at(-0.1, 0.0, 0.0));
    }
    // e⁻¹ of it after the time constant.
    assert!((passivity.energy().translation / 0.05 - 0.368).abs() < 0.001);
}

#[test]
fn whatever_the_simulation_wants_the_debt_stays_below_its_bound() {
    // The worst there is: a force that always pushes where the hand will go, by ways of up to 2 mm.
    let mut passivity = passivity();
    let mut events = SafetyEvents::default();
    let mut bits = 99_u64;
    let mut random = || {
        bits ^= bits << 13;
        bits ^= bits >> 7;
        bits ^= bits << 17;
        (bits >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut x = 0.0;
    for _ in 0..100_000 {
        let way = 4e-3 * random();
        let wanted = push(40.0 * way.signum());
        let passed = passivity.pass(&wanted, T, &mut events);
        let force = limit_length(passed.force, 10.0);
        x += way;
        went(
            &mut passivity,
            &Wrench::new(force, DVec3::ZERO),
            &at(x, 0.0, way / T),
        );
    }
    // A = 20 mJ = 10 N over 2 mm.
    let lowest = passivity.lowest().translation;
    assert!(
        (-0.02 * (1.0 + 1e-9)..-0.0199).contains(&lowest),
        "{lowest}"
    );
    assert!(events.energy_limited > 90_000);
}

#[test]
fn a_device_without_force_has_nothing_to_account_for() {
    let mut limits = Limits::virtuose_6d();
    (
        limits.peak_force,
        limits.continuous_force,
        limits.peak_torque,
    ) = (0.0, 0.0, 0.0);
    let settings = PassivitySettings::for_limits(&limits);
    let mut passivity = Passivity::new(&settings).unwrap();
    let mut events = SafetyEvents::default();
    for k in 0..10 {
        went(&mut passivity, &Wrench::ZERO, &at(f64::from(k), 0.1, 0.5));
        assert!(passivity.pass(&push(1.0), T, &mut events).is_finite());
    }
    assert_eq!(passivity.energy(), ObservedEnergy::default());
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let refused = |change: fn(&mut PassivitySettings)| {
        let mut settings = settings();
        change(&mut settings);
        match Passivity::new(&settings) {
            Err(DeviceError::InvalidSetting { name, .. }) => name,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(|s| s.bleed_s = 0.0), "bleed_s");
    assert_eq!(refused(|s| s.delay_s = f64::NAN), "delay_s");
    assert_eq!(
        refused(|s| s.rotation.damping_max = f64::NAN),
        "damping_max"
    );
    assert_eq!(refused(|s| s.translation.speed_min = 0.0), "speed_min");
    assert_eq!(refused(|s| s.translation.allowance = -1.0), "allowance");
    assert_eq!(refused(|s| s.rotation.store = f64::INFINITY), "store");
    assert_eq!(refused(|s| s.rotation.effort_max = -1.0), "effort_max");
}

//! Named models: their figures, their names, and what their bodies do.

use glam::DVec3;
use glamx::DPose3;

use super::*;
use crate::driver::simulated::{Simulated, Simulations};
use crate::driver::{self, Family};
use crate::error::DeviceError;
use crate::hand::{HandSettings, SimulatedHand};
use crate::haptic_device::{Command, HandPresence, HandleState, HapticDevice, Limits};
use crate::script::{Insertion, Script};
use crate::wrench::Wrench;

const STEP: f64 = 1e-4;

fn resting(model: &Model) -> Simulated {
    let hand = SimulatedHand::resting(HandSettings::default(), DPose3::IDENTITY, STEP).unwrap();
    Simulated::of_model(model, hand).unwrap()
}

fn push(x: f64) -> Wrench {
    Wrench::new(DVec3::X * x, DVec3::ZERO)
}

#[test]
fn each_model_has_limits_that_a_device_can_have_and_sources() {
    let keys: Vec<&str> = MODELS.iter().map(|model| model.key).collect();
    assert_eq!(
        keys,
        ["virtuose-6d", "touch", "falcon", "omega", "inverse3"]
    );
    for model in MODELS {
        model.limits.check().unwrap();
        assert!(model.limits.damping.is_some() && model.limits.max_stiffness.is_some());
        assert!(model.sources.iter().any(|(_, source)| *source == "assumed"));
    }
}

#[test]
fn each_model_is_opened_by_its_name_and_listed_under_it() {
    let listed: Vec<String> = Simulations
        .list()
        .into_iter()
        .map(|line| line.name)
        .collect();
    for model in MODELS {
        let name = format!("simulated:{}", model.key);
        assert!(listed.contains(&name));
        let mut opened = driver::open(&name).unwrap();
        assert_eq!(opened.device.name(), model.name);
        assert_eq!(opened.device.limits(), &model.limits);
        assert_eq!(opened.notes.len(), model.sources.len());
        assert_eq!(opened.device.read(0.0).unwrap().pose, DPose3::IDENTITY);
    }
    assert_eq!(
        driver::open("simulated").unwrap().device.name(),
        MODELS[0].name
    );
}

#[test]
fn unknown_model_is_refused_with_the_names_there_are() {
    let error = driver::open("simulated:phantom").unwrap_err();
    assert_eq!(
        error.to_string(),
        "there is no device \"simulated:phantom\"; simulated devices are virtuose-6d, touch, falcon, omega, inverse3"
    );
    assert!(matches!(error, Unavailable::UnknownName { .. }));
}

#[test]
fn force_arrives_after_the_delay_and_its_jitter() {
    for model in MODELS {
        let mut device = resting(model);
        device.read(0.0).unwrap();
        device.write(&push(1.0).into()).unwrap();
        let arrived = (1..100_u32)
            .find(|k| {
                device.read(f64::from(*k) * STEP).unwrap();
                device.felt() != Wrench::ZERO
            })
            .unwrap();
        let delay = (model.body.delay_s / STEP).round();
        let latest = delay + model.body.jitter_s / STEP;
        let late = f64::from(arrived - 1);
        assert!((delay - 0.5..latest + 0.5).contains(&late), "{}", model.key);
    }
}

#[test]
fn handle_is_read_in_encoder_steps_and_its_velocity_is_made_of_them() {
    let model = Model::named("touch").unwrap();
    let script = Script::new(&Insertion {
        start: DPose3::IDENTITY,
        direction: DVec3::X,
        speed: 0.05,
        travel: 0.03,
        hold_s: 0.0,
        retract: false,
    })
    .unwrap();
    let hand = SimulatedHand::new(HandSettings::default(), script, STEP).unwrap();
    let mut device = Simulated::of_model(model, hand).unwrap();
    let mut differs = false;
    for k in 0..500 {
        let state = device.read(f64::from(k) * 1e-3).unwrap();
        let counts = state.pose.translation.x / 5.5e-5;
        assert!((counts - counts.round()).abs() < 1e-6);
        let truth = device.hand().state().linear_velocity.x;
        differs |= truth != state.linear_velocity.x;
        if (200..400).contains(&k) {
            assert!((state.linear_velocity.x - truth).abs() < 0.01);
        }
    }
    assert!(differs);
}

#[test]
fn dry_friction_of_the_touch_holds_a_small_force() {
    let model = Model::named("touch").unwrap();
    let (mut guide, hand) =
        SimulatedHand::guided(HandSettings::default(), DPose3::IDENTITY, STEP).unwrap();
    guide.set_hand(HandPresence::Absent);
    let mut device = Simulated::of_model(model, hand).unwrap();
    let mut reach = |from: u32, force: f64| {
        for k in from..from + 100 {
            device.read(f64::from(k) * 1e-3).unwrap();
            device.write(&push(force).into()).unwrap();
        }
        device.hand().state().pose.translation.x
    };
    assert!(reach(0, 0.25).abs() < 1e-9);
    assert!(reach(100, 0.4) > 1e-3);
}

#[test]
fn stop_empties_the_wire() {
    let mut device = resting(Model::named("").unwrap());
    device.read(0.0).unwrap();
    device.write(&push(5.0).into()).unwrap();
    device.stop();
    for k in 0..50 {
        device.read(f64::from(k) * STEP).unwrap();
        assert_eq!(device.felt(), Wrench::ZERO);
    }
}

#[test]
fn script_that_leaves_the_model_s_workspace_is_refused() {
    let script = Script::new(&Insertion {
        start: DPose3::IDENTITY,
        direction: DVec3::NEG_Z,
        speed: 0.05,
        travel: 0.05,
        hold_s: 0.0,
        retract: false,
    })
    .unwrap();
    let on = |key| {
        let hand = SimulatedHand::new(HandSettings::default(), script, STEP).unwrap();
        Simulated::of_model(Model::named(key).unwrap(), hand)
    };
    assert!(on("touch").is_err() && on("falcon").is_err());
    assert!(on("omega").is_ok() && on("virtuose-6d").is_ok());
}

#[test]
fn delay_in_periods_is_rounded_up() {
    let omega = Model::named("omega").unwrap();
    assert_eq!(omega.plant(1e-3).delay_periods, 1);
    assert_eq!(omega.plant(2.5e-4).delay_periods, 1);
    assert_eq!(omega.plant(1e-4).delay_periods, 3);
}

#[test]
fn device_with_absurd_limits_is_not_opened() {
    let opened = || Simulations.open("touch").unwrap();
    assert!(driver::checked(opened()).is_ok());
    struct Absurd(Limits);
    impl HapticDevice for Absurd {
        fn name(&self) -> &str {
            "absurd"
        }
        fn limits(&self) -> &Limits {
            &self.0
        }
        fn read(&mut self, _: f64) -> Result<HandleState, DeviceError> {
            Ok(HandleState::at_rest(DPose3::IDENTITY))
        }
        fn write(&mut self, _: &Command) -> Result<(), DeviceError> {
            Ok(())
        }
        fn stop(&mut self) {}
    }
    let mut limits = Limits::virtuose_6d();
    limits.peak_force = f64::NAN;
    let absurd = driver::Opened {
        device: Box::new(Absurd(limits)),
        ..opened()
    };
    assert_eq!(
        driver::checked(absurd).unwrap_err().to_string(),
        "absurd reports limits that no device has: peak_force is NaN; it must be from 0 to 1000 N"
    );
}

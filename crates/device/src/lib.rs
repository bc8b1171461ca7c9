//! Haptic devices and the loop that serves them: pose in, wrench out, a thousand times a second.
//!
//! The way of one period:
//!
//! ```text
//! clock ── release ──> device.read ── pose ──> safety ──> simulation (closure)
//!                      device.write <── wrench ── safety <──────┘
//! ```
//!
//! - [`HapticDevice`] is what a driver offers, [`Limits`] what its hardware can do.
//! - [`driver::simulated`] is a device that needs no hardware: the figures of a Virtuose 6D, held by
//!   the scripted [`SimulatedHand`]; and models of other devices with bodies of their own.
//! - [`Mapping`] places the handle in the scene: axes, scale, clutch, and the wrench back.
//! - [`VelocityEstimator`] tells velocities from poses where a device reports none.
//! - [`VirtualCoupling`] ties the simulated tool to the handle; [`ChosenCoupling`] is as stiff as a
//!   device bears, and [`stability`] says where it would shake.
//! - [`Safety`] stands between the simulation and the hand: no wrench beyond the limits, nothing that
//!   is not finite, no jump; in a live session also no energy of its own, no heat, nothing old, and no
//!   force that was not armed. Each intervention is counted.
//! - [`Servo`] runs the loop on a [`Clock`]: [`RealTime`], [`AsFastAsPossible`] or, in tests,
//!   [`Driven`]. The loop sees the same times on each, so a headless run and a felt one are the same
//!   computation. [`Realtime`] asks the system to let the loop be on time.
//!
//! This crate knows poses, wrenches and time, and nothing of meshes or contacts.
//!
//! Units are SI. Poses are those of the handle in the device's frame; a wrench is the one *on the
//! handle* about the handle point, in the axes of the device's frame.
//!
//! # Example
//!
//! A simulated hand pushes the handle 10 mm down onto a spring wall of 1 kN/m that starts 5 mm below:
//!
//! ```
//! use device::{
//!     AsFastAsPossible, DeviceError, HandSettings, Insertion, Script, Servo, ServoSettings,
//!     Simulated, SimulatedSettings, SimulatedHand, Wrench, HapticDevice,
//! };
//! use glam::DVec3;
//! use glamx::DPose3;
//!
//! # fn main() -> Result<(), DeviceError> {
//! let period_s = 1e-3;
//! let script = Script::new(&Insertion {
//!     start: DPose3::IDENTITY,
//!     direction: DVec3::NEG_Z,
//!     speed: 0.05,
//!     travel: 0.010,
//!     hold_s: 0.5,
//!     retract: false,
//! })?;
//! let periods = script.periods(period_s);
//! let hand = SimulatedHand::new(HandSettings::default(), script, period_s)?;
//! let mut device = Simulated::new(SimulatedSettings::default(), hand)?;
//!
//! let clock = AsFastAsPossible::new(period_s)?;
//! let mut servo = Servo::new(clock, ServoSettings::for_limits(device.limits()))?;
//! let mut force = 0.0;
//! let report = servo.run_periods(&mut device, periods, |handle| {
//!     let depth = (-0.005 - handle.pose.translation.z).max(0.0);
//!     force = 1000.0 * depth;
//!     Wrench::new(DVec3::new(0.0, 0.0, force), DVec3::ZERO)
//! })?;
//!
//! assert_eq!(report.periods, periods);
//! // Grip (2 kN/m) and wall share the remaining 5 mm: 5 mm / (1/2000 + 1/1000) = 3.33 N,
//! // rendered in steps of 0.2 N.
//! assert!((force - 3.33_f64).abs() < 0.2);
//! # Ok(())
//! # }
//! ```
//!
//! A live session on whatever device is named, with every guard on:
//!
//! ```
//! use device::{Answer, AsFastAsPossible, ChosenCoupling, CouplingWish, Servo, ServoSettings, Wrench};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let period_s = 1e-3;
//! let mut opened = device::driver::open("simulated:touch")?;
//! let limits = *opened.device.limits();
//! let chosen = ChosenCoupling::for_device(&limits, period_s, &CouplingWish::default())?;
//! println!("coupling: {}", chosen.reason);
//!
//! // On hardware: `Realtime::ask()` on this thread, printed, and `RealTime::with_spin` as the clock.
//! let clock = AsFastAsPossible::new(period_s)?;
//! let mut servo = Servo::new(clock, ServoSettings::live(&limits)?)?;
//! let mut told = None;
//! for _ in 0..500 {
//!     let record = servo.step(&mut *opened.device, |_handle| Answer {
//!         command: Wrench::ZERO.into(), // of the newest result, with its stiffness
//!         age_s: 0.0,                   // how old that result is
//!     })?;
//!     if told.replace(record.arming) != Some(record.arming) {
//!         println!("{}", record.arming);
//!     }
//! }
//! servo.release(&mut *opened.device);
//! assert_eq!(servo.report().safety.trips(), 0);
//! # Ok(())
//! # }
//! ```
#![cfg_attr(
    test,
    allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")
)]

pub mod driver;
pub mod stability;

mod clock;
mod coupling;
mod error;
mod hand;
mod haptic_device;
mod histogram;
mod mapping;
mod realtime;
mod safety;
mod script;
mod servo;
mod velocity;
mod wrench;

pub use clock::{AsFastAsPossible, Clock, Driven, RealTime, Release};
pub use coupling::{
    ChosenCoupling, CouplingWish, STIFFNESS_MAX, VirtualCoupling, largest_stiffness_for_damping,
    largest_stiffness_for_friction,
};
pub use driver::simulated::{BodySettings, Simulated, SimulatedEvents, SimulatedSettings};
pub use error::DeviceError;
pub use hand::{Guide, HandSettings, SimulatedHand};
pub use haptic_device::{Command, HandPresence, HandleState, HapticDevice, Limits, Readiness};
pub use histogram::{TimeHistogram, TimeSummary};
pub use mapping::{Mapping, MappingSettings, Rotation};
pub use realtime::{Granted, Realtime, priority_of_loop};
pub use safety::{
    Arming, ArmingSettings, HeatingSettings, ObservedEnergy, PassivitySettings, PortSettings,
    Safety, SafetyEvents, SafetySettings, WaitsFor, Watchdog,
};
pub use script::{Insertion, Phase, Script, Target};
pub use servo::{Answer, PeriodRecord, Servo, ServoReport, ServoSettings};
pub use velocity::VelocityEstimator;
pub use wrench::{Wrench, rotation_from_vector, rotation_vector};

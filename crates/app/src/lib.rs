//! Assembles the crates of the workspace into the program: a scene file becomes a prepared part,
//! a prepared part becomes an engine, and a hand on a device pushes the tool onto the part.
//!
//! The data's way: [`scene`] (file to validated scene) → [`prepare`] (mesh to compliance, cached)
//! → [`engine`] (one deterministic haptic step) → [`session`] (device, hand and engine)
//! → [`report`] (tables, plots, pictures). [`study`] compares with other programs.

#![cfg_attr(test, allow(clippy::unwrap_used))]

pub mod between;
pub mod choice;
pub mod cli;
pub mod crash;
pub mod drive;
pub mod effects;
mod elsewhere;
pub mod engine;
mod error;
mod evaluate;
pub mod fields;
mod follow;
pub mod interrupt;
mod leftovers;
pub mod machine;
mod origin;
mod output;
mod plausibility;
pub mod prepare;
pub mod progress;
pub mod report;
pub mod scene;
pub mod session;
pub mod setup;
pub mod shape;
pub mod stored;
pub mod study;
#[cfg(feature = "viewer")]
mod viewer;

pub use cli::run;
pub use error::Error;

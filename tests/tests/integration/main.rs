//! Tests of the whole program through its public interface, one module per subject.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod accuracy;
mod architecture;
mod bad_input;
mod broken_cases;
mod cache;
mod contact_cases;
mod docs;
mod drive;
mod fast_path;
mod friction;
mod friction_wedge;
mod interior;
mod live;
mod multiply;
mod p_method;
mod places;
mod plausibility;
mod random_scenes;
mod readers;
mod report;
mod scenes;
mod shape_on_gpu;
mod shared_rows;
mod storage;
mod strain;
mod tool_features;
mod two_rates;
mod verify;

//! Drivers: one file per family of devices, the simulated one first.

pub mod simulated;

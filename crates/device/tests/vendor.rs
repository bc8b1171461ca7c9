//! The drivers of the makers' libraries, against stand-ins that the test compiles: what they call, in which order, in
//! which units, and what they do where a library fails, blocks, lies or is not there.

#![allow(
    unsafe_code,
    reason = "the stand-ins are loaded as the makers' libraries are, and allocations are counted"
)]
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

#[path = "vendor/stub.rs"]
mod stub;

#[path = "vendor/allocations.rs"]
mod allocations;
#[path = "vendor/dhd.rs"]
mod dhd;
#[path = "vendor/environment.rs"]
mod environment;
#[path = "vendor/hd.rs"]
mod hd;
#[path = "vendor/virtuose.rs"]
mod virtuose;

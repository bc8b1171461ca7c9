//! The crate from outside: files of other programs, exact fields, relations that must hold.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

mod columns;
mod common;
mod constrained;
mod convergence;
mod energy;
mod hierarchy;
mod patch;
mod quality;
mod raise;
mod raise_refused;
mod reader;
mod recovery;
mod reference;
mod refine;
mod relations;
mod stress;

//! What the program is worth: comparison with other programs' results, and what accuracy costs in time.

pub mod accuracy;
pub mod verify;

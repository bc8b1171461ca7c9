//! Tables of what the program is worth: comparison with other programs' results.

pub mod accuracy;
pub mod verify;

//! What the program is worth: comparison with other programs' results, what accuracy costs in time, and what
//! physical effects change and cost.

pub mod accuracy;
pub mod effects;
pub mod verify;

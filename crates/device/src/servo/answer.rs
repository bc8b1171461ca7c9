//! What the simulation says in a period.

use crate::haptic_device::Command;
use crate::wrench::Wrench;

/// What the simulation wants rendered, and how old the result behind it is.
///
/// A [`Wrench`] or a [`Command`] is an answer of age 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// What is to be rendered.
    pub command: Command,
    /// Time since the result behind it was computed, s. Beyond 10 ms the force fades, at 50 ms it is gone; where
    /// it is not a number too.
    pub age_s: f64,
}

impl From<Command> for Answer {
    fn from(command: Command) -> Self {
        Self {
            command,
            age_s: 0.0,
        }
    }
}

impl From<Wrench> for Answer {
    fn from(wrench: Wrench) -> Self {
        Command::from(wrench).into()
    }
}

//! How long work tells how far it is and learns that it should stop.

/// Receives progress; may be called from several threads.
pub trait Progress: Sync {
    /// `done` of `total` parts of `stage` are done.
    fn advance(&self, stage: &str, done: usize, total: usize);
    /// Whether the work should stop; it then ends with [`crate::Error::Cancelled`].
    fn is_cancelled(&self) -> bool;
}

/// Tells nobody and never stops.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Progress for Silent {
    fn advance(&self, _stage: &str, _done: usize, _total: usize) {}
    fn is_cancelled(&self) -> bool {
        false
    }
}

//! The surface's motion beside a loop in real time: computed for the newest snapshot, on a thread of its own.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::ports::SnapshotOutput;
use super::recording::Recording;
use crate::Error;
use crate::shape::{self, Shape};

/// Time between two looks, s.
const INTERVAL_S: f64 = 0.016;

/// What was seen.
#[derive(Debug, Default)]
pub(super) struct Watched {
    /// Largest displacement of a surface node, m.
    largest: f64,
    /// Periods whose surface was multiplied, and the ns that it took.
    multiplied: Vec<(u64, u64)>,
}

impl Watched {
    /// Puts it into the recording.
    pub(super) fn note(&self, recording: &mut Recording) {
        recording.see(self.largest);
        for (period, ns) in &self.multiplied {
            recording.note_multiply(*period, *ns);
        }
    }
}

/// Does `work` on this thread with the display on another, until the work is over.
///
/// # Errors
/// Those of the work, then those of the multiply.
pub(super) fn beside<T>(
    view: SnapshotOutput,
    shape: &mut Shape,
    work: impl FnOnce() -> Result<T, Error>,
) -> Result<(Watched, T), Error> {
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        // Also where the work panics.
        let stop = StopOnDrop(&stop);
        let flag = stop.0;
        let display = scope.spawn(move || watch(view, shape, flag));
        let done = work();
        drop(stop);
        let seen = display.join().map_err(|_| Error::EngineEnded)?;
        Ok((seen?, done?))
    })
}

/// Until `stop`, and once more.
fn watch(mut view: SnapshotOutput, shape: &mut Shape, stop: &AtomicBool) -> Result<Watched, Error> {
    let mut seen = Watched::default();
    let mut is_over = false;
    while !is_over {
        is_over = stop.load(Ordering::Acquire);
        if view.update() {
            look(view.output_buffer(), shape, &mut seen)?;
        }
        if !is_over {
            std::thread::sleep(Duration::from_secs_f64(INTERVAL_S));
        }
    }
    Ok(seen)
}

fn look(snapshot: &super::Snapshot, shape: &mut Shape, seen: &mut Watched) -> Result<(), Error> {
    let Some(sample) = &snapshot.sample else {
        return Ok(());
    };
    let begun = Instant::now();
    let largest = shape::largest(shape.update(snapshot.contacts())?);
    let elapsed_ns = begun.elapsed().as_nanos() as u64;
    shape.look_ahead(sample.report.tool_pose);
    seen.largest = seen.largest.max(largest);
    seen.multiplied.push((sample.step, elapsed_ns));
    Ok(())
}

/// Tells a thread beside to end.
pub(crate) struct StopOnDrop<'a>(pub(crate) &'a AtomicBool);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

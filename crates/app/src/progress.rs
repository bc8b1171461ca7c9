//! Progress bars and notes on the error stream.

use std::cell::RefCell;
use std::io::Write;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::interrupt;

/// Where notes go and whether bars are drawn.
pub struct Ui<'a> {
    err: RefCell<&'a mut dyn Write>,
    bars: bool,
}

impl<'a> Ui<'a> {
    /// `bars`: draw progress bars on the terminal's error stream.
    pub fn new(err: &'a mut dyn Write, bars: bool) -> Self {
        Self {
            err: RefCell::new(err),
            bars,
        }
    }

    /// One line to the user, beside the result.
    pub fn note(&self, line: &str) {
        self.end_status();
        // A closed error stream is no reason to lose a result.
        let _ = writeln!(self.err.borrow_mut(), "{line}");
    }

    /// Where long work is, on a terminal only; the next one takes its place.
    pub fn status(&self, line: &str) {
        if self.bars {
            // Column 1, and what was there is wiped out.
            let _ = write!(self.err.borrow_mut(), "\r\x1b[2K{line}");
            let _ = self.err.borrow_mut().flush();
        }
    }

    /// Ends [`Self::status`].
    pub fn end_status(&self) {
        if self.bars {
            let _ = write!(self.err.borrow_mut(), "\r\x1b[2K");
        }
    }

    /// A bar (or nothing) that long work advances.
    pub fn progress(&self) -> Progress {
        Progress {
            bars: self.bars,
            state: Mutex::new(None),
        }
    }
}

/// Passed into long work: takes its progress and tells it of Ctrl-C. A bar shows only once the
/// work has taken more than half a second.
pub struct Progress {
    bars: bool,
    state: Mutex<Option<Stage>>,
}

struct Stage {
    name: String,
    begun: Instant,
    bar: Option<ProgressBar>,
}

impl fem::Progress for Progress {
    fn advance(&self, stage: &str, done: usize, total: usize) {
        if !self.bars {
            return;
        }
        let Ok(mut state) = self.state.lock() else {
            return;
        };
        if state.as_ref().is_none_or(|s| s.name != stage) {
            if let Some(Stage { bar: Some(bar), .. }) = state.take() {
                bar.finish_and_clear();
            }
            *state = Some(Stage {
                name: stage.to_owned(),
                begun: Instant::now(),
                bar: None,
            });
        }
        let Some(current) = state.as_mut() else {
            return;
        };
        if current.bar.is_none() && current.begun.elapsed() > Duration::from_millis(500) {
            let bar = ProgressBar::with_draw_target(
                Some(total as u64),
                ProgressDrawTarget::stderr_with_hz(10),
            );
            if let Ok(style) =
                ProgressStyle::with_template("{msg:24} {bar:30} {pos}/{len}, {eta} left")
            {
                bar.set_style(style);
            }
            bar.set_message(stage.to_owned());
            current.bar = Some(bar);
        }
        if let Some(bar) = &current.bar {
            bar.set_length(total as u64);
            bar.set_position(done as u64);
        }
    }

    fn is_cancelled(&self) -> bool {
        interrupt::is_requested()
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Ok(mut state) = self.state.lock()
            && let Some(Stage { bar: Some(bar), .. }) = state.take()
        {
            bar.finish_and_clear();
        }
    }
}

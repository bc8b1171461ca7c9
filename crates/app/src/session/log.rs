//! Every period into a file while the session goes on: a ring to a thread that writes.
//!
//! The loop pushes samples of fixed size into a ring of fixed length and never waits. Should the program be killed,
//! the file is a recording all the same, of all but the last quarter of a second.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use device::{Arming, Phase};
use glam::DVec3;
use mcap::McapError;
use rtrb::{Consumer, Producer, RingBuffer};

use super::Sample;
use crate::Error;
use crate::report;
use crate::report::mcap_file::{StepMessage, StepWriter, WholeFile, finite, numbers};

/// Samples in the ring: eight seconds at 1 kHz for a disk that is busy.
const ROOM: usize = 8192;

/// Time between two flushes, s.
const FLUSH_S: f64 = 0.25;

/// Time between two looks into the ring, s.
const LOOK_S: f64 = 0.02;

/// The writer's end.
pub struct Log {
    path: PathBuf,
    steps: StepWriter<WholeFile>,
    samples: Consumer<Sample>,
}

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Logged {
    /// Steps in the file.
    pub n_steps: u64,
}

impl Log {
    /// Begins a file, which is empty or not there yet; with the loop's end of the ring. `about`: what the recording is of.
    ///
    /// # Errors
    /// A file that cannot be created.
    pub fn create(
        path: &Path,
        about: &BTreeMap<String, String>,
    ) -> Result<(Self, Producer<Sample>), Error> {
        let mut options = File::options();
        let opened = options.write(true).create(true).truncate(false).open(path);
        let file = opened.map_err(Error::io(path, "create the recording"))?;
        let (producer, samples) = RingBuffer::new(ROOM);
        let steps = StepWriter::new(WholeFile::new(file), about).map_err(failed(path))?;
        let path = path.to_path_buf();
        Ok((
            Self {
                path,
                steps,
                samples,
            },
            producer,
        ))
    }

    /// Where.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes until `stop`, and then what is left; ends the file.
    ///
    /// # Errors
    /// What the system says, such as a full disk. What was written until then stays.
    pub fn write(mut self, stop: &AtomicBool) -> Result<Logged, Error> {
        let mut logged = Logged::default();
        let mut flushed = Instant::now();
        loop {
            // First: what was pushed before the end is seen below.
            let is_over = stop.load(Ordering::Acquire);
            while let Ok(sample) = self.samples.pop() {
                let step = message(&sample);
                self.steps.push(&step).map_err(failed(&self.path))?;
                logged.n_steps += 1;
            }
            if is_over {
                break;
            }
            if flushed.elapsed().as_secs_f64() > FLUSH_S {
                self.steps.flush().map_err(failed(&self.path))?;
                flushed = Instant::now();
            }
            std::thread::sleep(Duration::from_secs_f64(LOOK_S));
        }
        let file = self.steps.finish().map_err(failed(&self.path))?;
        file.finish()
            .map_err(Error::io(&self.path, "write the recording"))?;
        Ok(logged)
    }
}

fn failed(path: &Path) -> impl FnOnce(McapError) -> Error {
    let io = Error::io(path, "write the recording");
    move |error| match error {
        McapError::Io(source) => io(source),
        other => io(std::io::Error::other(other)),
    }
}

/// A sample as it is written.
fn message(sample: &Sample) -> StepMessage {
    let (report, wrench) = (&sample.report, &sample.wrench_on_handle);
    let phase = match sample.phase {
        Phase::Approach => report::Phase::Approach,
        Phase::Retract => report::Phase::Retract,
        Phase::Hold | Phase::Done => report::Phase::Hold,
    };
    StepMessage {
        step: sample.step,
        time_s: sample.time_s,
        phase: phase.name().to_owned(),
        travel_m: finite(sample.gone.travel).unwrap_or_default(),
        // Adding zero turns a negative zero into a zero.
        force_n: finite(sample.resistance + 0.0),
        force_on_handle_n: numbers((wrench.force + DVec3::ZERO).to_array()),
        torque_on_handle_nm: numbers((wrench.torque + DVec3::ZERO).to_array()),
        sent_force_n: Some(sample.servo.wrench_on_handle.force.to_array()),
        armed: match sample.servo.arming {
            Arming::NotAsked => None,
            arming => Some(arming == Arming::Armed),
        },
        handle_position_m: numbers(sample.handle_pose.translation.to_array()),
        handle_rotation: numbers(sample.handle_pose.rotation.to_array()),
        tool_position_m: numbers(report.tool_pose.translation.to_array()),
        tool_rotation: numbers(report.tool_pose.rotation.to_array()),
        contacts: report.contacts,
        pivots: report.pivots,
        certificate: finite(report.certificate),
    }
}

//! A back-end on a graphics adapter with the processor behind it.

use std::time::{Duration, Instant};

use crate::error::Error;
use crate::gpu::Gpu;
use crate::layout::Layout;
use crate::multiply::ComplianceMultiply;

/// So often an answer may come too late before the adapter is given up. Once or twice is an adapter that wakes from
/// rest, or a window that is moved.
const LATE: u32 = 3;

/// An adapter that is silent for so long is given up.
const SILENT: Duration = Duration::from_secs(2);

/// The multiply on a graphics adapter; the processor takes over where the adapter fails, within the same call.
///
/// For good where the device is lost or refuses, or where it was late three times or silent for two seconds; until it
/// answers again otherwise. The processor's copy of the compliance is there from the beginning: making it then would
/// take longer than a frame.
pub struct Guarded {
    gpu: Option<Gpu>,
    /// Kept to the end: to wait for a driver that hangs would be more than a frame.
    given_up: Option<Gpu>,
    processor: Box<dyn ComplianceMultiply>,
    name: String,
    remark: Option<String>,
    n_late: u32,
    /// Since when the adapter owes an answer.
    late_since: Option<Instant>,
}

impl Guarded {
    /// `processor`: of the same compliance.
    ///
    /// # Panics
    /// Where their sizes differ.
    pub fn new(gpu: Gpu, processor: Box<dyn ComplianceMultiply>) -> Self {
        assert_eq!(
            gpu.layout(),
            processor.layout(),
            "two compliances of one part"
        );
        Self {
            name: gpu.name().to_owned(),
            gpu: Some(gpu),
            given_up: None,
            processor,
            remark: None,
            n_late: 0,
            late_since: None,
        }
    }

    /// The adapter's back-end, as long as it works: for whoever draws from its memory.
    pub fn gpu(&mut self) -> Option<&mut Gpu> {
        self.gpu.as_mut()
    }

    /// How often the adapter's answer came too late, so that the processor multiplied.
    pub fn n_late(&self) -> u32 {
        self.n_late
    }

    /// Runs `call` on the adapter, and on the processor if the adapter fails. What the caller did wrong is his.
    fn run<T>(
        &mut self,
        mut call: impl FnMut(&mut dyn ComplianceMultiply) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let Some(gpu) = &mut self.gpu else {
            return call(self.processor.as_mut());
        };
        if let Some(since) = self.late_since {
            if gpu.is_busy() {
                if since.elapsed() > SILENT {
                    let after = SILENT.as_secs();
                    let reason = format!("{} was silent for {after} s", gpu.name());
                    self.give_up(&reason);
                }
                return call(self.processor.as_mut());
            }
            self.late_since = None;
        }
        match call(gpu) {
            Err(error) if error.is_of_adapter() => {
                if let Error::TimedOut { .. } = error {
                    self.n_late += 1;
                    self.late_since = Some(Instant::now());
                }
                if self.late_since.is_none() || self.n_late >= LATE {
                    self.give_up(&error.to_string());
                }
                call(self.processor.as_mut())
            }
            other => other,
        }
    }

    fn give_up(&mut self, reason: &str) {
        self.remark = Some(format!("{reason}; the processor multiplies from now on"));
        self.processor.name().clone_into(&mut self.name);
        self.given_up = self.gpu.take();
        if let Some(gpu) = &self.given_up {
            gpu.stop();
        }
    }
}

impl ComplianceMultiply for Guarded {
    fn name(&self) -> &str {
        &self.name
    }

    fn bytes(&self) -> u64 {
        self.processor.bytes() + self.gpu.as_ref().map_or(0, Gpu::bytes)
    }

    fn layout(&self) -> Layout {
        self.processor.layout()
    }

    fn multiply_into(
        &mut self,
        columns: &[u32],
        forces: &[f64],
        displacement: &mut [f64],
    ) -> Result<(), Error> {
        self.run(|multiply| multiply.multiply_into(columns, forces, displacement))
    }

    fn multiply_rows_into(
        &mut self,
        columns: &[u32],
        forces: &[f64],
        n_first: usize,
        rows: &[u32],
        displacement: &mut [f64],
    ) -> Result<(), Error> {
        self.run(|multiply| {
            multiply.multiply_rows_into(columns, forces, n_first, rows, displacement)
        })
    }

    fn multiply_batch_into(
        &mut self,
        n_sets: usize,
        columns: &[u32],
        forces: &[f64],
        displacements: &mut [f64],
    ) -> Result<(), Error> {
        self.run(|multiply| multiply.multiply_batch_into(n_sets, columns, forces, displacements))
    }

    fn begin(&mut self, columns: &[u32], forces: &[f64]) -> Result<(), Error> {
        // The processor knows too what was asked for, should the adapter not answer.
        if self.gpu.is_some() {
            self.processor.begin(columns, forces)?;
        }
        self.run(|multiply| multiply.begin(columns, forces))
    }

    fn newest_into(&mut self, displacement: &mut [f64]) -> Result<bool, Error> {
        self.run(|multiply| multiply.newest_into(displacement))
    }

    fn take_remark(&mut self) -> Option<String> {
        self.remark.take()
    }
}

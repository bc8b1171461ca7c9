//! The back-end on a graphics adapter.

use std::time::{Duration, Instant};

use half::f16;

use crate::adapters::Adapter;
use crate::connection::Connection;
use crate::error::Error;
use crate::layout::{Layout, check_length};
use crate::multiply::{ComplianceMultiply, check, check_displacement, check_rows};
use crate::plan::{Job, Panels, Planner, Storage};
use crate::scaling::power_of_two_below;
use crate::worker::{Answer, Order, Preparing, Worker};

/// One frame of a display: whoever draws waits no longer for a product than this.
pub const FRAME: Duration = Duration::from_micros(16_667);

/// Where the longest product takes longer than half a frame, a wait is this many times as long.
const SLOWEST: u32 = 4;

/// A software adapter shares the processor with everything else that runs there; it does not hang, but waits for its
/// turn.
const SOFTWARE: Duration = Duration::from_secs(5);

/// Bytes that are written at a time; more would pile up in the driver.
const STRETCH: usize = 16 << 20;

/// Products from which a round trip is measured.
const ROUND_TRIPS: usize = 21;

/// How a compliance is kept on a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GpuSettings {
    /// Numbers of the compliance.
    pub storage: Storage,
    /// Bytes of a binding at most; the adapter's limit if `None`. A smaller one cuts the compliance into more panels.
    pub binding_limit: Option<u64>,
    /// How long a call waits for the driver; measured if `None`, see [`Gpu::patience`].
    pub patience: Option<Duration>,
}

impl Default for GpuSettings {
    /// 32 bits, the adapter's limit.
    fn default() -> Self {
        Self {
            storage: Storage::F32,
            binding_limit: None,
            patience: None,
        }
    }
}

/// The multiply on a graphics adapter: compliance in 32 or 16 bits, compensated sums in 32 bits.
///
/// Each column and the forces are brought near 1 by powers of two, so the result does not depend on the unit. With
/// 32-bit storage compliance, force and products are rounded once each, so
///
/// ```text
/// |u - u₆₄| ≤ 6 · 2⁻²⁴ Σ_j |C_ij| |f_j|
/// ```
/// beside second-order terms and numbers 2⁻¹²⁶ of the largest. With 16 bits 2⁻¹¹ takes the place of the factor.
///
/// Calls into the driver are made on a thread of its own; a call here waits for it no longer than [`Gpu::patience`],
/// and fails with [`Error::TimedOut`] then. [`Guarded`](crate::Guarded) takes the processor instead.
/// No buffer and no binding is made in a call, the first batch excepted, and each call is one submission.
pub struct Gpu {
    name: String,
    layout: Layout,
    panels: Panels,
    storage: Storage,
    planner: Planner,
    job: Job,
    batch_job: Option<Job>,
    worker: Worker,
    displacement: wgpu::Buffer,
    patience: Duration,
    round_trip: Duration,
    /// Where more rows are listed than there are: the whole surface.
    whole: Vec<f64>,
}

impl Gpu {
    /// Opens a device of the adapter and writes a compliance into its memory; blocks as in [`Layout`], m/N.
    ///
    /// # Errors
    /// Those of [`Layout`]; [`Error::OutOfMemory`], [`Error::Refused`], [`Error::DeviceLost`] and [`Error::TimedOut`]
    /// for what the driver says or does not say.
    pub fn new(
        adapter: &Adapter,
        layout: Layout,
        blocks: &[&[f64]],
        settings: GpuSettings,
    ) -> Result<Self, Error> {
        if settings.storage == Storage::F16 && !adapter.unpacks_16_bits() {
            return Err(Error::Refused {
                adapter: adapter.name(),
                reason: "its shaders cannot unpack 16-bit numbers; use 32 bits".to_owned(),
            });
        }
        let opened = adapter.clone();
        let limit = adapter.binding_limit();
        let open = move || Connection::open(&opened);
        Self::opened(
            adapter.name(),
            adapter.is_software(),
            limit,
            open,
            layout,
            blocks,
            settings,
        )
    }

    /// The same on a device that is open already: the viewer's.
    ///
    /// # Errors
    /// As [`Gpu::new`].
    pub fn on_device(
        connection: Connection,
        layout: Layout,
        blocks: &[&[f64]],
        settings: GpuSettings,
    ) -> Result<Self, Error> {
        let limits = connection.device.limits();
        let limit = limits
            .max_storage_buffer_binding_size
            .min(limits.max_buffer_size);
        let (name, is_software) = (connection.name.clone(), connection.is_software());
        let open = move || Ok(connection);
        Self::opened(name, is_software, limit, open, layout, blocks, settings)
    }

    fn opened(
        name: String,
        is_software: bool,
        limit: u64,
        open: impl FnOnce() -> Result<Connection, Error> + Send + 'static,
        layout: Layout,
        blocks: &[&[f64]],
        settings: GpuSettings,
    ) -> Result<Self, Error> {
        layout.check_blocks(blocks)?;
        let storage = settings.storage;
        let limit = settings.binding_limit.map_or(limit, |own| own.min(limit));
        let panels = Panels::new(layout, storage, limit)?;
        let empty = Job::empty(&panels, 1);
        let preparing = Preparing::start(name.clone(), open, panels, storage, empty.clone())?;
        let ready = preparing.ready()?;
        let units = upload(&preparing, layout, blocks, panels, storage)?;
        let mut gpu = Self {
            name: format!("GPU, {name}, {} bits", 8 * storage.bytes()),
            layout,
            panels,
            storage,
            planner: Planner::new(panels, units, is_software),
            job: empty,
            batch_job: None,
            worker: preparing.finish(),
            displacement: ready.displacement,
            patience: crate::worker::PREPARING,
            round_trip: Duration::ZERO,
            whole: Vec::new(),
        };
        let longest = gpu.measure_round_trip()?;
        gpu.patience = settings.patience.unwrap_or(if is_software {
            SOFTWARE.max(longest * SLOWEST)
        } else {
            FRAME.max(longest * SLOWEST)
        });
        Ok(gpu)
    }

    /// How long a call waits for the driver: a frame of a display; more where the product with all candidates takes a
    /// large part of that, and on a software adapter.
    pub fn patience(&self) -> Duration {
        self.patience
    }

    /// Median time of a product with one contact, from the call to the numbers.
    pub fn round_trip(&self) -> Duration {
        self.round_trip
    }

    /// How the compliance is kept.
    pub fn storage(&self) -> Storage {
        self.storage
    }

    /// Parts that the compliance was cut into, each as large as a binding may be.
    pub fn n_panels(&self) -> usize {
        self.panels.n_panels
    }

    /// The displacement on the device, 32-bit numbers, 3 for each row, m: vertices for whoever draws on the same
    /// device. It holds the last product that was finished.
    pub fn displacement_buffer(&self) -> &wgpu::Buffer {
        &self.displacement
    }

    /// Computes a displacement and leaves it on the device, in [`Gpu::displacement_buffer`]. Returns once the work is
    /// submitted: what the same queue is given afterwards sees it.
    ///
    /// # Errors
    /// As [`ComplianceMultiply::multiply_into`].
    pub fn multiply_on_device(&mut self, columns: &[u32], forces: &[f64]) -> Result<(), Error> {
        check(self.layout, columns, forces, 1)?;
        self.planner.write(columns, forces, None, &mut self.job);
        let number = self.worker.leave(&mut self.job, Order::Leave)?;
        self.worker.wait(number, self.patience)
    }

    /// Computes a displacement so many times in one submission and waits for it, without reading back: what a product
    /// takes on the device itself. For benchmarks.
    ///
    /// # Errors
    /// As [`ComplianceMultiply::multiply_into`].
    pub fn repeat_on_device(
        &mut self,
        times: u32,
        columns: &[u32],
        forces: &[f64],
    ) -> Result<(), Error> {
        check(self.layout, columns, forces, 1)?;
        self.planner.write(columns, forces, None, &mut self.job);
        let number = self.worker.leave(&mut self.job, Order::Repeat(times))?;
        self.worker.wait(number, crate::worker::PREPARING)
    }

    /// Whether a product is not done yet.
    pub(crate) fn is_busy(&self) -> bool {
        self.worker.is_busy()
    }

    /// Closes the device without waiting for that; every call fails then.
    pub(crate) fn stop(&self) {
        self.worker.stop();
    }

    /// Measures the round trip. The time of the product with all candidates, which reads the whole matrix.
    fn measure_round_trip(&mut self) -> Result<Duration, Error> {
        let all: Vec<u32> = (0..self.layout.n_candidates() as u32).collect();
        let forces = vec![1.0; 3 * all.len()];
        let one = all.len().min(1);
        let mut u = vec![0.0; self.layout.displacement_len()];
        let mut timed = |gpu: &mut Self, n: usize| {
            let begun = Instant::now();
            gpu.multiply_into(&all[..n], &forces[..3 * n], &mut u)
                .map(|()| begun.elapsed())
        };
        // Some drivers compile a shader when it is first used.
        timed(self, one)?;
        let mut times = [Duration::ZERO; ROUND_TRIPS];
        for time in &mut times {
            *time = timed(self, one)?;
        }
        times.sort_unstable();
        self.round_trip = times[ROUND_TRIPS / 2];
        let longest = timed(self, all.len())?.max(times[ROUND_TRIPS - 1]);
        self.multiply_rows_into(&all[..one], &forces[..3 * one], 1, &[], &mut u)?;
        Ok(longest)
    }

    /// Leaves the job that was written and hands its answer to `take`.
    fn ask(&mut self, take: impl FnOnce(&Answer)) -> Result<(), Error> {
        let number = self.worker.leave(&mut self.job, Order::Wait)?;
        self.worker.wait(number, self.patience)?;
        self.worker.take(take);
        Ok(())
    }
}

/// Writes the compliance, some candidates at a time. The unit of each column.
fn upload(
    preparing: &Preparing,
    layout: Layout,
    blocks: &[&[f64]],
    panels: Panels,
    storage: Storage,
) -> Result<Vec<f64>, Error> {
    let n_candidates = layout.n_candidates();
    let of_candidate = 3 * panels.stride * storage.bytes() as usize;
    let at_once = (STRETCH / of_candidate).max(1);
    let mut units = Vec::with_capacity(3 * n_candidates);
    let mut bytes = Vec::with_capacity(at_once.min(n_candidates) * of_candidate);
    for first in (0..n_candidates).step_by(at_once) {
        bytes.clear();
        for candidate in first..(first + at_once).min(n_candidates) {
            for axis in 0..3 {
                let column = || layout.column_from_blocks(blocks, candidate, axis);
                let unit = power_of_two_below(column().fold(0.0, |m: f64, c| m.max(c.abs())));
                units.push(unit);
                let end = bytes.len() + panels.stride * storage.bytes() as usize;
                for c in column() {
                    match storage {
                        Storage::F32 => bytes.extend(((c / unit) as f32).to_ne_bytes()),
                        Storage::F16 => bytes.extend(f16::from_f64(c / unit).to_ne_bytes()),
                    }
                }
                bytes.resize(end, 0);
            }
        }
        bytes = preparing.upload(first, bytes)?;
    }
    Ok(units)
}

/// Writes an answer as displacements in m.
fn write(answer: &Answer, displacement: &mut [f64]) {
    for (u, number) in displacement.iter_mut().zip(&answer.numbers) {
        *u = f64::from(*number) * answer.scale;
    }
}

impl ComplianceMultiply for Gpu {
    fn name(&self) -> &str {
        &self.name
    }

    fn bytes(&self) -> u64 {
        3 * (self.layout.n_candidates() * self.panels.stride) as u64 * self.storage.bytes()
    }

    fn layout(&self) -> Layout {
        self.layout
    }

    fn multiply_into(
        &mut self,
        columns: &[u32],
        forces: &[f64],
        displacement: &mut [f64],
    ) -> Result<(), Error> {
        check(self.layout, columns, forces, 1)?;
        check_displacement(self.layout, displacement)?;
        self.planner.write(columns, forces, None, &mut self.job);
        self.ask(|answer| write(answer, displacement))
    }

    fn multiply_rows_into(
        &mut self,
        columns: &[u32],
        forces: &[f64],
        n_first: usize,
        rows: &[u32],
        displacement: &mut [f64],
    ) -> Result<(), Error> {
        check(self.layout, columns, forces, 1)?;
        check_displacement(self.layout, displacement)?;
        check_rows(self.layout, n_first, rows)?;
        let listed = rows.iter().map(|row| 3 * *row as usize);
        if n_first + rows.len() > self.layout.n_rows() {
            // Some are listed twice; there is room for each row once.
            let mut whole = std::mem::take(&mut self.whole);
            whole.resize(displacement.len(), 0.0);
            let computed = self.multiply_into(columns, forces, &mut whole);
            if computed.is_ok() {
                displacement[..3 * n_first].copy_from_slice(&whole[..3 * n_first]);
                for row in listed {
                    displacement[row..row + 3].copy_from_slice(&whole[row..row + 3]);
                }
            }
            self.whole = whole;
            return computed;
        }
        if n_first + rows.len() == 0 {
            return Ok(());
        }
        self.planner
            .write(columns, forces, Some((n_first, rows)), &mut self.job);
        self.ask(|answer| {
            write(answer, &mut displacement[..3 * n_first]);
            for (row, numbers) in listed.zip(answer.numbers[3 * n_first..].chunks_exact(3)) {
                for (u, number) in displacement[row..row + 3].iter_mut().zip(numbers) {
                    *u = f64::from(*number) * answer.scale;
                }
            }
        })
    }

    fn multiply_batch_into(
        &mut self,
        n_sets: usize,
        columns: &[u32],
        forces: &[f64],
        displacements: &mut [f64],
    ) -> Result<(), Error> {
        check(self.layout, columns, forces, n_sets)?;
        let n = self.layout.displacement_len();
        check_length("displacements", displacements.len(), n_sets * n)?;
        if columns.is_empty() {
            displacements.fill(0.0);
            return Ok(());
        }
        let at_once = self.panels.room;
        let of_set = 3 * columns.len();
        let panels = self.panels;
        let mut job = self
            .batch_job
            .take()
            .unwrap_or_else(|| Job::empty(&panels, at_once));
        let result = forces
            .chunks(at_once * of_set)
            .zip(displacements.chunks_mut(at_once * n))
            .try_for_each(|(forces, displacements)| {
                self.planner
                    .write_batch(forces.len() / of_set, columns, forces, &mut job);
                let number = self.worker.leave(&mut job, Order::Wait)?;
                // Nobody draws a batch, and it may take longer than a frame.
                self.worker.wait(number, crate::worker::PREPARING)?;
                self.worker.take(|answer| {
                    let sets = answer.numbers.chunks_exact(panels.stride);
                    for (u, numbers) in displacements.chunks_exact_mut(n).zip(sets) {
                        for (u, number) in u.iter_mut().zip(numbers) {
                            *u = f64::from(*number) * answer.scale;
                        }
                    }
                });
                Ok(())
            });
        self.batch_job = Some(job);
        result
    }

    fn begin(&mut self, columns: &[u32], forces: &[f64]) -> Result<(), Error> {
        check(self.layout, columns, forces, 1)?;
        self.planner.write(columns, forces, None, &mut self.job);
        self.worker.leave(&mut self.job, Order::Later).map(|_| ())
    }

    fn newest_into(&mut self, displacement: &mut [f64]) -> Result<bool, Error> {
        check_displacement(self.layout, displacement)?;
        self.worker
            .take_newest(self.patience, |answer| write(answer, displacement))
    }
}

#[cfg(test)]
mod tests;

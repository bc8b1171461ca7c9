//! The compliance on a device and the passes over it: buffers, pipelines, one submission for each product.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bytemuck::cast_slice;
use wgpu::BufferUsages;

use crate::connection::{Connection, READ_ONLY, REDUCE, STORAGE};
use crate::error::Error;
use crate::plan::{Job, Kind, Panels, Storage};

/// Threads of a workgroup in the shaders.
const WORKGROUP: usize = 64;

/// A stretch of columns takes no longer than this to be written.
const UPLOAD: Duration = Duration::from_secs(30);

/// The compliance on a device.
pub(crate) struct OnDevice {
    pub(crate) connection: Connection,
    panels: Panels,
    storage: Storage,
    compliance: Vec<wgpu::Buffer>,
    /// The number of each panel, as the shader reads it.
    which: Vec<wgpu::Buffer>,
    partials: wgpu::Buffer,
    /// m, 3 for each row; of the last whole product or of the rows that were asked for.
    pub(crate) displacement: wgpu::Buffer,
    job: wgpu::Buffer,
    /// Mapped between two products: what is written there is copied to `job` on the device.
    upload: wgpu::Buffer,
    /// The submission after which it is mapped again, and whether it is.
    uploaded: Option<(wgpu::SubmissionIndex, Mapped)>,
    read_back: wgpu::Buffer,
    multiply_layout: wgpu::BindGroupLayout,
    reduce_layout: wgpu::BindGroupLayout,
    of_panels: Vec<wgpu::BindGroup>,
    of_reduce: wgpu::BindGroup,
    whole: wgpu::ComputePipeline,
    some_rows: wgpu::ComputePipeline,
    batch: wgpu::ComputePipeline,
    reduce: wgpu::ComputePipeline,
}

impl OnDevice {
    /// Makes buffers and pipelines; the compliance is not there yet.
    ///
    /// # Errors
    /// Where the device refuses, or has not the memory.
    pub(crate) fn new(
        connection: Connection,
        panels: Panels,
        storage: Storage,
    ) -> Result<Self, Error> {
        let c = &connection;
        let of_candidate = 3 * panels.stride as u64 * storage.bytes();
        let n_candidates = panels.layout.n_candidates();
        let bytes = of_candidate * n_candidates as u64;
        let u = u64::from(u32::BITS / 8);
        let column = panels.stride as u64 * u;
        let make = || {
            let in_storage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
            let compliance: Vec<_> = (0..panels.n_panels)
                .map(|panel| {
                    let size = panels.candidates_of(panel).len() as u64 * of_candidate;
                    c.buffer("compliance", size, in_storage)
                })
                .collect();
            let which: Vec<_> = (0..panels.n_panels)
                .map(|_| {
                    c.buffer(
                        "panel",
                        4 * u,
                        BufferUsages::UNIFORM | BufferUsages::COPY_DST,
                    )
                })
                .collect();
            for (panel, buffer) in (0_u32..).zip(&which) {
                c.queue
                    .write_buffer(buffer, 0, cast_slice(&[panel, 0, 0, 0]));
            }
            let partials = panels.room as u64 * column;
            let partials = c.buffer(
                "partial sums",
                partials,
                in_storage | BufferUsages::COPY_SRC,
            );
            // Drawn as vertices where the viewer has the same device.
            let drawn = in_storage | BufferUsages::COPY_SRC | BufferUsages::VERTEX;
            let displacement = c.buffer("displacement", column, drawn);
            let job = c.buffer("job", panels.job_words(1) as u64 * u, in_storage);
            let upload = upload_buffer(c, job.size());
            let to_read = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
            let read_back = c.buffer("read back", column, to_read);
            let uniform = wgpu::BufferBindingType::Uniform;
            let multiply_layout = c.bind_group_layout(&[READ_ONLY, READ_ONLY, STORAGE, uniform]);
            let reduce_layout = c.bind_group_layout(&[READ_ONLY, READ_ONLY, STORAGE]);
            let shader = match storage {
                Storage::F32 => 0,
                Storage::F16 => 1,
            };
            let multiply = |entry| c.pipeline(shader, entry, &multiply_layout);
            let (whole, some_rows, batch) =
                (multiply("whole"), multiply("some_rows"), multiply("batch"));
            let reduce = c.pipeline(REDUCE, "reduce", &reduce_layout);
            let of_reduce = c.bind(&reduce_layout, &[&job, &partials, &displacement]);
            Self {
                connection: connection.clone(),
                panels,
                storage,
                compliance,
                which,
                partials,
                displacement,
                job,
                upload,
                uploaded: None,
                read_back,
                multiply_layout,
                reduce_layout,
                of_panels: Vec::new(),
                of_reduce,
                whole,
                some_rows,
                batch,
                reduce,
            }
        };
        let mut made = c.scoped(bytes, make)?;
        c.scoped(bytes, || made.bind())?;
        Ok(made)
    }

    /// Binds the buffers as they are now.
    fn bind(&mut self) {
        let Self {
            connection: c,
            compliance,
            which,
            job,
            partials,
            displacement,
            ..
        } = self;
        let of_panel = |(panel, which): (&wgpu::Buffer, &wgpu::Buffer)| {
            c.bind(&self.multiply_layout, &[panel, job, partials, which])
        };
        self.of_panels = compliance.iter().zip(&*which).map(of_panel).collect();
        self.of_reduce = c.bind(&self.reduce_layout, &[job, partials, displacement]);
    }

    /// Writes candidates that follow each other, from `first` on: their columns as they are kept.
    ///
    /// # Errors
    /// Where the device refuses or is lost.
    pub(crate) fn upload(&self, first: usize, columns: &[u8]) -> Result<(), Error> {
        let c = &self.connection;
        let of_candidate = 3 * self.panels.stride * self.storage.bytes() as usize;
        c.scoped(columns.len() as u64, || {
            for (k, bytes) in columns.chunks_exact(of_candidate).enumerate() {
                let candidate = first + k;
                let panel = candidate / self.panels.per_panel;
                let local = candidate % self.panels.per_panel;
                let offset = (local * of_candidate) as u64;
                c.queue.write_buffer(&self.compliance[panel], offset, bytes);
            }
        })?;
        // What waits to be copied does not pile up.
        let submission = c.queue.submit([]);
        c.wait(submission, UPLOAD)
    }

    /// Submits a product, to be read back or to stay on the device.
    pub(crate) fn submit(&mut self, job: &Job, reads_back: bool) -> Result<Submitted, Error> {
        self.submit_repeated(job, 1, reads_back)
    }

    /// The same, computed so many times.
    pub(crate) fn submit_repeated(
        &mut self,
        job: &Job,
        times: u32,
        reads_back: bool,
    ) -> Result<Submitted, Error> {
        self.make_room(job)?;
        self.wait_for_upload()?;
        let c = &self.connection;
        let of_job = 4 * job.words.len() as u64;
        self.upload
            .get_mapped_range_mut(0..of_job)
            .map_err(|error| c.refused(error.to_string()))?
            .copy_from_slice(cast_slice(&job.words));
        self.upload.unmap();
        let mut encoder = c
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&self.upload, 0, &self.job, 0, of_job);
        let bytes = if reads_back { 4 * job.n_out as u64 } else { 0 };
        let source = {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            let groups = |n: usize| n.div_ceil(WORKGROUP) as u32;
            let fours = groups(self.panels.stride / 4);
            let (pipeline, x, y) = match job.kind {
                Kind::Whole => (&self.whole, fours, job.n_slices),
                Kind::SomeRows => (&self.some_rows, groups(job.n_out), job.n_slices),
                Kind::Batch(n_sets) => (&self.batch, fours, n_sets.div_ceil(4)),
            };
            let reduces = !matches!(job.kind, Kind::Batch(_));
            for _ in 0..times {
                pass.set_pipeline(pipeline);
                for panel in &job.panels {
                    pass.set_bind_group(0, &self.of_panels[*panel], &[]);
                    pass.dispatch_workgroups(x, y as u32, 1);
                }
                if reduces {
                    pass.set_pipeline(&self.reduce);
                    pass.set_bind_group(0, &self.of_reduce, &[]);
                    pass.dispatch_workgroups(groups(job.n_out), 1, 1);
                }
            }
            if reduces {
                &self.displacement
            } else {
                &self.partials
            }
        };
        let mapped = Mapped::default();
        if bytes > 0 {
            encoder.copy_buffer_to_buffer(source, 0, &self.read_back, 0, bytes);
            let to_read = 0..bytes;
            let told = mapped.teller();
            encoder.map_buffer_on_submit(&self.read_back, wgpu::MapMode::Read, to_read, told);
        }
        let upload_mapped = Mapped::default();
        let told = upload_mapped.teller();
        encoder.map_buffer_on_submit(&self.upload, wgpu::MapMode::Write, .., told);
        let submission = c.queue.submit([encoder.finish()]);
        self.uploaded = Some((submission.clone(), upload_mapped));
        c.check()?;
        Ok(Submitted {
            submission,
            mapped,
            bytes,
        })
    }

    /// Waits for a product that is read back and copies its numbers, as they are on the device.
    pub(crate) fn read(
        &self,
        submitted: Submitted,
        most: Duration,
        numbers: &mut Vec<f32>,
    ) -> Result<(), Error> {
        let c = &self.connection;
        numbers.clear();
        c.wait(submitted.submission, most)?;
        if submitted.bytes == 0 {
            return Ok(());
        }
        if !submitted.mapped.is_mapped() {
            return Err(c.refused("the result could not be mapped".to_owned()));
        }
        let range = self.read_back.get_mapped_range(0..submitted.bytes);
        numbers.extend_from_slice(cast_slice(&range.map_err(|e| c.refused(e.to_string()))?));
        self.read_back.unmap();
        Ok(())
    }

    /// Waits until the job before has been read, so that the next can be written.
    fn wait_for_upload(&mut self) -> Result<(), Error> {
        let Some((submission, mapped)) = self.uploaded.take() else {
            return Ok(());
        };
        if !mapped.is_mapped() {
            self.connection.wait(submission, UPLOAD)?;
        }
        if mapped.is_mapped() {
            Ok(())
        } else {
            let reason = "the job's buffer could not be mapped".to_owned();
            Err(self.connection.refused(reason))
        }
    }

    /// Larger buffers for the first batch; the same ones afterwards.
    fn make_room(&mut self, job: &Job) -> Result<(), Error> {
        let (of_job, of_result) = (4 * job.words.capacity() as u64, 4 * job.n_out as u64);
        if of_job <= self.job.size() && of_result <= self.read_back.size() {
            return Ok(());
        }
        self.wait_for_upload()?;
        let c = self.connection.clone();
        let bytes = 2 * of_job + of_result;
        c.scoped(bytes, || {
            if of_job > self.job.size() {
                self.job = c.buffer("job", of_job, self.job.usage());
                self.upload = upload_buffer(&c, of_job);
            }
            if of_result > self.read_back.size() {
                self.read_back = c.buffer("read back", of_result, self.read_back.usage());
            }
            self.bind();
        })
    }
}

/// A product on its way.
pub(crate) struct Submitted {
    submission: wgpu::SubmissionIndex,
    mapped: Mapped,
    bytes: u64,
}

/// Whether a buffer is mapped; false as long as it is not, and for good where that failed.
#[derive(Clone, Default)]
struct Mapped(Arc<AtomicBool>);

impl Mapped {
    fn is_mapped(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }

    /// What the device calls when it has tried.
    fn teller(&self) -> impl FnOnce(Result<(), wgpu::BufferAsyncError>) + Send + 'static {
        let mapped = Arc::clone(&self.0);
        move |result| mapped.store(result.is_ok(), Ordering::Release)
    }
}

/// A buffer of so many bytes that is mapped to be written.
fn upload_buffer(c: &Connection, size: u64) -> wgpu::Buffer {
    c.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("upload"),
        size,
        usage: BufferUsages::MAP_WRITE | BufferUsages::COPY_SRC,
        mapped_at_creation: true,
    })
}

#[cfg(test)]
impl OnDevice {
    /// Writes NaN where results go, so that a number that is not written is seen.
    pub(crate) fn poison(&self) -> Result<(), Error> {
        let c = &self.connection;
        for buffer in [&self.partials, &self.displacement] {
            let numbers = vec![f32::NAN; buffer.size() as usize / 4];
            c.queue.write_buffer(buffer, 0, cast_slice(&numbers));
        }
        c.check()
    }

    /// Binds a buffer for what it was not made for.
    pub(crate) fn misuse(&self) -> Result<(), Error> {
        self.connection
            .bind(&self.reduce_layout, &[&self.read_back; 3]);
        self.connection.check()
    }
}

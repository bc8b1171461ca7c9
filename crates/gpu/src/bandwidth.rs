//! The memory bandwidth of an adapter, measured with a kernel that copies: what the multiply is compared with.

use std::time::{Duration, Instant};

use wgpu::BufferUsages;

use crate::adapters::Adapter;
use crate::connection::{COPY, Connection, READ_ONLY, STORAGE};
use crate::error::Error;

/// Copies in one submission, so that submitting is a small part of the time.
const REPEATS: u32 = 10;

/// Submissions from which the median is taken, and how long one may take.
const SUBMISSIONS: usize = 9;
const LONGEST: Duration = Duration::from_secs(30);

/// Workgroups of a copy: more than run at once on any adapter, fewer than a grid may have.
const WORKGROUPS: u32 = 16_384;

/// Bytes read and written in a second by a copy of a buffer of `bytes`, or of the largest that the adapter binds.
///
/// For benchmarks: unlike a product it waits for the driver on the caller's thread.
///
/// # Errors
/// What the driver says.
pub fn copy_bandwidth(adapter: &Adapter, bytes: u64) -> Result<f64, Error> {
    let connection = Connection::open(adapter)?;
    let c = &connection;
    let bytes = bytes.min(adapter.binding_limit()).max(16) / 16 * 16;
    let (pipeline, group) = c.scoped(2 * bytes, || {
        let layout = c.bind_group_layout(&[READ_ONLY, STORAGE]);
        let [from, to] = ["from", "to"].map(|label| c.buffer(label, bytes, BufferUsages::STORAGE));
        let group = c.bind(&layout, &[&from, &to]);
        (c.pipeline(COPY, "copy", &layout), group)
    })?;
    let submit = || -> Result<f64, Error> {
        let begun = Instant::now();
        let mut encoder = c
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        for _ in 0..REPEATS {
            let fours = (bytes / 16).div_ceil(64);
            pass.dispatch_workgroups((fours as u32).min(WORKGROUPS), 1, 1);
        }
        drop(pass);
        let submission = c.queue.submit([encoder.finish()]);
        c.wait(submission, LONGEST)?;
        Ok(begun.elapsed().as_secs_f64() / f64::from(REPEATS))
    };
    submit()?;
    let mut times = [0.0; SUBMISSIONS];
    for time in &mut times {
        *time = submit()?;
    }
    times.sort_by(f64::total_cmp);
    Ok(2.0 * bytes as f64 / times[SUBMISSIONS / 2])
}

//! The dense multiply of the display: surface compliance times contact forces.
//!
//! ```text
//! u = Σ_j C[:, j] f_j        j over the candidates that carry force
//! ```
//! C is the compliance of the whole surface under unit forces at the candidates (m/N), f the forces (N),
//! u the displacement of the surface (m). The product reads each number of C once, so what counts is
//! how much memory is read and in which order. [`Layout`] says where each number lies,
//! [`ComplianceMultiply`] is what a back-end offers, [`Cpu`] the back-end on the processor with C kept in 64 or
//! 32 bits, [`Gpu`] the one on a graphics adapter with C in 32 or 16 bits, and [`Guarded`] the second with the first
//! behind it. [`Adapters`] says which adapters are there, [`compare`] which of two back-ends is faster.
//!
//! # Example
//!
//! Two rows, one candidate (row 0), compliance 2 mm/N at itself and 1 mm/N at the other row, along each
//! axis:
//!
//! ```
//! use gpu::{ComplianceMultiply, Layout, Scalar, on_cpu};
//!
//! # fn main() -> Result<(), gpu::Error> {
//! let layout = Layout::new(2, 1)?;
//! let mut blocks = vec![0.0; layout.n_scalars()];
//! for (row, compliance) in [(0, 2e-3), (1, 1e-3)] {
//!     for axis in 0..3 {
//!         blocks[Layout::block_offset(2, row, 0) + 4 * axis] = compliance;
//!     }
//! }
//! let mut multiply = on_cpu(layout, &[&blocks], Scalar::F64)?;
//!
//! let mut displacement = [0.0; 6];
//! multiply.multiply_into(&[0], &[0.0, 0.0, -10.0], &mut displacement)?;
//! assert_eq!(displacement, [0.0, 0.0, -0.02, 0.0, 0.0, -0.01]);
//! # Ok(())
//! # }
//! ```
#![cfg_attr(
    test,
    allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")
)]

mod adapters;
mod bandwidth;
mod connection;
mod cpu;
mod error;
mod gpu;
mod guarded;
mod layout;
mod multiply;
#[cfg(test)]
mod numbers;
mod plan;
mod scaling;
mod select;
mod wgpu_backend;
mod worker;

pub use adapters::{Adapter, Adapters};
pub use bandwidth::copy_bandwidth;
pub use connection::Connection;
pub use cpu::{Cpu, Stored, on_cpu, on_cpu_with_threads};
pub use error::Error;
pub use gpu::{FRAME, Gpu, GpuSettings};
pub use guarded::Guarded;
pub use layout::Layout;
pub use multiply::{ComplianceMultiply, Scalar};
pub use plan::Storage;
pub use select::{Compared, compare};

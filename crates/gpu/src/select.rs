//! Which of two back-ends is faster for a compliance: measured, not reckoned.

use std::time::Instant;

use crate::error::Error;
use crate::gpu::Gpu;
use crate::multiply::ComplianceMultiply;
use crate::plan::Storage;

/// Contacts of the measured products: what a snap has at its crest.
const TYPICAL_CONTACTS: usize = 16;

/// Calls from which a median is taken.
const CALLS: usize = 21;

/// Two back-ends side by side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compared {
    /// Contacts of the products.
    pub n_contacts: usize,
    /// Median time of a product on the processor, s.
    pub processor_s: f64,
    /// Median time of a product on the adapter, from the call to the numbers, s.
    pub gpu_s: f64,
    /// Largest difference between the two, over the largest displacement.
    pub difference: f64,
}

impl Compared {
    /// Whether the adapter is the faster one.
    #[must_use]
    pub fn gpu_wins(&self) -> bool {
        self.gpu_s < self.processor_s
    }
}

/// Measures products of a few contacts, other columns in each, and compares the results.
///
/// # Errors
/// Those of the products; [`Error::Wrong`] where the results differ by more than the numbers' width explains, as with
/// a driver that is broken.
pub fn compare(processor: &mut dyn ComplianceMultiply, gpu: &mut Gpu) -> Result<Compared, Error> {
    let layout = processor.layout();
    let n_contacts = TYPICAL_CONTACTS.min(layout.n_candidates());
    let columns_of = |call: usize| -> Vec<u32> {
        (0..n_contacts)
            .map(|k| {
                ((k * layout.n_candidates() / n_contacts + call) % layout.n_candidates()) as u32
            })
            .collect()
    };
    // Each contact along one axis, so that the terms of a sum are known.
    let mut forces = vec![0.0; 3 * n_contacts];
    for k in 0..n_contacts {
        forces[3 * k + k % 3] = 1.0;
    }
    let mut u = vec![0.0; layout.displacement_len()];
    let mut other = u.clone();
    let columns = columns_of(0);
    let mut terms = vec![0.0; u.len()];
    for (column, force) in columns.iter().zip(forces.chunks_exact(3)) {
        processor.multiply_into(&[*column], force, &mut u)?;
        for (terms, u) in terms.iter_mut().zip(&u) {
            *terms += u.abs();
        }
    }
    processor.multiply_into(&columns, &forces, &mut u)?;
    gpu.multiply_into(&columns, &forces, &mut other)?;
    let largest = |x: &[f64]| x.iter().fold(f64::MIN_POSITIVE, |m, x| m.max(x.abs()));
    let apart = |(a, b): (&f64, &f64)| {
        if b.is_finite() {
            (a - b).abs()
        } else {
            f64::INFINITY
        }
    };
    let apart = u.iter().zip(&other).map(apart).fold(0.0, f64::max);
    let difference = apart / largest(&u);
    // The processor's own numbers may be of 32 bits too.
    if apart > 2.0 * rounding(gpu.storage()) * largest(&terms) {
        return Err(Error::Wrong {
            adapter: gpu.name().to_owned(),
            error: difference,
        });
    }
    let mut median = |multiply: &mut dyn ComplianceMultiply| -> Result<f64, Error> {
        let mut times = [0.0; CALLS];
        for (call, time) in times.iter_mut().enumerate() {
            let columns = columns_of(call);
            let begun = Instant::now();
            multiply.multiply_into(&columns, &forces, &mut u)?;
            *time = begun.elapsed().as_secs_f64();
        }
        times.sort_by(f64::total_cmp);
        Ok(times[CALLS / 2])
    };
    Ok(Compared {
        n_contacts,
        processor_s: median(processor)?,
        gpu_s: median(gpu)?,
        difference,
    })
}

/// Of the sum of the terms' magnitudes, what rounding can make of a product.
fn rounding(storage: Storage) -> f64 {
    match storage {
        Storage::F32 => 6.0 * 2_f64.powi(-24),
        Storage::F16 => 2_f64.powi(-11),
    }
}

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
    // Forces of both signs would leave a small sum of large terms: more difference than a contact has.
    let forces = vec![1.0; 3 * n_contacts];
    let mut u = vec![0.0; layout.displacement_len()];
    let mut other = u.clone();
    let columns = columns_of(0);
    processor.multiply_into(&columns, &forces, &mut u)?;
    gpu.multiply_into(&columns, &forces, &mut other)?;
    let largest = u.iter().fold(f64::MIN_POSITIVE, |m, u| m.max(u.abs()));
    let apart = |m: f64, (a, b): (&f64, &f64)| {
        if b.is_finite() {
            m.max((a - b).abs())
        } else {
            f64::INFINITY
        }
    };
    let difference = u.iter().zip(&other).fold(0.0, apart) / largest;
    if difference > explained(gpu.storage(), n_contacts) {
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

/// What rounding can make of a product: each term is at most the largest displacement of one force, and as large as
/// all of them together where they cancel.
fn explained(storage: Storage, n_contacts: usize) -> f64 {
    let of_term = match storage {
        Storage::F32 => 6.0 * 2_f64.powi(-24),
        Storage::F16 => 2_f64.powi(-11),
    };
    of_term * 3.0 * n_contacts as f64
}

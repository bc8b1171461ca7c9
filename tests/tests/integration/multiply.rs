//! The drawn displacement on graphics adapters: compliances of the shipped parts, against 64 bits on the processor.
//!
//! On every adapter that is found, software ones too; without one the test says "no adapter", and what is asked for
//! then is an error. Tolerance: 1e-6 of the largest displacement in 32 bits, a few roundings of 2⁻²⁴; with 16 bits
//! 2⁻¹¹ for each of the terms, which have one sign here at most places: 1e-3.

use gpu::{Adapters, ComplianceMultiply, Gpu, GpuSettings, Layout, Scalar, Storage, on_cpu};
use snapin::prepare::PreparedCompliance;
use snapin_tests::shipped;

/// Largest difference, of the largest displacement.
fn difference(found: &[f64], expected: &[f64]) -> f64 {
    let largest = expected.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
    assert!(largest > 0.0);
    // A number that was not written is as wrong as can be.
    let apart = |(a, b): (&f64, &f64)| {
        if a.is_nan() {
            f64::INFINITY
        } else {
            (a - b).abs()
        }
    };
    found.iter().zip(expected).map(apart).fold(0.0, f64::max) / largest
}

#[test]
fn compliances_of_the_shipped_parts_agree_on_every_adapter() {
    let adapters = Adapters::find();
    if adapters.list.is_empty() {
        eprintln!("no adapter: {adapters}");
        assert!(adapters.best(true).is_err());
    }
    for scene in ["clip.toml", "hook.toml"] {
        let part = shipped(scene).1;
        let PreparedCompliance::All(stored) = &part.compliance else {
            panic!("the shipped parts fit into memory");
        };
        let stretches = stored.stretches();
        let layout = Layout::new(part.loaded.rows.len(), part.loaded.candidates.len()).unwrap();
        let n_candidates = layout.n_candidates() as u32;
        let mut exact = on_cpu(layout, &stretches, Scalar::F64).unwrap();
        let mut expected = vec![0.0; layout.displacement_len()];
        let mut found = expected.clone();
        // One, a patch as of a contact, and all that can touch; forces as of a contact, towards the part.
        let lists: [Vec<u32>; 3] = [
            vec![n_candidates - 1],
            (0..11).collect(),
            (0..n_candidates).collect(),
        ];
        for adapter in &adapters.list {
            eprintln!("{scene} on {}", adapter.key());
            for (storage, tolerance) in [(Storage::F32, 1e-6), (Storage::F16, 1e-3)] {
                let settings = GpuSettings {
                    storage,
                    ..GpuSettings::default()
                };
                let mut gpu = Gpu::new(adapter, layout, &stretches, settings).unwrap();
                for columns in &lists {
                    let forces: Vec<f64> = columns
                        .iter()
                        .flat_map(|c| [0.1, -1.0 - f64::from(c % 7), 0.2 * f64::from(c % 3)])
                        .collect();
                    exact
                        .multiply_into(columns, &forces, &mut expected)
                        .unwrap();
                    found.fill(f64::NAN);
                    gpu.multiply_into(columns, &forces, &mut found).unwrap();
                    let difference = difference(&found, &expected);
                    eprintln!("{storage:?}, {} columns: {difference:.1e}", columns.len());
                    assert!(
                        difference < tolerance,
                        "{} columns: {difference:e}",
                        columns.len()
                    );
                }
                found.fill(f64::NAN);
                gpu.multiply_into(&[], &[], &mut found).unwrap();
                assert!(found.iter().all(|u| *u == 0.0));
            }
        }
    }
}

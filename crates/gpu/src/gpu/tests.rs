//! On every adapter that is found, software ones too. Without any, each test says so and checks what happens then.
//!
//! Tolerance: [`Gpu`]'s bound, number by number; and 1e-6 of the largest displacement for 32-bit storage, which is
//! what the drawn shape is held to.

use super::*;
use crate::multiply::Scalar;
use crate::numbers::Numbers;
use crate::{Adapters, on_cpu};

mod faults;

/// Runs `test` on every adapter. Without one: nothing can be opened, and that is an error with a reason.
fn on_each(test: impl Fn(&Adapter)) {
    let adapters = Adapters::find();
    for adapter in &adapters.list {
        eprintln!("on {}", adapter.key());
        test(adapter);
    }
    if adapters.list.is_empty() {
        eprintln!("no adapter: {adapters}");
        let error = adapters.best(true).unwrap_err();
        assert!(matches!(error, Error::NoAdapter { .. }));
        assert!(error.to_string().contains("looked for"), "{error}");
    }
}

/// Compliance between points of the surface of an elastic half-space, in a square of 1 mm pitch (Cerruti's and
/// Boussinesq's solutions: Johnson, Contact Mechanics, 1985, sections 3.2 and 3.6; E = 2 GPa, nu = 0.3), with r² + h²
/// in place of r² so that it is finite. Neighbouring columns nearly depend on each other.
fn half_space(n_rows: usize, n_candidates: usize) -> Vec<f64> {
    let side = (n_rows as f64).sqrt().ceil() as usize;
    let at = |k: usize| [1e-3 * (k % side) as f64, 1e-3 * (k / side) as f64];
    let (modulus, nu) = (2e9, 0.3);
    let factor = (1.0 + nu) / (std::f64::consts::PI * modulus);
    let mut blocks = Vec::with_capacity(9 * n_rows * n_candidates);
    for candidate in 0..n_candidates {
        for row in 0..n_rows {
            let (a, b) = (at(row), at(candidate));
            let (x, y) = (a[0] - b[0], a[1] - b[1]);
            let r = (x * x + y * y + 0.25e-6).sqrt();
            let cubed = r * r * r;
            let normal = factor * (1.0 - nu) / r;
            let shear = factor * nu * x * y / cubed;
            let tilt = factor * (1.0 - 2.0 * nu) / (2.0 * r * r);
            blocks.extend([normal + factor * nu * x * x / cubed, shear, -tilt * x]);
            blocks.extend([shear, normal + factor * nu * y * y / cubed, -tilt * y]);
            blocks.extend([tilt * x, tilt * y, normal]);
        }
    }
    blocks
}

/// Displacement in 64 bits, and the sums of magnitudes that rounding is relative to.
fn reference(
    layout: Layout,
    blocks: &[f64],
    columns: &[u32],
    forces: &[f64],
) -> (Vec<f64>, Vec<f64>) {
    let product = |blocks: &[f64], forces: &[f64]| {
        let mut u = vec![0.0; layout.displacement_len()];
        let mut multiply = on_cpu(layout, &[blocks], Scalar::F64).unwrap();
        multiply.multiply_into(columns, forces, &mut u).unwrap();
        u
    };
    let magnitudes = |x: &[f64]| x.iter().map(|x| x.abs()).collect::<Vec<f64>>();
    (
        product(blocks, forces),
        product(&magnitudes(blocks), &magnitudes(forces)),
    )
}

fn settings(storage: Storage) -> GpuSettings {
    GpuSettings {
        storage,
        ..GpuSettings::default()
    }
}

/// Compares a product with the reference: each number within the bound, and 1e-6 of the largest in 32 bits.
fn compare(u: &[f64], (exact, scale): &(Vec<f64>, Vec<f64>), storage: Storage, case: &str) {
    let rounding = match storage {
        Storage::F32 => 6.0 * 2_f64.powi(-24),
        // 2^-11 of numbers that are not denormal; those are below 2^-14 of their column's largest.
        Storage::F16 => 2_f64.powi(-11) + 6.0 * 2_f64.powi(-24),
    };
    let largest = exact.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
    let largest_scale = scale.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
    for ((u, exact), scale) in u.iter().zip(exact).zip(scale) {
        let denormal = if storage == Storage::F16 {
            2_f64.powi(-25)
        } else {
            0.0
        };
        let bound = rounding * scale + denormal * 3.0 * largest_scale;
        assert!(
            (u - exact).abs() <= bound,
            "{case}: {u:e} for {exact:e}, bound {bound:e}"
        );
        if storage == Storage::F32 {
            assert!(
                (u - exact).abs() <= 1e-6 * largest,
                "{case}: {u:e} for {exact:e}"
            );
        }
    }
}

/// Writes NaN where results go, on the device and in the caller's buffer.
fn poison(gpu: &mut Gpu, displacement: &mut [f64]) {
    displacement.fill(f64::NAN);
    let number = gpu.worker.leave(&mut gpu.job, Order::Poison).unwrap();
    gpu.worker.wait(number, PATIENT).unwrap();
}

const PATIENT: Duration = Duration::from_secs(60);

#[test]
fn product_agrees_with_64_bits_and_every_row_is_written() {
    // Rows that are no multiple of the workgroup's 64 or of four, one row, and enough for several workgroups; random
    // numbers and a compliance as parts have it.
    on_each(|adapter| {
        for (seed, (n_rows, n_candidates)) in
            (1..).zip([(1, 1), (21, 5), (64, 64), (333, 40), (1001, 130)])
        {
            let layout = Layout::new(n_rows, n_candidates).unwrap();
            let mut numbers = Numbers(seed);
            for (kind, blocks) in [
                ("random", numbers.take(layout.n_scalars())),
                ("half-space", half_space(n_rows, n_candidates)),
            ] {
                for storage in [Storage::F32, Storage::F16] {
                    let mut gpu = Gpu::new(adapter, layout, &[&blocks], settings(storage)).unwrap();
                    let last = n_candidates as u32 - 1;
                    let all: Vec<u32> = (0..=last).rev().collect();
                    for columns in [&[][..], &[last], &[0, last, 0], &all] {
                        let forces = numbers.take(3 * columns.len());
                        let case = format!(
                            "{kind}, seed {seed}, {n_rows} rows, {} columns",
                            columns.len()
                        );
                        let expected = reference(layout, &blocks, columns, &forces);
                        let mut u = vec![0.0; layout.displacement_len()];
                        poison(&mut gpu, &mut u);
                        gpu.multiply_into(columns, &forces, &mut u).unwrap();
                        compare(&u, &expected, storage, &case);
                        // The same bits again.
                        let mut again = u.clone();
                        poison(&mut gpu, &mut again);
                        gpu.multiply_into(columns, &forces, &mut again).unwrap();
                        assert_eq!(u, again, "{case}");
                    }
                }
            }
        }
    });
}

#[test]
fn some_rows_are_those_of_the_whole_and_the_others_stay() {
    on_each(|adapter| {
        let layout = Layout::new(150, 20).unwrap();
        let mut numbers = Numbers(7);
        let blocks = numbers.take(layout.n_scalars());
        let columns: Vec<u32> = (0..20).collect();
        let forces = numbers.take(60);
        let expected = reference(layout, &blocks, &columns, &forces);
        for storage in [Storage::F32, Storage::F16] {
            let mut gpu = Gpu::new(adapter, layout, &[&blocks], settings(storage)).unwrap();
            // Listed rows alone, first rows alone, both, none; more than there are rows, since some come twice.
            let twice: Vec<u32> = (0..150).chain([3, 149]).collect();
            for (n_first, rows) in [
                (0, &[149, 64, 65, 2][..]),
                (70, &[]),
                (70, &[149, 71]),
                (0, &[]),
                (150, &[]),
                (10, &twice),
            ] {
                let mut u = vec![0.0; 450];
                poison(&mut gpu, &mut u);
                gpu.multiply_rows_into(&columns, &forces, n_first, rows, &mut u)
                    .unwrap();
                let is_asked = |row: usize| row < n_first || rows.contains(&(row as u32));
                for row in (0..150).filter(|row| !is_asked(*row)) {
                    let of_row = 3 * row..3 * row + 3;
                    assert!(
                        u[of_row.clone()].iter().all(|u| u.is_nan()),
                        "row {row} was written"
                    );
                    u[of_row.clone()].copy_from_slice(&expected.0[of_row]);
                }
                compare(
                    &u,
                    &expected,
                    storage,
                    &format!("{n_first} and {} rows", rows.len()),
                );
            }
        }
    });
}

#[test]
fn batch_is_the_products_of_its_sets() {
    on_each(|adapter| {
        let layout = Layout::new(101, 30).unwrap();
        let mut numbers = Numbers(11);
        let blocks = numbers.take(layout.n_scalars());
        let columns = [29, 0, 17, 17];
        for storage in [Storage::F32, Storage::F16] {
            let mut gpu = Gpu::new(adapter, layout, &[&blocks], settings(storage)).unwrap();
            // One set; not a multiple of the shader's four; more than go into one submission.
            for n_sets in [0, 1, 6, 37] {
                let forces = numbers.take(12 * n_sets);
                let mut u = vec![0.0; 303 * n_sets];
                poison(&mut gpu, &mut u);
                gpu.multiply_batch_into(n_sets, &columns, &forces, &mut u)
                    .unwrap();
                for (u, forces) in u.chunks_exact(303).zip(forces.chunks_exact(12)) {
                    let expected = reference(layout, &blocks, &columns, forces);
                    compare(u, &expected, storage, &format!("{n_sets} sets"));
                }
            }
            let mut u = vec![f64::NAN; 303 * 2];
            gpu.multiply_batch_into(2, &[], &[], &mut u).unwrap();
            assert!(u.iter().all(|u| *u == 0.0));
        }
    });
}

#[test]
fn compliance_larger_than_a_binding_is_split() {
    on_each(|adapter| {
        let layout = Layout::new(60, 33).unwrap();
        let mut numbers = Numbers(13);
        let blocks = numbers.take(layout.n_scalars());
        for storage in [Storage::F32, Storage::F16] {
            for limit in [4096, 8192, 1 << 16] {
                let asked = GpuSettings {
                    storage,
                    binding_limit: Some(limit),
                    patience: None,
                };
                let mut gpu = Gpu::new(adapter, layout, &[&blocks], asked).unwrap();
                assert!(gpu.n_panels() > 1 || limit > 1 << 15);
                // All panels, some of them, and only the last.
                let all: Vec<u32> = (0..33).collect();
                for columns in [&all[..], &[32, 2, 31], &[32]] {
                    let forces = numbers.take(3 * columns.len());
                    let expected = reference(layout, &blocks, columns, &forces);
                    let mut u = vec![0.0; 180];
                    poison(&mut gpu, &mut u);
                    gpu.multiply_into(columns, &forces, &mut u).unwrap();
                    compare(&u, &expected, storage, "whole");
                    poison(&mut gpu, &mut u);
                    gpu.multiply_rows_into(columns, &forces, 60, &[], &mut u)
                        .unwrap();
                    compare(&u, &expected, storage, "rows");
                    poison(&mut gpu, &mut u);
                    gpu.multiply_batch_into(1, columns, &forces, &mut u)
                        .unwrap();
                    compare(&u, &expected, storage, "batch");
                }
            }
            let too_small = GpuSettings {
                storage,
                binding_limit: Some(64),
                patience: None,
            };
            let refused = Gpu::new(adapter, layout, &[&blocks], too_small).err();
            assert!(matches!(refused, Some(Error::TooLarge { .. })));
        }
    });
}

#[test]
fn result_does_not_depend_on_the_unit() {
    // A power of two as factor changes the exponents only, far beyond the range of 32 bits.
    on_each(|adapter| {
        let layout = Layout::new(9, 4).unwrap();
        let mut numbers = Numbers(17);
        let (blocks, forces) = (numbers.take(layout.n_scalars()), numbers.take(6));
        for storage in [Storage::F32, Storage::F16] {
            let product = |of_compliance: f64, of_force: f64| {
                let times =
                    |x: &[f64], factor: f64| x.iter().map(|x| x * factor).collect::<Vec<f64>>();
                let blocks = times(&blocks, of_compliance);
                let mut gpu = Gpu::new(adapter, layout, &[&blocks], settings(storage)).unwrap();
                let mut u = vec![0.0; 27];
                gpu.multiply_into(&[3, 1], &times(&forces, of_force), &mut u)
                    .unwrap();
                times(&u, 1.0 / (of_compliance * of_force))
            };
            for exponent in [-400, -70, 70, 400] {
                let factor = 2_f64.powi(exponent);
                assert_eq!(product(factor, 1.0), product(1.0, 1.0));
                assert_eq!(product(1.0, factor), product(1.0, 1.0));
            }
        }
    });
}

#[test]
fn newest_product_arrives_without_a_wait() {
    on_each(|adapter| {
        let layout = Layout::new(40, 3).unwrap();
        let mut numbers = Numbers(19);
        let blocks = numbers.take(layout.n_scalars());
        let mut gpu = Gpu::new(adapter, layout, &[&blocks], settings(Storage::F32)).unwrap();
        let mut u = vec![7.0; 120];
        assert!(!gpu.newest_into(&mut u).unwrap(), "nothing was asked for");
        assert_eq!(u, vec![7.0; 120]);

        let forces = numbers.take(3);
        for column in 0..3 {
            gpu.begin(&[column], &forces).unwrap();
        }
        // Those before may arrive too; the last one does in any case.
        let expected = reference(layout, &blocks, &[2], &forces);
        let begun = Instant::now();
        while (u[0] - expected.0[0]).abs() > 1e-6 {
            assert!(
                begun.elapsed() < PATIENT,
                "the last product does not arrive"
            );
            u.fill(f64::NAN);
            while !gpu.newest_into(&mut u).unwrap() {
                assert!(begun.elapsed() < PATIENT, "no product arrives");
                std::thread::yield_now();
            }
        }
        compare(&u, &expected, Storage::F32, "newest");
        assert!(!gpu.newest_into(&mut u).unwrap(), "it was taken");
        gpu.multiply_into(&[0], &forces, &mut u).unwrap();
        assert!(!gpu.newest_into(&mut u).unwrap(), "that was for who waited");
    });
}

#[test]
fn wrong_input_is_refused_and_nothing_is_written() {
    on_each(|adapter| {
        let layout = Layout::new(4, 2).unwrap();
        let mut blocks = vec![1.0; 72];
        let mut gpu = Gpu::new(adapter, layout, &[&blocks], settings(Storage::F32)).unwrap();
        let mut u = [7.0; 12];
        let no_column = Error::NoSuchColumn {
            column: 2,
            n_candidates: 2,
        };
        let not_finite = Error::ForceNotFinite { contact: 1 };
        let forces = [1.0, 1.0, 1.0, 1.0, f64::NAN, 1.0];
        assert_eq!(
            gpu.multiply_into(&[2], &[1.0; 3], &mut u),
            Err(no_column.clone())
        );
        assert_eq!(
            gpu.multiply_into(&[0, 1], &forces, &mut u),
            Err(not_finite.clone())
        );
        assert_eq!(gpu.begin(&[2], &[1.0; 3]), Err(no_column.clone()));
        assert_eq!(
            gpu.multiply_on_device(&[2], &[1.0; 3]),
            Err(no_column.clone())
        );
        let batch = gpu.multiply_batch_into(2, &[0], &forces, &mut [0.0; 24]);
        assert_eq!(batch, Err(not_finite));
        let rows = gpu.multiply_rows_into(&[0], &[1.0; 3], 0, &[4], &mut u);
        assert_eq!(rows, Err(Error::NoSuchRow { row: 4, n_rows: 4 }));
        for wrong in [
            gpu.multiply_into(&[0], &[1.0; 4], &mut u),
            gpu.multiply_into(&[0], &[1.0; 3], &mut u[1..]),
            gpu.newest_into(&mut u[1..]).map(|_| ()),
            gpu.multiply_batch_into(2, &[0], &[1.0; 6], &mut u),
        ] {
            assert!(matches!(wrong, Err(Error::WrongLength { .. })), "{wrong:?}");
        }
        assert_eq!(u, [7.0; 12]);
        // None of this is the adapter's fault: it goes on.
        gpu.multiply_into(&[0], &[1.0, 0.0, 0.0], &mut u).unwrap();
        assert_eq!(u, [1.0; 12]);

        blocks[(4 + 3) * 9 + 2] = f64::INFINITY;
        let refused = Gpu::new(adapter, layout, &[&blocks], settings(Storage::F32)).err();
        let place = Error::NotFinite {
            row: 3,
            candidate: 1,
        };
        assert_eq!(refused, Some(place));
        let refused = Gpu::new(adapter, layout, &[&blocks[1..]], settings(Storage::F32)).err();
        assert!(matches!(refused, Some(Error::WrongLength { .. })));
    });
}

/// A part that nothing can touch: there is no column, and nothing moves.
#[test]
fn no_candidate_is_no_displacement() {
    on_each(|adapter| {
        let layout = Layout::new(5, 0).unwrap();
        let mut gpu = Gpu::new(adapter, layout, &[&[]], settings(Storage::F32)).unwrap();
        let mut u = [f64::NAN; 15];
        gpu.multiply_into(&[], &[], &mut u).unwrap();
        assert_eq!(u, [0.0; 15]);
    });
}

#[test]
fn two_back_ends_are_compared_and_a_wrong_product_is_refused() {
    on_each(|adapter| {
        let layout = Layout::new(30, 20).unwrap();
        let mut numbers = Numbers(31);
        let blocks = numbers.take(layout.n_scalars());
        // Columns that nearly cancel each other: rounding is more of the sum then, and not taken for a fault.
        let half = layout.n_scalars() / 2;
        let opposite: Vec<f64> = blocks[..half].iter().map(|c| -c * 1.001).collect();
        let cancelling = [&blocks[..half], &opposite].concat();
        for storage in [Storage::F32, Storage::F16] {
            for blocks in [&blocks, &cancelling] {
                let mut gpu = Gpu::new(adapter, layout, &[blocks], settings(storage)).unwrap();
                let mut processor = on_cpu(layout, &[blocks], Scalar::F64).unwrap();
                let compared = crate::compare(processor.as_mut(), &mut gpu).unwrap();
                assert_eq!(compared.n_contacts, 16);
                assert!(compared.processor_s > 0.0 && compared.gpu_s > 0.0);

                // One number of a column that is compared, along the axis of its force: of the first, x.
                let mut other = blocks.clone();
                other[1] += 0.1;
                let mut wrong = Gpu::new(adapter, layout, &[&other], settings(storage)).unwrap();
                let refused = crate::compare(processor.as_mut(), &mut wrong);
                assert!(matches!(refused, Err(Error::Wrong { .. })), "{refused:?}");
            }
        }
        let nothing = Layout::new(3, 0).unwrap();
        let mut gpu = Gpu::new(adapter, nothing, &[&[]], settings(Storage::F32)).unwrap();
        let mut processor = on_cpu(nothing, &[&[]], Scalar::F64).unwrap();
        assert_eq!(
            crate::compare(processor.as_mut(), &mut gpu)
                .unwrap()
                .n_contacts,
            0
        );
    });
}

#[test]
fn shaders_are_valid() {
    for (name, text) in crate::connection::SHADERS {
        let module = naga::front::wgsl::parse_str(text)
            .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(text)));
        // What runs everywhere, and the unpacking of 16 bits, which every WebGPU has.
        let flags = naga::valid::ValidationFlags::all();
        let capabilities = naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32;
        let mut validator = naga::valid::Validator::new(flags, capabilities);
        validator
            .validate(&module)
            .unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(text)));
        assert!(!module.entry_points.is_empty());
    }
}

//! What the back-end on the processor promises.

use super::*;
use crate::numbers::Numbers;

#[test]
fn some_rows_are_those_of_the_whole_and_the_others_stay() {
    let layout = Layout::new(7, 4).unwrap();
    let mut numbers = Numbers(5);
    let blocks = numbers.take(layout.n_scalars());
    let forces = numbers.take(9);
    for scalar in [Scalar::F32, Scalar::F64] {
        let mut multiply = on_cpu(layout, &[&blocks], scalar).unwrap();
        let (mut whole, mut some) = ([0.0; 21], [7.0; 21]);
        multiply
            .multiply_into(&[3, 0, 2], &forces, &mut whole)
            .unwrap();
        multiply
            .multiply_rows_into(&[3, 0, 2], &forces, 2, &[6, 4], &mut some)
            .unwrap();
        for (i, (a, b)) in some.iter().zip(whole).enumerate() {
            match i / 3 {
                0 | 1 | 4 | 6 => assert!((a - b).abs() < 1e-15, "{i}"),
                _ => assert_eq!(*a, 7.0),
            }
        }
        for (n_first, row) in [(8, 3), (1, 7)] {
            let refused = multiply.multiply_rows_into(&[], &[], n_first, &[row], &mut some);
            assert_eq!(refused, Err(Error::NoSuchRow { row: 7, n_rows: 7 }));
        }
    }
}

/// The definition, number by number; also Σ|C||f|, the scale of the rounding.
fn naive(n_rows: usize, blocks: &[f64], columns: &[u32], forces: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut u = vec![0.0; 3 * n_rows];
    let mut scale = vec![0.0; 3 * n_rows];
    for (k, &j) in columns.iter().enumerate() {
        for i in 0..n_rows {
            for row in 0..3 {
                for col in 0..3 {
                    let c = blocks[(j as usize * n_rows + i) * 9 + col * 3 + row];
                    u[3 * i + row] += c * forces[3 * k + col];
                    scale[3 * i + row] += (c * forces[3 * k + col]).abs();
                }
            }
        }
    }
    (u, scale)
}

#[test]
fn both_scalars_agree_with_the_definition_within_their_bound() {
    let mut numbers = Numbers(1);
    // Sizes that do and do not fill vector registers, lists even and odd and with a repetition.
    for (n_rows, n_candidates) in [(1, 1), (7, 3), (64, 5), (1000, 6)] {
        let layout = Layout::new(n_rows, n_candidates).unwrap();
        let blocks = numbers.take(layout.n_scalars());
        let last = n_candidates as u32 - 1;
        for columns in [vec![], vec![0], vec![last, 0], vec![last, 0, last]] {
            let forces = numbers.take(3 * columns.len());
            let (expected, scale) = naive(n_rows, &blocks, &columns, &forces);
            // 9 products are summed in another order: 10 roundings of 2^-53 at the most.
            for (scalar, rounding) in [
                (Scalar::F64, 10.0 * 2_f64.powi(-53)),
                (Scalar::F32, 2_f64.powi(-24) + 10.0 * 2_f64.powi(-53)),
            ] {
                let mut multiply = on_cpu(layout, &[&blocks], scalar).unwrap();
                let mut u = vec![f64::NAN; 3 * n_rows];
                multiply.multiply_into(&columns, &forces, &mut u).unwrap();
                for ((u, expected), scale) in u.iter().zip(&expected).zip(&scale) {
                    assert!((u - expected).abs() <= rounding * scale, "{scalar:?}");
                }
            }
        }
    }
}

#[test]
fn result_does_not_depend_on_the_unit_of_compliance() {
    // A power of two as factor scales the bits' exponent only, far beyond the range of 32 bits.
    let layout = Layout::new(5, 2).unwrap();
    let mut numbers = Numbers(2);
    let blocks = numbers.take(layout.n_scalars());
    let forces = numbers.take(6);
    for scalar in [Scalar::F32, Scalar::F64] {
        let product = |factor: f64| {
            let scaled: Vec<f64> = blocks.iter().map(|c| c * factor).collect();
            let mut u = vec![0.0; 15];
            on_cpu(layout, &[&scaled], scalar)
                .unwrap()
                .multiply_into(&[1, 0], &forces, &mut u)
                .unwrap();
            u.iter().map(|u| u / factor).collect::<Vec<f64>>()
        };
        for exponent in [-400, 400] {
            assert_eq!(product(2_f64.powi(exponent)), product(1.0));
        }
    }
}

#[test]
fn same_input_gives_the_same_bits_and_old_contents_do_not_matter() {
    let layout = Layout::new(100, 3).unwrap();
    let mut numbers = Numbers(3);
    let blocks = numbers.take(layout.n_scalars());
    let forces = numbers.take(9);
    let mut multiply = Cpu::<f32>::new(layout, &[&blocks]).unwrap();
    let (mut a, mut b) = (vec![1e30; 300], vec![f64::NAN; 300]);
    multiply.multiply_into(&[2, 0, 1], &forces, &mut a).unwrap();
    multiply.multiply_into(&[2, 0, 1], &forces, &mut b).unwrap();
    assert_eq!(a, b);
    multiply.multiply_into(&[], &[], &mut a).unwrap();
    assert!(a.iter().all(|&u| u == 0.0));
}

#[test]
fn bytes_and_names_tell_the_two_apart() {
    let layout = Layout::new(10, 2).unwrap();
    let blocks = vec![0.0; 180];
    let narrow = on_cpu(layout, &[&blocks], Scalar::F32).unwrap();
    let wide = on_cpu(layout, &[&blocks], Scalar::F64).unwrap();
    assert_eq!((narrow.bytes(), wide.bytes()), (720, 1440));
    assert_eq!(narrow.name(), "cpu, 32-bit compliance");
    assert_eq!(wide.name(), "cpu, 64-bit compliance");
    assert_eq!(narrow.layout(), layout);
}

#[test]
fn wrong_lengths_and_columns_are_typed_errors_and_write_nothing() {
    let layout = Layout::new(2, 2).unwrap();
    let mut multiply = Cpu::<f64>::new(layout, &[&[1.0; 36]]).unwrap();
    let mut u = [7.0; 6];
    assert_eq!(
        multiply.multiply_into(&[0], &[1.0; 4], &mut u),
        Err(Error::WrongLength {
            what: "forces",
            found: 4,
            expected: 3
        })
    );
    assert_eq!(
        multiply.multiply_into(&[0], &[1.0; 3], &mut u[..5]),
        Err(Error::WrongLength {
            what: "displacement",
            found: 5,
            expected: 6
        })
    );
    let error = multiply
        .multiply_into(&[1, 2], &[1.0; 6], &mut u)
        .unwrap_err();
    assert_eq!(error.to_string(), "column 2 is not among the 2 candidates");
    assert_eq!(u, [7.0; 6]);
    assert!(matches!(
        Cpu::<f64>::new(layout, &[&[1.0; 35]]),
        Err(Error::WrongLength { what: "blocks", .. })
    ));
}

#[test]
fn compliance_that_is_not_finite_is_refused_with_its_place() {
    let layout = Layout::new(3, 2).unwrap();
    let mut blocks = vec![1.0; 54];
    blocks[(3 + 2) * 9 + 4] = f64::NAN;
    for scalar in [Scalar::F32, Scalar::F64] {
        assert_eq!(
            on_cpu(layout, &[&blocks], scalar).err(),
            Some(Error::NotFinite {
                row: 2,
                candidate: 1
            })
        );
    }
}

/// A compliance with forces at listed candidates, for the tests below.
fn example(n_rows: usize, columns: &[u32], n_sets: usize) -> (Layout, Vec<f64>, Vec<f64>) {
    let layout = Layout::new(n_rows, 9).unwrap();
    let mut numbers = Numbers(11);
    let blocks = numbers.take(layout.n_scalars());
    let forces = numbers.take(3 * columns.len() * n_sets);
    (layout, blocks, forces)
}

#[test]
fn vectors_of_any_width_give_the_same_bits() {
    fn bits<T: Stored>(
        vectors: Vectors,
        n_rows: usize,
        columns: &[u32],
        n_sets: usize,
    ) -> Vec<u64> {
        let (layout, blocks, forces) = example(n_rows, columns, n_sets);
        let multiply = Cpu::<T>::new(layout, &[&blocks]).unwrap();
        let product = multiply.product(columns, &forces);
        let mut u = vec![f64::NAN; n_sets * layout.displacement_len()];
        if n_sets == 1 {
            product.stretch_into(vectors, 0, &mut u);
        } else {
            product.sets_into(vectors, &mut u);
        }
        u.iter().map(|u| u.to_bits()).collect()
    }
    let widest = Vectors::of_this_processor();
    // With and without a rest after whole blocks, tiles and pairs of candidates.
    for n_rows in [1, 64, 717] {
        for columns in [&[3, 1, 8, 0, 3][..], &[7, 2]] {
            for n_sets in [1, 2, SETS] {
                let narrow = bits::<f32>(Vectors::Compiled, n_rows, columns, n_sets);
                assert_eq!(bits::<f32>(widest, n_rows, columns, n_sets), narrow);
                let narrow = bits::<f64>(Vectors::Compiled, n_rows, columns, n_sets);
                assert_eq!(bits::<f64>(widest, n_rows, columns, n_sets), narrow);
            }
        }
    }
}

#[test]
fn threads_and_batches_give_the_bits_of_single_calls() {
    // Long enough that the pool is used, and one that is not.
    for (n_rows, n_listed) in [(40_000, 9), (50, 3)] {
        let columns: Vec<u32> = (0..n_listed).rev().collect();
        // More than are read for at once, and not a multiple.
        let n_sets = SETS + 3;
        let (layout, blocks, forces) = example(n_rows, &columns, n_sets);
        let (n, per_set) = (layout.displacement_len(), 3 * columns.len());
        for scalar in [Scalar::F32, Scalar::F64] {
            let mut one = on_cpu(layout, &[&blocks], scalar).unwrap();
            let mut singles = vec![f64::NAN; n_sets * n];
            for (u, f) in singles.chunks_mut(n).zip(forces.chunks(per_set)) {
                one.multiply_into(&columns, f, u).unwrap();
            }
            let is_same = |u: &[f64]| {
                u.iter()
                    .zip(&singles)
                    .all(|(a, b)| a.to_bits() == b.to_bits())
            };
            let mut batch = vec![f64::NAN; n_sets * n];
            one.multiply_batch_into(n_sets, &columns, &forces, &mut batch)
                .unwrap();
            assert!(is_same(&batch), "{scalar:?}, one thread");
            for n_threads in [2, 3] {
                let mut many = on_cpu_with_threads(layout, &[&blocks], scalar, n_threads).unwrap();
                let mut u = vec![f64::NAN; n];
                many.multiply_into(&columns, &forces[..per_set], &mut u)
                    .unwrap();
                assert!(is_same(&u), "{scalar:?}, {n_threads} threads");
                batch.fill(f64::NAN);
                many.multiply_batch_into(n_sets, &columns, &forces, &mut batch)
                    .unwrap();
                assert!(is_same(&batch), "{scalar:?}, {n_threads} threads, batch");
            }
        }
    }
}

#[test]
fn batches_without_sets_or_columns_are_nothing_and_zero() {
    let (layout, blocks, _) = example(20, &[], 1);
    let mut multiply = Cpu::<f32>::new(layout, &[&blocks]).unwrap();
    assert_eq!(multiply.multiply_batch_into(0, &[1], &[], &mut []), Ok(()));
    let mut u = [f64::NAN; 120];
    multiply.multiply_batch_into(2, &[], &[], &mut u).unwrap();
    assert_eq!(u, [0.0; 120]);
}

#[test]
fn rows_that_are_asked_for_are_overwritten_whatever_they_held() {
    let (layout, blocks, forces) = example(40, &[4, 2, 7], 1);
    let mut multiply = Cpu::<f64>::new(layout, &[&blocks]).unwrap();
    let mut u = [f64::NAN; 120];
    multiply
        .multiply_rows_into(&[4, 2, 7], &forces, 30, &[31, 32, 39], &mut u)
        .unwrap();
    for (i, u) in u.iter().enumerate() {
        let is_asked = matches!(i / 3, 0..=29 | 31 | 32 | 39);
        assert_eq!(u.is_finite(), is_asked, "{i}");
    }
}

#[test]
fn newest_of_those_asked_for_is_given_once() {
    let (layout, blocks, forces) = example(40, &[4, 2, 7], 1);
    let mut multiply = Cpu::<f32>::new(layout, &[&blocks]).unwrap();
    let mut u = [7.0; 120];
    assert_eq!(multiply.newest_into(&mut u), Ok(false));
    assert_eq!(u, [7.0; 120]);

    multiply.begin(&[1], &[1.0, 2.0, 3.0]).unwrap();
    multiply.begin(&[4, 2, 7], &forces).unwrap();
    u.fill(f64::NAN);
    // A wrong length does not use it up.
    assert!(matches!(
        multiply.newest_into(&mut u[1..]),
        Err(Error::WrongLength { .. })
    ));
    assert_eq!(multiply.newest_into(&mut u), Ok(true));
    let mut expected = [0.0; 120];
    multiply
        .multiply_into(&[4, 2, 7], &forces, &mut expected)
        .unwrap();
    assert_eq!(u, expected);
    assert_eq!(multiply.newest_into(&mut u), Ok(false));

    // What is refused is not asked for.
    assert!(multiply.begin(&[1], &[1.0]).is_err());
    assert!(multiply.begin(&[9], &[1.0; 3]).is_err());
    assert_eq!(multiply.newest_into(&mut u), Ok(false));
    // More than there are candidates, by repetition.
    multiply.begin(&[5; 12], &[1.0; 36]).unwrap();
    assert_eq!(multiply.newest_into(&mut u), Ok(true));
    multiply
        .multiply_into(&[5; 12], &[1.0; 36], &mut expected)
        .unwrap();
    assert_eq!(u, expected);
}

#[test]
fn forces_that_are_not_finite_are_refused_and_nothing_is_written() {
    let layout = Layout::new(2, 3).unwrap();
    let mut multiply = Cpu::<f32>::new(layout, &[&[1.0; 54]]).unwrap();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut forces = [1.0; 12];
        forces[10] = bad;
        let mut u = [7.0; 12];
        let second = Err(Error::ForceNotFinite { contact: 1 });
        assert_eq!(
            multiply.multiply_into(&[0, 2], &forces[6..], &mut u[..6]),
            second
        );
        assert_eq!(
            multiply.multiply_rows_into(&[0, 2], &forces[6..], 2, &[], &mut u[..6]),
            second
        );
        assert_eq!(
            multiply.multiply_batch_into(2, &[0, 2], &forces, &mut u),
            Err(Error::ForceNotFinite { contact: 3 })
        );
        assert_eq!(multiply.begin(&[0, 2], &forces[6..]), second);
        assert_eq!(u, [7.0; 12]);
        assert_eq!(multiply.newest_into(&mut u[..6]), Ok(false));
    }
}

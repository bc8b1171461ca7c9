//! The back-end on the processor, with the compliance kept in 64 or 32 bits.

use std::ops::Range;

use crate::error::Error;
use crate::layout::{Layout, check_length};
use crate::multiply::{ComplianceMultiply, Scalar, check, check_rows};

/// A number in which the compliance can be kept.
pub trait Stored: Copy + Default + Send + sealed::Sealed {
    /// Name of the back-end that keeps it.
    const NAME: &'static str;

    /// Is the matrix brought near 1 before it is kept?
    const IS_SCALED: bool;

    /// Rounded to nearest.
    fn from_f64(value: f64) -> Self;

    /// Exact.
    fn to_f64(self) -> f64;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

impl Stored for f64 {
    const NAME: &'static str = "cpu, 64-bit compliance";
    const IS_SCALED: bool = false;

    fn from_f64(value: f64) -> Self {
        value
    }

    fn to_f64(self) -> f64 {
        self
    }
}

impl Stored for f32 {
    const NAME: &'static str = "cpu, 32-bit compliance";
    const IS_SCALED: bool = true;

    fn from_f64(value: f64) -> Self {
        value as f32
    }

    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

/// The multiply on one core of the processor.
///
/// The sum is formed in 64 bits. With 32-bit storage each number of C is rounded once, so
///
/// ```text
/// |u − u₆₄| ≤ 2⁻²⁴ Σ_j |C_ij| |f_j|  +  2⁻¹⁵⁰ max|C| Σ_j |f_j|
/// ```
/// beside the rounding of the sum itself. The second term is for numbers that are denormal after the
/// matrix has been brought near 1 by a power of two; that scaling makes the bound hold in any unit.
#[derive(Debug, Clone)]
pub struct Cpu<T> {
    layout: Layout,
    columns: Vec<T>,
    /// Power of two; stored number times this is the compliance in m/N.
    unit: f64,
    /// Of the last call of `begin`.
    asked_columns: Vec<u32>,
    asked_forces: Vec<f64>,
    is_asked: bool,
}

impl<T: Stored> Cpu<T> {
    /// Copies a compliance given as blocks in stretches of rows (see [`Layout`]), m/N.
    ///
    /// # Errors
    /// Where a length is wrong or a number is not finite.
    pub fn new(layout: Layout, blocks: &[&[f64]]) -> Result<Self, Error> {
        let found = blocks.iter().map(|stretch| stretch.len()).sum();
        check_length("blocks", found, layout.n_scalars())?;
        let mut first_row = 0;
        for stretch in blocks {
            let n_rows = layout.rows_of(stretch)?;
            if let Some(at) = stretch.iter().position(|x| !x.is_finite()) {
                let block = at / 9;
                return Err(Error::NotFinite {
                    row: first_row + block % n_rows,
                    candidate: block / n_rows,
                });
            }
            first_row += n_rows;
        }
        let unit = if T::IS_SCALED {
            let numbers = blocks.iter().copied().flatten();
            power_of_two_below(numbers.fold(0.0, |m: f64, x| m.max(x.abs())))
        } else {
            1.0
        };
        let mut columns = vec![T::default(); layout.n_scalars()];
        layout.columns_from_blocks(blocks, &mut columns, |x| T::from_f64(x / unit))?;
        Ok(Self {
            layout,
            columns,
            unit,
            asked_columns: Vec::with_capacity(layout.n_candidates()),
            asked_forces: Vec::with_capacity(3 * layout.n_candidates()),
            is_asked: false,
        })
    }

    /// The three columns of a candidate, one per axis of the force.
    fn columns_of(&self, candidate: u32) -> [&[T]; 3] {
        [0, 1, 2].map(|axis| &self.columns[self.layout.column(candidate as usize, axis)])
    }
}

impl<T: Stored> ComplianceMultiply for Cpu<T> {
    fn name(&self) -> &str {
        T::NAME
    }

    fn bytes(&self) -> u64 {
        size_of_val(self.columns.as_slice()) as u64
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
        check_length(
            "displacement",
            displacement.len(),
            self.layout.displacement_len(),
        )?;
        self.multiply_range(columns, forces, 0..self.layout.n_rows(), displacement);
        Ok(())
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
        check_length(
            "displacement",
            displacement.len(),
            self.layout.displacement_len(),
        )?;
        check_rows(self.layout, n_first, rows)?;
        self.multiply_range(columns, forces, 0..n_first, displacement);
        // Rows that follow each other are one stretch.
        for run in rows.chunk_by(|a, b| a + 1 == *b) {
            let first = run[0] as usize;
            self.multiply_range(columns, forces, first..first + run.len(), displacement);
        }
        Ok(())
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
        for (set, u) in displacements.chunks_exact_mut(n).enumerate() {
            let f = &forces[3 * columns.len() * set..3 * columns.len() * (set + 1)];
            self.multiply_range(columns, f, 0..self.layout.n_rows(), u);
        }
        Ok(())
    }

    fn begin(&mut self, columns: &[u32], forces: &[f64]) -> Result<(), Error> {
        check(self.layout, columns, forces, 1)?;
        self.asked_columns.clear();
        self.asked_columns.extend_from_slice(columns);
        self.asked_forces.clear();
        self.asked_forces.extend_from_slice(forces);
        self.is_asked = true;
        Ok(())
    }

    fn newest_into(&mut self, displacement: &mut [f64]) -> Result<bool, Error> {
        check_length(
            "displacement",
            displacement.len(),
            self.layout.displacement_len(),
        )?;
        if !std::mem::take(&mut self.is_asked) {
            return Ok(false);
        }
        let rows = 0..self.layout.n_rows();
        self.multiply_range(&self.asked_columns, &self.asked_forces, rows, displacement);
        Ok(true)
    }
}

impl<T: Stored> Cpu<T> {
    /// Displacement of a stretch of rows.
    fn multiply_range(
        &self,
        columns: &[u32],
        forces: &[f64],
        rows: Range<usize>,
        displacement: &mut [f64],
    ) {
        let rows = 3 * rows.start..3 * rows.end;
        let displacement = &mut displacement[rows.clone()];
        let columns_of = |candidate: u32| self.columns_of(candidate).map(|c| &c[rows.clone()]);
        // Two candidates at a time: six columns for one load and store of the sums, which stay in the
        // cache, so that only the compliance is read from memory. Cutting the columns into tiles of
        // 8 to 32 KB of sums gained nothing.
        displacement.fill(0.0);
        let mut pairs = columns.chunks_exact(2);
        let mut pair_forces = forces.chunks_exact(6);
        for (pair, f) in pairs.by_ref().zip(pair_forces.by_ref()) {
            let [a, b, c] = columns_of(pair[0]);
            let [d, e, g] = columns_of(pair[1]);
            let f = [f[0], f[1], f[2], f[3], f[4], f[5]].map(|f| f * self.unit);
            add_six(displacement, [a, b, c, d, e, g], f);
        }
        if let (&[candidate], &[x, y, z]) = (pairs.remainder(), pair_forces.remainder()) {
            let f = [x, y, z].map(|f| f * self.unit);
            add_three(displacement, columns_of(candidate), f);
        }
    }
}

/// A multiply on the processor with the compliance kept as asked.
///
/// # Errors
/// Where the length is wrong or a number is not finite.
pub fn on_cpu(
    layout: Layout,
    blocks: &[&[f64]],
    scalar: Scalar,
) -> Result<Box<dyn ComplianceMultiply>, Error> {
    Ok(match scalar {
        Scalar::F32 => Box::new(Cpu::<f32>::new(layout, blocks)?),
        Scalar::F64 => Box::new(Cpu::<f64>::new(layout, blocks)?),
    })
}

/// sums += Σ columns f, element by element. All slices have the length of `sums`.
fn add_six<T: Stored>(sums: &mut [f64], columns: [&[T]; 6], f: [f64; 6]) {
    // Equal lengths known to the compiler: no bounds check is left in the loop and it vectorises.
    let n = sums.len();
    let [a, b, c, d, e, g] = columns.map(|column| &column[..n]);
    for i in 0..n {
        let first = a[i].to_f64() * f[0] + b[i].to_f64() * f[1] + c[i].to_f64() * f[2];
        let second = d[i].to_f64() * f[3] + e[i].to_f64() * f[4] + g[i].to_f64() * f[5];
        sums[i] += first + second;
    }
}

/// The same for a single candidate.
fn add_three<T: Stored>(sums: &mut [f64], columns: [&[T]; 3], f: [f64; 3]) {
    let n = sums.len();
    let [a, b, c] = columns.map(|column| &column[..n]);
    for i in 0..n {
        sums[i] += a[i].to_f64() * f[0] + b[i].to_f64() * f[1] + c[i].to_f64() * f[2];
    }
}

/// The largest power of two not above a positive normal number; 1 for 0. Dividing by it is exact.
fn power_of_two_below(value: f64) -> f64 {
    if value < f64::MIN_POSITIVE {
        // Zero or denormal: nothing physical; kept as it is.
        return 1.0;
    }
    // The exponent bits alone.
    f64::from_bits(value.to_bits() & (0x7ff << 52))
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// Numbers in [-1, 1) from a fixed seed (linear congruence of Knuth's MMIX).
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }

        fn take(&mut self, n: usize) -> Vec<f64> {
            (0..n).map(|_| self.next()).collect()
        }
    }

    /// The definition, number by number; also Σ|C||f|, the scale of the rounding.
    fn naive(
        n_rows: usize,
        blocks: &[f64],
        columns: &[u32],
        forces: &[f64],
    ) -> (Vec<f64>, Vec<f64>) {
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

    #[test]
    fn power_of_two_is_the_one_below() {
        for (value, expected) in [(1.0, 1.0), (1.99, 1.0), (6.0, 4.0), (0.3, 0.25)] {
            assert_eq!(power_of_two_below(value), expected);
        }
        assert_eq!(power_of_two_below(0.0), 1.0);
        assert_eq!(power_of_two_below(1e-310), 1.0);
    }
}

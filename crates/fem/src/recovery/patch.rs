//! One patch: elements around a vertex, and the polynomial that fits their strains.

use std::collections::HashMap;

use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::element::FACE_VERTICES;
use crate::mesh::Mesh;

/// Layers of neighbours by which a patch may grow beyond the elements at its vertex.
const MOST_LAYERS: usize = 4;

/// Largest factor from the errors of the samples to that of the fit at the vertex (norm of its weights): a fit is used
/// that makes no more of an error than one sample has. Nominal 0.3 to 0.9.
const MOST_AMPLIFIED: f64 = 1.0;

/// The same for a fit of the degree that an element's own strain has, when no more elements are left: one element alone
/// has 2.
const MOST_AMPLIFIED_ALONE: f64 = 4.0;

/// Highest degree of a fit, also of elements of higher order.
const HIGHEST: u32 = 3;

/// Monomials of [`HIGHEST`].
const MOST_TERMS: usize = 20;

/// Elements at each vertex and across each face.
#[derive(Debug)]
pub(super) struct Neighbours {
    at_vertex: Vec<Vec<u32>>,
    across: Vec<[u32; 4]>,
}

impl Neighbours {
    pub(super) fn of(mesh: &Mesh) -> Self {
        let mut at_vertex = vec![Vec::new(); mesh.n_nodes()];
        let mut across = vec![[u32::MAX; 4]; mesh.n_elements()];
        let mut open: HashMap<[u32; 3], (usize, usize)> = HashMap::new();
        for e in 0..mesh.n_elements() {
            let nodes = mesh.element_nodes(e);
            for &v in &nodes[..4] {
                at_vertex[v as usize].push(e as u32);
            }
            for (f, vertices) in FACE_VERTICES.iter().enumerate() {
                let mut key = vertices.map(|v| nodes[v]);
                key.sort_unstable();
                if let Some((other, face)) = open.remove(&key) {
                    across[e][f] = other as u32;
                    across[other][face] = e as u32;
                } else {
                    open.insert(key, (e, f));
                }
            }
        }
        Self { at_vertex, across }
    }

    /// Elements that have the node as a vertex.
    pub(super) fn at(&self, vertex: u32) -> &[u32] {
        &self.at_vertex[vertex as usize]
    }

    /// Adds the elements across the faces of all that are there.
    fn grow(&self, elements: &mut Vec<u32>) {
        let mut wider: Vec<u32> = elements
            .iter()
            .flat_map(|&e| self.across[e as usize])
            .filter(|e| *e != u32::MAX)
            .collect();
        elements.append(&mut wider);
        elements.sort_unstable();
        elements.dedup();
    }
}

/// Elements and the frame of their polynomial.
#[derive(Debug)]
pub(super) struct Patch {
    elements: Vec<u32>,
    centre: [f64; 3],
    /// Rows: principal axes of the samples over their spread, 1/m.
    axes: [[f64; 3]; 3],
    degree: u32,
    /// R⁻¹ of A = Q R, A the monomials at the samples; upper triangle, by rows.
    inverse: Vec<f64>,
}

/// A fitted strain: coefficients of the monomials, and those of the fit of one degree less.
#[derive(Debug)]
pub(super) struct Coefficients {
    full: Vec<[f64; 6]>,
    lower: Vec<[f64; 6]>,
}

impl Patch {
    /// The smallest patch that bears the elements' degree at the vertex; failing that, the next lower degree.
    pub(super) fn around(
        mesh: &Mesh,
        vertex: u32,
        neighbours: &Neighbours,
        places: &[[f64; 3]],
        per_element: usize,
    ) -> Self {
        let at = mesh.nodes[vertex as usize];
        let highest = (mesh.order as u32).min(HIGHEST);
        for degree in (1..=highest).rev() {
            let mut elements = neighbours.at(vertex).to_vec();
            for layer in 0..=MOST_LAYERS {
                if layer > 0 {
                    let before = elements.len();
                    neighbours.grow(&mut elements);
                    if elements.len() == before {
                        break;
                    }
                }
                let most = if degree == highest {
                    MOST_AMPLIFIED
                } else {
                    MOST_AMPLIFIED_ALONE
                };
                match Self::try_new(&elements, degree, at, places, per_element) {
                    Some((patch, amplified)) if amplified <= most => return patch,
                    _ => {}
                }
            }
        }
        // The mean of the samples.
        Self {
            elements: neighbours.at(vertex).to_vec(),
            centre: at,
            axes: [[0.0; 3]; 3],
            degree: 0,
            inverse: vec![
                1.0 / ((neighbours.at(vertex).len() * per_element) as f64)
                    .sqrt()
                    .max(1.0),
            ],
        }
    }

    /// The patch of these elements and by how much it amplifies errors at the vertex; `None` if they do not determine it.
    fn try_new(
        elements: &[u32],
        degree: u32,
        at: [f64; 3],
        places: &[[f64; 3]],
        per_element: usize,
    ) -> Option<(Self, f64)> {
        let n = terms(degree);
        let samples = || {
            elements
                .iter()
                .flat_map(|&e| &places[e as usize * per_element..][..per_element])
        };
        let m = elements.len() * per_element;
        if m < n {
            return None;
        }
        let (centre, axes) = frame(samples(), m)?;
        let mut patch = Self {
            elements: elements.to_vec(),
            centre,
            axes,
            degree,
            inverse: Vec::new(),
        };
        let mut a = DMatrix::zeros(m, n);
        for (k, x) in samples().enumerate() {
            let monomials = patch.monomials(*x);
            for (j, value) in monomials[..n].iter().enumerate() {
                a[(k, j)] = *value;
            }
        }
        let r = a.qr().r();
        let largest = (0..n).map(|i| r[(i, i)].abs()).fold(0.0, f64::max);
        // Beyond this the seminormal equations lose more than half of the digits.
        if (0..n).any(|i| r[(i, i)].abs() < 1e-4 * largest) {
            return None;
        }
        let inverse = r.solve_upper_triangular(&DMatrix::identity(n, n))?;
        patch.inverse = (0..n * n).map(|k| inverse[(k / n, k % n)]).collect();
        let there = patch.monomials(at);
        let amplified: f64 = (0..n)
            .map(|j| {
                let weight: f64 = (0..=j).map(|i| there[i] * patch.inverse[i * n + j]).sum();
                weight * weight
            })
            .sum();
        Some((patch, amplified.sqrt()))
    }

    /// All monomials up to the degree, by degree.
    fn monomials(&self, x: [f64; 3]) -> [f64; MOST_TERMS] {
        let d = [0, 1, 2].map(|c| x[c] - self.centre[c]);
        let [s, t, r] = self
            .axes
            .map(|axis| axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2]);
        let mut m = [0.0; MOST_TERMS];
        m[..4].copy_from_slice(&[1.0, s, t, r]);
        if self.degree > 1 {
            m[4..10].copy_from_slice(&[s * s, t * t, r * r, s * t, t * r, r * s]);
        }
        if self.degree > 2 {
            let cubic = [
                s * s * s,
                t * t * t,
                r * r * r,
                s * s * t,
                s * s * r,
                t * t * s,
                t * t * r,
                r * r * s,
                r * r * t,
                s * t * r,
            ];
            m[10..].copy_from_slice(&cubic);
        }
        m
    }

    /// Least squares by the seminormal equations, a = R⁻¹ R⁻ᵀ Aᵀ b.
    pub(super) fn fit(
        &self,
        places: &[[f64; 3]],
        samples: &[[f64; 6]],
        per_element: usize,
    ) -> Coefficients {
        let n = terms(self.degree);
        let mut projected = [[0.0; 6]; MOST_TERMS];
        for &e in &self.elements {
            let range = e as usize * per_element..(e as usize + 1) * per_element;
            for (x, b) in places[range.clone()].iter().zip(&samples[range]) {
                let monomials = self.monomials(*x);
                for (row, m) in projected.iter_mut().zip(&monomials[..n]) {
                    for (p, b) in row.iter_mut().zip(b) {
                        *p += m * b;
                    }
                }
            }
        }
        // By orthonormal polynomials: those of the lower degree come first and are the same.
        let mut orthonormal = [[0.0; 6]; MOST_TERMS];
        for j in 0..n {
            for i in 0..=j {
                for c in 0..6 {
                    orthonormal[j][c] += self.inverse[i * n + j] * projected[i][c];
                }
            }
        }
        let by_monomials = |count: usize| -> Vec<[f64; 6]> {
            (0..count)
                .map(|i| {
                    let mut a = [0.0; 6];
                    for j in i..count {
                        for c in 0..6 {
                            a[c] += self.inverse[i * n + j] * orthonormal[j][c];
                        }
                    }
                    a
                })
                .collect()
        };
        Coefficients {
            full: by_monomials(n),
            lower: by_monomials(terms(self.degree.saturating_sub(1))),
        }
    }

    /// The fit at a point; `is_lower`: that of one degree less.
    pub(super) fn value(&self, fit: &Coefficients, x: [f64; 3], is_lower: bool) -> [f64; 6] {
        let monomials = self.monomials(x);
        let terms = if is_lower { &fit.lower } else { &fit.full };
        let mut sum = [0.0; 6];
        for (a, m) in terms.iter().zip(&monomials) {
            for (s, a) in sum.iter_mut().zip(a) {
                *s += m * a;
            }
        }
        sum
    }
}

/// Number of monomials in three variables up to a degree: 1, 4, 10, 20.
fn terms(degree: u32) -> usize {
    let d = degree as usize;
    (d + 1) * (d + 2) * (d + 3) / 6
}

/// Centre and scaled principal axes of the samples, so that flat and long patches are as well-conditioned as round ones.
fn frame<'p>(
    samples: impl Iterator<Item = &'p [f64; 3]> + Clone,
    count: usize,
) -> Option<([f64; 3], [[f64; 3]; 3])> {
    let mut centre = Vector3::zeros();
    for x in samples.clone() {
        centre += Vector3::from(*x) / count as f64;
    }
    let mut spread = Matrix3::zeros();
    for x in samples {
        let d = Vector3::from(*x) - centre;
        spread += d * d.transpose() / count as f64;
    }
    let eigen = spread.symmetric_eigen();
    // Samples of one element of order 2 span space, those of one of order 1 are a point.
    let smallest = eigen.eigenvalues.min();
    if smallest.is_nan() || smallest <= 1e-12 * eigen.eigenvalues.max() {
        return None;
    }
    let axes = std::array::from_fn(|k| {
        let scale = 0.5 / eigen.eigenvalues[k].sqrt();
        let axis = eigen.eigenvectors.column(k);
        [0, 1, 2].map(|c| axis[c] * scale)
    });
    Some((centre.into(), axes))
}

//! What would make the stiffness singular or wrong, found before it is assembled.

use super::Mesh;
use crate::element::{MAX_NODES, Order};
use crate::geometry::{determinant, jacobian};
use crate::supports::{self, Supports};
use crate::{Error, quadrature};

impl Mesh {
    /// Finds inverted elements, loose pieces and free rigid motions; returns warnings about what
    /// can be lived with.
    ///
    /// # Errors
    /// [`Error::Inverted`], [`Error::LoosePiece`], [`Error::FreeRigidMotion`]: named by tags of
    /// the mesh file.
    pub fn check(&self, supports: &Supports) -> Result<Vec<String>, Error> {
        self.check_elements()?;
        self.check_supports(supports)?;
        Ok(self.warnings())
    }

    /// How small det J gets in an element, m³ (6 times the volume for straight elements); not
    /// finite if it overflows.
    ///
    /// Order 1: the value. Order 2: a lower bound, so that a positive answer proves the element
    /// valid. Order 3: the smallest of samples at the nodes and 125 points inside; a fold that is
    /// narrower than their distance is not seen.
    pub fn smallest_jacobian(&self, element: usize) -> f64 {
        let x = self.element_coordinates(element);
        match self.order {
            Order::Linear => det_at(self.order, &x, [0.25; 4]),
            Order::Quadratic => smallest_bernstein(&x),
            // det J of tet20 is of degree 6: sampled at the nodes and at a rule of degree 9.
            Order::Cubic => self
                .order
                .node_coordinates()
                .into_iter()
                .chain(
                    quadrature::tetrahedron(9)
                        .into_iter()
                        .map(|p| p.coordinates),
                )
                .map(|l| det_at(self.order, &x, l))
                .fold(f64::INFINITY, smaller),
        }
    }

    fn check_elements(&self) -> Result<(), Error> {
        let mut worst: Option<(usize, f64)> = None;
        let mut count = 0;
        for e in 0..self.n_elements() {
            let smallest = self.smallest_jacobian(e);
            if smallest > 0.0 && smallest.is_finite() {
                continue;
            }
            count += 1;
            if worst.is_none_or(|(_, w)| smallest < w) {
                worst = Some((e, smallest));
            }
        }
        match worst {
            None => Ok(()),
            Some((e, jacobian)) => Err(Error::Inverted {
                tag: self.element_tags[e],
                jacobian,
                more: if count > 1 {
                    format!("; {} more are too", count - 1)
                } else {
                    String::new()
                },
            }),
        }
    }

    fn check_supports(&self, supports: &Supports) -> Result<(), Error> {
        let pieces = self.pieces();
        let n_pieces = pieces.iter().max().map_or(0, |p| p + 1);
        let mut nodes_of_piece = vec![Vec::new(); n_pieces as usize];
        for (e, &piece) in pieces.iter().enumerate() {
            nodes_of_piece[piece as usize].extend_from_slice(self.element_nodes(e));
        }
        for (piece, nodes) in nodes_of_piece.iter_mut().enumerate() {
            nodes.sort_unstable();
            nodes.dedup();
            let free = supports::free_rigid_motions(&self.nodes, nodes, supports);
            if free.is_empty() {
                continue;
            }
            let motions = free.join(", ");
            if n_pieces == 1 {
                return Err(Error::FreeRigidMotion { motions });
            }
            let elements: Vec<usize> = (0..pieces.len())
                .filter(|&e| pieces[e] as usize == piece)
                .collect();
            return Err(Error::LoosePiece {
                tag: self.element_tags[elements[0]],
                elements: elements.len(),
                motions,
            });
        }
        Ok(())
    }

    fn warnings(&self) -> Vec<String> {
        let mut used = vec![false; self.n_nodes()];
        for &node in &self.elements {
            used[node as usize] = true;
        }
        let unused: Vec<u64> = self
            .node_tags
            .iter()
            .zip(&used)
            .filter(|(_, used)| !**used)
            .map(|(tag, _)| *tag)
            .collect();
        let mut warnings = Vec::new();
        if let [first, ..] = unused[..] {
            warnings.push(format!(
                "{} nodes are in no element (the first is node {first}); they are held and take no part",
                unused.len()
            ));
        }
        if let Some((element, count)) = self.overlap() {
            warnings.push(format!(
                "{count} faces belong to more than two elements (the first is of element {}); \
                 elements overlap or are there twice, and their stiffness counts twice",
                self.element_tags[element as usize]
            ));
        }
        warnings
    }
}

fn det_at(order: Order, x: &[[f64; 3]; MAX_NODES], l: [f64; 4]) -> f64 {
    let (mut n, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
    order.shape(l, &mut n, &mut d);
    determinant(&jacobian(&d[..order.nodes_per_element()], x))
}

/// The smaller one; not a number if either is not, so that overflow does not pass as valid.
fn smaller(a: f64, b: f64) -> f64 {
    if a < b || a.is_nan() { a } else { b }
}

/// Smallest Bernstein coefficient of det J of a tet10, a cubic: positive coefficients prove a
/// valid element. If one is not positive, the element is divided, which sharpens the bound.
///
/// Source: Johnen, Remacle, Geuzaine 2013 (curved elements' validity by Bézier coefficients).
fn smallest_bernstein(x: &[[f64; 3]; MAX_NODES]) -> f64 {
    let whole = [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ];
    // Three divisions of the longest kind: 512 parts at most, only for elements near the limit.
    bernstein_in(x, &whole, 3)
}

fn bernstein_in(x: &[[f64; 3]; MAX_NODES], corners: &[[f64; 4]; 4], depth: u32) -> f64 {
    let at = |a: [f64; 4]| {
        let mut l = [0.0; 4];
        for (weight, corner) in a.iter().zip(corners) {
            for k in 0..4 {
                l[k] += weight * corner[k];
            }
        }
        det_at(Order::Quadratic, x, l)
    };
    let unit = |v: usize| {
        let mut l = [0.0; 4];
        l[v] = 1.0;
        l
    };
    let vertex: [f64; 4] = std::array::from_fn(|v| at(unit(v)));
    let mut lowest = vertex.iter().copied().fold(f64::INFINITY, smaller);
    // On an edge: values at 0, 1/3, 2/3, 1 of a cubic give its inner coefficients.
    let mut edge = [[0.0; 4]; 4];
    for a in 0..4 {
        for b in 0..4 {
            if a != b {
                let mut l = [0.0; 4];
                (l[a], l[b]) = (2.0 / 3.0, 1.0 / 3.0);
                edge[a][b] = at(l);
            }
        }
    }
    let mut coefficient = [[0.0; 4]; 4];
    for a in 0..4 {
        for b in 0..4 {
            if a != b {
                coefficient[a][b] = (-5.0 * vertex[a] + 18.0 * edge[a][b] - 9.0 * edge[b][a]
                    + 2.0 * vertex[b])
                    / 6.0;
                lowest = smaller(lowest, coefficient[a][b]);
            }
        }
    }
    for left_out in 0..4 {
        let face: Vec<usize> = (0..4).filter(|v| *v != left_out).collect();
        let mut l = [1.0 / 3.0; 4];
        l[left_out] = 0.0;
        let mut sum = 27.0 * at(l);
        for &a in &face {
            sum -= vertex[a];
            for &b in &face {
                if a != b {
                    sum -= 3.0 * coefficient[a][b];
                }
            }
        }
        lowest = smaller(lowest, sum / 6.0);
    }
    let is_negative_somewhere = vertex.iter().chain(edge.iter().flatten()).any(|v| *v < 0.0);
    if lowest > 0.0 || lowest.is_nan() || depth == 0 || is_negative_somewhere {
        return lowest;
    }
    divide(corners)
        .iter()
        .map(|part| bernstein_in(x, part, depth - 1))
        .fold(f64::INFINITY, smaller)
}

/// Eight parts by the mid points of the edges.
fn divide(c: &[[f64; 4]; 4]) -> [[[f64; 4]; 4]; 8] {
    let mid =
        |a: usize, b: usize| -> [f64; 4] { std::array::from_fn(|k| 0.5 * (c[a][k] + c[b][k])) };
    let (m01, m02, m03, m12, m13, m23) = (
        mid(0, 1),
        mid(0, 2),
        mid(0, 3),
        mid(1, 2),
        mid(1, 3),
        mid(2, 3),
    );
    [
        [c[0], m01, m02, m03],
        [m01, c[1], m12, m13],
        [m02, m12, c[2], m23],
        [m03, m13, m23, c[3]],
        [m01, m02, m03, m13],
        [m01, m02, m12, m13],
        [m02, m03, m13, m23],
        [m02, m12, m13, m23],
    ]
}

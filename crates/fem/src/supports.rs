//! Held degrees of freedom, and which rigid motions they leave free.

use nalgebra::{DMatrix, Matrix6};

use crate::mesh::Mesh;

/// Which components of which nodes are held.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Supports {
    held: Vec<bool>,
}

impl Supports {
    /// Nothing held.
    pub fn new(n_nodes: usize) -> Self {
        Self {
            held: vec![false; 3 * n_nodes],
        }
    }

    /// Holds the marked components of a node, in addition to those already held.
    pub fn fix_node(&mut self, node: u32, components: [bool; 3]) {
        for (held, hold) in self.held[3 * node as usize..][..3]
            .iter_mut()
            .zip(components)
        {
            *held |= hold;
        }
    }

    /// Whether a degree of freedom (3 node + component) is held.
    pub fn is_fixed(&self, dof: usize) -> bool {
        self.held[dof]
    }

    /// Whether all three components of a node are held.
    pub fn is_fixed_in_all(&self, node: u32) -> bool {
        self.held[3 * node as usize..][..3].iter().all(|h| *h)
    }

    /// Degrees of freedom that are not held, ascending.
    pub fn free_dofs(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.held.len()).filter(|&dof| !self.held[dof])
    }

    /// Rigid motions of the whole mesh that these supports leave free, in words; of each piece by
    /// itself in [`Mesh::check`].
    pub fn free_rigid_motions(&self, mesh: &Mesh) -> Vec<String> {
        let mut nodes = mesh.elements.clone();
        nodes.sort_unstable();
        nodes.dedup();
        free_rigid_motions(&mesh.nodes, &nodes, self)
    }

    /// Number of degrees of freedom, held or not.
    pub fn n_dofs(&self) -> usize {
        self.held.len()
    }
}

/// Rigid motions of the given nodes that the supports leave free, in words.
///
/// The six rigid motions, restricted to the held components, form a matrix; its null space is
/// what is left. Lengths are divided by the body's size so that turns and shifts compare.
pub(crate) fn free_rigid_motions(
    x: &[[f64; 3]],
    nodes: &[u32],
    supports: &Supports,
) -> Vec<String> {
    let n = nodes.len().max(1) as f64;
    let mut centre = [0.0; 3];
    for &node in nodes {
        for c in 0..3 {
            centre[c] += x[node as usize][c] / n;
        }
    }
    let size = nodes
        .iter()
        .flat_map(|&node| (0..3).map(move |c| (x[node as usize][c] - centre[c]).abs()))
        .fold(0.0, f64::max)
        .max(f64::MIN_POSITIVE);
    let mut rows: Vec<[f64; 6]> = Vec::new();
    for &node in nodes {
        let r: [f64; 3] = std::array::from_fn(|c| (x[node as usize][c] - centre[c]) / size);
        for c in (0..3).filter(|c| supports.is_fixed(3 * node as usize + c)) {
            let mut row = [0.0; 6];
            row[c] = 1.0;
            // Turn about axis k: e_k x r.
            for k in 0..3 {
                row[3 + k] = if c == (k + 1) % 3 {
                    -r[(k + 2) % 3]
                } else if c == (k + 2) % 3 {
                    r[(k + 1) % 3]
                } else {
                    0.0
                };
            }
            rows.push(row);
        }
    }
    let matrix = DMatrix::from_fn(rows.len(), 6, |i, j| rows[i][j]);
    let gram: Matrix6<f64> = if rows.is_empty() {
        Matrix6::zeros()
    } else {
        let product = matrix.transpose() * &matrix;
        Matrix6::from_fn(|i, j| product[(i, j)])
    };
    let eigen = gram.symmetric_eigen();
    let largest = eigen.eigenvalues.max().max(1.0);
    (0..6)
        .filter(|&i| eigen.eigenvalues[i] < 1e-10 * largest)
        .map(|i| {
            name_of(
                eigen
                    .eigenvectors
                    .column(i)
                    .iter()
                    .copied()
                    .collect::<Vec<_>>()
                    .as_slice(),
            )
        })
        .collect()
}

fn name_of(motion: &[f64]) -> String {
    const NAMES: [&str; 6] = [
        "shift along x",
        "shift along y",
        "shift along z",
        "turn about x",
        "turn about y",
        "turn about z",
    ];
    let parts: Vec<&str> = (0..6)
        .filter(|&k| motion[k].abs() > 0.3)
        .map(|k| NAMES[k])
        .collect();
    parts.join(" with ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn the_free_motions_are_those_that_move_no_held_component() {
        let free = |hold: &[(u32, [bool; 3])]| {
            let mut supports = Supports::new(4);
            for &(node, components) in hold {
                supports.fix_node(node, components);
            }
            free_rigid_motions(&CUBE, &[0, 1, 2, 3], &supports)
        };
        assert_eq!(free(&[]).len(), 6);
        assert_eq!(free(&[(0, [true; 3])]).len(), 3);
        assert_eq!(free(&[(0, [true; 3]), (1, [true; 3])]).len(), 1);
        assert!(free(&[(0, [true; 3]), (1, [true; 3]), (2, [true; 3])]).is_empty());
        let plane = [
            (0, [true, false, false]),
            (2, [true, false, false]),
            (3, [true, false, false]),
        ];
        assert_eq!(free(&plane).len(), 3);
    }
}

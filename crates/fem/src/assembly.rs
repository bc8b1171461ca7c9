//! Stiffness of the whole mesh: a sparse symmetric matrix, the same bits for any thread count.

use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use rayon::prelude::*;

use crate::Error;
use crate::element::MAX_NODES;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::quadrature::Quadrature;
use crate::stiffness::ElementRule;

/// K of all degrees of freedom (3 node + component), held or not, N/m.
#[derive(Clone, Debug)]
pub struct Stiffness {
    pub(crate) matrix: SparseColMat<u32, f64>,
}

impl Stiffness {
    /// Both triangles, rows ascending in each column.
    pub fn matrix(&self) -> &SparseColMat<u32, f64> {
        &self.matrix
    }

    /// Number of degrees of freedom.
    pub fn n_dofs(&self) -> usize {
        self.matrix.ncols()
    }

    /// K u, N.
    pub fn multiply(&self, u: &[f64]) -> Vec<f64> {
        let mut f = vec![0.0; u.len()];
        for (j, &x) in u.iter().enumerate() {
            if x != 0.0 {
                for (i, k) in self.column(j) {
                    f[i] += k * x;
                }
            }
        }
        f
    }

    /// ½ uᵀ K u, J.
    pub fn strain_energy(&self, u: &[f64]) -> f64 {
        0.5 * self
            .multiply(u)
            .iter()
            .zip(u)
            .map(|(f, u)| f * u)
            .sum::<f64>()
    }

    /// Rows and values of a column.
    pub(crate) fn column(&self, j: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.matrix.symbolic().col_range(j);
        let rows = &self.matrix.symbolic().row_idx()[range.clone()];
        rows.iter()
            .zip(&self.matrix.val()[range])
            .map(|(&i, &v)| (i as usize, v))
    }
}

/// Elements whose matrices are in memory at a time.
const CHUNK: usize = 2048;

/// Sums the element matrices. `material_of_element[e]` is an index into `materials`.
///
/// # Errors
/// [`Error::TooLarge`] if the matrix has more entries than 32-bit indices count.
///
/// # Panics
/// If `material_of_element` does not fit the mesh (a programmer's mistake).
pub fn assemble_stiffness(
    mesh: &Mesh,
    materials: &[Material],
    material_of_element: &[u32],
    quadrature: Quadrature,
) -> Result<Stiffness, Error> {
    assert_eq!(
        material_of_element.len(),
        mesh.n_elements(),
        "one material for each element"
    );
    let n_local = mesh.order.nodes_per_element();
    let size = 3 * n_local;
    let neighbours = neighbours(mesh);
    let matrix_entries = neighbours.iter().map(|n| 9 * n.len() as u64).sum::<u64>();
    if matrix_entries > u64::from(u32::MAX) {
        return Err(Error::TooLarge(format!(
            "{matrix_entries} entries of the stiffness"
        )));
    }
    let mut column_start = Vec::with_capacity(3 * mesh.n_nodes() + 1);
    let mut rows = Vec::with_capacity(matrix_entries as usize);
    column_start.push(0u32);
    for list in &neighbours {
        for _ in 0..3 {
            rows.extend(
                list.iter()
                    .flat_map(|&node| [3 * node, 3 * node + 1, 3 * node + 2]),
            );
            column_start.push(rows.len() as u32);
        }
    }
    let mut values = vec![0.0; rows.len()];

    // Element matrices in parallel, their sum in the order of the elements: the same bits always.
    let rule = ElementRule::new(mesh.order, quadrature);
    let mut chunk = vec![0.0; CHUNK.min(mesh.n_elements().max(1)) * size * size];
    for first in (0..mesh.n_elements()).step_by(CHUNK) {
        let count = CHUNK.min(mesh.n_elements() - first);
        chunk
            .par_chunks_exact_mut(size * size)
            .take(count)
            .enumerate()
            .for_each(|(i, k)| {
                let e = first + i;
                let x: [[f64; 3]; MAX_NODES] = mesh.element_coordinates(e);
                rule.stiffness(&x, &materials[material_of_element[e] as usize], k);
            });
        for (i, k) in chunk.chunks_exact(size * size).take(count).enumerate() {
            let nodes = mesh.element_nodes(first + i);
            for (b, &column_node) in nodes.iter().enumerate() {
                let list = &neighbours[column_node as usize];
                for (a, row_node) in nodes.iter().enumerate() {
                    // The neighbour list holds every node of the element.
                    let at = list.partition_point(|n| n < row_node);
                    for c in 0..3 {
                        let start = column_start[3 * column_node as usize + c] as usize + 3 * at;
                        for r in 0..3 {
                            values[start + r] += k[(3 * a + r) * size + 3 * b + c];
                        }
                    }
                }
            }
        }
    }
    let n = 3 * mesh.n_nodes();
    let symbolic = SymbolicSparseColMat::new_checked(n, n, column_start, None, rows);
    Ok(Stiffness {
        matrix: SparseColMat::new(symbolic, values),
    })
}

/// Nodes that share an element with each node, ascending, itself included.
fn neighbours(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut lists: Vec<Vec<u32>> = vec![Vec::new(); mesh.n_nodes()];
    for e in 0..mesh.n_elements() {
        let nodes = mesh.element_nodes(e);
        for &node in nodes {
            lists[node as usize].extend_from_slice(nodes);
        }
    }
    lists.par_iter_mut().enumerate().for_each(|(i, list)| {
        // A node of no element keeps a place on the diagonal; it is held.
        list.push(i as u32);
        list.sort_unstable();
        list.dedup();
    });
    lists
}

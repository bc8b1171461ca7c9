//! Strain at the skin, recovered from where elements are most accurate.
//!
//! Strains of displacement elements are good inside and poor where they are largest, at the surface. Superconvergent
//! patch recovery (Zienkiewicz and Zhu 1992) fits, for each vertex of the skin, one polynomial of the elements' order to
//! the strains at the Gauss points of the elements around it, by least squares, and takes its value at the surface:
//!
//! ```text
//! P_v(x) = m(x)ᵀ a_v        m: all monomials up to degree p, 3 at most      a_v: min Σ_k |P_v(x_k) - ε_h(x_k)|²
//! ε*(x)  = Σ_v L_v(x) P_v(x)        on a face with vertices v and barycentric coordinates L_v
//! ```
//!
//! ε* is continuous, needs no material, and is exact where the elements are: for strains of degree p - 1 on straight
//! elements, for uniform ones on curved elements. A patch that is too small or too flat for its polynomial is widened by
//! the neighbours of its elements; where no more are left, the degree is lowered. At edges, corners and one-layered walls
//! the fit is one-sided.
//!
//! Error: the larger of what separates ε* from the elements' own strain at the place (Zienkiewicz and Zhu) and from the
//! same fit of one degree less, see [`RecoveredStrain::error`].
//!
//! Source: Zienkiewicz, Zhu, "The superconvergent patch recovery and a posteriori error estimates", Int. J. Numer. Meth.
//! Eng. 33 (1992) 1331-1382. Blending of patches as in Blacker, Belytschko, ibid. 37 (1994) 517-536.

mod patch;

use rayon::prelude::*;

use crate::element::{MAX_FACE_NODES, MAX_NODES, Order};
use crate::mesh::{Face, Mesh};
use crate::quadrature;
use crate::stress::{Tensor, displacement_gradient, largest_principal, strain};
use patch::{Coefficients, Neighbours, Patch};

/// Components of a symmetric tensor that are kept: xx, yy, zz, xy, yz, zx.
const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)];

/// What recovery needs of the geometry; made once for a mesh, used for any displacement of it.
#[derive(Debug)]
pub struct Recovery<'a> {
    mesh: &'a Mesh,
    /// Local coordinates of the sampling points of an element.
    points: Vec<[f64; 4]>,
    /// Where they are, m: `points.len()` for each element.
    places: Vec<[f64; 3]>,
    faces: Vec<Face>,
    /// Nodes of the skin, ascending.
    nodes: Vec<u32>,
    /// For each of them: patches and weights, and the elements it belongs to.
    shares: Vec<Vec<(u32, f64)>>,
    owners: Vec<Vec<u32>>,
    patches: Vec<Patch>,
    /// By node; `u32::MAX` where there is none.
    patch_of_vertex: Vec<u32>,
}

impl<'a> Recovery<'a> {
    /// Fits the patches of all vertices of the skin.
    pub fn new(mesh: &'a Mesh) -> Self {
        let points: Vec<[f64; 4]> = quadrature::tetrahedron(mesh.order.stiffness_degree())
            .iter()
            .map(|p| p.coordinates)
            .collect();
        let places: Vec<[f64; 3]> = (0..mesh.n_elements())
            .into_par_iter()
            .flat_map_iter(|e| points.iter().map(move |l| place(mesh, e, *l)))
            .collect();
        let faces = mesh.boundary_faces();
        let neighbours = Neighbours::of(mesh);
        let mut vertices: Vec<u32> = faces.iter().flat_map(|f| f.nodes[..3].to_vec()).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let patches: Vec<Patch> = vertices
            .par_iter()
            .map(|&v| Patch::around(mesh, v, &neighbours, &places, points.len()))
            .collect();
        let mut patch_of_vertex = vec![u32::MAX; mesh.n_nodes()];
        for (i, &v) in vertices.iter().enumerate() {
            patch_of_vertex[v as usize] = i as u32;
        }
        let mut shares_of: Vec<Vec<(u32, f64)>> = vec![Vec::new(); mesh.n_nodes()];
        let mut owners_of: Vec<Vec<u32>> = vec![Vec::new(); mesh.n_nodes()];
        let on_face = face_coordinates(mesh.order);
        for face in &faces {
            for (&node, l) in face.nodes.iter().zip(&on_face) {
                if !shares_of[node as usize].is_empty() {
                    continue;
                }
                let shares = (0..3).filter(|&k| l[k] > 0.0);
                shares_of[node as usize] = shares
                    .map(|k| (patch_of_vertex[face.nodes[k] as usize], l[k]))
                    .collect();
                // Every element with this node has the vertices of its edge or face too.
                let vertex = (0..3).find(|&k| l[k] > 0.0).map_or(node, |k| face.nodes[k]);
                owners_of[node as usize] = neighbours
                    .at(vertex)
                    .iter()
                    .copied()
                    .filter(|&e| mesh.element_nodes(e as usize).contains(&node))
                    .collect();
            }
        }
        let nodes: Vec<u32> = (0..mesh.n_nodes() as u32)
            .filter(|&n| !shares_of[n as usize].is_empty())
            .collect();
        let pick = |of: &mut Vec<Vec<_>>| -> Vec<Vec<_>> {
            nodes
                .iter()
                .map(|&n| std::mem::take(&mut of[n as usize]))
                .collect()
        };
        let shares = pick(&mut shares_of);
        let owners = nodes
            .iter()
            .map(|&n| std::mem::take(&mut owners_of[n as usize]))
            .collect();
        Self {
            mesh,
            points,
            places,
            faces,
            shares,
            owners,
            nodes,
            patches,
            patch_of_vertex,
        }
    }

    /// Nodes of the skin, ascending: where [`RecoveredStrain::at_nodes`] has values.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Faces of the skin, as [`Mesh::boundary_faces`] gives them.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// Recovers the strain of a displacement (3 node + component, m).
    pub fn strain<'r>(&'r self, u: &'r [f64]) -> RecoveredStrain<'r> {
        let samples: Vec<[f64; 6]> = (0..self.mesh.n_elements())
            .into_par_iter()
            .flat_map_iter(|e| {
                self.points.iter().map(move |l| {
                    let eps = strain(&displacement_gradient(self.mesh, u, e, *l));
                    PAIRS.map(|(i, j)| eps[i][j])
                })
            })
            .collect();
        let coefficients: Vec<Coefficients> = self
            .patches
            .par_iter()
            .map(|p| p.fit(&self.places, &samples, self.points.len()))
            .collect();
        let at_nodes = (0..self.nodes.len())
            .into_par_iter()
            .map(|i| self.blend(&coefficients, &self.shares[i], self.place_of(i), false))
            .collect();
        RecoveredStrain {
            recovery: self,
            u,
            coefficients,
            at_nodes,
        }
    }

    fn place_of(&self, i: usize) -> [f64; 3] {
        self.mesh.nodes[self.nodes[i] as usize]
    }

    fn blend(
        &self,
        coefficients: &[Coefficients],
        shares: &[(u32, f64)],
        x: [f64; 3],
        is_lower: bool,
    ) -> Tensor {
        let mut sum = [0.0; 6];
        for &(patch, weight) in shares {
            let value =
                self.patches[patch as usize].value(&coefficients[patch as usize], x, is_lower);
            for (s, v) in sum.iter_mut().zip(value) {
                *s += weight * v;
            }
        }
        full(sum)
    }
}

/// Strain of one displacement at the skin.
#[derive(Debug)]
pub struct RecoveredStrain<'r> {
    recovery: &'r Recovery<'r>,
    u: &'r [f64],
    coefficients: Vec<Coefficients>,
    at_nodes: Vec<Tensor>,
}

impl RecoveredStrain<'_> {
    /// Strain at each of [`Recovery::nodes`].
    pub fn at_nodes(&self) -> &[Tensor] {
        &self.at_nodes
    }

    /// Strain at a point of a face of the skin, by its number in [`Recovery::faces`] and barycentric coordinates.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn on_face(&self, face: usize, l: [f64; 3]) -> Tensor {
        let recovery = self.recovery;
        let nodes = &recovery.faces[face].nodes;
        let (mut n, mut d) = ([0.0; MAX_FACE_NODES], [[0.0; 3]; MAX_FACE_NODES]);
        crate::element::face_shape(recovery.mesh.order, l, &mut n, &mut d);
        let x = std::array::from_fn(|c| {
            let along = nodes.iter().zip(&n);
            along
                .map(|(&node, n)| n * recovery.mesh.nodes[node as usize][c])
                .sum()
        });
        let shares: [(u32, f64); 3] =
            std::array::from_fn(|k| (recovery.patch_of_vertex[nodes[k] as usize], l[k]));
        recovery.blend(&self.coefficients, &shares, x, false)
    }

    /// The largest [`RecoveredStrain::error`] of the faces at the `i`-th node of [`Recovery::nodes`]. For the largest strain
    /// of a part: at a single node both fits may agree by chance.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn error_around(&self, i: usize) -> f64 {
        let recovery = self.recovery;
        let node = recovery.nodes[i];
        let faces = recovery.faces.iter().filter(|f| f.nodes.contains(&node));
        let mut around: Vec<u32> = faces.flat_map(|f| &f.nodes).copied().collect();
        around.sort_unstable();
        around.dedup();
        let places = around
            .iter()
            .filter_map(|n| recovery.nodes.binary_search(n).ok());
        places.map(|k| self.error(k)).fold(self.error(i), f64::max)
    }

    /// Estimated error of the principal strains at the `i`-th node of [`Recovery::nodes`]: the larger of
    ///
    /// ```text
    /// mean over the node's elements of |ε* - ε_h|        (Zienkiewicz and Zhu)
    /// |ε* - the same fits of degree p - 1|
    /// ```
    ///
    /// |.| being the largest principal value by size, by which principal strains can move (Weyl). Measures the strain of
    /// the elements, so that it is on the safe side for ε* where the field is smooth. At singular places (point loads,
    /// clamped borders, inner edges) it is of the size of the strain itself.
    ///
    /// # Panics
    /// If there is no such node.
    pub fn error(&self, i: usize) -> f64 {
        let recovery = self.recovery;
        let here = &self.at_nodes[i];
        let node = recovery.nodes[i];
        let corners = recovery.mesh.order.node_coordinates();
        let owners = &recovery.owners[i];
        let mut sum = 0.0;
        for &e in owners {
            let nodes = recovery.mesh.element_nodes(e as usize);
            if let Some(k) = nodes.iter().position(|n| *n == node) {
                let gradient = displacement_gradient(recovery.mesh, self.u, e as usize, corners[k]);
                sum += largest_principal(&difference(here, &strain(&gradient)));
            }
        }
        let lower = recovery.blend(
            &self.coefficients,
            &recovery.shares[i],
            recovery.place_of(i),
            true,
        );
        let own = sum / owners.len().max(1) as f64;
        own.max(largest_principal(&difference(here, &lower)))
    }
}

/// Barycentric coordinates of the nodes of a face, in the order of [`Face::nodes`].
fn face_coordinates(order: Order) -> Vec<[f64; 3]> {
    let nodes = order.node_coordinates();
    let vertices = crate::element::FACE_VERTICES[0];
    order
        .face_nodes(0)
        .into_iter()
        .map(|i| vertices.map(|v| nodes[i][v]))
        .collect()
}

/// Where a local point of an element is, m.
fn place(mesh: &Mesh, element: usize, l: [f64; 4]) -> [f64; 3] {
    let (mut n, mut d) = ([0.0; MAX_NODES], [[0.0; 4]; MAX_NODES]);
    mesh.order.shape(l, &mut n, &mut d);
    let nodes = mesh.element_nodes(element);
    std::array::from_fn(|c| {
        nodes
            .iter()
            .zip(&n)
            .map(|(&node, n)| n * mesh.nodes[node as usize][c])
            .sum()
    })
}

fn full(values: [f64; 6]) -> Tensor {
    let mut t = [[0.0; 3]; 3];
    for ((i, j), v) in PAIRS.into_iter().zip(values) {
        (t[i][j], t[j][i]) = (v, v);
    }
    t
}

fn difference(a: &Tensor, b: &Tensor) -> Tensor {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] - b[i][j]))
}

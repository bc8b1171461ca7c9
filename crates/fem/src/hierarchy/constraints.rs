//! Nodes that follow others, as weights.

use crate::supports::Supports;

/// Where a constraint puts a node of a curved edge or face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// The weights of a straight edge or face on every one: `u_ab = (u_a + u_b)/2`. On a curved
    /// edge a rigid turn then strains the part. For comparison.
    Plain,
    /// Exact for affine fields, hence for rigid motions, on curved edges and faces also. Equal to
    /// [`Rule::Plain`] on straight ones.
    AffineExact,
}

/// Nodes that follow others: `u_node = Σ w_k u_k`.
///
/// The nodes followed do not follow themselves. A constraint acts on each component by itself. A
/// component that the supports hold stays held and does not follow; one that is held at a followed
/// node counts with the displacement it is held at.
#[derive(Clone, Debug, PartialEq)]
pub struct Constraints {
    nodes: Vec<u32>,
    held: Vec<[bool; 3]>,
    /// Weights of node `k` of the list: `weights[starts[k]..starts[k + 1]]`.
    starts: Vec<usize>,
    weights: Vec<(u32, f64)>,
    n_dofs: usize,
}

/// How one node follows others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constraint<'a> {
    /// The node that follows.
    pub node: u32,
    /// Components that the supports hold: they do not follow.
    pub held: [bool; 3],
    /// Nodes followed, ascending, with weights that sum to 1, the same for x, y and z.
    pub weights: &'a [(u32, f64)],
}

impl Constraint<'_> {
    /// `Σ w_k u_k` of a displacement of all degrees of freedom, m; held components too.
    pub fn interpolate(&self, u: &[f64]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for &(k, w) in self.weights {
            for (sum, u) in sum.iter_mut().zip(&u[3 * k as usize..][..3]) {
                *sum += w * u;
            }
        }
        sum
    }
}

impl Constraints {
    /// By ascending nodes, each once.
    pub(super) fn new(constraints: Vec<(u32, Vec<(u32, f64)>)>, supports: &Supports) -> Self {
        let mut all = Self {
            nodes: Vec::with_capacity(constraints.len()),
            held: Vec::with_capacity(constraints.len()),
            starts: vec![0],
            weights: Vec::new(),
            n_dofs: supports.n_dofs(),
        };
        for (node, weights) in constraints {
            all.nodes.push(node);
            all.held.push(std::array::from_fn(|c| {
                supports.is_fixed(3 * node as usize + c)
            }));
            all.weights.extend(weights);
            all.starts.push(all.weights.len());
        }
        all
    }

    /// Nodes that follow, ascending.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Number of degrees of freedom of the mesh.
    pub fn n_dofs(&self) -> usize {
        self.n_dofs
    }

    /// How a node follows, if it does. Does not allocate.
    pub fn of_node(&self, node: u32) -> Option<Constraint<'_>> {
        self.nodes.binary_search(&node).ok().map(|k| self.at(k))
    }

    /// All constraints, by ascending nodes. Does not allocate.
    pub fn iter(&self) -> impl Iterator<Item = Constraint<'_>> {
        (0..self.nodes.len()).map(|k| self.at(k))
    }

    /// Overwrites the displacements of the nodes that follow, but for held components. Does not
    /// allocate.
    ///
    /// # Panics
    /// If `u` is not of all degrees of freedom (a programmer's mistake).
    pub fn apply(&self, u: &mut [f64]) {
        assert_eq!(u.len(), self.n_dofs, "one displacement for each");
        for constraint in self.iter() {
            let value = constraint.interpolate(u);
            for c in (0..3).filter(|&c| !constraint.held[c]) {
                u[3 * constraint.node as usize + c] = value[c];
            }
        }
    }

    /// How far each node that follows is in `u` from where it would follow to, m: the error of
    /// interpolating it, and the indicator of where order is missing. Does not allocate.
    pub fn departures<'a>(&'a self, u: &'a [f64]) -> impl Iterator<Item = (u32, f64)> + 'a {
        self.iter().map(move |constraint| {
            let value = constraint.interpolate(u);
            let square: f64 = (0..3)
                .filter(|&c| !constraint.held[c])
                .map(|c| (u[3 * constraint.node as usize + c] - value[c]).powi(2))
                .sum();
            (constraint.node, square.sqrt())
        })
    }

    fn at(&self, k: usize) -> Constraint<'_> {
        Constraint {
            node: self.nodes[k],
            held: self.held[k],
            weights: &self.weights[self.starts[k]..self.starts[k + 1]],
        }
    }
}

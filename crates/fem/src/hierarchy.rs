//! Principal and interface nodes, and the constraints by which interface nodes follow.
//!
//! Principal nodes p are the vertices of the elements, interface nodes i the nodes on their edges
//! and faces. Near the contact interface nodes are free; the others follow their principal nodes,
//! `u_ic = G(u_p)` (Duriez et al. 2004, section 3.2).
//!
//! ```text
//! a --------- m --------- b     order 1 on 2    u_m = (u_a + u_b)/2
//! a ---- 1 ------- 2 ---- b     order 1 on 3    u_1 = (2 u_a + u_b)/3, u_2 = (u_a + 2 u_b)/3,
//!                                               face centre: mean of the three vertices
//!                               order 2 on 3    u_2 = u_1 + (u_b - u_a)/3,
//!                                               face centre: -1/6 vertices + 1/4 edge nodes
//! ```
//!
//! Whether an edge or face is lowered is a property of that edge or face, not of an element, so
//! that neighbours agree. The plain rules hold on straight edges. On a curved edge the node is
//! beside the place of the plain rule, by d, and the plain rule makes forces from a rigid turn.
//! Here each constraint is exact for affine fields:
//!
//! ```text
//! u_node = Σ w_k u_k + A d       d = x_node - Σ w_k x_k       A d = Σ_v (∇L_v · d) u_v
//! ```
//!
//! A is the displacement gradient of the affine field through the four vertices of an element,
//! averaged by volume over the elements at the edge or face. It is linear in the vertices'
//! displacements: the constraint stays a list of scalar weights, the same for x, y and z, with
//! `Σ w_k = 1` and `Σ w_k x_k = x_node`.

mod constraints;

use crate::element::{FACE_VERTICES, Order};
use crate::mesh::Mesh;
use crate::supports::Supports;

pub use constraints::{Constraint, Constraints, Rule};

/// Which nodes are principal, which are interface nodes, and on which edge or face these are.
#[derive(Clone, Debug)]
pub struct Hierarchy {
    order: Order,
    nodes: Vec<[f64; 3]>,
    principal_nodes: Vec<u32>,
    interface_nodes: Vec<u32>,
    edges: Vec<Edge>,
    faces: Vec<CentredFace>,
    /// Where each interface node is, in the order of `interface_nodes`.
    places: Vec<Place>,
}

/// An edge of the mesh with the nodes on it.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Its two vertices, the smaller number first.
    pub vertices: [u32; 2],
    /// Its interface nodes, from the first vertex to the second: one (tet10) or two (tet20).
    pub nodes: Vec<u32>,
    /// `∇L_v` of the vertices of the elements at the edge, averaged: A d = Σ (g_v · d) u_v, 1/m.
    gradient: Vec<(u32, [f64; 3])>,
}

/// A face with a node in its middle (tet20).
#[derive(Clone, Debug)]
struct CentredFace {
    vertices: [u32; 3],
    node: u32,
    /// Indices of its edges in [`Hierarchy::edges`].
    edges: [u32; 3],
    gradient: Vec<(u32, [f64; 3])>,
}

#[derive(Clone, Copy, Debug)]
enum Place {
    /// Node `k` of edge `edge`.
    Edge { edge: u32, k: u8 },
    /// The middle of a face.
    Face(u32),
}

impl Hierarchy {
    /// Sorts the nodes of a mesh. A node of no element is neither principal nor interface.
    pub fn of(mesh: &Mesh) -> Self {
        let mut principal_nodes: Vec<u32> = (0..mesh.n_elements())
            .flat_map(|e| mesh.element_nodes(e)[..4].to_vec())
            .collect();
        principal_nodes.sort_unstable();
        principal_nodes.dedup();

        let edges = edges(mesh);
        let faces = centred_faces(mesh, &edges);
        let mut places: Vec<(u32, Place)> = Vec::new();
        for (edge, i) in edges.iter().zip(0..) {
            let at = |k| Place::Edge { edge: i, k };
            places.extend(edge.nodes.iter().zip(0..).map(|(&node, k)| (node, at(k))));
        }
        places.extend(faces.iter().zip(0..).map(|(f, i)| (f.node, Place::Face(i))));
        places.sort_unstable_by_key(|(node, _)| *node);
        let (interface_nodes, places) = places.into_iter().unzip();
        Self {
            order: mesh.order,
            nodes: mesh.nodes.clone(),
            principal_nodes,
            interface_nodes,
            edges,
            faces,
            places,
        }
    }

    /// Vertices of the elements, ascending.
    pub fn principal_nodes(&self) -> &[u32] {
        &self.principal_nodes
    }

    /// Nodes on edges and faces, ascending.
    pub fn interface_nodes(&self) -> &[u32] {
        &self.interface_nodes
    }

    /// Whether the node is a vertex of an element.
    pub fn is_principal(&self, node: u32) -> bool {
        self.principal_nodes.binary_search(&node).is_ok()
    }

    /// Whether the node is on an edge or face.
    pub fn is_interface(&self, node: u32) -> bool {
        self.interface_nodes.binary_search(&node).is_ok()
    }

    /// Edges with their nodes, by ascending vertices; none of a mesh of order 1.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Makes each of these interface nodes follow its principal nodes (order 1 on 2, 1 on 3); the
    /// other interface nodes are free. The list may be in any order.
    ///
    /// # Panics
    /// If a node is not an interface node, or the supports are of another mesh (a programmer's
    /// mistake).
    pub fn constrain(
        &self,
        constrained_interface: &[u32],
        supports: &Supports,
        rule: Rule,
    ) -> Constraints {
        let constraints = constrained_interface
            .iter()
            .map(|&node| (node, self.follow_principal(node, rule)))
            .collect();
        self.collect(constraints, supports)
    }

    /// Lowers each edge to the order given for it (in the order of [`Self::edges`]); a face keeps
    /// the node in its middle free if none of its edges was lowered, else it carries what its
    /// edges give it.
    ///
    /// An edge of order 2 on a tet20 keeps free the node nearer to the vertex of smaller number.
    ///
    /// # Panics
    /// If there is not one order for each edge, or the supports are of another mesh (a
    /// programmer's mistake).
    pub fn constrain_edges(
        &self,
        order_of_edge: &[Order],
        supports: &Supports,
        rule: Rule,
    ) -> Constraints {
        assert_eq!(
            order_of_edge.len(),
            self.edges.len(),
            "one order for each edge"
        );
        let mut constraints = Vec::new();
        for (edge, &order) in self.edges.iter().zip(order_of_edge) {
            if order == Order::Linear {
                for k in 0..edge.nodes.len() {
                    constraints.push((edge.nodes[k], self.linear_on_edge(edge, k, rule)));
                }
            } else if order < self.order {
                constraints.push((edge.nodes[1], self.quadratic_on_edge(edge, rule)));
            }
        }
        constraints.sort_unstable_by_key(|(node, _)| *node);
        let mut of_faces = Vec::new();
        for face in &self.faces {
            let orders = face.edges.map(|e| order_of_edge[e as usize]);
            if orders == [Order::Linear; 3] {
                of_faces.push((face.node, self.linear_on_face(face, rule)));
            } else if orders.iter().any(|o| *o < self.order) {
                let weights = self.edges_on_face(face, &constraints, rule);
                of_faces.push((face.node, weights));
            }
        }
        constraints.extend(of_faces);
        self.collect(constraints, supports)
    }

    /// Sorts the constraints and marks what the supports hold.
    fn collect(
        &self,
        mut constraints: Vec<(u32, Vec<(u32, f64)>)>,
        supports: &Supports,
    ) -> Constraints {
        assert_eq!(
            supports.n_dofs(),
            3 * self.nodes.len(),
            "supports of this mesh"
        );
        constraints.sort_by_key(|(node, _)| *node);
        constraints.dedup_by_key(|(node, _)| *node);
        Constraints::new(constraints, supports)
    }

    fn follow_principal(&self, node: u32, rule: Rule) -> Vec<(u32, f64)> {
        let place = self.interface_nodes.binary_search(&node);
        match place.map(|i| self.places[i]) {
            Ok(Place::Edge { edge, k }) => {
                self.linear_on_edge(&self.edges[edge as usize], k as usize, rule)
            }
            Ok(Place::Face(face)) => self.linear_on_face(&self.faces[face as usize], rule),
            Err(_) => panic!("node {node} is not an interface node"),
        }
    }

    fn linear_on_edge(&self, edge: &Edge, k: usize, rule: Rule) -> Vec<(u32, f64)> {
        let parts = (edge.nodes.len() + 1) as f64;
        let [a, b] = edge.vertices;
        let w = (k + 1) as f64 / parts;
        let plain = vec![(a, (parts - (k + 1) as f64) / parts), (b, w)];
        self.make_affine_exact(edge.nodes[k], plain, &edge.gradient, rule)
    }

    fn quadratic_on_edge(&self, edge: &Edge, rule: Rule) -> Vec<(u32, f64)> {
        let [a, b] = edge.vertices;
        let plain = vec![(a, -1.0 / 3.0), (b, 1.0 / 3.0), (edge.nodes[0], 1.0)];
        self.make_affine_exact(edge.nodes[1], plain, &edge.gradient, rule)
    }

    fn linear_on_face(&self, face: &CentredFace, rule: Rule) -> Vec<(u32, f64)> {
        let plain = face.vertices.map(|v| (v, 1.0 / 3.0)).to_vec();
        self.make_affine_exact(face.node, plain, &face.gradient, rule)
    }

    /// -1/6 of the vertices and 1/4 of the edge nodes: exact for quadratic fields, and the mean
    /// of the vertices if all edges are linear. Edge nodes that follow are replaced by what they
    /// follow; `constraints` are those of the edges, by ascending nodes.
    fn edges_on_face(
        &self,
        face: &CentredFace,
        constraints: &[(u32, Vec<(u32, f64)>)],
        rule: Rule,
    ) -> Vec<(u32, f64)> {
        let mut plain = face.vertices.map(|v| (v, -1.0 / 6.0)).to_vec();
        for edge in face.edges {
            plain.extend(self.edges[edge as usize].nodes.iter().map(|&n| (n, 0.25)));
        }
        let exact = self.make_affine_exact(face.node, plain, &face.gradient, rule);
        let mut weights = Vec::new();
        for (node, weight) in exact {
            match constraints.binary_search_by_key(&node, |(n, _)| *n) {
                Ok(at) => weights.extend(constraints[at].1.iter().map(|&(m, w)| (m, weight * w))),
                Err(_) => weights.push((node, weight)),
            }
        }
        sum_by_node(weights)
    }

    /// Adds `A d` to a rule, unless the node is where the rule puts it but for round-off.
    fn make_affine_exact(
        &self,
        node: u32,
        plain: Vec<(u32, f64)>,
        gradient: &[(u32, [f64; 3])],
        rule: Rule,
    ) -> Vec<(u32, f64)> {
        /// Offset over the largest coordinate that counts as none: some thousand roundings. A
        /// curve is then off by less than the solution's own round-off.
        const STRAIGHT: f64 = 1e-12;
        let mut weights = plain;
        let mut d = self.nodes[node as usize];
        let mut size = d.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        for &(k, w) in &weights {
            for (d, x) in d.iter_mut().zip(self.nodes[k as usize]) {
                *d -= w * x;
                size = size.max(x.abs());
            }
        }
        let is_straight = d.iter().all(|d| d.abs() <= STRAIGHT * size);
        if rule == Rule::AffineExact && !is_straight {
            weights.extend(gradient.iter().map(|&(v, g)| (v, dot(g, d))));
        }
        sum_by_node(weights)
    }
}

/// Edges by ascending vertices.
fn edges(mesh: &Mesh) -> Vec<Edge> {
    let on_edge = mesh.order as usize - 1;
    let mut found: Vec<([u32; 2], u32, u8)> = Vec::new();
    for e in 0..mesh.n_elements() {
        let nodes = mesh.element_nodes(e);
        for (edge, i) in mesh.order.edges().iter().zip(0..) {
            let mut vertices = edge.map(|v| nodes[v]);
            vertices.sort_unstable();
            found.push((vertices, e as u32, i));
        }
    }
    found.sort_unstable();
    found
        .chunk_by(|a, b| a.0 == b.0)
        .map(|owners| {
            let (vertices, e, i) = owners[0];
            let nodes = mesh.element_nodes(e as usize);
            let mut on = nodes[4 + on_edge * i as usize..][..on_edge].to_vec();
            if nodes[mesh.order.edges()[i as usize][0]] != vertices[0] {
                on.reverse();
            }
            Edge {
                vertices,
                nodes: on,
                gradient: mean_gradient(mesh, owners.iter().map(|o| o.1)),
            }
        })
        .collect()
}

/// Faces with a node in their middle, by ascending vertices.
fn centred_faces(mesh: &Mesh, edges: &[Edge]) -> Vec<CentredFace> {
    if mesh.order != Order::Cubic {
        return Vec::new();
    }
    let mut found: Vec<([u32; 3], u32, u32)> = Vec::new();
    for face in 0..4 {
        let local = mesh.order.face_nodes(face);
        for e in 0..mesh.n_elements() {
            let nodes = mesh.element_nodes(e);
            let mut vertices = FACE_VERTICES[face].map(|v| nodes[v]);
            vertices.sort_unstable();
            found.push((vertices, e as u32, nodes[local[9]]));
        }
    }
    found.sort_unstable();
    let edge_of = |a: u32, b: u32| edges.partition_point(|e| e.vertices < [a, b]) as u32;
    found
        .chunk_by(|a, b| a.0 == b.0)
        .map(|owners| {
            let (vertices @ [a, b, c], _, node) = owners[0];
            CentredFace {
                vertices,
                node,
                edges: [edge_of(a, b), edge_of(a, c), edge_of(b, c)],
                gradient: mean_gradient(mesh, owners.iter().map(|o| o.1)),
            }
        })
        .collect()
}

/// ∇L of the vertices of some elements with straight edges, averaged by volume: a sliver then has
/// no say.
fn mean_gradient(mesh: &Mesh, elements: impl Iterator<Item = u32>) -> Vec<(u32, [f64; 3])> {
    let mut gradient: Vec<(u32, [f64; 3])> = Vec::new();
    let mut total = 0.0;
    for e in elements {
        let vertices = &mesh.element_nodes(e as usize)[..4];
        let x = |v: usize| mesh.nodes[vertices[v] as usize];
        let from_first = |v: usize| std::array::from_fn(|c| x(v)[c] - x(0)[c]);
        let sides: [[f64; 3]; 3] = [from_first(1), from_first(2), from_first(3)];
        // Six times the volume, and that times the gradients.
        let volume = dot(sides[0], cross(sides[1], sides[2]));
        let areas: [[f64; 3]; 3] =
            std::array::from_fn(|k| cross(sides[(k + 1) % 3], sides[(k + 2) % 3]));
        let sign = volume.signum();
        for (k, area) in areas.into_iter().enumerate() {
            gradient.push((vertices[k + 1], area.map(|a| sign * a)));
            gradient.push((vertices[0], area.map(|a| -sign * a)));
        }
        total += volume.abs();
    }
    gradient.sort_by_key(|(v, _)| *v);
    gradient
        .chunk_by(|a, b| a.0 == b.0)
        .map(|parts| {
            let sum = |c: usize| parts.iter().map(|(_, g)| g[c]).sum::<f64>();
            (parts[0].0, std::array::from_fn(|c| sum(c) / total))
        })
        .collect()
}

/// Adds weights of the same node, ascending nodes, without zeros.
fn sum_by_node(mut weights: Vec<(u32, f64)>) -> Vec<(u32, f64)> {
    weights.sort_by_key(|(node, _)| *node);
    weights
        .chunk_by(|a, b| a.0 == b.0)
        .map(|parts| (parts[0].0, parts.iter().map(|(_, w)| w).sum()))
        .filter(|(_, w)| *w != 0.0)
        .collect()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    })
}

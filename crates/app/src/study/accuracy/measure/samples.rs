//! Places of the part at which displacements are compared, on whatever mesh and order.

use fem::{Hierarchy, Mesh};

use crate::prepare::PreparedPart;
use crate::session::part_extent;

/// Places of the base mesh at which displacements are compared.
#[derive(Clone, Debug)]
pub(in crate::study::accuracy) struct Samples {
    /// Tag of the node in the base mesh, place, and for a node amid an edge the tags of its ends.
    places: Vec<(u64, [f64; 3], Option<[u64; 2]>)>,
    size: f64,
}

impl Samples {
    /// The nodes that can touch; of order 1 and 2 only, whose mid nodes are amid their edges.
    pub(in crate::study::accuracy) fn of(base: &PreparedPart) -> Self {
        let mesh = &base.loaded.mesh;
        let hierarchy = Hierarchy::of(mesh);
        let mut ends = vec![None; mesh.n_nodes()];
        for edge in hierarchy.edges() {
            if let [mid] = edge.nodes[..] {
                ends[mid as usize] = Some(edge.vertices.map(|v| mesh.node_tags[v as usize]));
            }
        }
        let is_compared =
            |node: &&u32| hierarchy.is_principal(**node) || ends[**node as usize].is_some();
        let candidates = base.loaded.candidates.iter().filter(is_compared);
        Self {
            places: candidates
                .map(|&node| {
                    let node = node as usize;
                    (mesh.node_tags[node], mesh.nodes[node], ends[node])
                })
                .collect(),
            size: part_extent(mesh),
        }
    }

    /// For each place the rows whose displacements, weighted, are its own; `None` if this mesh does
    /// not have the place.
    pub(super) fn in_part(&self, part: &PreparedPart) -> Option<Vec<Vec<(usize, f64)>>> {
        let mesh = &part.loaded.mesh;
        let mut row_of = vec![None; mesh.n_nodes()];
        for (row, node) in part.loaded.rows.iter().enumerate() {
            row_of[*node as usize] = Some(row);
        }
        let hierarchy = Hierarchy::of(mesh);
        let at = |tag: u64, place: Option<[f64; 3]>| -> Option<usize> {
            let node = mesh.node_of_tag(tag)? as usize;
            let is_there = place.is_none_or(|x| distance(mesh, node, x) < 1e-9 * self.size);
            row_of[node].filter(|_| is_there)
        };
        self.places
            .iter()
            .map(|(tag, place, ends)| {
                if let Some(row) = at(*tag, Some(*place)) {
                    return Some(vec![(row, 1.0)]);
                }
                // Amid an edge of another order: its own shape functions there.
                let mut vertices = [
                    mesh.node_of_tag(ends.as_ref()?[0])?,
                    mesh.node_of_tag(ends.as_ref()?[1])?,
                ];
                vertices.sort_unstable();
                let row = |node: u32| row_of[node as usize];
                if hierarchy.edges().is_empty() {
                    let [a, b] = vertices;
                    return Some(vec![(row(a)?, 0.5), (row(b)?, 0.5)]);
                }
                let found = hierarchy
                    .edges()
                    .binary_search_by(|e| e.vertices.cmp(&vertices));
                let edge = &hierarchy.edges()[found.ok()?];
                let mut weights = Vec::new();
                let (of_vertex, of_node) = match edge.nodes.len() {
                    1 => (0.0, 1.0),
                    _ => (-1.0 / 16.0, 9.0 / 16.0),
                };
                for v in vertices {
                    weights.push((row(v)?, of_vertex));
                }
                for node in &edge.nodes {
                    weights.push((row(*node)?, of_node));
                }
                Some(weights)
            })
            .collect()
    }
}

fn distance(mesh: &Mesh, node: usize, x: [f64; 3]) -> f64 {
    let at = mesh.nodes[node];
    (0..3).map(|c| (at[c] - x[c]).powi(2)).sum::<f64>().sqrt()
}

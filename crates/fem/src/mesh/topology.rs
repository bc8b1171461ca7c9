//! Faces, surface and pieces of a mesh.

use std::collections::HashMap;

use super::{Face, Mesh};
use crate::element::FACE_VERTICES;

/// The first element that has a face, which of its faces it is, and how many elements have it.
struct FaceOwners {
    element: u32,
    face: u8,
    count: u32,
}

impl Mesh {
    /// Faces that belong to one element only, with normals out of the body.
    pub fn boundary_faces(&self) -> Vec<Face> {
        let mut boundary: Vec<(u32, u8)> = self
            .face_owners()
            .into_values()
            .filter(|o| o.count == 1)
            .map(|o| (o.element, o.face))
            .collect();
        boundary.sort_unstable();
        let local: Vec<Vec<usize>> = (0..4).map(|f| self.order.face_nodes(f)).collect();
        boundary
            .into_iter()
            .map(|(e, f)| {
                let nodes = self.element_nodes(e as usize);
                Face {
                    nodes: local[f as usize].iter().map(|&i| nodes[i]).collect(),
                }
            })
            .collect()
    }

    /// First element with a face that more than two elements have, and how many such faces.
    pub(super) fn overlap(&self) -> Option<(u32, usize)> {
        let owners = self.face_owners();
        let overlapping = owners.values().filter(|o| o.count > 2);
        let first = overlapping.clone().map(|o| o.element).min()?;
        Some((first, overlapping.count()))
    }

    /// Owners of every face, by its vertices, ascending.
    fn face_owners(&self) -> HashMap<[u32; 3], FaceOwners> {
        let mut owners = HashMap::with_capacity(2 * self.n_elements());
        for e in 0..self.n_elements() {
            let nodes = self.element_nodes(e);
            for (f, vertices) in FACE_VERTICES.iter().enumerate() {
                let mut key = vertices.map(|v| nodes[v]);
                key.sort_unstable();
                let first = FaceOwners {
                    element: e as u32,
                    face: f as u8,
                    count: 0,
                };
                owners.entry(key).or_insert(first).count += 1;
            }
        }
        owners
    }

    /// Nodes of the boundary faces, ascending.
    pub fn surface_nodes(&self) -> Vec<u32> {
        let mut nodes: Vec<u32> = self
            .boundary_faces()
            .into_iter()
            .flat_map(|f| f.nodes)
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Piece of each element, pieces numbered from 0 in the order of their first element.
    /// Elements are of one piece if they share a node.
    pub fn pieces(&self) -> Vec<u32> {
        let mut parent: Vec<u32> = (0..self.n_nodes() as u32).collect();
        fn root(parent: &mut [u32], mut i: u32) -> u32 {
            while parent[i as usize] != i {
                parent[i as usize] = parent[parent[i as usize] as usize];
                i = parent[i as usize];
            }
            i
        }
        for e in 0..self.n_elements() {
            let nodes = self.element_nodes(e);
            let first = root(&mut parent, nodes[0]);
            for &node in &nodes[1..] {
                let other = root(&mut parent, node);
                parent[other as usize] = first;
            }
        }
        let mut numbers = HashMap::new();
        (0..self.n_elements())
            .map(|e| {
                let root = root(&mut parent, self.element_nodes(e)[0]);
                let next = numbers.len() as u32;
                *numbers.entry(root).or_insert(next)
            })
            .collect()
    }
}

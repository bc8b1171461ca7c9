//! Faces, surface and pieces of a mesh.

use std::collections::HashMap;

use super::{Face, Mesh};
use crate::element::FACE_VERTICES;

impl Mesh {
    /// Faces that belong to one element only, with normals out of the body.
    pub fn boundary_faces(&self) -> Vec<Face> {
        let mut owners: HashMap<[u32; 3], (u32, u8, u8)> =
            HashMap::with_capacity(2 * self.n_elements());
        for e in 0..self.n_elements() {
            let nodes = self.element_nodes(e);
            for (f, vertices) in FACE_VERTICES.iter().enumerate() {
                let mut key = vertices.map(|v| nodes[v]);
                key.sort_unstable();
                owners.entry(key).or_insert((e as u32, f as u8, 0)).2 += 1;
            }
        }
        let mut boundary: Vec<(u32, u8)> = owners
            .into_values()
            .filter(|o| o.2 == 1)
            .map(|o| (o.0, o.1))
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

//! The faces of a prepared part that can touch, as the contact crate wants them.

use std::collections::HashMap;

use contact::surface::{FaceData, Surface};
use glam::DVec3;

use super::{LoadedPart, PreparedPart};

/// The vertices of an element without each of its four.
const WITHOUT: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];

impl PreparedPart {
    /// Faces of the contact groups all nodes of which can touch or are held; `None` if there are none, as for a group of
    /// loose nodes.
    ///
    /// # Errors
    /// A face that the contact crate refuses, which a checked mesh does not have.
    pub fn contact_surface(&self) -> Result<Option<Surface>, contact::Error> {
        let loaded = &self.loaded;
        let place = |node: u32| DVec3::from_array(loaded.mesh.nodes[node as usize]);
        let faces = touchable_faces(loaded);
        if faces.is_empty() {
            return Ok(None);
        }
        // As the engine numbers them: those that may move, then those that are held.
        let contact_nodes = loaded.candidates.iter().chain(&loaded.held).copied();
        let mut number: HashMap<u32, u32> = contact_nodes.zip(0..).collect();
        let rest: Vec<DVec3> = loaded.candidates.iter().map(|n| place(*n)).collect();
        let mut held = loaded.held_positions();
        for &node in faces.iter().flatten() {
            let next = number.len() as u32;
            number.entry(node).or_insert_with(|| {
                held.push(place(node));
                next
            });
        }
        let heights = heights(loaded, &faces);
        let data: Vec<FaceData> = faces
            .iter()
            .zip(heights)
            .map(|(nodes, height)| FaceData {
                nodes: nodes.iter().map(|node| number[node]).collect(),
                height,
            })
            .collect();
        Surface::new(&rest, held, &data).map(Some)
    }
}

fn key(vertices: &[u32]) -> [u32; 3] {
    let mut key = [vertices[0], vertices[1], vertices[2]];
    key.sort_unstable();
    key
}

/// Boundary faces of the contact groups, by their nodes, turned so that they face outward.
fn touchable_faces(loaded: &LoadedPart) -> Vec<Vec<u32>> {
    let mut is_of_face = std::collections::HashSet::new();
    let mut is_of_solid = vec![false; loaded.mesh.n_nodes()];
    for wanted in &loaded.spec.contact {
        let Some(group) = loaded.mesh.group(&wanted.name) else {
            continue;
        };
        is_of_face.extend(group.faces.iter().map(|face| key(&face.nodes)));
        if group.faces.is_empty() && !group.elements.is_empty() {
            for &node in &group.nodes {
                is_of_solid[node as usize] = true;
            }
        }
    }
    let faces = loaded.mesh.boundary_faces().into_iter();
    faces
        .map(|face| face.nodes)
        .filter(|nodes| {
            is_of_face.contains(&key(nodes)) || nodes.iter().all(|n| is_of_solid[*n as usize])
        })
        .collect()
}

/// m, by face: how high the element behind it is, from the plane of the face's vertices to the element's fourth.
fn heights(loaded: &LoadedPart, faces: &[Vec<u32>]) -> Vec<f64> {
    let of_face: HashMap<[u32; 3], usize> = faces.iter().map(|nodes| key(nodes)).zip(0..).collect();
    let place = |node: u32| DVec3::from_array(loaded.mesh.nodes[node as usize]);
    let mut heights = vec![0.0; faces.len()];
    for element in 0..loaded.mesh.n_elements() {
        let nodes = loaded.mesh.element_nodes(element);
        for (fourth, three) in WITHOUT.into_iter().enumerate() {
            if let Some(&face) = of_face.get(&key(&three.map(|v| nodes[v]))) {
                let [a, b, c] = three.map(|v| place(nodes[v]));
                let normal = (b - a).cross(c - a).normalize_or_zero();
                heights[face] = normal.dot(place(nodes[fourth]) - a).abs();
            }
        }
    }
    heights
}

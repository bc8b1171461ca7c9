//! The part's surface as it is drawn: vertices that follow the displacement, with normals that stop at creases.

use std::collections::HashMap;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

use crate::report::PartDrawing;
use crate::report::render::surface::Surface;

/// A corner of a triangle as the shader takes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Vertex {
    /// m.
    pub(super) position: [f32; 3],
    /// Outwards, of any length.
    pub(super) normal: [f32; 3],
    /// Red, green, blue and opacity; of the part the place on the colour scale, 0 to 1, and nothing else.
    pub(super) paint: [f32; 4],
}

/// A line as the shader takes it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Line {
    /// m.
    pub(super) ends: [[f32; 3]; 2],
    /// Red, green, blue, opacity.
    pub(super) colour: [f32; 4],
    /// Pixels.
    pub(super) width: f32,
}

/// An element edge, between faces that go on smoothly.
const EDGE: ([f32; 4], f32) = ([0.06, 0.07, 0.10, 0.30], 1.0);

/// Where the surface turns sharply.
const CREASE: ([f32; 4], f32) = ([0.05, 0.06, 0.09, 0.85], 1.8);

/// The surface of the part.
#[derive(Debug)]
pub(super) struct Skin {
    /// By vertex, m.
    rest: Vec<DVec3>,
    /// By vertex: row of the displacement; none of a node that does not move.
    row: Vec<Option<u32>>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Pairs of vertices, and whether they are a crease.
    edges: Vec<([u32; 2], bool)>,
}

impl Skin {
    /// `rows`: nodes whose displacement is given, in its order.
    pub(super) fn new(part: &PartDrawing, rows: &[u32]) -> Self {
        let row_of_node: HashMap<u32, u32> = rows
            .iter()
            .zip(0..)
            .map(|(&node, row)| (node, row))
            .collect();
        let surface = Surface::new(part.nodes.clone(), part.triangles.clone());
        let mut skin = Self {
            rest: Vec::new(),
            row: Vec::new(),
            triangles: Vec::with_capacity(part.triangles.len()),
            edges: Vec::new(),
        };
        // A node on a crease is a vertex for each side of it.
        let mut known: HashMap<(u32, [i32; 3]), u32> = HashMap::new();
        let mut any: HashMap<u32, u32> = HashMap::new();
        for (triangle, normals) in surface.triangles.iter().zip(&surface.corner_normals) {
            let corner = |i: usize| {
                let (node, normal) = (triangle[i], normals[i]);
                let side = (normal * 1e3).round().to_array().map(|v| v as i32);
                *known.entry((node, side)).or_insert_with(|| {
                    skin.rest.push(part.nodes[node as usize]);
                    skin.row.push(row_of_node.get(&node).copied());
                    let vertex = skin.rest.len() as u32 - 1;
                    any.entry(node).or_insert(vertex);
                    vertex
                })
            };
            skin.triangles.push([0, 1, 2].map(corner));
        }
        let pair = |ends: [u32; 2]| {
            let [a, b] = ends.map(|node| any.get(&node).copied());
            Some([a?, b?])
        };
        let lines = part.edges.iter().flat_map(|line| line.windows(2));
        let edges = lines.map(|ends| ([ends[0], ends[1]], false));
        let creases = surface.creases.iter().map(|&ends| (ends, true));
        skin.edges = edges
            .chain(creases)
            .filter_map(|(ends, is_crease)| Some((pair(ends)?, is_crease)))
            .collect();
        skin
    }

    /// Vertices, each as often as it has sides.
    pub(super) fn n_vertices(&self) -> usize {
        self.rest.len()
    }

    /// m, of a vertex under a displacement of 3 components for each row, m.
    fn place(&self, vertex: usize, displacement: &[f64]) -> (DVec3, DVec3) {
        let moved = self.row[vertex].and_then(|row| displacement.get(3 * row as usize..)?.get(..3));
        let moved = moved.map_or(DVec3::ZERO, DVec3::from_slice);
        (self.rest[vertex] + moved, moved)
    }

    /// The vertices under a displacement (3 components for each row, m), coloured by its length; `top`: m at the end of the
    /// colour scale.
    pub(super) fn vertices_into(&self, displacement: &[f64], top: f64, out: &mut Vec<Vertex>) {
        out.clear();
        out.extend((0..self.rest.len()).map(|vertex| {
            let (place, moved) = self.place(vertex, displacement);
            Vertex {
                position: place.as_vec3().to_array(),
                paint: [(moved.length() / top) as f32, 0.0, 0.0, 1.0],
                ..Vertex::default()
            }
        }));
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|v| Vec3::from_array(out[v as usize].position));
            // Twice the area times the unit normal: larger neighbours count more.
            let normal = (b - a).cross(c - a);
            for vertex in triangle.map(|v| v as usize) {
                let sum = Vec3::from_array(out[vertex].normal) + normal;
                out[vertex].normal = sum.to_array();
            }
        }
    }

    /// Element edges and creases between the given vertices.
    pub(super) fn lines_into(&self, vertices: &[Vertex], out: &mut Vec<Line>) {
        out.clear();
        out.extend(self.edges.iter().map(|(ends, is_crease)| {
            let (colour, width) = if *is_crease { CREASE } else { EDGE };
            Line {
                ends: ends.map(|v| vertices[v as usize].position),
                colour,
                width,
            }
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles at a right angle along the edge from node 0 to node 1; node 3 is held.
    fn corner() -> PartDrawing {
        PartDrawing {
            nodes: vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z],
            triangles: vec![[0, 1, 2], [1, 0, 3]],
            edges: vec![vec![0, 1]],
            ..PartDrawing::default()
        }
    }

    #[test]
    fn a_vertex_is_its_rest_place_and_its_displacement() {
        let part = corner();
        let rows = [2, 0, 1];
        let displacement = [0.0, 0.0, 0.5, 0.1, 0.0, 0.0, 0.0, -0.2, 0.0];
        let skin = Skin::new(&part, &rows);
        let mut vertices = Vec::new();
        skin.vertices_into(&displacement, 0.5, &mut vertices);
        assert_eq!(skin.n_vertices(), 6, "the crease has two sides");
        for (triangle, nodes) in skin.triangles.iter().zip(&part.triangles) {
            for (&vertex, &node) in triangle.iter().zip(nodes) {
                let row = rows.iter().position(|&n| n == node);
                let moved = row.map_or(DVec3::ZERO, |r| DVec3::from_slice(&displacement[3 * r..]));
                let expected = (part.nodes[node as usize] + moved).as_vec3();
                let drawn = vertices[vertex as usize];
                assert_eq!(drawn.position, expected.to_array());
                let share = (moved.length() / 0.5) as f32;
                assert!((drawn.paint[0] - share).abs() < 1e-6);
            }
        }
        let mut lines = Vec::new();
        skin.lines_into(&vertices, &mut lines);
        assert!(lines.iter().any(|line| line.width == CREASE.1));
    }

    #[test]
    fn normals_follow_the_displaced_surface() {
        let mut part = corner();
        part.triangles.truncate(1);
        let skin = Skin::new(&part, &[0, 1, 2]);
        let mut vertices = Vec::new();
        // Node 2 goes to z: the triangle turns by 45 degrees.
        skin.vertices_into(
            &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
            1.0,
            &mut vertices,
        );
        let normal = Vec3::from_array(vertices[0].normal).normalize();
        let expected = Vec3::new(0.0, -1.0, 1.0).normalize();
        assert!((normal - expected).length() < 1e-6, "{normal}");
    }
}

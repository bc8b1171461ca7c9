//! The part as it is drawn: flat triangles, element edges, cells.

use std::collections::HashSet;

use fem::{Face, Mesh, Order};
use glam::DVec3;

use crate::report::{CellKind, PartDrawing};

/// Triangles of a face in its local nodes: 1, 4 or 9. Orders above 3 are of the inside and never drawn: by vertices.
fn split(order: Order) -> &'static [[usize; 3]] {
    match order {
        Order::Linear | Order::Quartic | Order::Quintic => &[[0, 1, 2]],
        Order::Quadratic => &[[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]],
        Order::Cubic => &[
            [0, 3, 8],
            [3, 9, 8],
            [3, 4, 9],
            [4, 5, 9],
            [4, 1, 5],
            [8, 9, 7],
            [9, 6, 7],
            [9, 5, 6],
            [7, 6, 2],
        ],
    }
}

/// Edges of a face as polylines of its local nodes.
fn edges(order: Order) -> &'static [&'static [usize]] {
    match order {
        Order::Linear | Order::Quartic | Order::Quintic => &[&[0, 1], &[1, 2], &[2, 0]],
        Order::Quadratic => &[&[0, 3, 1], &[1, 4, 2], &[2, 5, 0]],
        Order::Cubic => &[&[0, 3, 4, 1], &[1, 5, 6, 2], &[2, 7, 8, 0]],
    }
}

pub(crate) fn part(mesh: &Mesh) -> PartDrawing {
    let faces = mesh.boundary_faces();
    PartDrawing {
        nodes: mesh.nodes.iter().map(|x| DVec3::from_array(*x)).collect(),
        triangles: faces
            .iter()
            .flat_map(|f| split(mesh.order).iter().map(|t| t.map(|i| f.nodes[i])))
            .collect(),
        edges: surface_edges(mesh.order, &faces),
        cells: mesh.elements.clone(),
        cell_kind: match mesh.order {
            Order::Linear | Order::Quartic | Order::Quintic => CellKind::Tet4,
            Order::Quadratic => CellKind::Tet10,
            Order::Cubic => CellKind::Tet20,
        },
    }
}

fn surface_edges(order: Order, faces: &[Face]) -> Vec<Vec<u32>> {
    let mut seen = HashSet::new();
    let mut lines = Vec::new();
    for face in faces {
        for edge in edges(order) {
            let line: Vec<u32> = edge.iter().map(|&i| face.nodes[i]).collect();
            let ends = (line[0], line[line.len() - 1]);
            if seen.insert((ends.0.min(ends.1), ends.0.max(ends.1))) {
                lines.push(line);
            }
        }
    }
    lines
}

/// m, between the ends of the shortest element edge on the surface.
pub(crate) fn shortest_edge(mesh: &Mesh) -> f64 {
    surface_edges(mesh.order, &mesh.boundary_faces())
        .iter()
        .map(|line| {
            let at = |i: usize| DVec3::from_array(mesh.nodes[line[i] as usize]);
            (at(0) - at(line.len() - 1)).length()
        })
        .fold(f64::INFINITY, f64::min)
}

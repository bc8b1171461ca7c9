//! Makes one of corners that differ in their last bits.
//!
//! Programs compute the points of a seam twice, or print 0 beside 1.8e-17: closed for the eye, open for a reader that
//! compares bits.

use std::collections::HashMap;

use glam::DVec3;

use super::topology::Closed;

/// Distances to try, from the round-off of numbers with 64 bits to that of numbers with 32.
pub(super) fn distances(vertices: &[DVec3]) -> Vec<f64> {
    /// Of the size. Beyond the last one two corners are two: 2 µm on a metre.
    const SHARES: [f64; 8] = [1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 2e-6];
    /// Of the largest coordinate: four steps of a 32-bit number, which far from the origin are more.
    const F32_STEPS: f64 = 4.0 * f32::EPSILON as f64;
    /// Of the size: however far the origin is, no more than this.
    const MOST: f64 = 1e-4;
    let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &vertex in vertices {
        min = min.min(vertex);
        max = max.max(vertex);
    }
    let size = (max - min).length();
    let largest = min.abs().max(max.abs()).max_element();
    let mut distances: Vec<f64> = SHARES.map(|share| share * size).to_vec();
    let of_f32 = (F32_STEPS * largest).min(MOST * size);
    if distances.last().is_some_and(|last| of_f32 > *last) {
        distances.push(of_f32);
    }
    distances.retain(|distance| *distance > 0.0 && distance.is_finite());
    distances
}

/// Marked vertices that are at most `distance` apart along each axis become the first of them; triangles that lose a
/// side go. `None` if there are no such vertices.
pub(super) fn weld(mesh: &Closed, is_marked: &[bool], distance: f64) -> Option<Closed> {
    let stays = first_within(&mesh.vertices, is_marked, distance);
    let mut welded = mesh.clone();
    welded.vertices.clear();
    let mut new_index = vec![0_u32; stays.len()];
    for (vertex, &stay) in stays.iter().enumerate() {
        if stay as usize == vertex {
            new_index[vertex] = welded.vertices.len() as u32;
            welded.vertices.push(mesh.vertices[vertex]);
        } else {
            // The first of its place has its index already.
            new_index[vertex] = new_index[stay as usize];
            let moved = (mesh.vertices[vertex] - mesh.vertices[stay as usize]).abs();
            let repair = &mut welded.repair;
            repair.n_welded_vertices += 1;
            repair.weld_distance = repair.weld_distance.max(moved.max_element());
        }
    }
    if welded.repair.n_welded_vertices == 0 {
        return None;
    }
    for corners in &mut welded.triangles {
        *corners = corners.map(|corner| new_index[corner as usize]);
    }
    welded
        .triangles
        .retain(|[a, b, c]| a != b && b != c && c != a);
    welded.repair.n_removed_triangles += mesh.triangles.len() - welded.triangles.len();
    Some(welded)
}

/// For each vertex the first one within `distance` that stays itself, or the vertex.
fn first_within(vertices: &[DVec3], is_marked: &[bool], distance: f64) -> Vec<u32> {
    let mut stays: Vec<u32> = (0..vertices.len() as u32).collect();
    let mut in_cell: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for (vertex, &place) in vertices.iter().enumerate() {
        if !is_marked[vertex] {
            continue;
        }
        let cell = (place / distance).floor().to_array().map(|x| x as i64);
        let steps = || -1..=1_i64;
        let around =
            steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| [x, y, z])));
        let near = around
            .filter_map(|step| in_cell.get(&[0, 1, 2].map(|k| cell[k].saturating_add(step[k]))))
            .flatten()
            .filter(|&&other| {
                let apart = (vertices[other as usize] - place).abs();
                apart.max_element() <= distance
            })
            .min();
        match near {
            Some(&first) => stays[vertex] = first,
            None => in_cell.entry(cell).or_default().push(vertex as u32),
        }
    }
    stays
}

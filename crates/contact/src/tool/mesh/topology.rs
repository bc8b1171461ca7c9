//! Makes a closed, outward oriented surface of a list of triangles, or says where it is not one.

use std::collections::BTreeMap;

use glam::DVec3;

use super::MeshRepair;
use super::nesting::turn_outward;
use super::weld;
use crate::error::{Coordinates, Error};

/// A checked surface.
#[derive(Debug, Clone)]
pub(super) struct Closed {
    pub(super) vertices: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) repair: MeshRepair,
    pub(super) coordinates: Coordinates,
}

/// Takes the corners as they stand where that gives a closed surface; else those at its faults that differ by no more
/// than round-off become one, by the least distance that closes it.
pub(super) fn close(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    coordinates: Coordinates,
) -> Result<Closed, Error> {
    let exact = merge(vertices, triangles, coordinates)?;
    let mut refusal = match check(exact.clone()) {
        Ok(closed) => return Ok(closed),
        Err(refusal) => refusal,
    };
    let at_fault = vertices_at_fault(&exact);
    for distance in weld::distances(&exact.vertices) {
        let Some(welded) = weld::weld(&exact, &at_fault, distance) else {
            continue;
        };
        match check(welded) {
            Ok(closed) => return Ok(closed),
            // What is left when seams are closed is the fault to mend.
            Err(less) if n_open(&less) < n_open(&refusal) => refusal = less,
            Err(_) => {}
        }
    }
    Err(refusal)
}

fn n_open(refusal: &Error) -> usize {
    match refusal {
        Error::MeshOpen { n_edges, .. } => *n_edges,
        _ => 0,
    }
}

fn check(mut mesh: Closed) -> Result<Closed, Error> {
    check_area(&mesh)?;
    let neighbours = pair_edges(&mesh)?;
    check_vertices(&mesh, &neighbours)?;
    let piece = orient(&mut mesh, &neighbours)?;
    turn_outward(&mut mesh, &piece)?;
    Ok(mesh)
}

/// Vertices at the same place become one; triangles that then lose their area go.
fn merge(
    vertices: &[DVec3],
    triangles: &[[u32; 3]],
    coordinates: Coordinates,
) -> Result<Closed, Error> {
    if let Some(index) = vertices.iter().position(|v| !v.is_finite()) {
        return Err(Error::NotFinite {
            what: "tool mesh vertex",
            index,
        });
    }
    let mut repair = MeshRepair::default();
    let mut place_of: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    let mut merged: Vec<DVec3> = Vec::new();
    let mut new_triangles = Vec::new();
    for (triangle, corners) in triangles.iter().enumerate() {
        let mut new_corners = [0; 3];
        for (new, &vertex) in new_corners.iter_mut().zip(corners) {
            let Some(&position) = vertices.get(vertex as usize) else {
                return Err(Error::MeshIndex {
                    triangle,
                    vertex,
                    n_vertices: vertices.len(),
                });
            };
            // Adding zero makes -0 equal to 0.
            let key = position.to_array().map(|x| (x + 0.0).to_bits());
            *new = *place_of.entry(key).or_insert_with(|| {
                merged.push(position);
                merged.len() as u32 - 1
            });
        }
        let [a, b, c] = new_corners;
        if a == b || b == c || c == a {
            repair.n_removed_triangles += 1;
        } else {
            new_triangles.push(new_corners);
        }
    }
    if new_triangles.is_empty() {
        return Err(Error::MeshEmpty);
    }
    repair.n_merged_vertices = vertices.len().saturating_sub(merged.len());
    Ok(Closed {
        vertices: merged,
        triangles: new_triangles,
        repair,
        coordinates,
    })
}

impl Closed {
    pub(super) fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }
}

/// Whether the triangle's normal is nothing but round-off.
fn is_flat([a, b, c]: [DVec3; 3]) -> bool {
    /// Twice the area over the longest edge squared.
    const FLAT: f64 = 1e-14;
    let longest = (b - a)
        .length_squared()
        .max((c - b).length_squared())
        .max((a - c).length_squared());
    (b - a).cross(c - a).length() <= FLAT * longest
}

fn check_area(mesh: &Closed) -> Result<(), Error> {
    let flat = (0..mesh.triangles.len()).find(|&triangle| is_flat(mesh.corners(triangle)));
    match flat {
        None => Ok(()),
        Some(triangle) => Err(Error::MeshZeroArea {
            triangle,
            position: mesh.corners(triangle).iter().sum::<DVec3>() / 3.0,
            coordinates: mesh.coordinates,
        }),
    }
}

/// Ends of edges that are not shared by two triangles, and corners of triangles without area.
fn vertices_at_fault(mesh: &Closed) -> Vec<bool> {
    let mut at_fault = vec![false; mesh.vertices.len()];
    for ((start, end), users) in edge_users(mesh) {
        if users.len() != 2 {
            at_fault[start as usize] = true;
            at_fault[end as usize] = true;
        }
    }
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        if is_flat(mesh.corners(triangle)) {
            for &corner in corners {
                at_fault[corner as usize] = true;
            }
        }
    }
    at_fault
}

/// A triangle at an edge: its number, which of its edges, and whether it runs from the lower to the higher vertex.
type EdgeUser = (u32, u8, bool);

/// Across each of the three edges: the other triangle and whether both run along the edge in the same direction, which
/// is wrong.
type Neighbours = Vec<[(u32, bool); 3]>;

fn edge_users(mesh: &Closed) -> BTreeMap<(u32, u32), Vec<EdgeUser>> {
    let mut users: BTreeMap<(u32, u32), Vec<EdgeUser>> = BTreeMap::new();
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        for edge in 0..3 {
            let (a, b) = (corners[edge], corners[(edge + 1) % 3]);
            users.entry((a.min(b), a.max(b))).or_default().push((
                triangle as u32,
                edge as u8,
                a < b,
            ));
        }
    }
    users
}

fn pair_edges(mesh: &Closed) -> Result<Neighbours, Error> {
    let users = edge_users(mesh);
    let place = |vertex: u32| mesh.vertices[vertex as usize];
    let mut n_open = 0;
    let mut first_open = None;
    let mut neighbours = vec![[(0, false); 3]; mesh.triangles.len()];
    for (&(start, end), users) in &users {
        match users[..] {
            [_] => {
                n_open += 1;
                first_open.get_or_insert((start, end));
            }
            [(t0, e0, forward0), (t1, e1, forward1)] => {
                let is_same_way = forward0 == forward1;
                neighbours[t0 as usize][e0 as usize] = (t1, is_same_way);
                neighbours[t1 as usize][e1 as usize] = (t0, is_same_way);
            }
            _ => {
                return Err(Error::MeshEdgeNotManifold {
                    start: place(start),
                    end: place(end),
                    n_triangles: users.len(),
                    coordinates: mesh.coordinates,
                });
            }
        }
    }
    match first_open {
        Some((start, end)) => Err(Error::MeshOpen {
            start: place(start),
            end: place(end),
            n_edges: n_open,
            coordinates: mesh.coordinates,
        }),
        None => Ok(neighbours),
    }
}

/// The triangles round a vertex must form one fan.
fn check_vertices(mesh: &Closed, neighbours: &Neighbours) -> Result<(), Error> {
    let mut n_triangles = vec![0_u32; mesh.vertices.len()];
    let mut any_triangle = vec![0_u32; mesh.vertices.len()];
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        for &vertex in corners {
            n_triangles[vertex as usize] += 1;
            any_triangle[vertex as usize] = triangle as u32;
        }
    }
    for (vertex, (&n_expected, &first)) in n_triangles.iter().zip(&any_triangle).enumerate() {
        // Walk round the vertex, always leaving a triangle by the edge not come in by.
        let mut triangle = first;
        let mut came_from = u32::MAX;
        let mut n_walked = 0;
        loop {
            n_walked += 1;
            let corners = mesh.triangles[triangle as usize];
            let across = (0..3).filter(|&edge| {
                corners[edge] == vertex as u32 || corners[(edge + 1) % 3] == vertex as u32
            });
            let mut next = across.map(|edge| neighbours[triangle as usize][edge].0);
            let (a, b) = (next.next().unwrap_or(first), next.next().unwrap_or(first));
            let onward = if a == came_from { b } else { a };
            came_from = triangle;
            triangle = onward;
            if triangle == first || n_walked > n_expected {
                break;
            }
        }
        if n_walked != n_expected && n_expected > 0 {
            return Err(Error::MeshVertexNotManifold {
                position: mesh.vertices[vertex],
                coordinates: mesh.coordinates,
            });
        }
    }
    Ok(())
}

/// Turns triangles until neighbours agree. Returns the piece of surface that each belongs to.
fn orient(mesh: &mut Closed, neighbours: &Neighbours) -> Result<Vec<u32>, Error> {
    const NONE: u32 = u32::MAX;
    let n = mesh.triangles.len();
    let mut piece = vec![NONE; n];
    let mut is_turned = vec![false; n];
    let mut n_pieces = 0;
    let mut waiting = Vec::new();
    for seed in 0..n {
        if piece[seed] != NONE {
            continue;
        }
        piece[seed] = n_pieces;
        waiting.push(seed);
        while let Some(triangle) = waiting.pop() {
            for (edge, &(other, is_same_way)) in neighbours[triangle].iter().enumerate() {
                let other = other as usize;
                let must_turn = is_turned[triangle] != is_same_way;
                if piece[other] == NONE {
                    piece[other] = n_pieces;
                    is_turned[other] = must_turn;
                    waiting.push(other);
                } else if is_turned[other] != must_turn {
                    let corners = mesh.corners(triangle);
                    return Err(Error::MeshNotOrientable {
                        start: corners[edge],
                        end: corners[(edge + 1) % 3],
                        coordinates: mesh.coordinates,
                    });
                }
            }
        }
        n_pieces += 1;
    }
    for (corners, &is_turned) in mesh.triangles.iter_mut().zip(&is_turned) {
        if is_turned {
            corners.swap(1, 2);
            mesh.repair.n_turned_triangles += 1;
        }
    }
    Ok(piece)
}

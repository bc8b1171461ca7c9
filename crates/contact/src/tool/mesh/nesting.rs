//! Which pieces of surface bound a body and which a cavity in one, and which are inside out.

use glam::DVec3;

use super::topology::Closed;
use crate::error::Error;

/// A closed piece of surface.
struct Piece {
    triangles: Vec<u32>,
    /// As its triangles are wound: below 0 where they face inward.
    volume: f64,
    min: DVec3,
    max: DVec3,
}

/// A piece that faces inward is turned, unless it is a cavity: a cavity lies within a body that faces outward. Within,
/// told by the winding number, not by boxes: what lies in the hole of a frame is a body of its own.
pub(super) fn turn_outward(mesh: &mut Closed, piece_of: &[u32]) -> Result<(), Error> {
    let pieces = pieces(mesh, piece_of);
    /// Of the cube round the piece: a volume below this is round-off.
    const EMPTY: f64 = 1e-12;
    for piece in &pieces {
        let size = (piece.max - piece.min).max_element();
        if piece.volume.abs() <= EMPTY * size * size * size {
            return Err(Error::MeshNoVolume);
        }
    }
    if pieces.iter().all(|piece| piece.volume > 0.0) {
        return Ok(());
    }
    let is_turned = turned(mesh, &pieces);
    mesh.repair.n_inverted_pieces = is_turned.iter().filter(|&&turned| turned).count();
    for (corners, &piece) in mesh.triangles.iter_mut().zip(piece_of) {
        if is_turned[piece as usize] {
            corners.swap(1, 2);
        }
    }
    Ok(())
}

fn pieces(mesh: &Closed, piece_of: &[u32]) -> Vec<Piece> {
    let n_pieces = piece_of.iter().max().map_or(0, |&last| last as usize + 1);
    let mut pieces: Vec<Piece> = Vec::new();
    pieces.resize_with(n_pieces, || Piece {
        triangles: Vec::new(),
        volume: 0.0,
        min: DVec3::INFINITY,
        max: DVec3::NEG_INFINITY,
    });
    let origin = mesh.vertices[0];
    for (triangle, &piece) in piece_of.iter().enumerate() {
        let piece = &mut pieces[piece as usize];
        piece.triangles.push(triangle as u32);
        let corners = mesh.corners(triangle);
        let [a, b, c] = corners.map(|corner| corner - origin);
        piece.volume += a.dot(b.cross(c)) / 6.0;
        for corner in corners {
            piece.min = piece.min.min(corner);
            piece.max = piece.max.max(corner);
        }
    }
    pieces
}

/// Whether each piece is to be turned. Outer pieces first: a cavity of a body that is turned is turned with it.
fn turned(mesh: &Closed, pieces: &[Piece]) -> Vec<bool> {
    let mut by_volume: Vec<usize> = (0..pieces.len()).collect();
    by_volume.sort_by(|&a, &b| pieces[b].volume.abs().total_cmp(&pieces[a].volume.abs()));
    let mut is_turned = vec![false; pieces.len()];
    for (n_larger, &piece) in by_volume.iter().enumerate() {
        // How often the place is inside, and what is round it next.
        let mut depth = 0;
        let mut next = None;
        for &larger in &by_volume[..n_larger] {
            if contains(mesh, &pieces[larger], &pieces[piece]) {
                let faces_outward = (pieces[larger].volume > 0.0) != is_turned[larger];
                depth += if faces_outward { 1 } else { -1 };
                next = Some(larger);
            }
        }
        let with_next = next.is_some_and(|next| is_turned[next]);
        let faces_outward = (pieces[piece].volume > 0.0) != with_next;
        // Outside of every body there is no cavity.
        is_turned[piece] = with_next != (depth <= 0 && !faces_outward);
    }
    is_turned
}

/// Whether `inner` lies within the closed surface `outer`. Pieces that cross count by one of their places.
fn contains(mesh: &Closed, outer: &Piece, inner: &Piece) -> bool {
    /// Places of the inner piece that are tried until one is clearly in or out, not on the surface.
    const MOST_PLACES: usize = 16;
    /// From 0.5, half inside.
    const CLEAR: f64 = 0.25;
    if !(outer.min.cmple(inner.min).all() && outer.max.cmpge(inner.max).all()) {
        return false;
    }
    let step = inner.triangles.len().div_ceil(MOST_PLACES);
    let places = inner.triangles.iter().step_by(step);
    let mut clearest = 0.0_f64;
    for &triangle in places {
        let center = mesh.corners(triangle as usize).iter().sum::<DVec3>() / 3.0;
        let from_half = winding_number(mesh, outer, center).abs() - 0.5;
        if from_half.abs() > clearest.abs() {
            clearest = from_half;
        }
        if clearest.abs() > CLEAR {
            break;
        }
    }
    clearest > 0.0
}

/// Solid angle of the piece seen from `place` over 4π: 1 inside, 0 outside.
///
/// Source: Van Oosterom and Strackee, The solid angle of a plane triangle (1983).
fn winding_number(mesh: &Closed, piece: &Piece, place: DVec3) -> f64 {
    let angle = |&triangle: &u32| {
        let [a, b, c] = mesh.corners(triangle as usize).map(|corner| corner - place);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    piece.triangles.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

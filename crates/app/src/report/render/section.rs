//! A plane that cuts part and tool open where contact would be hidden, and what the cut lays bare.

use fem::Order;
use glam::DVec3;

use super::super::data::{CellKind, PartDrawing};
use super::surface::Surface;

/// A plane: what lies on the side of `normal`, where the eye is, is not drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cut {
    pub(super) point: DVec3,
    /// Unit length, towards the eye.
    pub(super) normal: DVec3,
    /// m: contacts this little in front of the plane count as on it.
    pub(super) slack: f64,
}

/// A flat piece of the part's inside: three or four corners in order, each with its value.
pub(super) type Facet = Vec<(DVec3, f32)>;

impl Cut {
    /// Distance from the plane, m; above zero is cut away.
    pub(super) fn side(&self, point: DVec3) -> f64 {
        (point - self.point).dot(self.normal)
    }

    /// What is left of a line; nothing of one in front of the plane.
    pub(super) fn kept(&self, ends: [DVec3; 2]) -> Option<[DVec3; 2]> {
        let [a, b] = ends;
        let (da, db) = (self.side(a), self.side(b));
        let crossing = || a + (b - a) * (da / (da - db));
        match (da > 0.0, db > 0.0) {
            (false, false) => Some(ends),
            (true, true) => None,
            (false, true) => Some([a, crossing()]),
            (true, false) => Some([crossing(), b]),
        }
    }

    /// Lines in which the plane meets a surface.
    pub(super) fn outline(&self, surface: &Surface) -> Vec<[DVec3; 2]> {
        let sides: Vec<f64> = surface.nodes.iter().map(|&p| self.side(p)).collect();
        let mut lines = Vec::new();
        for triangle in &surface.triangles {
            let mut ends = Vec::with_capacity(2);
            for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                let (a, b) = (triangle[i] as usize, triangle[j] as usize);
                if (sides[a] > 0.0) != (sides[b] > 0.0) {
                    let share = sides[a] / (sides[a] - sides[b]);
                    ends.push(surface.nodes[a].lerp(surface.nodes[b], share));
                }
            }
            if let [a, b] = ends[..] {
                lines.push([a, b]);
            }
        }
        lines
    }

    /// The part's inside where the plane cuts it. `nodes` are displaced, `values` by node.
    pub(super) fn facets(&self, part: &PartDrawing, nodes: &[DVec3], values: &[f32]) -> Vec<Facet> {
        let pieces = pieces(part.cell_kind);
        let sides: Vec<f64> = nodes.iter().map(|&p| self.side(p)).collect();
        let mut facets = Vec::new();
        for cell in part.cells.chunks_exact(part.cell_kind.nodes_per_cell()) {
            let in_front = cell.iter().filter(|&&n| sides[n as usize] > 0.0).count();
            if in_front == 0 || in_front == cell.len() {
                continue;
            }
            for piece in &pieces {
                let corners = piece.map(|i| cell[i] as usize);
                let (front, back): (Vec<usize>, Vec<usize>) =
                    corners.iter().partition(|&&n| sides[n] > 0.0);
                let on = |a: usize, b: usize| {
                    let share = sides[a] / (sides[a] - sides[b]);
                    let value = values[a] + share as f32 * (values[b] - values[a]);
                    (nodes[a].lerp(nodes[b], share), value)
                };
                match (&front[..], &back[..]) {
                    (&[a], &[b, c, d]) | (&[b, c, d], &[a]) => {
                        facets.push(vec![on(a, b), on(a, c), on(a, d)]);
                    }
                    (&[a, b], &[c, d]) => {
                        facets.push(vec![on(a, c), on(a, d), on(b, d), on(b, c)]);
                    }
                    _ => {}
                }
            }
        }
        facets
    }
}

/// Tetrahedra without curved edges that an element is made of, as positions in its list of nodes: 1, 8 or 27.
///
/// The element's nodes are the whole points (x, y, z) of n >= x >= y >= z >= 0, and the pieces are those of the six tetrahedra of each
/// unit cube (Kuhn 1960) that lie in it.
fn pieces(kind: CellKind) -> Vec<[usize; 4]> {
    let (order, n) = match kind {
        CellKind::Tet4 => (Order::Linear, 1),
        CellKind::Tet10 => (Order::Quadratic, 2),
        CellKind::Tet20 => (Order::Cubic, 3),
    };
    let whole = |share: f64| (share * f64::from(n)).round() as i32;
    let places: Vec<[i32; 3]> = order
        .node_coordinates()
        .iter()
        .map(|&[_, b, c, d]| [whole(b + c + d), whole(c + d), whole(d)])
        .collect();
    let node_at = |place: [i32; 3]| places.iter().position(|&p| p == place);
    let mut pieces = Vec::new();
    for corner in (0..n * n * n).map(|i| [i % n, i / n % n, i / (n * n)]) {
        for axes in [
            [0, 1, 2],
            [0, 2, 1],
            [1, 0, 2],
            [1, 2, 0],
            [2, 0, 1],
            [2, 1, 0],
        ] {
            let mut place = corner;
            let mut piece = [node_at(place); 4];
            for (k, axis) in axes.into_iter().enumerate() {
                place[axis] += 1;
                piece[k + 1] = node_at(place);
            }
            if let [Some(a), Some(b), Some(c), Some(d)] = piece {
                pieces.push([a, b, c, d]);
            }
        }
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::super::super::sample;
    use super::*;

    fn volume([a, b, c, d]: [DVec3; 4]) -> f64 {
        (b - a).cross(c - a).dot(d - a).abs() / 6.0
    }

    /// Pieces of the reference tetrahedron, whose volume is 1/6, are alike and fill it.
    #[test]
    fn an_element_is_its_pieces() {
        for (kind, order) in [
            (CellKind::Tet4, Order::Linear),
            (CellKind::Tet10, Order::Quadratic),
            (CellKind::Tet20, Order::Cubic),
        ] {
            let nodes: Vec<DVec3> = order
                .node_coordinates()
                .iter()
                .map(|&[_, x, y, z]| DVec3::new(x, y, z))
                .collect();
            let pieces = pieces(kind);
            assert_eq!(pieces.len(), (order as usize).pow(3));
            let volumes: Vec<f64> = pieces.iter().map(|p| volume(p.map(|i| nodes[i]))).collect();
            let alike = 1.0 / 6.0 / pieces.len() as f64;
            assert!(
                volumes.iter().all(|v| (v - alike).abs() < 1e-12),
                "{volumes:?}"
            );
        }
    }

    /// A ring of 8 to 10 mm radius and 12 mm depth, cut through its axis on one side: a rectangle of 2 x 12 mm at each of
    /// the places that the plane meets, here the one opposite the gap.
    #[test]
    fn a_cut_lays_bare_the_cross_section() {
        let part = sample::part(24, 2, 3);
        let cut = Cut {
            point: DVec3::ZERO,
            normal: DVec3::X,
            slack: 0.0,
        };
        let values: Vec<f32> = part.nodes.iter().map(|p| p.y as f32).collect();
        let area: f64 = cut
            .facets(&part, &part.nodes, &values)
            .iter()
            .map(|f| {
                let corner = f[0].0;
                let of = |w: &[(DVec3, f32)]| (w[0].0 - corner).cross(w[1].0 - corner).length();
                0.5 * f.windows(2).map(of).sum::<f64>()
            })
            .sum();
        assert!((area - 24e-6).abs() < 0.5e-6, "{area}");
        // Values are those of the place.
        for (place, value) in cut
            .facets(&part, &part.nodes, &values)
            .into_iter()
            .flatten()
        {
            assert!((place.y as f32 - value).abs() < 1e-6);
            assert!(cut.side(place).abs() < 1e-12);
        }
        let surface = Surface::new(part.nodes.clone(), part.triangles.clone());
        let length: f64 = cut
            .outline(&surface)
            .iter()
            .map(|[a, b]| a.distance(*b))
            .sum();
        assert!((length - 28e-3).abs() < 1e-3, "{length}");
    }

    #[test]
    fn lines_end_at_the_plane() {
        let cut = Cut {
            point: DVec3::ZERO,
            normal: DVec3::Z,
            slack: 0.0,
        };
        let (front, back) = (DVec3::new(0.0, 0.0, 1.0), DVec3::new(4.0, 0.0, -3.0));
        let middle = DVec3::new(1.0, 0.0, 0.0);
        assert_eq!(cut.kept([front, back]), Some([middle, back]));
        assert_eq!(cut.kept([back, front]), Some([back, middle]));
        assert_eq!(cut.kept([back, middle]), Some([back, middle]));
        assert_eq!(cut.kept([front, front]), None);
    }
}

//! Contact forces as arrows.

use glam::DVec3;

use super::skin::Vertex;

/// A force on the part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Force {
    /// m, part frame: where it acts.
    pub(super) point: DVec3,
    /// N, part frame, on the part.
    pub(super) force: DVec3,
    /// Whether the contact sticks to the tool.
    pub(super) sticks: bool,
}

/// Colour of the force of a contact that slips, or without friction.
pub(super) const SLIPPING: [f32; 3] = [0.80, 0.10, 0.32];

/// Of one that sticks: apart from the other also in lightness.
pub(super) const STICKING: [f32; 3] = [0.0, 0.32, 0.70];

/// Sides of shaft and head.
const N_SIDES: usize = 10;

/// Of the part's size: radius of the shaft, radius and length of the head.
const SHAFT: f64 = 0.0055;
const HEAD: [f64; 2] = [0.016, 0.044];

/// Of an arrow, its head at most.
const HEAD_SHARE: f64 = 0.45;

/// Arrows that end where the forces act. `size`: m, of the part; `per_newton`: m.
pub(super) fn arrows_into(forces: &[Force], per_newton: f64, size: f64, out: &mut Vec<Vertex>) {
    out.clear();
    for force in forces {
        let length = force.force.length() * per_newton;
        let way = force.force.normalize_or_zero();
        if way == DVec3::ZERO || !force.point.is_finite() || length < 0.004 * size {
            continue;
        }
        let head = (HEAD[1] * size).min(HEAD_SHARE * length);
        let thin = head / (HEAD[1] * size);
        let neck = force.point - way * head;
        let tail = force.point - way * length;
        let [r, g, b] = if force.sticks { STICKING } else { SLIPPING };
        let mut cone = Cone {
            way,
            paint: [r, g, b, 1.0],
            out,
        };
        cone.side([tail, neck], [SHAFT * size * thin; 2]);
        cone.side([neck, force.point], [HEAD[0] * size * thin, 0.0]);
        cone.side([neck, neck], [0.0, HEAD[0] * size * thin]);
        cone.side([tail, tail], [0.0, SHAFT * size * thin]);
    }
}

struct Cone<'a> {
    way: DVec3,
    paint: [f32; 4],
    out: &'a mut Vec<Vertex>,
}

impl Cone<'_> {
    /// Between two rings around places on the way, with their radii.
    fn side(&mut self, places: [DVec3; 2], radii: [f64; 2]) {
        let (x, y) = self.way.any_orthonormal_pair();
        let spoke = |k: usize| {
            let angle = k as f64 / N_SIDES as f64 * std::f64::consts::TAU;
            x * angle.cos() + y * angle.sin()
        };
        let along = (places[1] - places[0]).length();
        let vertex = |end: usize, k: usize| {
            let normal = spoke(k) * along + self.way * (radii[0] - radii[1]);
            Vertex {
                position: (places[end] + spoke(k) * radii[end]).as_vec3().to_array(),
                normal: normal.as_vec3().normalize_or_zero().to_array(),
                paint: self.paint,
            }
        };
        for k in 0..N_SIDES {
            let [a, b] = [vertex(0, k), vertex(0, k + 1)];
            let [c, d] = [vertex(1, k), vertex(1, k + 1)];
            self.out.extend([a, b, d, a, d, c]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arrow_ends_at_its_point_and_is_as_long_as_the_force_says() {
        let force = Force {
            point: DVec3::new(0.0, 1.0, 0.0),
            force: DVec3::new(0.0, 2.0, 0.0),
            sticks: true,
        };
        let mut out = Vec::new();
        arrows_into(&[force], 0.25, 1.0, &mut out);
        let heights = || out.iter().map(|v| v.position[1]);
        assert_eq!(heights().fold(f32::INFINITY, f32::min), 0.5);
        assert_eq!(heights().fold(f32::NEG_INFINITY, f32::max), 1.0);
        assert!(out.iter().all(|v| v.paint[..3] == STICKING));
        arrows_into(
            &[Force {
                force: DVec3::NAN,
                ..force
            }],
            0.25,
            1.0,
            &mut out,
        );
        assert!(out.is_empty(), "what is no force is not drawn");
    }
}

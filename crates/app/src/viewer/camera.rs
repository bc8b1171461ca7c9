//! Where the window looks from: parallel projection, turned about the part.

use glam::{DQuat, DVec2, DVec3};

use crate::report::View;

/// Share of the picture that the part and its tool fill at first.
const FILLED: f64 = 0.74;

/// Smallest cosine between the way of looking and the level plane: never quite from above, where up would be lost.
const STEEPEST: f64 = 0.02;

/// Heights between which the picture is zoomed, as shares of the first one.
const ZOOM: [f64; 2] = [0.01, 20.0];

/// A point of view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Camera {
    right: DVec3,
    up: DVec3,
    into: DVec3,
    /// What stays upright when the view is turned.
    upright: DVec3,
    /// m, in the middle of the picture.
    centre: DVec3,
    /// m, what fits into the height of the picture.
    height: f64,
    first_height: f64,
}

impl Camera {
    /// Looks along a view so that all points are in a picture of `aspect` (width / height).
    pub(super) fn fit(view: &View, points: &[DVec3], aspect: f64) -> Self {
        let into = view.direction.normalize_or(DVec3::NEG_Z);
        let up = view.up.reject_from(into);
        let up = up.normalize_or(into.any_orthonormal_vector());
        let right = into.cross(up);
        let extent = |axis: DVec3| {
            let along = points.iter().filter(|p| p.is_finite()).map(|p| p.dot(axis));
            let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| {
                (a.min(v), b.max(v))
            });
            if low <= high {
                (0.5 * (low + high), high - low)
            } else {
                (0.0, 0.0)
            }
        };
        let ((x, width), (y, height), (z, _)) = (extent(right), extent(up), extent(into));
        let needed = height.max(width / aspect);
        let height = if needed > 0.0 { needed / FILLED } else { 1.0 };
        Self {
            right,
            up,
            into,
            upright: view.up.normalize_or(up),
            centre: right * x + up * y + into * z,
            height,
            first_height: height,
        }
    }

    /// Turns the part under the pointer, by angles to the right and down, rad.
    pub(super) fn orbit(&mut self, angle: DVec2) {
        let turn = DQuat::from_axis_angle(self.upright, -angle.x);
        let (right, into) = (turn * self.right, turn * self.into);
        let tilted = DQuat::from_axis_angle(right, -angle.y) * into;
        let is_level = 1.0 - tilted.dot(self.upright).powi(2) > STEEPEST * STEEPEST;
        // A tilt past the pole would turn the picture upside down.
        let is_upright = right.cross(tilted).dot(self.upright) > 0.0;
        self.into = if is_level && is_upright { tilted } else { into }.normalize();
        self.right = self.into.cross(self.upright).normalize_or(right);
        self.up = self.right.cross(self.into);
    }

    /// Moves the part with the pointer. `shift`: right and down, in heights of the picture.
    pub(super) fn pan(&mut self, shift: DVec2) {
        self.centre -= self.in_plane(shift);
    }

    /// Zooms by a factor (> 1 is nearer); what is `at` (right and down of the middle, in heights) stays there.
    pub(super) fn zoom(&mut self, factor: f64, at: DVec2) {
        let before = self.in_plane(at);
        let [least, most] = ZOOM.map(|share| share * self.first_height);
        self.height = (self.height / factor).clamp(least, most);
        self.centre += before - self.in_plane(at);
    }

    /// m, the motion in the picture's plane of a shift to the right and down, in heights of the picture.
    pub(super) fn in_plane(&self, shift: DVec2) -> DVec3 {
        (self.right * shift.x - self.up * shift.y) * self.height
    }

    /// Right and down on the picture of a direction in space; shorter than 1 where it points at the eye.
    pub(super) fn on_picture(&self, direction: DVec3) -> [f64; 2] {
        [direction.dot(self.right), -direction.dot(self.up)]
    }

    /// Pixels per metre of a picture with this height, pixels.
    pub(super) fn pixels_per_metre(&self, height: f64) -> f64 {
        height / self.height
    }

    /// Column and row of a point on a picture of this size, pixels.
    #[cfg(test)]
    pub(super) fn pixel(&self, point: DVec3, [width, height]: [f64; 2]) -> [f64; 2] {
        let p = (point - self.centre) * self.pixels_per_metre(height);
        [
            0.5 * width + p.dot(self.right),
            0.5 * height - p.dot(self.up),
        ]
    }

    /// From the eye into the picture, unit vector.
    pub(super) fn into(&self) -> DVec3 {
        self.into
    }

    /// Towards a light over the eye's left shoulder, unit vector.
    pub(super) fn to_light(self) -> DVec3 {
        (self.up * 0.55 - self.right * 0.45 - self.into).normalize()
    }

    /// World (m) to clip space, columns. Depth 0 to 1 is `reach` (m) before to behind the middle.
    pub(super) fn view_projection(&self, aspect: f64, reach: f64) -> [[f32; 4]; 4] {
        let rows = [
            (self.right * (2.0 / (self.height * aspect)), 0.0),
            (self.up * (2.0 / self.height), 0.0),
            (self.into * (0.5 / reach), 0.5),
        ];
        let entry = |row: usize, column: usize| match (row, column) {
            (3, 3) => 1.0,
            (3, _) => 0.0,
            (_, 3) => rows[row].1 - rows[row].0.dot(self.centre),
            _ => rows[row].0[column],
        };
        std::array::from_fn(|column| std::array::from_fn(|row| entry(row, column) as f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        let view = View::three_quarter(DVec3::NEG_Z, DVec3::Y);
        let points = [DVec3::ZERO, DVec3::new(0.04, 0.02, 0.01)];
        Camera::fit(&view, &points, 1.5)
    }

    #[test]
    fn all_points_are_in_the_first_picture_and_its_middle_is_theirs() {
        let camera = camera();
        for point in [DVec3::ZERO, DVec3::new(0.04, 0.02, 0.01)] {
            let [x, y] = camera.pixel(point, [300.0, 200.0]);
            assert!((0.0..300.0).contains(&x) && (0.0..200.0).contains(&y));
        }
        let [x, y] = camera.pixel(DVec3::new(0.02, 0.01, 0.005), [300.0, 200.0]);
        assert!((x - 150.0).abs() < 1e-9 && (y - 100.0).abs() < 1e-9);
    }

    #[test]
    fn the_matrix_puts_a_point_where_the_pixel_is() {
        let camera = camera();
        let point = DVec3::new(0.01, 0.015, -0.003);
        let m = camera.view_projection(1.5, 0.2);
        let p = point.as_vec3().extend(1.0).to_array();
        let clip: Vec<f32> = (0..4)
            .map(|row| (0..4).map(|c| m[c][row] * p[c]).sum())
            .collect();
        let [x, y] = camera.pixel(point, [300.0, 200.0]);
        assert!((f64::from(clip[0]) - (x / 150.0 - 1.0)).abs() < 1e-5);
        assert!((f64::from(clip[1]) - (1.0 - y / 100.0)).abs() < 1e-5);
        assert!((0.0..1.0).contains(&clip[2]) && clip[3] == 1.0);
    }

    #[test]
    fn orbit_keeps_the_axes_orthonormal_and_up_upright() {
        let mut camera = camera();
        for k in 0..200 {
            let k = f64::from(k);
            camera.orbit(DVec2::new(0.3 * k.sin(), 0.4 * (0.7 * k).cos()));
            let Camera {
                right, up, into, ..
            } = camera;
            assert!((right.cross(into) - up).length() < 1e-9);
            for (a, b) in [(right, up), (up, into), (into, right)] {
                assert!(a.dot(b).abs() < 1e-9 && (a.length() - 1.0).abs() < 1e-9);
            }
            assert!(up.dot(DVec3::Y) > 0.0, "never upside down");
        }
    }

    #[test]
    fn a_drag_to_the_right_and_down_takes_the_part_along() {
        let mut camera = camera();
        let before = camera.pixel(DVec3::ZERO, [300.0, 200.0]);
        camera.pan(DVec2::new(0.1, 0.2));
        let after = camera.pixel(DVec3::ZERO, [300.0, 200.0]);
        assert!((after[0] - before[0] - 20.0).abs() < 1e-9);
        assert!((after[1] - before[1] - 40.0).abs() < 1e-9);
    }

    #[test]
    fn zoom_keeps_what_is_under_the_pointer() {
        let mut camera = camera();
        let at = DVec2::new(0.2, -0.3);
        let place = camera.centre + camera.in_plane(at);
        let before = camera.pixel(place, [300.0, 200.0]);
        camera.zoom(2.0, at);
        let after = camera.pixel(place, [300.0, 200.0]);
        assert!((after[0] - before[0]).abs() < 1e-9 && (after[1] - before[1]).abs() < 1e-9);
        assert!((before[0] - 190.0).abs() < 1e-9 && (before[1] - 40.0).abs() < 1e-9);
        for _ in 0..100 {
            camera.zoom(2.0, at);
        }
        assert!(camera.height > 0.0);
    }
}

//! Parallel projection of the part onto the picture.

use glam::DVec3;

use super::super::data::View;

/// Share of a colour that is left in the shade.
const AMBIENT: f64 = 0.6;

/// A point of view.
#[derive(Clone, Debug)]
pub(super) struct Camera {
    right: DVec3,
    up: DVec3,
    into: DVec3,
    to_light: DVec3,
    /// Samples per metre.
    scale: f64,
    /// Sample at which `centre` appears.
    middle: [f64; 2],
    centre: DVec3,
}

impl Camera {
    /// Looks along `view` so that all `points` lie within `stage` (left, top, right, bottom, in
    /// samples).
    pub(super) fn fit(view: &View, points: &[DVec3], stage: [f64; 4]) -> Self {
        let into = view.direction.try_normalize().unwrap_or(DVec3::NEG_Z);
        let up = view.up.reject_from(into);
        let up = up
            .try_normalize()
            .unwrap_or_else(|| into.any_orthonormal_vector());
        let right = into.cross(up);
        let extent = |axis: DVec3| {
            let along = points.iter().map(|p| p.dot(axis)).filter(|v| v.is_finite());
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
        let [left, top, stage_right, bottom] = stage;
        let fit = |room: f64, size: f64| {
            if size > 0.0 {
                room / size
            } else {
                f64::INFINITY
            }
        };
        let scale = fit(stage_right - left, width).min(fit(bottom - top, height));
        Self {
            right,
            up,
            into,
            to_light: (up * 0.55 - right * 0.45 - into).normalize(),
            scale: if scale.is_finite() { scale } else { 1.0 },
            middle: [0.5 * (left + stage_right), 0.5 * (top + bottom)],
            centre: right * x + up * y + into * z,
        }
    }

    /// Samples per metre.
    pub(super) fn pixels_per_metre(&self) -> f64 {
        self.scale
    }

    /// Column, row (downwards) and depth (away from the eye), all in samples.
    pub(super) fn project(&self, point: DVec3) -> [f64; 3] {
        let p = (point - self.centre) * self.scale;
        [
            self.middle[0] + p.dot(self.right),
            self.middle[1] - p.dot(self.up),
            p.dot(self.into),
        ]
    }

    /// Depth of a plane at a column and row, all in samples; infinite for one that is seen edge on.
    pub(super) fn depth_of_plane(
        &self,
        point: DVec3,
        normal: DVec3,
    ) -> impl Fn(f64, f64) -> f64 + use<> {
        let [x, y, z] = self.project(point);
        let (right, down) = (normal.dot(self.right), -normal.dot(self.up));
        let into = normal.dot(self.into);
        move |column, row| {
            if into.abs() < 1e-9 {
                return f64::INFINITY;
            }
            z - ((column - x) * right + (row - y) * down) / into
        }
    }

    pub(super) fn project_all(&self, points: &[DVec3]) -> Vec<[f64; 3]> {
        points.iter().map(|&p| self.project(p)).collect()
    }

    /// Direction on the picture (right, down) of a direction in space; shorter than 1 where it
    /// points at or away from the eye.
    pub(super) fn on_picture(&self, direction: DVec3) -> [f64; 2] {
        [direction.dot(self.right), -direction.dot(self.up)]
    }

    /// Brightness of a surface with this unit normal (either side), about 0.6 to 1.
    pub(super) fn light(&self, normal: DVec3) -> f64 {
        let towards_eye = if normal.dot(self.into) > 0.0 {
            -normal
        } else {
            normal
        };
        AMBIENT + (1.0 - AMBIENT) * towards_eye.dot(self.to_light).max(0.0)
    }

    /// 1 where the surface looks at the eye, 0 where it is seen edge on.
    pub(super) fn facing(&self, normal: DVec3) -> f64 {
        normal.dot(self.into).abs().min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_as_deep_as_its_points() {
        let view = View {
            direction: DVec3::new(-1.0, -0.3, -0.4),
            up: DVec3::Y,
        };
        let camera = Camera::fit(&view, &[DVec3::ZERO, DVec3::ONE], [0.0, 0.0, 100.0, 80.0]);
        let (point, normal) = (DVec3::new(0.2, 0.1, 0.3), DVec3::new(0.8, 0.0, 0.6));
        let depth = camera.depth_of_plane(point, normal);
        for shift in [DVec3::Y, DVec3::new(-0.6, 0.5, 0.8)] {
            let [x, y, z] = camera.project(point + shift);
            assert!((depth(x, y) - z).abs() < 1e-9);
        }
        assert_eq!(
            camera.depth_of_plane(point, camera.right)(3.0, 4.0),
            f64::INFINITY
        );
    }

    #[test]
    fn points_stay_on_the_stage_and_up_is_up() {
        let view = View {
            direction: DVec3::new(-1.0, -0.3, -0.4),
            up: DVec3::Y,
        };
        let points = [DVec3::ZERO, DVec3::X, DVec3::Y * 0.2, DVec3::Z * -0.5];
        let stage = [10.0, 20.0, 110.0, 80.0];
        let camera = Camera::fit(&view, &points, stage);
        for p in points {
            let [x, y, _] = camera.project(p);
            assert!((stage[0] - 1e-9..=stage[2] + 1e-9).contains(&x), "{x}");
            assert!((stage[1] - 1e-9..=stage[3] + 1e-9).contains(&y), "{y}");
        }
        assert!(camera.project(DVec3::Y)[1] < camera.project(DVec3::ZERO)[1]);
        let nearer = camera.project(-view.direction)[2];
        assert!(nearer < camera.project(DVec3::ZERO)[2]);
    }

    #[test]
    fn right_is_right_seen_from_the_front() {
        let view = View {
            direction: DVec3::NEG_Z,
            up: DVec3::Y,
        };
        let camera = Camera::fit(&view, &[DVec3::ZERO, DVec3::ONE], [0.0, 0.0, 10.0, 10.0]);
        assert!(camera.project(DVec3::X)[0] > camera.project(DVec3::ZERO)[0]);
    }

    #[test]
    fn an_impossible_view_is_replaced() {
        let view = View {
            direction: DVec3::ZERO,
            up: DVec3::NAN,
        };
        let camera = Camera::fit(&view, &[], [0.0, 0.0, 10.0, 10.0]);
        assert!(camera.project(DVec3::ONE).iter().all(|v| v.is_finite()));
    }
}

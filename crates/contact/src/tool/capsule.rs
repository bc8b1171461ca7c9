//! Round bar along local z with half spheres as ends.

use glam::DVec3;

use super::{ContactPoint, tessellation, unit_or};
use crate::error::{Error, check_positive};

/// All points within `radius` of the segment from -half_length to half_length on local z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    radius: f64,
    half_length: f64,
}

impl Capsule {
    /// `radius` and `half_length` (of the segment, without the ends) in m.
    ///
    /// # Errors
    /// [`Error::NotPositive`].
    pub fn new(radius: f64, half_length: f64) -> Result<Self, Error> {
        Ok(Self {
            radius: check_positive("capsule radius", radius)?,
            half_length: check_positive("capsule half length", half_length)?,
        })
    }

    /// m.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Of the segment, without the ends, m.
    pub fn half_length(&self) -> f64 {
        self.half_length
    }

    /// On the segment the normal is +x.
    pub(super) fn signed_distance_local(&self, point: DVec3) -> ContactPoint {
        let on_segment = point.z.clamp(-self.half_length, self.half_length);
        let away = DVec3::new(point.x, point.y, point.z - on_segment);
        let length = away.length();
        ContactPoint {
            signed_distance: length - self.radius,
            normal: unit_or(away, length, DVec3::X),
        }
    }

    /// For an axis (unit) in the frame of the result.
    pub(super) fn half_extents(&self, axis: DVec3) -> DVec3 {
        axis.abs() * self.half_length + DVec3::splat(self.radius)
    }

    pub(super) fn tessellate(&self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let quarter = tessellation::SEGMENTS / 4;
        let cap = |k: usize| {
            let angle = std::f64::consts::FRAC_PI_2 * k as f64 / quarter as f64;
            (
                self.radius * angle.cos(),
                self.half_length + self.radius * angle.sin(),
            )
        };
        let lower = (0..quarter).rev().map(cap).map(|(rho, z)| (rho, -z));
        let upper = (0..quarter).map(cap);
        let end = self.half_length + self.radius;
        tessellation::revolve(-end, end, lower.chain(upper))
    }
}

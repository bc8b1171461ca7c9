//! Ball.

use glam::DVec3;

use super::{ContactPoint, tessellation, unit_or};
use crate::error::{Error, check_positive};

/// Ball round the origin of the tool's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    radius: f64,
}

impl Sphere {
    /// `radius` in m.
    ///
    /// # Errors
    /// [`Error::NotPositive`].
    pub fn new(radius: f64) -> Result<Self, Error> {
        Ok(Self {
            radius: check_positive("sphere radius", radius)?,
        })
    }

    /// m.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The centre's normal is +x.
    pub(super) fn signed_distance_local(&self, point: DVec3) -> ContactPoint {
        let length = point.length();
        ContactPoint {
            signed_distance: length - self.radius,
            normal: unit_or(point, length, DVec3::X),
        }
    }

    pub(super) fn half_extents(&self) -> DVec3 {
        DVec3::splat(self.radius)
    }

    pub(super) fn tessellate(&self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let quarter = tessellation::SEGMENTS / 4;
        let profile = (1..2 * quarter).map(|k| {
            let angle = std::f64::consts::FRAC_PI_2 * (k as f64 / quarter as f64 - 1.0);
            (self.radius * angle.cos(), self.radius * angle.sin())
        });
        tessellation::revolve(-self.radius, self.radius, profile)
    }
}

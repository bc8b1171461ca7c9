//! Round bar along local z.

use glam::DVec3;

use super::{ContactPoint, tessellation, unit_or};
use crate::error::{Error, check_positive};

/// Round bar along local z, symmetric to z = 0; infinite without a half length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    radius: f64,
    half_length: Option<f64>,
}

impl Cylinder {
    /// `radius` and `half_length` in m; None makes it infinite.
    ///
    /// # Errors
    /// [`Error::NotPositive`].
    pub fn new(radius: f64, half_length: Option<f64>) -> Result<Self, Error> {
        Ok(Self {
            radius: check_positive("cylinder radius", radius)?,
            half_length: half_length
                .map(|half_length| check_positive("cylinder half length", half_length))
                .transpose()?,
        })
    }

    /// m.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// m; None if infinite.
    pub fn half_length(&self) -> Option<f64> {
        self.half_length
    }

    /// On the axis the normal is +x; inside, where mantle and end are equally near, the mantle's.
    pub(super) fn signed_distance_local(&self, point: DVec3) -> ContactPoint {
        let across = DVec3::new(point.x, point.y, 0.0);
        // Not `hypot`, which is as dear as all the rest: radii whose squares are no numbers are no radii.
        let from_axis = (point.x * point.x + point.y * point.y).sqrt();
        let radial = unit_or(across, from_axis, DVec3::X);
        let mantle = from_axis - self.radius;
        let mantle_contact = ContactPoint {
            signed_distance: mantle,
            normal: radial,
        };
        let Some(half_length) = self.half_length else {
            return mantle_contact;
        };
        let axial = DVec3::new(0.0, 0.0, 1.0_f64.copysign(point.z));
        let end = point.z.abs() - half_length;
        if mantle > 0.0 && end > 0.0 {
            // Nearest is the rim.
            let distance = mantle.hypot(end);
            ContactPoint {
                signed_distance: distance,
                normal: unit_or(radial * mantle + axial * end, distance, radial),
            }
        } else if mantle >= end {
            mantle_contact
        } else {
            ContactPoint {
                signed_distance: end,
                normal: axial,
            }
        }
    }

    /// For an axis (unit) in the frame of the result.
    pub(super) fn half_extents(&self, axis: DVec3) -> DVec3 {
        let half_length = self.half_length.unwrap_or(f64::INFINITY);
        // 0 times infinity is no extent here: the axis does not go that way at all.
        let along = axis
            .abs()
            .map(|a| if a == 0.0 { 0.0 } else { a * half_length });
        let across = axis.map(|a| (1.0 - a * a).max(0.0).sqrt());
        along + across * self.radius
    }

    pub(super) fn characteristic_size(&self) -> f64 {
        self.half_length
            .map_or(self.radius, |half_length| self.radius.min(half_length))
    }

    pub(super) fn tessellate(&self, extent: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let half_length = self.half_length.unwrap_or(extent);
        let profile = [(self.radius, -half_length), (self.radius, half_length)];
        tessellation::revolve(-half_length, half_length, profile.into_iter())
    }
}

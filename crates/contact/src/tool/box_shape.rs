//! Brick. (`box` is a word that the language keeps for itself.)

use glam::{DMat3, DVec3};

use super::{ContactPoint, tessellation, unit_or};
use crate::error::{Error, check_positive};

/// Brick round the origin of the tool's frame, edges along its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxShape {
    half_extents: DVec3,
}

impl BoxShape {
    /// Half the edge lengths, m.
    ///
    /// # Errors
    /// [`Error::NotPositive`].
    pub fn new(half_extents: DVec3) -> Result<Self, Error> {
        for value in half_extents.to_array() {
            check_positive("box half extent", value)?;
        }
        Ok(Self { half_extents })
    }

    /// Half the edge lengths, m.
    pub fn half_extents_local(&self) -> DVec3 {
        self.half_extents
    }

    /// Inside, of equally near faces the first of x, y, z; on the middle plane the positive one.
    pub(super) fn signed_distance_local(&self, point: DVec3) -> ContactPoint {
        let sign = point.map(|x| 1.0_f64.copysign(x));
        let beyond = point.abs() - self.half_extents;
        if beyond.max_element() > 0.0 {
            // Nearest is a face, an edge or a corner, by how many coordinates are beyond.
            let away = beyond.max(DVec3::ZERO);
            let distance = away.length();
            ContactPoint {
                signed_distance: distance,
                normal: unit_or(away, distance, nearest_axis(beyond)) * sign,
            }
        } else {
            let axis = nearest_axis(beyond);
            ContactPoint {
                signed_distance: beyond.max_element(),
                normal: axis * sign,
            }
        }
    }

    pub(super) fn half_extents(&self, rotation: &DMat3) -> DVec3 {
        rotation.abs() * self.half_extents
    }

    pub(super) fn tessellate(&self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        tessellation::brick(self.half_extents)
    }
}

fn nearest_axis(beyond: DVec3) -> DVec3 {
    DVec3::AXES[beyond.max_position()]
}

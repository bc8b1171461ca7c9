//! The virtual coupling: the six-axis spring between the handle and the simulated tool.

use glam::DVec3;
use glamx::DPose3;

use crate::error::{DeviceError, check_setting};
use crate::wrench::{Wrench, rotation_from_vector, rotation_vector};

mod choice;

pub use choice::{ChosenCoupling, CouplingWish};

/// Largest stiffness that is accepted, N/m and N m/rad. Above it the coupling is rigid for every part
/// of any size, and 1/K begins to vanish beside the part's compliance in 64-bit numbers.
pub const STIFFNESS_MAX: f64 = 1e12;

/// Smallest translational stiffness used, N/m: 0 becomes this. A metre of deviation then gives 1 µN,
/// far below what any device renders, and the compliance stays finite.
const TRANSLATIONAL_STIFFNESS_MIN: f64 = 1e-6;

/// Smallest rotational stiffness used, N m/rad: 0 becomes this; a turn of 1 rad gives 1 nN m.
const ROTATIONAL_STIFFNESS_MIN: f64 = 1e-9;

/// Virtual coupling: an isotropic translational and rotational spring between target and tool.
///
/// The *target* is where the handle wants the tool (p*, R*), the *tool* is where contact lets it be
/// (p, R), both poses of the coupling reference point in one common frame. The deviation of the tool
/// and the wrenches are
///
/// ```text
/// e = (p − p*, rotvec(R R*⁻¹))        wrench on the tool = −K_c e       wrench on the handle = +K_c e
/// K_c = diag(k_t, k_t, k_t, k_r, k_r, k_r)
/// ```
///
/// e in m and rad, wrenches in N and N m about the coupling reference point, in the axes of the common
/// frame. The stiffness that the hand feels is that of the contact in series with K_c, so K_c belongs
/// beside every result.
///
/// Source: methods of six-axis rendering with a virtual coupling, as in McNeely, Puterbaugh, Troy 1999.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VirtualCoupling {
    translational_stiffness: f64,
    rotational_stiffness: f64,
}

impl VirtualCoupling {
    /// A coupling from its translational (N/m) and rotational (N m/rad) stiffness.
    ///
    /// Each may be from 0 to [`STIFFNESS_MAX`]. A stiffness of 0 lets the tool go: it is replaced by
    /// 1e-6 N/m (1e-9 N m/rad) so that the compliance stays finite.
    ///
    /// # Errors
    /// Where a stiffness is not finite or outside that range.
    pub fn new(translational: f64, rotational: f64) -> Result<Self, DeviceError> {
        for (name, value) in [
            ("translational_stiffness", translational),
            ("rotational_stiffness", rotational),
        ] {
            check_setting(
                name,
                value,
                (0.0..=STIFFNESS_MAX).contains(&value),
                "from 0 to 1e12 (N/m, N m/rad)",
            )?;
        }
        Ok(Self {
            translational_stiffness: translational.max(TRANSLATIONAL_STIFFNESS_MIN),
            rotational_stiffness: rotational.max(ROTATIONAL_STIFFNESS_MIN),
        })
    }

    /// Translational stiffness k_t, N/m.
    #[must_use]
    pub fn translational_stiffness(&self) -> f64 {
        self.translational_stiffness
    }

    /// Rotational stiffness k_r, N m/rad.
    #[must_use]
    pub fn rotational_stiffness(&self) -> f64 {
        self.rotational_stiffness
    }

    /// K_c, symmetric positive definite: N/m in the upper left 3 x 3, N m/rad in the lower right.
    #[must_use]
    pub fn stiffness(&self) -> [[f64; 6]; 6] {
        diagonal(self.translational_stiffness, self.rotational_stiffness)
    }

    /// K_c⁻¹: m/N in the upper left 3 x 3, rad/(N m) in the lower right.
    #[must_use]
    pub fn compliance(&self) -> [[f64; 6]; 6] {
        diagonal(
            self.translational_stiffness.recip(),
            self.rotational_stiffness.recip(),
        )
    }

    /// Deviation of the tool from its target, `[m; 3]` then `[rad; 3]`, in the frame of the two poses.
    #[must_use]
    pub fn deviation(target: &DPose3, tool: &DPose3) -> [f64; 6] {
        let d = tool.translation - target.translation;
        let phi = rotation_vector(tool.rotation * target.rotation.inverse());
        [d.x, d.y, d.z, phi.x, phi.y, phi.z]
    }

    /// The tool's pose from its deviation: p = p* + d, R = exp(φ) R*.
    ///
    /// The inverse of [`deviation`](Self::deviation) for |φ| < π.
    #[must_use]
    pub fn pose_from_deviation(target: &DPose3, deviation: &[f64; 6]) -> DPose3 {
        let d = DVec3::new(deviation[0], deviation[1], deviation[2]);
        let phi = DVec3::new(deviation[3], deviation[4], deviation[5]);
        DPose3::from_parts(
            target.translation + d,
            (rotation_from_vector(phi) * target.rotation).normalize(),
        )
    }

    /// Wrench of the coupling on the tool, −K_c e, about the reference point, N and N m.
    #[must_use]
    pub fn wrench_on_tool(&self, deviation: &[f64; 6]) -> Wrench {
        let e = Wrench::from_array(deviation);
        Wrench::new(
            e.force * -self.translational_stiffness,
            e.torque * -self.rotational_stiffness,
        )
    }

    /// Wrench of the coupling on the handle, +K_c e, about the reference point: what the hand feels.
    #[must_use]
    pub fn wrench_on_handle(&self, deviation: &[f64; 6]) -> Wrench {
        -self.wrench_on_tool(deviation)
    }
}

/// Largest stiffness a sampled coupling may have beside the device's damping, N/m.
///
/// ```text
/// K_c ≤ 2 (b − |B|) / T
/// ```
/// `device_damping` b: damping of the device (and the hand) in N s/m; `virtual_damping` B: damping of
/// the coupling, N s/m; `period_s` T. Returns 0 where nothing is stable (b ≤ |B|) or the input makes
/// no sense. With N m s/rad in, N m/rad comes out.
///
/// Source: Colgate and Schenkel 1997 (passivity of the sampled wall).
#[must_use]
pub fn largest_stiffness_for_damping(
    device_damping: f64,
    virtual_damping: f64,
    period_s: f64,
) -> f64 {
    let bound = 2.0 * (device_damping - virtual_damping.abs()) / period_s;
    if bound.is_finite() && period_s > 0.0 {
        bound.max(0.0)
    } else {
        0.0
    }
}

/// Largest stiffness whose force step of one encoder count is held by the device's dry friction, N/m.
///
/// ```text
/// K_c ≤ 2 f_c / Δ
/// ```
/// `coulomb_friction` f_c of the device, N; `position_resolution` Δ, m. Infinite for Δ = 0.
///
/// Source: Abbott and Okamura 2005.
#[must_use]
pub fn largest_stiffness_for_friction(coulomb_friction: f64, position_resolution: f64) -> f64 {
    if position_resolution == 0.0 {
        f64::INFINITY
    } else {
        2.0 * coulomb_friction / position_resolution
    }
}

fn diagonal(translational: f64, rotational: f64) -> [[f64; 6]; 6] {
    let mut matrix = [[0.0; 6]; 6];
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] = if i < 3 { translational } else { rotational };
    }
    matrix
}

#[cfg(test)]
mod tests;

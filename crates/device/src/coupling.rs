//! The virtual coupling: the six-axis spring between the handle and the simulated tool.

use glam::DVec3;
use glamx::DPose3;

use crate::error::{DeviceError, check_setting};
use crate::wrench::{Wrench, rotation_from_vector, rotation_vector};

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
mod tests {
    use super::*;

    fn target() -> DPose3 {
        DPose3::new(DVec3::new(0.1, -0.2, 0.3), DVec3::new(0.4, 1.0, -0.7))
    }

    #[test]
    fn deviation_of_pose_from_deviation_is_the_deviation() {
        for scale in [0.0, 1e-9, 1e-3, 0.5, 1.0] {
            // |phi| = 3.04 < pi at scale 1.
            let e = [0.01, -0.02, 0.03, 2.0, -1.0, 2.06].map(|x| x * scale);
            let tool = VirtualCoupling::pose_from_deviation(&target(), &e);
            let back = VirtualCoupling::deviation(&target(), &tool);
            for (a, b) in e.iter().zip(back) {
                // Positions of 0.3 m carry 6e-17 m each, rotations of unit quaternions 2e-16 rad;
                // near pi the angle is the worst conditioned.
                assert!((a - b).abs() < 4e-15, "{e:?} {back:?}");
            }
        }
    }

    #[test]
    fn deviation_turns_with_the_common_frame() {
        let world = DPose3::new(DVec3::new(1.0, 2.0, 3.0), DVec3::new(-0.3, 0.8, 0.1));
        let e = [0.01, 0.02, -0.01, 0.1, -0.2, 0.3];
        let tool = VirtualCoupling::pose_from_deviation(&target(), &e);
        let seen = VirtualCoupling::deviation(&(world * target()), &(world * tool));
        let d = world.rotation * DVec3::new(e[0], e[1], e[2]);
        let phi = world.rotation * DVec3::new(e[3], e[4], e[5]);
        let expected = [d.x, d.y, d.z, phi.x, phi.y, phi.z];
        for (a, b) in expected.iter().zip(seen) {
            assert!((a - b).abs() < 2e-15);
        }
    }

    #[test]
    fn wrench_on_tool_pulls_back_and_balances_the_handle() {
        let coupling = VirtualCoupling::new(1000.0, 5.0).unwrap();
        let e = [0.001, 0.0, 0.0, 0.0, 0.0, 0.1];
        let on_tool = coupling.wrench_on_tool(&e);
        assert_eq!(on_tool.to_array(), [-1.0, 0.0, 0.0, 0.0, 0.0, -0.5]);
        let on_handle = coupling.wrench_on_handle(&e);
        assert_eq!(on_tool + on_handle, Wrench::ZERO);
    }

    #[test]
    fn wrench_is_the_gradient_of_the_energy() {
        // V = k_t |d|^2 / 2 + k_r |phi|^2 / 2; a rotation of the tool by small a changes V by k_r phi.a.
        let coupling = VirtualCoupling::new(800.0, 3.0).unwrap();
        let energy = |e: &[f64; 6]| {
            400.0 * (e[0] * e[0] + e[1] * e[1] + e[2] * e[2])
                + 1.5 * (e[3] * e[3] + e[4] * e[4] + e[5] * e[5])
        };
        let e = [0.01, -0.02, 0.005, 0.9, -1.1, 0.4];
        let tool = VirtualCoupling::pose_from_deviation(&target(), &e);
        let wrench = coupling.wrench_on_tool(&e).to_array();
        let h = 1e-6;
        for axis in 0..6 {
            let moved = |by: f64| {
                let mut step = [0.0; 6];
                step[axis] = by;
                let pose = VirtualCoupling::pose_from_deviation(&tool, &step);
                energy(&VirtualCoupling::deviation(&target(), &pose))
            };
            let slope = (moved(h) - moved(-h)) / (2.0 * h);
            assert!((slope + wrench[axis]).abs() < 1e-7, "axis {axis}");
        }
    }

    #[test]
    fn compliance_inverts_stiffness_over_the_whole_range() {
        for k in [0.0, 1e-3, 1.0, 1e4, 1e12] {
            let coupling = VirtualCoupling::new(k, k).unwrap();
            let (stiff, soft) = (coupling.stiffness(), coupling.compliance());
            for (i, row) in stiff.iter().enumerate() {
                for (j, expected) in (0..6).map(|j| (j, if i == j { 1.0 } else { 0.0 })) {
                    let product: f64 = row.iter().zip(&soft).map(|(k, c)| k * c[j]).sum();
                    assert!((product - expected).abs() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn stiffness_outside_the_range_is_refused_by_name() {
        for bad in [-1.0, 2e12, f64::NAN, f64::INFINITY] {
            assert!(matches!(
                VirtualCoupling::new(bad, 1.0),
                Err(DeviceError::InvalidSetting {
                    name: "translational_stiffness",
                    ..
                })
            ));
            assert!(matches!(
                VirtualCoupling::new(1.0, bad),
                Err(DeviceError::InvalidSetting {
                    name: "rotational_stiffness",
                    ..
                })
            ));
        }
    }

    #[test]
    fn stability_bounds_have_their_textbook_values() {
        assert!((largest_stiffness_for_damping(5.0, 0.0, 1e-3) - 1e4).abs() < 1e-9);
        assert!((largest_stiffness_for_damping(5.0, -3.0, 1e-3) - 4e3).abs() < 1e-9);
        assert_eq!(largest_stiffness_for_damping(1.0, 2.0, 1e-3), 0.0);
        assert_eq!(largest_stiffness_for_damping(1.0, 0.0, 0.0), 0.0);
        assert_eq!(largest_stiffness_for_friction(0.5, 1e-4), 1e4);
        assert_eq!(largest_stiffness_for_friction(0.5, 0.0), f64::INFINITY);
    }
}

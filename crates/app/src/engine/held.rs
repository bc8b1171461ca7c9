//! How the tool is held: at which point, and by what.
//!
//! The virtual coupling is a spring at one point, the grip: the tool's deviation from its target and the wrenches are about
//! that point. Were it the origin of the tool's file, a file in the coordinates of a car would be held by a lever of metres.
//!
//! ```text
//! p = g + d + R(φ) (p* - g)    R = R(φ) R*    e = (d, φ) = K⁻¹ f        g: the grip at the target
//! ```

use contact::delassus::CouplingCompliance;
use device::VirtualCoupling;
use glam::DVec3;
use glamx::DPose3;

/// Of the coupling's largest compliance, what of it along a row is none: what is left of a direction that is imposed.
const NO_COMPLIANCE: f64 = 1e-12;

/// Where the spring between handle and held body is fastened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Grip {
    /// At this point of the tool, in its own frame, m.
    OnTool(DVec3),
    /// At this point of the part, m: the part is held, and in its frame the tool gives way about that point.
    OnPart(DVec3),
}

/// The tool's target and what its pose may do about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    grip: Grip,
    /// Without one the pose is imposed.
    coupling: Option<VirtualCoupling>,
    /// K⁻¹ (m/N, rad/(N m)); without what is imposed.
    compliance: Option<[[f64; 6]; 6]>,
    /// Whether a direction is imposed although the rest gives way.
    is_guided: bool,
}

impl Held {
    pub(super) fn by(coupling: Option<VirtualCoupling>) -> Self {
        Self {
            grip: Grip::OnTool(DVec3::ZERO),
            compliance: coupling.as_ref().map(VirtualCoupling::compliance),
            coupling,
            is_guided: false,
        }
    }

    pub(super) fn at(self, grip: Grip) -> Self {
        Self { grip, ..self }
    }

    /// Takes the coupling's compliance out along a direction of unit length: there the target is where the tool is.
    pub(super) fn guided_along(self, direction: DVec3) -> Self {
        let compliance = self.compliance.map(|mut compliance| {
            // The coupling is isotropic.
            let isotropic = compliance[0][0];
            for i in 0..3 {
                for j in 0..3 {
                    compliance[i][j] -= isotropic * direction[i] * direction[j];
                }
            }
            compliance
        });
        Self {
            compliance,
            is_guided: compliance.is_some(),
            ..self
        }
    }

    /// Leaves the coupling's compliance along a direction of unit length alone: a tool on a rail, with a spring along it.
    pub(super) fn on_rail(self, direction: DVec3) -> Self {
        let compliance = self.compliance.map(|compliance| {
            // The coupling is isotropic.
            let isotropic = compliance[0][0];
            let mut along = [[0.0; 6]; 6];
            for i in 0..3 {
                for j in 0..3 {
                    along[i][j] = isotropic * direction[i] * direction[j];
                }
            }
            along
        });
        Self {
            compliance,
            is_guided: compliance.is_some(),
            ..self
        }
    }

    pub(super) fn coupling(&self) -> Option<&VirtualCoupling> {
        self.coupling.as_ref()
    }

    /// Whether the pose, or one direction of it, is imposed: what cannot give way meets what cannot then.
    pub(super) fn is_imposed(&self) -> bool {
        self.compliance.is_none() || self.is_guided
    }

    /// For the operator, about the point of the tool's rows.
    pub(super) fn compliance_about(&self, reference: DVec3) -> Option<CouplingCompliance<'_>> {
        let matrix = self.compliance.as_ref()?;
        Some(CouplingCompliance { matrix, reference })
    }

    /// Whether the tool gives way along a row, whose part of the tool is `row`.
    pub(super) fn yields_along(&self, row: &[f64; 6]) -> bool {
        self.compliance.as_ref().is_some_and(|compliance| {
            let own = quadratic(compliance, row);
            // As if nothing were imposed.
            let largest = (0..3).map(|i| compliance[i][i]).fold(0.0, f64::max);
            own > NO_COMPLIANCE * largest
        })
    }

    /// Deviation (m, rad) of the tool under a wrench (N, N m about the grip).
    pub(super) fn deviation_under(&self, wrench: &[f64; 6]) -> [f64; 6] {
        match &self.compliance {
            Some(compliance) => compliance.map(|row| dot(&row, wrench)),
            None => [0.0; 6],
        }
    }

    /// J, in the springs under a wrench (N, N m about the grip).
    pub(super) fn energy_under(&self, wrench: &[f64; 6]) -> f64 {
        let compliance = self.compliance.as_ref();
        compliance.map_or(0.0, |compliance| 0.5 * quadratic(compliance, wrench))
    }

    fn grip_at(&self, target: &DPose3) -> DVec3 {
        match self.grip {
            Grip::OnTool(point) => target * point,
            Grip::OnPart(point) => point,
        }
    }

    /// Where the grip is, with the tool as far from its target as `deviation`.
    pub(super) fn reference(&self, target: &DPose3, deviation: &[f64; 6]) -> DVec3 {
        self.grip_at(target) + DVec3::new(deviation[0], deviation[1], deviation[2])
    }

    /// The tool's pose, so far from its target.
    pub(super) fn pose(&self, target: &DPose3, deviation: &[f64; 6]) -> DPose3 {
        let grip = self.grip_at(target);
        let of_grip = DPose3::from_parts(grip, target.rotation);
        let moved = VirtualCoupling::pose_from_deviation(&of_grip, deviation);
        // Nothing to turn where the tool is held at its origin.
        let arm = target.translation - grip;
        if arm == DVec3::ZERO {
            return moved;
        }
        let turned = moved.rotation * (target.rotation.inverse() * arm);
        DPose3::from_parts(moved.translation + turned, moved.rotation)
    }

    /// How far a pose is from a target (m, rad): the inverse of [`Held::pose`].
    pub(super) fn deviation(&self, target: &DPose3, pose: &DPose3) -> [f64; 6] {
        let grip = self.grip_at(target);
        let arm = target.translation - grip;
        let turn = pose.rotation * target.rotation.inverse();
        VirtualCoupling::deviation(
            &DPose3::from_parts(grip, target.rotation),
            &DPose3::from_parts(pose.translation - turn * arm, pose.rotation),
        )
    }

    /// What holds the tool in a pose, on the tool, about the grip. `from_contact`: what the contacts exert.
    pub(super) fn wrench_on_tool(
        &self,
        target: &DPose3,
        pose: &DPose3,
        from_contact: &[f64; 6],
    ) -> [f64; 6] {
        match &self.coupling {
            Some(coupling) if !self.is_guided => {
                let e = self.deviation(target, pose);
                coupling.wrench_on_tool(&e).to_array()
            }
            // An imposed pose carries whatever the contact asks for.
            _ => from_contact.map(|x| -x),
        }
    }
}

fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn quadratic(matrix: &[[f64; 6]; 6], row: &[f64; 6]) -> f64 {
    matrix
        .iter()
        .zip(row)
        .map(|(line, h)| h * dot(line, row))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn target() -> DPose3 {
        DPose3::new(DVec3::new(3.0, -0.2, 0.3), DVec3::new(0.4, 1.0, -0.7))
    }

    #[test]
    fn a_tool_held_at_its_origin_deviates_as_the_coupling_says() {
        let held = Held::by(VirtualCoupling::new(1e4, 20.0).ok());
        let e = [1e-3, 2e-3, -1e-3, 0.1, 0.0, -0.2];
        let pose = held.pose(&target(), &e);
        assert_eq!(pose, VirtualCoupling::pose_from_deviation(&target(), &e));
        assert_eq!(held.reference(&target(), &e), pose.translation);
    }

    /// The same body in a file with another origin: its points go to the same places.
    #[test]
    fn the_origin_of_the_file_does_not_matter() {
        let e = [1e-3, 2e-3, -1e-3, 0.1, 0.05, -0.2];
        let grip = DVec3::new(0.01, 0.02, 0.03);
        let held = Held::by(VirtualCoupling::new(1e4, 20.0).ok());
        let near = held.at(Grip::OnTool(grip)).pose(&target(), &e);
        let shift = DVec3::new(3.0, 2.0, -1.0);
        let shifted_target = target() * DPose3::from_translation(-shift);
        let far_held = held.at(Grip::OnTool(grip + shift));
        let far = far_held.pose(&shifted_target, &e);
        for point in [DVec3::ZERO, DVec3::X, DVec3::new(0.1, -0.4, 0.2)] {
            let apart = (near * point - far * (point + shift)).length();
            assert!(apart < 1e-14, "{apart}");
        }
    }

    #[test]
    fn the_wrench_of_the_spring_balances_the_one_that_made_the_deviation() {
        let held = Held::by(VirtualCoupling::new(1e4, 20.0).ok());
        let wrench = [3.0, -2.0, 1.0, 0.1, -0.3, 0.2];
        for grip in [
            Grip::OnTool(DVec3::new(0.1, 0.0, -0.2)),
            Grip::OnPart(DVec3::new(0.3, 0.1, 0.2)),
        ] {
            let held = held.at(grip);
            let e = held.deviation_under(&wrench);
            let pose = held.pose(&target(), &e);
            let back = held.wrench_on_tool(&target(), &pose, &wrench);
            for (on_tool, from_contact) in back.iter().zip(&wrench) {
                assert!((on_tool + from_contact).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn a_tool_on_a_rail_gives_way_along_it_only() {
        let along = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let held = Held::by(VirtualCoupling::new(1e4, 20.0).ok()).on_rail(along);
        let e = held.deviation_under(&[5.0, 0.0, 0.0, 0.0, 0.1, 0.0]);
        let moved = DVec3::new(e[0], e[1], e[2]);
        assert!((moved - along * (along.x * 5e-4)).length() < 1e-18);
        assert_eq!([e[3], e[4], e[5]], [0.0; 3]);
    }

    #[test]
    fn a_guided_tool_gives_way_across_the_guide_only() {
        let along = DVec3::new(1.0, 2.0, -2.0) / 3.0;
        let held = Held::by(VirtualCoupling::new(1e4, 20.0).ok()).guided_along(along);
        let e = held.deviation_under(&[5.0, 0.0, 0.0, 0.0, 0.1, 0.0]);
        let moved = DVec3::new(e[0], e[1], e[2]);
        assert!(moved.dot(along).abs() < 1e-18);
        let across = (DVec3::X - along * along.x) * 5e-4;
        assert!((moved - across).length() < 1e-18);
        assert!((e[4] - 0.1 / 20.0).abs() < 1e-18);
        let row = |n: DVec3| [n.x, n.y, n.z, 0.0, 0.0, 0.0];
        assert!(!held.yields_along(&row(along)));
        assert!(held.yields_along(&row(along.any_orthonormal_vector())));
        assert!(held.is_imposed());
    }
}

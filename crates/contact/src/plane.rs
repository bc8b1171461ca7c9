//! One contact plane per near node: the tool's surface, linearised where the node is.
//!
//! Source: Duriez et al. 2004, Fig. 3, here with unit normals.

use glam::DVec3;
use glamx::DPose3;

use crate::tool::Tool;

/// The tool's surface seen from one near node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The candidate node: its place in the caller's list.
    pub candidate: u32,
    /// Signed distance of the node at `point`, m; > 0 apart.
    pub gap: f64,
    /// Unit, outward from the tool, towards the part; part's frame.
    pub normal: DVec3,
    /// Position of the node at which the plane was made, part's frame, m.
    pub point: DVec3,
}

impl Plane {
    /// Gap of the node at another position, by the plane: `gap + n · (position - point)`, m.
    pub fn gap_at(&self, position: DVec3) -> f64 {
        self.gap + self.normal.dot(position - self.point)
    }

    /// The tool's contact Jacobian h = [n, r x n] with r from `reference` to the point (m): the gap falls by
    /// h · (translation, rotation) of the tool, and `-h f_n` is the wrench (force N, torque N m about `reference`) on the tool.
    pub fn tool_row(&self, reference: DVec3) -> [f64; 6] {
        let [nx, ny, nz] = self.normal.to_array();
        let [tx, ty, tz] = (self.point - reference).cross(self.normal).to_array();
        [nx, ny, nz, tx, ty, tz]
    }
}

/// What happened while planes were made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PlaneReport {
    /// Nodes left out because position, distance or normal was not finite or the normal had no length.
    pub n_invalid: usize,
    /// Nodes left out because there was no room: those with the largest gaps.
    pub n_beyond_capacity: usize,
}

/// Planes of all `candidates` whose gap is below `max_gap` (m), in the order of `candidates`; replaces `planes`.
///
/// `position_of`: present position of a candidate, part's frame, m. At most `planes.capacity()` planes are
/// made, the deepest ones; nothing is allocated.
pub fn planes_into(
    tool: &Tool,
    pose_part_tool: &DPose3,
    candidates: &[u32],
    position_of: impl Fn(u32) -> DVec3,
    max_gap: f64,
    planes: &mut Vec<Plane>,
) -> PlaneReport {
    let beyond = |_, _, _| ();
    planes_and_rest_into(
        tool,
        pose_part_tool,
        candidates,
        position_of,
        max_gap,
        planes,
        beyond,
    )
}

/// As [`planes_into`]; tells `beyond` of each candidate whose gap (m) is `max_gap` or more, of that gap and where it is.
pub fn planes_and_rest_into(
    tool: &Tool,
    pose_part_tool: &DPose3,
    candidates: &[u32],
    position_of: impl Fn(u32) -> DVec3,
    max_gap: f64,
    planes: &mut Vec<Plane>,
    mut beyond: impl FnMut(u32, f64, DVec3),
) -> PlaneReport {
    let mut report = PlaneReport::default();
    planes.clear();
    // Looked up only once there is no room, and again after each exchange.
    let mut largest_gap = None;
    for &candidate in candidates {
        let point = position_of(candidate);
        let contact = tool.signed_distance(pose_part_tool, point);
        // A product that is not finite says so for all its factors.
        let check = contact.signed_distance * point.length();
        if !check.is_finite() || !is_unit(contact.normal) {
            report.n_invalid += 1;
            continue;
        }
        if contact.signed_distance >= max_gap {
            beyond(candidate, contact.signed_distance, point);
            continue;
        }
        let plane = Plane {
            candidate,
            gap: contact.signed_distance,
            normal: contact.normal,
            point,
        };
        if planes.len() < planes.capacity() {
            planes.push(plane);
            continue;
        }
        report.n_beyond_capacity += 1;
        let largest = largest_gap.or_else(|| position_of_largest_gap(planes));
        largest_gap = largest;
        if let Some(largest) = largest
            && planes[largest].gap > plane.gap
        {
            planes.remove(largest);
            planes.push(plane);
            largest_gap = None;
        }
    }
    report
}

fn position_of_largest_gap(planes: &[Plane]) -> Option<usize> {
    (0..planes.len()).max_by(|&a, &b| planes[a].gap.total_cmp(&planes[b].gap))
}

fn is_unit(normal: DVec3) -> bool {
    /// Round-off of a rotated unit vector is 1e-15; a pose quaternion that is off by more is no rotation.
    const TOLERANCE: f64 = 1e-6;
    (normal.length_squared() - 1.0).abs() < TOLERANCE
}

/// Force (N) and torque (N m about `reference`) of the normal forces `normal_force` (N, >= 0) on the tool, part's frame:
/// `-Σ f_n h`.
pub fn wrench_on_tool(planes: &[Plane], normal_forces: &[f64], reference: DVec3) -> (DVec3, DVec3) {
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for (plane, &normal_force) in planes.iter().zip(normal_forces) {
        let force_on_tool = -normal_force * plane.normal;
        force += force_on_tool;
        torque += (plane.point - reference).cross(force_on_tool);
    }
    (force, torque)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tool::{HalfSpace, Sphere};

    #[test]
    fn plane_of_a_sphere_predicts_gaps_to_second_order() {
        let tool = Tool::Sphere(Sphere::new(2.0).unwrap());
        let pose = DPose3::from_translation(DVec3::new(0.3, -0.2, 0.1));
        let node = DVec3::new(1.5, 1.2, 0.9);
        let mut planes = Vec::with_capacity(1);
        planes_into(&tool, &pose, &[5], |_| node, 1.0, &mut planes);
        let plane = planes[0];
        assert_eq!(plane.candidate, 5);
        let error = |step: f64| {
            let moved = node + step * DVec3::new(0.3, -1.0, 0.7);
            let exact = tool.signed_distance(&pose, moved).signed_distance;
            (plane.gap_at(moved) - exact).abs()
        };
        // Halving the step quarters the error: the plane is the tangent.
        let ratio = error(1e-3) / error(5e-4);
        assert!((ratio - 4.0).abs() < 0.05, "{ratio}");
    }

    #[test]
    fn tool_row_is_the_rate_of_the_gap_under_tool_motion() {
        let tool = Tool::Sphere(Sphere::new(2.0).unwrap());
        let pose = DPose3::from_parts(
            DVec3::new(0.3, -0.2, 0.1),
            glam::DQuat::from_scaled_axis(DVec3::new(0.1, 0.2, -0.3)),
        );
        let reference = DVec3::new(-1.0, 0.4, 2.0);
        let node = DVec3::new(1.5, 1.2, 0.9);
        let mut planes = Vec::with_capacity(1);
        planes_into(&tool, &pose, &[0], |_| node, 1.0, &mut planes);
        let row = planes[0].tool_row(reference);
        let step = 1e-6;
        for k in 0..6 {
            let gap_after = |step: f64| {
                let mut twist = [0.0; 6];
                twist[k] = step;
                let shift = DVec3::new(twist[0], twist[1], twist[2]);
                let turn = glam::DQuat::from_scaled_axis(DVec3::new(twist[3], twist[4], twist[5]));
                let place = reference + turn * (pose.translation - reference) + shift;
                let moved = DPose3::from_parts(place, turn * pose.rotation);
                tool.signed_distance(&moved, node).signed_distance
            };
            let rate = (gap_after(step) - gap_after(-step)) / (2.0 * step);
            assert!((rate + row[k]).abs() < 1e-8, "{k}: {rate} and {}", row[k]);
        }
    }

    #[test]
    fn wrench_on_tool_is_minus_the_rows_times_the_forces() {
        let plane = |x: f64| Plane {
            candidate: 0,
            gap: 0.0,
            normal: DVec3::new(0.6, 0.0, 0.8),
            point: DVec3::new(x, 2.0, 3.0),
        };
        let planes = [plane(1.0), plane(-4.0)];
        let reference = DVec3::new(0.5, 0.5, 0.5);
        let (force, torque) = wrench_on_tool(&planes, &[2.0, 3.0], reference);
        for k in 0..3 {
            let rows = planes.map(|p| p.tool_row(reference));
            assert_eq!(force[k], -(2.0 * rows[0][k] + 3.0 * rows[1][k]));
            let expected = -(2.0 * rows[0][k + 3] + 3.0 * rows[1][k + 3]);
            assert!((torque[k] - expected).abs() < 1e-14);
        }
    }

    #[test]
    fn beyond_capacity_the_deepest_are_kept_and_invalid_nodes_are_counted() {
        let tool = Tool::HalfSpace(HalfSpace);
        let heights = [0.5, -0.1, f64::NAN, 0.2, -0.3, 5.0, 0.1];
        let position_of = |k: u32| DVec3::new(0.0, 0.0, heights[k as usize]);
        let mut planes = Vec::with_capacity(3);
        let candidates = [0, 1, 2, 3, 4, 5, 6];
        let report = planes_into(
            &tool,
            &DPose3::IDENTITY,
            &candidates,
            position_of,
            1.0,
            &mut planes,
        );
        assert_eq!(planes.capacity(), 3);
        let kept: Vec<u32> = planes.iter().map(|p| p.candidate).collect();
        assert_eq!(kept, [1, 4, 6]);
        assert_eq!((report.n_invalid, report.n_beyond_capacity), (1, 2));
    }
}

//! The body that is moved: which it is, where it is held, and what its pose means in the part's frame.

use contact::tool::Tool;
use device::Wrench;
use fem::Mesh;
use glam::DVec3;
use glamx::DPose3;

use crate::engine::{Grip, StepReport};

/// Which body is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds {
    /// The tool; the part is fixed in the world.
    Tool,
    /// The part; the tool is fixed in the world.
    Part,
}

/// The held body. The *handle* is the pose of its grip: the axes of the body, the origin at the grip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// Which body.
    pub holds: Holds,
    /// m, in the body's own frame.
    pub grip: DVec3,
    /// Tool in the world at the start, m; the part's frame is the world then.
    pub tool_pose: DPose3,
}

/// How far a held body has gone from where it was at the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gone {
    /// m, of its grip along the approach direction.
    pub travel: f64,
    /// m, across it.
    pub sideways: f64,
    /// rad, from how it stood.
    pub turn: f64,
}

impl Held {
    /// Held at the centre of its bounding box; a tool without bounds at its own origin.
    pub fn centred(holds: Holds, tool_pose: DPose3, tool: &Tool, mesh: &Mesh) -> Self {
        let grip = match holds {
            Holds::Tool => {
                let bounds = tool.aabb(&DPose3::IDENTITY);
                bounds.map_or(DVec3::ZERO, |(low, high)| 0.5 * (low + high))
            }
            Holds::Part => {
                let places = mesh.nodes.iter().map(|x| DVec3::from_array(*x));
                let bounds = places.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |b, x| {
                    (b.0.min(x), b.1.max(x))
                });
                0.5 * (bounds.0 + bounds.1)
            }
        };
        Self {
            holds,
            // A shape without an end on one side only has no centre.
            grip: if grip.is_finite() { grip } else { DVec3::ZERO },
            tool_pose,
        }
    }

    /// The other body, held at its centre.
    pub fn other(&self, tool: &Tool, mesh: &Mesh) -> Self {
        let holds = match self.holds {
            Holds::Tool => Holds::Part,
            Holds::Part => Holds::Tool,
        };
        Self::centred(holds, self.tool_pose, tool, mesh)
    }

    /// Where the engine's coupling is fastened.
    pub fn engine_grip(&self) -> Grip {
        match self.holds {
            Holds::Tool => Grip::OnTool(self.grip),
            Holds::Part => Grip::OnPart(self.grip),
        }
    }

    /// The handle at the start.
    pub fn start(&self) -> DPose3 {
        match self.holds {
            Holds::Tool => at_grip(&self.tool_pose, self.grip),
            Holds::Part => at_grip(&DPose3::IDENTITY, self.grip),
        }
    }

    /// The handle, so far along a direction from the start.
    pub fn along(&self, shift: DVec3) -> DPose3 {
        let start = self.start();
        DPose3 {
            translation: start.translation + shift,
            ..start
        }
    }

    /// Pose of the tool that a handle asks for, in the part's frame.
    pub fn target(&self, handle: &DPose3) -> DPose3 {
        let body = at_grip(handle, -self.grip);
        match self.holds {
            Holds::Tool => body,
            Holds::Part => body.inverse() * self.tool_pose,
        }
    }

    /// Where the grip is in the simulation, world. `tool_pose`: in the part's frame.
    pub fn pose(&self, tool_pose: &DPose3) -> DPose3 {
        match self.holds {
            Holds::Tool => at_grip(tool_pose, self.grip),
            Holds::Part => at_grip(&(self.tool_pose * tool_pose.inverse()), self.grip),
        }
    }

    /// How far it has gone from the start. `direction`: unit vector, world.
    pub fn gone(&self, tool_pose: &DPose3, direction: DVec3) -> Gone {
        let (body, start) = (self.pose(tool_pose), self.start());
        let moved = body.translation - start.translation;
        let travel = moved.dot(direction);
        Gone {
            travel,
            sideways: (moved - direction * travel).length(),
            turn: body.rotation.angle_between(start.rotation),
        }
    }

    /// A direction of the world in which the held body goes, as the tool's way in the part's frame.
    pub fn way_of_tool(&self, direction: DVec3) -> DVec3 {
        match self.holds {
            Holds::Tool => direction,
            Holds::Part => -direction,
        }
    }

    /// On a handle about its point, world.
    pub fn wrench_on_handle(&self, handle: &DPose3, report: &StepReport) -> Wrench {
        let body = self.pose(&report.tool_pose);
        let on_handle = match self.holds {
            // The handle feels the opposite of what holds the tool.
            Holds::Tool => -Wrench::from_array(&report.coupling_wrench_on_tool),
            // The part feels the opposite of the tool, turned into the world. The spring's deflection is along its
            // force, so that its two ends are as good as each other for the torque.
            Holds::Part => {
                let on_part = -Wrench::from_array(&report.contact_wrench_on_tool);
                Wrench::new(
                    body.rotation * on_part.force,
                    body.rotation * on_part.torque,
                )
            }
        };
        on_handle.about(body.translation, handle.translation)
    }
}

/// The same axes at a point given in the pose's own frame.
pub(super) fn at_grip(pose: &DPose3, grip: DVec3) -> DPose3 {
    DPose3 {
        translation: pose.translation + pose.rotation * grip,
        ..*pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn handle_target_and_pose_belong_together() {
        let tool_pose = DPose3::new(DVec3::new(0.1, 0.2, -0.3), DVec3::new(0.3, -0.8, 0.5));
        for holds in [Holds::Tool, Holds::Part] {
            let held = Held {
                holds,
                grip: DVec3::new(0.02, -0.01, 0.04),
                tool_pose,
            };
            let at_start = held.target(&held.start());
            assert!((at_start.translation - tool_pose.translation).length() < 1e-15);
            let shift = DVec3::new(0.0, 0.0, 2e-3);
            let tool = held.target(&held.along(shift));
            let back = held.pose(&tool);
            assert!((back.translation - held.start().translation - shift).length() < 1e-15);
            let way = held.way_of_tool(shift);
            assert!((tool.translation - tool_pose.translation - way).length() < 1e-15);
        }
    }
}

//! What a step tells: pose, wrenches, certificate and the time of each stage.

use glam::DVec3;
use glamx::DPose3;

/// Number of [`Stage`]s.
pub const N_STAGES: usize = 5;

/// The stages of a step, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Which candidates can be near the tool.
    Proximity,
    /// Displaced positions, signed distances and normals: one plane per near node.
    Planes,
    /// W and q.
    Delassus,
    /// The linear complementarity problem.
    Lcp,
    /// Contact forces to displacements of the near nodes, and the tool's pose.
    Update,
}

impl Stage {
    /// All stages in order.
    pub const ALL: [Self; N_STAGES] = [
        Self::Proximity,
        Self::Planes,
        Self::Delassus,
        Self::Lcp,
        Self::Update,
    ];

    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Proximity => "proximity",
            Self::Planes => "planes",
            Self::Delassus => "delassus",
            Self::Lcp => "lcp",
            Self::Update => "update",
        }
    }
}

/// A node that carries contact force: its own, or its share of a force between the nodes of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActiveContact {
    /// Index among the candidates.
    pub candidate: u32,
    /// N, along the tool's outward normals, on the part: its own, >= 0, and its shares N_a f_n of forces on faces, which
    /// may be below 0 at the vertex of a curved face. Sums over the nodes to the sum of all normal forces.
    pub normal_force: f64,
    /// N, part frame: the same along each normal, and with friction across it.
    pub force_on_part: DVec3,
    /// Whether it sticks to the tool; false without friction, and where one of its contacts slips.
    pub sticks: bool,
}

/// Result of one step. Wrenches are `[force N, torque N m]` in the part's frame, about the tool's
/// origin.
#[derive(Clone, Copy, Debug)]
pub struct StepReport {
    /// Pose of the tool in the part's frame.
    pub tool_pose: DPose3,
    /// What the contacts exert on the tool.
    pub contact_wrench_on_tool: [f64; 6],
    /// What the virtual coupling exerts on the tool; the handle feels its opposite.
    pub coupling_wrench_on_tool: [f64; 6],
    /// Nodes that had a plane in the last pass, and points of the tool's edges that had a row.
    pub near: u32,
    /// Rows of the last contact problem: fewer than `near` where nodes share rows in patches.
    pub rows: u32,
    /// Nodes, and points of the tool's edges, that carry force.
    pub contacts: u32,
    /// Of those that carry force, the ones that stick; with friction only.
    pub sticking: u32,
    /// J, that friction took in the step, >= 0 but for round-off; with friction only.
    pub dissipated: f64,
    /// Near nodes and points of the tool's edges left out because memory for more was not reserved.
    pub dropped: u32,
    /// Near nodes left out because their column of the compliance is not there yet.
    pub without_column: u32,
    /// Where nodes share rows: estimate of the resultant's relative error by that, of the last pass (see
    /// [`contact::patch::Loss`]).
    pub merge_error: f64,
    /// m, deepest that a node penetrates its plane after the last pass because it shares a row.
    pub merged_penetration: f64,
    /// Whether `merge_error` is above its tolerance.
    pub merged_badly: bool,
    /// m: how deep a tool whose pose is imposed is in nodes or faces that are held along the contact's normal, rigid
    /// against rigid; their forces, which nothing limits, are left out. 0 where there is none, or the tool has a coupling.
    pub rigid_depth: f64,
    /// Passes over the contact planes (of the last stride).
    pub passes: u32,
    /// Strides in which a fast handle was followed.
    pub strides: u32,
    /// Changes of the active set of all LCPs of the step, each one factorisation.
    pub pivots: u32,
    /// Natural residual of the last contact problem, scaled: max |min(z / max z, w / max q)|, or on the cone of friction.
    pub certificate: f64,
    /// Whether the last LCP was solved; otherwise its best answer was used.
    pub lcp_solved: bool,
    /// Whether the planes stood still at the end (always true for a fixed number of passes).
    pub converged: bool,
    /// Whether the target pose was refused (not finite, or no unit quaternion).
    pub rejected: bool,
    /// Nanoseconds by [`Stage`].
    pub stage_ns: [u64; N_STAGES],
}

impl StepReport {
    pub(crate) fn at(target: &DPose3) -> Self {
        Self {
            tool_pose: *target,
            contact_wrench_on_tool: [0.0; 6],
            coupling_wrench_on_tool: [0.0; 6],
            near: 0,
            rows: 0,
            contacts: 0,
            sticking: 0,
            dissipated: 0.0,
            dropped: 0,
            without_column: 0,
            merge_error: 0.0,
            merged_penetration: 0.0,
            merged_badly: false,
            rigid_depth: 0.0,
            passes: 0,
            strides: 0,
            pivots: 0,
            certificate: 0.0,
            lcp_solved: true,
            converged: true,
            rejected: false,
            stage_ns: [0; N_STAGES],
        }
    }

    /// N, on the tool, from the contacts.
    pub fn contact_force_on_tool(&self) -> DVec3 {
        DVec3::new(
            self.contact_wrench_on_tool[0],
            self.contact_wrench_on_tool[1],
            self.contact_wrench_on_tool[2],
        )
    }

    /// How far contact and coupling are from balancing on the tool, relative to the contact
    /// force, with torques made comparable by `lever` (m). Forces under 1 mN, two hundred times
    /// below what the finest device resolves, count as 1 mN: there the coupling's deflection is
    /// the difference of two positions and has no nine digits left.
    pub fn wrench_mismatch_rel(&self, lever: f64) -> f64 {
        let (contact, coupling) = (&self.contact_wrench_on_tool, &self.coupling_wrench_on_tool);
        let norm = |from: usize, f: &dyn Fn(usize) -> f64| {
            (from..from + 3).map(|i| f(i) * f(i)).sum::<f64>().sqrt()
        };
        let force = norm(0, &|i| contact[i] + coupling[i]);
        let torque = norm(3, &|i| contact[i] + coupling[i]);
        let scale = norm(0, &|i| contact[i])
            .max(norm(3, &|i| contact[i]) / lever)
            .max(1e-3);
        force.max(torque / lever) / scale
    }
}

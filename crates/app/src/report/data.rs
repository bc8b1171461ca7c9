//! What the writers of the result folder are given: plain numbers, no references into the engine.
//!
//! SI units throughout; vectors in the part's frame. Whoever runs a session fills a [`Run`] and
//! hands it to [`write_all`](super::write_all).

mod drive;

use glam::DVec3;
use glamx::DPose3;

pub use self::drive::{DriveRow, Driven, FrictionFacts, coefficient_in_words};
use super::origin::Origin;
use super::strain::StrainFacts;
use super::summary::Percentiles;

/// Number of timed stages in a step; see [`STAGE_NAMES`].
pub const N_STAGES: usize = 5;

/// The timed stages of a step in their order, as they are called in tables and files.
pub const STAGE_NAMES: [&str; N_STAGES] = ["proximity", "planes", "delassus", "lcp", "update"];

/// Everything that one run tells.
#[derive(Clone, Debug)]
pub struct Run {
    /// The scene's title.
    pub title: String,
    /// The scene file as the user named it.
    pub scene_path: String,
    /// Processor, cores, system: one line.
    pub machine: String,
    /// When the run was made, and from what.
    pub origin: Origin,
    /// Settings worth repeating beside the result, as (label, value with unit).
    pub settings: Vec<(String, String)>,
    /// Checks that were made, as (label, value), for example of the compliance matrix.
    pub checks: Vec<(String, String)>,
    /// Sentences for the reader.
    pub notes: Vec<String>,
    /// What the reader must not miss.
    pub warnings: Vec<Warning>,
    /// Numbers about the part and the run as a whole.
    pub facts: Facts,
    /// The largest strains, and what the material bears.
    pub strain: StrainFacts,
    /// The part's own curve; `None` where none was driven.
    pub driven: Option<Driven>,
    /// What the hand felt, one row per step, in order of time; empty for a scene without a hand.
    pub rows: Vec<StepRow>,
    /// What all pictures share.
    pub part: PartDrawing,
    /// Moments to be drawn and written for a viewer.
    pub frames: Vec<Frame>,
    /// The handbook's answer, where one exists for the part.
    pub handbook: Option<Handbook>,
    /// Stage by stage beside the paper of 2004; empty to leave the comparison out.
    pub paper: Vec<PaperStage>,
    /// Every physical effect with its number and verdict.
    pub effects: Vec<Effect>,
    /// Where the pictures are taken from.
    pub viewing: Viewing,
    /// Which of the larger files are written.
    pub outputs: Outputs,
}

/// What the reader must not miss: one doubt about a run, with its number and the mend.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    /// Kind of doubt, in words joined by hyphens, for programs.
    pub id: &'static str,
    /// One sentence: what was seen, with its number and unit, and what to do.
    pub text: String,
    /// The number that gave rise to it, in the SI unit that the text names or without unit.
    pub number: Option<f64>,
}

impl From<String> for Warning {
    /// A doubt of no kind of its own.
    fn from(text: String) -> Self {
        Self {
            id: "run",
            text,
            number: None,
        }
    }
}

/// Numbers about the part and the run as a whole.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// Nodes of the mesh that was computed with.
    pub nodes: usize,
    /// Elements of that mesh.
    pub elements: usize,
    /// Polynomial order of the elements: 1, 2 or 3.
    pub order: u32,
    /// Nodes on the surface.
    pub surface_nodes: usize,
    /// Nodes that may touch.
    pub candidates: usize,
    /// Translational stiffness of the virtual coupling, N/m; `None` where the tool's pose is
    /// imposed.
    pub coupling_stiffness: Option<f64>,
    /// Wall-clock time of the preparation, s.
    pub prepare_s: f64,
    /// Whether the preparation was read from the cache.
    pub from_cache: bool,
    /// Steps that ended after their servo period; `None` where no clock was kept.
    pub missed_deadlines: Option<u64>,
    /// Largest principal strain of the free skin, 1 (0.01 is 1 %); [`StrainFacts::value`].
    pub max_principal_strain: f64,
    /// Largest rotation of a material point, degrees.
    pub max_rotation_deg: f64,
    /// Whether the haptic loop solved whole steps.
    pub rates: RateFacts,
    /// Where the multiply of the whole surface ran.
    pub multiply: MultiplyFacts,
}

/// Where the multiply of the whole surface ran, and why there.
#[derive(Clone, Debug, Default)]
pub struct MultiplyFacts {
    /// Name of the place, with the numbers kept there.
    pub runs_on: String,
    /// Whether that is a graphics adapter.
    pub is_on_gpu: bool,
    /// Why there, in one word.
    pub why: &'static str,
    /// Where and why, in one line.
    pub words: String,
    /// Times of processor and adapter, if they were compared.
    pub race: Option<MultiplyRace>,
    /// Products that an adapter gave too late.
    pub n_late: u32,
    /// Why an adapter was given up on the way, if it was.
    pub given_up: Option<String>,
}

/// Times of the multiply on processor and adapter.
#[derive(Clone, Debug)]
pub struct MultiplyRace {
    /// The adapter.
    pub adapter: String,
    /// Contacts of the product.
    pub n_contacts: usize,
    /// Median, s.
    pub processor_s: f64,
    /// Median, s.
    pub gpu_s: f64,
    /// Whether it was measured in an earlier run.
    pub is_remembered: bool,
}

/// Whether the haptic loop solved whole steps, and what two rates did.
#[derive(Clone, Debug, Default)]
pub struct RateFacts {
    /// Why one or two were chosen.
    pub why: String,
    /// What two did; `None` for one.
    pub two: Option<TwoRateFacts>,
}

/// What two rates did.
#[derive(Clone, Copy, Debug, Default)]
pub struct TwoRateFacts {
    /// Periods after which the engine's results were there; `None`: as soon as they were solved.
    pub every: Option<u64>,
    /// Problems that took the place of another.
    pub hand_overs: u64,
    /// By how much two problems differed at a hand-over that was felt, N: median.
    pub difference_median_n: f64,
    /// The same, N: largest.
    pub difference_max_n: f64,
    /// Highest age of the target whose problem was used, periods.
    pub max_staleness: u64,
    /// Periods in which a node without a row may have come into contact.
    pub beyond_margin: u64,
    /// Periods in which a stale wrench was faded.
    pub faded: u64,
    /// The engine's steps with contact, frozen, µs.
    pub engine_us: Option<Percentiles>,
}

/// What the hand is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Pushing along the approach direction.
    Approach,
    /// Standing still at the end of the travel.
    Hold,
    /// Pulling back.
    Retract,
}

impl Phase {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Approach => "approach",
            Self::Hold => "hold",
            Self::Retract => "retract",
        }
    }
}

/// One haptic step.
#[derive(Clone, Copy, Debug)]
pub struct StepRow {
    /// Number of the step, from 0.
    pub step: u64,
    /// Simulated time, s.
    pub time_s: f64,
    /// What the hand is doing.
    pub phase: Phase,
    /// Travel of the held body (not of the handle, which is ahead by the deflection of the
    /// coupling) along the approach direction since the start, m.
    pub travel_m: f64,
    /// Force at the hand along the approach direction, positive when it resists, N.
    pub force_n: f64,
    /// Force that the simulation exerts on the handle, N.
    pub force_on_handle: DVec3,
    /// Its torque about the handle point, N m.
    pub torque_on_handle: DVec3,
    /// Nodes that carry force.
    pub contacts: u32,
    /// Pivots of all LCPs in the step.
    pub pivots: u32,
    /// Largest violation of the contact conditions, scaled; 0 is exact.
    pub certificate: f64,
    /// Contact wrench against coupling wrench on the tool, relative; 0 is equilibrium.
    pub wrench_mismatch_rel: f64,
    /// Handle in the world, m.
    pub handle_pose: DPose3,
    /// Tool in the part's frame, m.
    pub tool_pose: DPose3,
    /// Time of each stage in the order of [`STAGE_NAMES`], ns.
    pub stage_ns: [u64; N_STAGES],
    /// Time of the whole step, ns.
    pub total_ns: u64,
    /// Time of the whole-surface displacement, ns, in the steps that computed it (display rate).
    pub multiply_ns: Option<u64>,
}

/// The undeformed part as it is drawn and written.
#[derive(Clone, Debug, Default)]
pub struct PartDrawing {
    /// Position of every node at rest, m.
    pub nodes: Vec<DVec3>,
    /// Surface triangles as node indices, outward by the right-hand rule; faces with nodes along
    /// their edges already split.
    pub triangles: Vec<[u32; 3]>,
    /// Element edges on the surface as polylines of node indices, each edge once.
    pub edges: Vec<Vec<u32>>,
    /// Node indices of all elements, one after the other, in Gmsh's order.
    pub cells: Vec<u32>,
    /// Kind of all elements.
    pub cell_kind: CellKind,
}

/// Kind of the volume elements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CellKind {
    /// Four nodes.
    Tet4,
    /// Ten nodes.
    #[default]
    Tet10,
    /// Twenty nodes.
    Tet20,
}

impl CellKind {
    /// Nodes of one element.
    pub fn nodes_per_cell(self) -> usize {
        match self {
            Self::Tet4 => 4,
            Self::Tet10 => 10,
            Self::Tet20 => 20,
        }
    }
}

/// One moment of the run.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// A word or two, for example `peak`; becomes part of the file name.
    pub label: String,
    /// The step at whose end the moment lies.
    pub step: u64,
    /// Travel of the held body, m.
    pub travel_m: f64,
    /// Force at the hand, positive when it resists, N.
    pub force_n: f64,
    /// Displacement of every node, m.
    pub displacement: Vec<DVec3>,
    /// Von Mises stress at every node, Pa; empty where none was recovered.
    pub von_mises: Vec<f64>,
    /// Largest principal strain by size at every node, not a number off the skin; empty where none was recovered.
    pub strain: Vec<f64>,
    /// Forces of the contacts on the part.
    pub contacts: Vec<ContactForce>,
    /// The tool's surface in its pose, as corner points, m.
    pub tool: Vec<[DVec3; 3]>,
}

/// Force of one contact on the part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactForce {
    /// The node that carries it.
    pub node: u32,
    /// Where it acts, displaced position, m.
    pub point: DVec3,
    /// Force on the part, N.
    pub force: DVec3,
    /// Whether it sticks to the tool; false without friction.
    pub sticks: bool,
}

/// The handbook's answer for the same part.
#[derive(Clone, Debug, Default)]
pub struct Handbook {
    /// Which formula and source.
    pub name: String,
    /// Compared numbers.
    pub rows: Vec<HandbookRow>,
    /// Force over travel by the handbook, as (travel m, force N); may be empty.
    pub curve: Vec<(f64, f64)>,
}

/// One number from the handbook beside ours.
#[derive(Clone, Debug, PartialEq)]
pub struct HandbookRow {
    /// What it is.
    pub label: String,
    /// The handbook's number, in `unit`.
    pub handbook: f64,
    /// Ours, in `unit`.
    pub computed: f64,
    /// Unit of both; empty for a ratio.
    pub unit: String,
}

/// Time of one stage in the paper and here.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperStage {
    /// The paper's word for it.
    pub stage: String,
    /// The paper's time, ms.
    pub paper_ms: f64,
    /// Our median for the same work, µs.
    pub ours_us: f64,
}

impl PaperStage {
    /// The three times of Duriez et al. 2004 (Pentium 4, 2.4 GHz) beside ours, all medians in µs.
    pub fn duriez_2004(collision_us: f64, lcp_us: f64, multiply_us: f64) -> Vec<Self> {
        let row = |stage: &str, paper_ms, ours_us| Self {
            stage: stage.into(),
            paper_ms,
            ours_us,
        };
        vec![
            row("collision detection", 2.5, collision_us),
            row("LCP", 0.2, lcp_us),
            row("compliance multiply", 0.01, multiply_us),
        ]
    }
}

/// Verdict on one physical effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// Name as in the scene.
    pub name: String,
    /// Whether it is simulated.
    pub on: bool,
    /// Estimate of what it would change, if one could be made.
    pub number: Option<f64>,
    /// Number from which the effect matters.
    pub threshold: f64,
    /// In words.
    pub why: String,
}

/// Where the pictures are taken from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// From the eye towards the part; any length but zero.
    pub direction: DVec3,
    /// What points up in the picture; not along `direction`.
    pub up: DVec3,
}

/// Where the pictures are taken from, and what another place is chosen by if contact is hidden there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Viewing {
    /// As it is if nothing speaks against it.
    pub view: View,
    /// Whether it was asked for: then it is kept, whatever it shows.
    pub is_fixed: bool,
    /// Way of the held body, of any length; zero keeps the view.
    pub approach: DVec3,
}

impl View {
    /// A three-quarter view mostly along `axis` (for example of a cylindrical tool), with `up`
    /// upwards: 30 degrees to the side and 20 degrees from above.
    pub fn three_quarter(axis: DVec3, up: DVec3) -> Self {
        let into = axis.normalize_or(DVec3::Z);
        let up = up
            .reject_from(into)
            .normalize_or(into.any_orthonormal_vector());
        let side = into.cross(up);
        let (yaw, pitch) = (30f64.to_radians(), 20f64.to_radians());
        let level = into * yaw.cos() + side * yaw.sin();
        Self {
            direction: level * pitch.cos() - up * pitch.sin(),
            up,
        }
    }
}

impl Default for View {
    fn default() -> Self {
        Self::three_quarter(DVec3::NEG_Z, DVec3::Y)
    }
}

/// Which of the larger files are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs {
    /// Pictures of the frames.
    pub png: bool,
    /// Deformed shapes for ParaView.
    pub vtu: bool,
    /// The session as MCAP.
    pub mcap: bool,
}

impl Default for Outputs {
    fn default() -> Self {
        Self {
            png: true,
            vtu: true,
            mcap: true,
        }
    }
}

//! What an engine is built from: all that a scene calls for, and nothing else.

use std::sync::Arc;

use contact::friction::Coefficients;
use contact::lcp;
use contact::surface::Surface;
use contact::tool::{Features, Tool};
use device::VirtualCoupling;
use glam::DVec3;

use super::{ContactPart, Grip};

/// How often the contact planes are drawn anew within one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactIterations {
    /// Until the displacement of every near node changes by less than
    /// [`EngineSettings::displacement_tolerance`].
    Converged,
    /// This many passes; 1 is the single pass of the paper.
    Fixed(u32),
}

/// What a step is allowed and asked to do.
#[derive(Clone, Debug)]
pub struct EngineSettings {
    /// Passes over the contact planes in a step.
    pub contact_iterations: ContactIterations,
    /// m. With [`ContactIterations::Converged`], the change of displacement and tool position
    /// below which the planes stand still. 1e-9 m is 1e-5 N on a part of 10 kN/m.
    pub displacement_tolerance: f64,
    /// m. Places nearer to the tool than this get a contact. Does not change a converged result:
    /// one that comes in from farther away gets its contact in the next pass.
    pub near_distance: f64,
    /// Rows of the LCP. More contacts than that share rows in patches, up to [`super::NEAR_PER_ROW`] times as many; beyond
    /// it the deepest gaps are kept. A solution takes a time that grows with the cube of the rows, W with the square of
    /// the contacts.
    pub max_contacts: usize,
    /// Of the resultant's relative error where rows are shared, as [`super::StepReport::merge_error`] estimates it: above it
    /// a step says so. Human fingers resolve 7 % of a force at best.
    pub merge_tolerance: f64,
    /// Settings of the LCP solver.
    pub lcp: lcp::Settings,
    /// m. Tool motion in one go; a faster handle is followed in several strides of the same step,
    /// so that a jump cannot pick another branch or pass through the part unseen.
    pub max_stride: f64,
}

/// Where contact acts on the part.
#[derive(Clone, Debug)]
pub enum ContactPlaces {
    /// At its nodes.
    Nodes,
    /// At the places of these faces' edges, and inside them, that are nearest to the tool: they move with it.
    Moving(Arc<Surface>),
}

/// The parts of an engine.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The elastic part.
    pub part: Arc<ContactPart>,
    /// The rigid tool.
    pub tool: Tool,
    /// The virtual coupling between handle and tool; `None`: the tool's pose is imposed (no coupling compliance in the
    /// contact problem; what reference cases ask for).
    pub coupling: Option<VirtualCoupling>,
    /// Where the coupling is fastened.
    pub grip: Grip,
    /// Unit, part's frame: along it the tool's place is imposed, whatever the coupling does across it.
    pub guide: Option<DVec3>,
    /// Unit, part's frame: the coupling is a spring along it, and all else of the tool's pose is imposed.
    pub rail: Option<DVec3>,
    /// Where contact acts.
    pub places: ContactPlaces,
    /// Corners and edges of the tool, that touch these faces between the nodes.
    pub features: Option<(Arc<Surface>, Features)>,
    /// Coulomb's coefficients between part and tool; `None`: no friction, and nothing is built for it.
    pub friction: Option<Coefficients>,
    /// What a step is allowed and asked to do.
    pub settings: EngineSettings,
}

impl Plan {
    /// Contact at the nodes alone, without friction; the coupling, if there is one, is fastened at the tool's origin.
    pub fn new(
        part: Arc<ContactPart>,
        tool: Tool,
        coupling: Option<VirtualCoupling>,
        settings: EngineSettings,
    ) -> Self {
        Self {
            part,
            tool,
            coupling,
            grip: Grip::OnTool(DVec3::ZERO),
            guide: None,
            rail: None,
            places: ContactPlaces::Nodes,
            features: None,
            friction: None,
            settings,
        }
    }
}

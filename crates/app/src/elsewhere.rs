//! A tool that goes into the part where nothing is named that it could touch.
//!
//! After a run, at sampled places, outside the haptic step: the nodes of the part's surface that are in no contact group.

use contact::tool::Tool;
use glam::DVec3;
use glamx::DPose3;

use crate::prepare::LoadedPart;

/// Of the travel, and of the mean distance of neighbouring vertices, the depth from which it is told: at the border of the
/// contact faces the tool is as deep in as contact at nodes lets it.
const TOLD: f64 = 0.02;
const TOLD_OF_EDGE: f64 = 0.25;

/// The deepest that a tool was in a surface without contact.
pub(crate) struct Elsewhere<'a> {
    loaded: &'a LoadedPart,
    tool: &'a Tool,
    /// Nodes of the surface, in no contact group.
    nodes: Vec<u32>,
    /// m.
    edge: f64,
    /// m below a node, and the node; where the travel was, m.
    deepest: Option<(f64, u32, f64)>,
    /// m, travel at which it was first told of.
    first: Option<f64>,
}

impl<'a> Elsewhere<'a> {
    pub(crate) fn new(loaded: &'a LoadedPart, tool: &'a Tool) -> Self {
        let is_in = |nodes: &[u32], node: &u32| nodes.binary_search(node).is_ok();
        let nodes = loaded.rows.iter().copied();
        let nodes = nodes.filter(|n| !is_in(&loaded.candidates, n) && !is_in(&loaded.held, n));
        Self {
            nodes: nodes.collect(),
            edge: mean_edge(loaded),
            loaded,
            tool,
            deepest: None,
            first: None,
        }
    }

    /// `u`: displacement of all nodes of the mesh, m.
    pub(crate) fn look(&mut self, u: &[f64], tool_pose: &DPose3, travel: f64) {
        for &node in &self.nodes {
            let i = node as usize;
            let rest = DVec3::from_array(self.loaded.mesh.nodes[i]);
            let at = rest + DVec3::from_slice(&u[3 * i..3 * i + 3]);
            let depth = -self.tool.signed_distance(tool_pose, at).signed_distance;
            if depth <= TOLD_OF_EDGE * self.edge {
                continue;
            }
            self.first = Some(self.first.map_or(travel, |first| first.min(travel)));
            if self.deepest.is_none_or(|(most, ..)| depth > most) {
                self.deepest = Some((depth, node, travel));
            }
        }
    }

    /// `way`: of the whole run, m.
    pub(crate) fn warning(&self, way: f64) -> Option<String> {
        let (depth, node, travel) = self.deepest.filter(|(depth, ..)| *depth > TOLD * way)?;
        let mesh = &self.loaded.mesh;
        let [x, y, z] = mesh.nodes[node as usize].map(|x| format!("{:.3}", 1e3 * x + 0.0));
        Some(format!(
            "the tool goes into the part where nothing is named that it could touch: from about {:.3} mm of travel on, up to \
             {:.3} mm deep at node {} at ({x}, {y}, {z}) mm, at {:.3} mm; name these faces in part.contact, or end the way \
             before",
            1e3 * self.first.unwrap_or(travel),
            1e3 * depth,
            mesh.node_tags[node as usize],
            1e3 * travel,
        ))
    }
}

/// m, between the vertices of the elements.
fn mean_edge(loaded: &LoadedPart) -> f64 {
    let mesh = &loaded.mesh;
    let (mut sum, mut n) = (0.0, 0);
    for element in 0..mesh.n_elements() {
        let corners = &mesh.element_nodes(element)[..4];
        let place = |k: usize| DVec3::from_array(mesh.nodes[corners[k] as usize]);
        for (a, b) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
            sum += (place(a) - place(b)).length();
            n += 1;
        }
    }
    sum / f64::from(n.max(1))
}

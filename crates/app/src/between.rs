//! How deep a tool gets into the part's faces between their nodes, where contact at nodes feels nothing.
//!
//! After a run, at sampled steps, outside the haptic step: each contact face near the tool is searched for the point that
//! is deepest in it.

use contact::face::{Face, FaceOrder, MAX_FACE_NODES};
use contact::surface::Surface;
use contact::tool::Tool;
use glam::DVec3;
use glamx::DPose3;

use crate::engine::Engine;
use crate::prepare::{LoadedPart, PreparedPart};

/// Points of a face's grid along an edge, from which the search for the deepest goes on.
const GRID: usize = 4;

/// Halvings of the search's step: to a thousandth of a face.
const HALVINGS: usize = 8;

/// Of the distance between nodes, how near a tool is at a face, and how deep in it is told.
const AT_FACE: f64 = 0.02;

/// Of the travel, the depth between nodes from which it is told: the force is then wrong by a like share at least.
const TOLD_DEPTH: f64 = 0.02;

/// Distances of nodes in a radius of the tool from which on it is smooth for the mesh. A tapered hook under edges of
/// 0.5 and 2 mm, nodes 0.05 to 0.65 mm apart: with 8 of them in the radius the peak is 10 % too high, with 3 30 %, with 1
/// four times what it should be.
const NODES_IN_RADIUS: f64 = 4.0;

/// Distances of nodes in a radius of the tool below which it is taken for the bend between two facets.
const FACET: f64 = 0.2;

/// A place where a tool is at a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// m, how deep the tool is in the face there; not below 0.
    pub depth: f64,
    /// m, between neighbouring nodes of that face.
    pub spacing: f64,
    /// m, smallest radius of curvature of the tool there; infinite where it is flat.
    pub radius: f64,
}

/// How a tool and the nodes of the faces that it is at go together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Between {
    /// Where it is deepest in a face.
    pub deepest: Option<Place>,
    /// Where its radius is smallest for the distance of the nodes.
    pub finest: Option<Place>,
}

impl Between {
    /// Looks at a deformed surface under a tool. `position_of`: of a candidate, part's frame, m.
    pub fn look(
        &mut self,
        surface: &Surface,
        position_of: impl Fn(u32) -> DVec3,
        tool: &Tool,
        tool_pose: &DPose3,
    ) {
        let order = surface.order();
        for face in 0..surface.n_faces() {
            let mut places = [DVec3::ZERO; MAX_FACE_NODES];
            surface.positions_into(face, &position_of, &mut places);
            let places = &places[..order.n_nodes()];
            let spacing = spacing(order, places);
            let nearest = nearest(order, places, tool, tool_pose);
            let Some((distance, at)) = nearest.filter(|(d, _)| *d <= AT_FACE * spacing) else {
                continue;
            };
            let here = Place {
                depth: (-distance).max(0.0),
                spacing,
                radius: radius_at(tool, tool_pose, at, spacing),
            };
            if self.deepest.is_none_or(|then| here.depth > then.depth) {
                self.deepest = Some(here);
            }
            let fineness = |place: Place| place.spacing / place.radius;
            if self
                .finest
                .is_none_or(|then| fineness(here) > fineness(then))
            {
                self.finest = Some(here);
            }
        }
    }

    /// Words for a warning, if the tool is too fine for the mesh. `travel` (m): of the whole run. `is_felt_between`: whether
    /// it is felt between the nodes; then only what is smooth can be missed, which the depth shows. `has_facets`: whether
    /// the tool is a mesh, of which a round is as many slopes.
    pub fn warning(&self, travel: f64, is_felt_between: bool, has_facets: bool) -> Option<String> {
        let is_deep = |p: &Place| p.depth > TOLD_DEPTH * travel && p.depth > AT_FACE * p.spacing;
        let is_fine = |p: &Place| !is_felt_between && p.radius < NODES_IN_RADIUS * p.spacing;
        let is_facet = |p: &Place| has_facets && p.radius < FACET * p.spacing;
        let deep = self.deepest.filter(is_deep);
        let place = deep.or(self.finest.filter(is_fine))?;
        let shape = match self.finest.filter(is_fine) {
            Some(fine) if is_facet(&fine) => format!(
                "the tool bends within less than the {:.3} mm between the part's nodes, as facets and sharp rounds do, so \
                 that it",
                1e3 * fine.spacing
            ),
            Some(fine) => format!(
                "the tool's radius of {:.3} mm is small for nodes that are {:.3} mm apart, so that it",
                1e3 * fine.radius,
                1e3 * fine.spacing
            ),
            None => format!(
                "the tool meets nodes that are {:.3} mm apart; it",
                1e3 * place.spacing
            ),
        };
        let depth = self.deepest.map_or(0.0, |p| p.depth);
        let goes_in = if depth > 1e-3 * place.spacing && depth > 1e-3 * travel {
            format!(
                "gets up to {:.3} mm ({:.1} % of the travel) into faces between nodes, where contact at nodes feels \
                 nothing, and",
                1e3 * depth,
                100.0 * depth / travel.max(f64::MIN_POSITIVE)
            )
        } else {
            "can lie between them unfelt and".to_owned()
        };
        // Facets are as fine as their file makes them, and no mesh follows them.
        let mend = if is_facet(&place) {
            "give a round tool finer facets or the shape of a cylinder, sphere or capsule, a sharp edge a round, or mesh the \
             contact faces finer"
                .to_owned()
        } else {
            format!(
                "mesh the contact faces finer (nodes about {:.2} mm apart) or raise accuracy.order",
                1e3 * (0.5 * place.radius / NODES_IN_RADIUS).min(0.5 * place.spacing)
            )
        };
        Some(format!(
            "{shape} {goes_in} meets the nodes one by one: force and work are wrong there; {mend}"
        ))
    }
}

/// m, mean distance of neighbouring nodes along the edges.
fn spacing(order: FaceOrder, places: &[DVec3]) -> f64 {
    let steps = match order {
        FaceOrder::Linear => 1.0,
        FaceOrder::Quadratic => 2.0,
        FaceOrder::Cubic => 3.0,
    };
    let [a, b, c] = [places[0], places[1], places[2]];
    ((b - a).length() + (c - b).length() + (a - c).length()) / (3.0 * steps)
}

/// The signed distance of the tool from a face, m, and where; `None` where it is clear of it.
fn nearest(
    order: FaceOrder,
    places: &[DVec3],
    tool: &Tool,
    tool_pose: &DPose3,
) -> Option<(f64, DVec3)> {
    let face = Face::new(order, places);
    let look = |l: [f64; 3]| {
        let (at, _, _) = face.at(l);
        (tool.signed_distance(tool_pose, at).signed_distance, at)
    };
    let middle = look([1.0 / 3.0; 3]);
    let reach = places.iter().map(|x| (*x - middle.1).length());
    let reach = order.largest_sum() * reach.fold(0.0, f64::max);
    if middle.0 > reach {
        return None;
    }
    let mut best = (middle, [1.0 / 3.0; 3]);
    let try_at = |best: &mut ((f64, DVec3), [f64; 3]), l: [f64; 3]| {
        let here = look(l);
        let is_better = here.0 < best.0.0;
        if is_better {
            *best = (here, l);
        }
        is_better
    };
    for i in 0..=GRID {
        for j in 0..=GRID - i {
            let (a, b) = (i as f64 / GRID as f64, j as f64 / GRID as f64);
            try_at(&mut best, [a, b, 1.0 - a - b]);
        }
    }
    // On along the three directions of the edges, step by step halved.
    let mut step = 0.5 / GRID as f64;
    for _ in 0..HALVINGS {
        for (up, down) in [(0, 1), (1, 2), (2, 0), (1, 0), (2, 1), (0, 2)] {
            let mut l = best.1;
            let way = step.min(l[down]);
            l[up] += way;
            l[down] -= way;
            try_at(&mut best, l);
        }
        step *= 0.5;
    }
    Some(best.0)
}

/// m, smallest radius of curvature of the tool at a point, by how its normal turns over half the distance of the nodes or
/// a hundredth of it, whichever turns more for its way.
fn radius_at(tool: &Tool, tool_pose: &DPose3, at: DVec3, spacing: f64) -> f64 {
    let normal = tool.signed_distance(tool_pose, at).normal;
    let (along, across) = normal.any_orthonormal_pair();
    // On the surface: inside, radii are less by the depth.
    let on_surface = at - tool.signed_distance(tool_pose, at).signed_distance * normal;
    let mut least = f64::INFINITY;
    for way in [0.25 * spacing, 0.005 * spacing] {
        for direction in [
            along,
            across,
            (along + across).normalize(),
            (along - across).normalize(),
        ] {
            let [a, b] = [way, -way].map(|s| {
                tool.signed_distance(tool_pose, on_surface + s * direction)
                    .normal
            });
            let turn = (a - b).length();
            // What is no more than the noise of a flat tool.
            if turn > 1e-6 {
                least = least.min(2.0 * way / turn);
            }
        }
    }
    least
}

/// What sampled steps of a run show.
pub(crate) struct BetweenNodes<'a> {
    surface: Option<Surface>,
    loaded: &'a LoadedPart,
    engine: &'a Engine,
    between: Between,
}

impl<'a> BetweenNodes<'a> {
    pub(crate) fn new(prepared: &'a PreparedPart, engine: &'a Engine) -> Self {
        Self {
            // Groups without faces have nothing between their nodes; a checked mesh has no other error.
            surface: prepared.contact_surface().ok().flatten(),
            loaded: &prepared.loaded,
            engine,
            between: Between::default(),
        }
    }

    /// `u`: displacement of all nodes of the mesh, m.
    pub(crate) fn look(&mut self, u: &[f64], tool_pose: &DPose3) {
        let Some(surface) = &self.surface else {
            return;
        };
        let position_of = |candidate: u32| {
            let node = self.loaded.candidates[candidate as usize] as usize;
            let rest = DVec3::from_array(self.loaded.mesh.nodes[node]);
            rest + DVec3::from_slice(&u[3 * node..3 * node + 3])
        };
        let tool = self.engine.tool();
        self.between.look(surface, position_of, tool, tool_pose);
    }

    /// Whether it gets so deep into faces that the force is another than the part's. `travel` (m): of the whole run.
    pub(crate) fn gets_in(&self, travel: f64) -> bool {
        let deepest = self.between.deepest;
        deepest.is_some_and(|p| p.depth > TOLD_DEPTH * travel && p.depth > AT_FACE * p.spacing)
    }

    /// `travel`: of the whole run, m.
    pub(crate) fn warning(&self, travel: f64) -> Option<String> {
        let has_facets = matches!(self.engine.tool(), Tool::Mesh(_) | Tool::Field(_));
        let is_felt_between = self.engine.has_features() || self.engine.has_moving_places();
        self.between.warning(travel, is_felt_between, has_facets)
    }
}

#[cfg(test)]
mod tests {
    use contact::surface::FaceData;
    use contact::tool::{BoxShape, Sphere};

    use super::*;

    /// A face of 4 mm under a ball of 1 mm whose centre is 0.3 mm above its middle: 0.7 mm deep, whatever its nodes.
    #[test]
    fn a_ball_in_the_middle_of_a_face_is_found_with_its_depth_and_radius() {
        let rest = [DVec3::ZERO, 4e-3 * DVec3::X, 4e-3 * DVec3::Y];
        let face = FaceData {
            nodes: vec![0, 1, 2],
            height: 1e-3,
        };
        let surface = Surface::new(&rest, Vec::new(), &[face]).unwrap();
        let ball = Tool::Sphere(Sphere::new(1e-3).unwrap());
        let at = |x: f64, y: f64, z: f64| DPose3::from_translation(1e-3 * DVec3::new(x, y, z));
        let position_of = |c: u32| rest[c as usize];
        let look = |tool: &Tool, pose: DPose3| {
            let mut between = Between::default();
            between.look(&surface, position_of, tool, &pose);
            between
        };
        for (x, y) in [(1.3, 1.1), (0.4, 3.0), (1.9, 1.9)] {
            let between = look(&ball, at(x, y, 0.3));
            let here = between.deepest.unwrap();
            assert!((here.depth - 0.7e-3).abs() < 2e-6, "{here:?}");
            assert!((here.radius - 1e-3).abs() < 1e-5, "{here:?}");
            assert!((here.spacing - (8e-3 + 4e-3 * 2f64.sqrt()) / 3.0).abs() < 1e-12);
            let words = between.warning(4e-3, false, false).unwrap();
            for part in [
                "1.000 mm is small for nodes that are 4.552 mm",
                "0.700 mm (17.5 %",
            ] {
                assert!(words.contains(part), "{words}");
            }
        }
        assert_eq!(look(&ball, at(1.3, 1.1, 1.5)), Between::default());
        // At the face, not in it: too fine all the same, unless its shape is felt in faces.
        let touching = look(&ball, at(1.3, 1.1, 1.0));
        assert!(touching.warning(4e-3, false, false).is_some());
        assert_eq!(touching.warning(4e-3, true, false), None);
        // A flat tool has no radius, and lies on the nodes.
        let flat = Tool::Box(BoxShape::new(DVec3::splat(0.1)).unwrap());
        let between = look(&flat, at(0.0, 0.0, 100.0));
        assert_eq!(between.deepest.unwrap().radius, f64::INFINITY);
        assert_eq!(between.warning(4e-3, false, false), None);
    }
}

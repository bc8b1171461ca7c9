//! What the tool is near: places to hold for the stride, found by nodes or by edges and faces, and the points of the
//! tool's own edges.

use contact::Place;
use contact::tool::Tool;
use glamx::DPose3;

use super::features::ToolFeatures;
use super::forces::Forces;
use super::late::{Late, has_columns};
use super::places::Places;
use super::sites::Sites;
use super::watch::{State, Watch};
use super::{ContactPart, StepReport};

/// Finds the places of a stride.
#[derive(Debug)]
pub(super) struct Near {
    pub(super) watch: Watch,
    /// Edges and faces of the part, where places move with the tool.
    pub(super) sites: Option<Box<Sites>>,
    /// Corners and edges of the tool, where it has some.
    pub(super) features: Option<Box<ToolFeatures>>,
}

/// What a look is judged by, and what it finds.
pub(super) struct Look<'a> {
    pub(super) part: &'a ContactPart,
    pub(super) tool: &'a Tool,
    pub(super) tool_pose: &'a DPose3,
    /// m: places nearer than this are held.
    pub(super) near_distance: f64,
    pub(super) forces: &'a mut Forces,
    pub(super) places: &'a mut Places,
    pub(super) late: Option<&'a mut Late>,
    pub(super) report: &'a mut StepReport,
}

impl Look<'_> {
    pub(super) fn state(&self) -> State<'_> {
        State {
            deformed: self.forces.deformed(self.part),
            tool: self.tool,
            tool_pose: self.tool_pose,
            loads: self.forces.loads(),
        }
    }

    /// Holds a place that is nearer than the near distance, or carries force; its gap, m. `None` where it is nowhere.
    pub(super) fn offer(&mut self, place: Place) -> Option<f64> {
        let Self { part, forces, .. } = self;
        let u = place.displacement(|node| forces.displacement(part, node));
        let contact = place.contact(0, self.tool, self.tool_pose, place.rest + u);
        if !contact.is_sound() {
            self.report.dropped += 1;
            return None;
        }
        let is_near = contact.gap < self.near_distance || self.forces.is_carried(place.key);
        if is_near && has_columns(&place, self.part) {
            let is_held = self.places.hold(place, contact, u, self.forces);
            self.report.dropped += u32::from(!is_held);
        } else if is_near && let Some(late) = &mut self.late {
            late.leave_out(&place, contact.gap);
            self.report.without_column += 1;
        }
        Some(contact.gap)
    }
}

impl Near {
    /// Forgets what was seen.
    pub(super) fn reset(&mut self) {
        self.watch.forget();
        if let Some(sites) = &mut self.sites {
            sites.reset();
        }
        if let Some(features) = &mut self.features {
            features.reset();
        }
    }

    /// A search for equilibrium begins: no place is held.
    pub(super) fn begin_stride(&mut self, forces: &Forces) {
        if let Some(sites) = &mut self.sites {
            sites.begin_stride();
        }
        if let Some(features) = &mut self.features {
            features.begin_stride(forces.carried_at());
        }
    }

    /// Finds places that have come near since the last look.
    pub(super) fn look(&mut self, look: &mut Look<'_>) {
        (look.report.dropped, look.report.without_column) = (0, 0);
        look.places.begin_pass();
        self.watch.advance(look.state());
        match &mut self.sites {
            Some(sites) => {
                sites.look(&self.watch, look);
                self.watch.pass_over();
            }
            None => self.look_at_nodes(look),
        }
        if let Some(features) = &mut self.features {
            features.find(&self.watch, look);
        }
    }

    /// Holds the places that are nearer than the near distance of the look, which is more than that of other looks,
    /// `near_distance` (m); `candidates`: room for all nodes. Points of the tool's edges are not looked for.
    pub(super) fn look_further(
        &mut self,
        near_distance: f64,
        candidates: &mut Vec<u32>,
        look: &mut Look<'_>,
    ) {
        self.watch.advance(look.state());
        if let Some(sites) = &mut self.sites {
            self.watch.pass_over();
            sites.look_further(&self.watch, near_distance, look);
            return;
        }
        self.watch.look(look.state());
        let clusters = look.part.clusters();
        self.watch.within(clusters, look.near_distance, candidates);
        for &candidate in candidates.iter() {
            if !look.places.has(candidate) && look.places.room() > 0 {
                let rest = look.part.rest_positions()[candidate as usize];
                look.offer(Place::node(candidate, rest));
            }
        }
    }

    fn look_at_nodes(&mut self, look: &mut Look<'_>) {
        self.watch.look(look.state());
        let due = self.watch.take_due();
        let rest = look.part.rest_positions();
        for &candidate in &due {
            if look.places.has(candidate) {
                continue;
            }
            let place = Place::node(candidate, rest[candidate as usize]);
            if let Some(gap) = look.offer(place)
                && gap >= look.near_distance
                && !look.places.has(candidate)
            {
                let at = look.forces.position(look.part, candidate);
                self.watch
                    .postpone(look.part.clusters(), candidate, gap, at);
            }
        }
        self.watch.give_back(due);
    }
}

//! The places of a stride: material points of the part that the tool is near, their compliance, and where they are.
//!
//! Places are found once and held until the stride ends: passes draw the tool's surface anew at the same points. So the
//! set only grows, and passes end: without that two sets of places can take turns, each lifting off while the other is
//! pressed. Behind the held ones come those that a pass finds for itself, the points of the tool's edges at faces.

use contact::delassus::ComplianceBlocks;
use contact::tool::Tool;
use contact::{Contact, Place};
use glam::{DMat3, DVec3};
use glamx::DPose3;

use super::ContactPart;
use super::forces::Forces;
use super::law::ByContact;
use super::pairs::Pairs;

/// No place.
const NONE: u32 = u32::MAX;

/// Places that are no nodes whose blocks are kept side by side: 42 MB of them, touched only as far as they are used.
const MOST_KEPT: usize = 768;

/// All places of the stride, and the tool seen from them in this pass.
#[derive(Debug)]
pub(super) struct Places {
    list: Vec<Place>,
    /// By place: the tool seen from it.
    drawn: Vec<Contact>,
    /// By place: displacement now, and before the pass, m.
    u: Vec<DVec3>,
    u_before: Vec<DVec3>,
    /// Those that are held.
    n_held: usize,
    /// Those whose contact was drawn when they were found, from this one on.
    n_old: usize,
    /// By key: its place in the list.
    place_of: Vec<u32>,
    /// Where blocks between the places are.
    kept: Kept,
    slots: Vec<u32>,
    /// Blocks of places i <= j at `j capacity + i`, 9 numbers each, of the first `n_filled`.
    blocks: Vec<f64>,
    capacity: usize,
    n_filled: usize,
}

/// Where blocks between the places are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kept {
    /// All places are nodes, whose blocks lie side by side.
    OfNodes,
    /// Weighted sums, made once.
    OfPlaces,
    /// Nowhere: too many.
    Nowhere,
}

/// The compliance between places, by their number.
pub(super) struct Compliance<'a> {
    places: &'a Places,
    pairs: &'a Pairs,
    part: &'a ContactPart,
}

impl ComplianceBlocks for Compliance<'_> {
    #[inline]
    fn block(&self, row: usize, col: usize) -> DMat3 {
        let Self {
            places,
            pairs,
            part,
        } = self;
        match places.kept {
            Kept::OfNodes => *pairs.at(places.slots[row] as usize, places.slots[col] as usize),
            Kept::OfPlaces => {
                let (i, j) = (row.min(col), row.max(col));
                let at = 9 * (j * places.capacity + i);
                let block = DMat3::from_cols_slice(&places.blocks[at..at + 9]);
                if row <= col { block } else { block.transpose() }
            }
            Kept::Nowhere => places.list[row].block(&places.list[col], *part),
        }
    }
}

impl Places {
    /// `n_keys`: keys that places can have; `max_near`: places at most; `are_nodes`: whether all of them are nodes.
    pub(super) fn new(n_keys: usize, max_near: usize, are_nodes: bool) -> Self {
        let capacity = if are_nodes {
            0
        } else {
            max_near.min(MOST_KEPT)
        };
        Self {
            list: Vec::with_capacity(max_near),
            drawn: Vec::with_capacity(max_near),
            u: Vec::with_capacity(max_near),
            u_before: Vec::with_capacity(max_near),
            n_held: 0,
            n_old: 0,
            place_of: vec![NONE; n_keys],
            kept: Kept::OfNodes,
            slots: Vec::with_capacity(max_near),
            blocks: vec![0.0; 9 * capacity * capacity],
            capacity,
            n_filled: 0,
        }
    }

    /// All, in their order.
    pub(super) fn list(&self) -> &[Place] {
        &self.list
    }

    /// The tool seen from each in this pass.
    pub(super) fn drawn(&self) -> &[Contact] {
        &self.drawn
    }

    /// Displacement of each, m.
    pub(super) fn displacements(&self) -> &[DVec3] {
        &self.u
    }

    /// Displacement of a place when its contact was drawn, m.
    pub(super) fn displacement_when_drawn(&self, place: usize) -> DVec3 {
        self.u_before.get(place).copied().unwrap_or(self.u[place])
    }

    /// Places that may still be added.
    pub(super) fn room(&self) -> usize {
        self.list.capacity() - self.list.len()
    }

    /// Places at most.
    pub(super) fn capacity(&self) -> usize {
        self.list.capacity()
    }

    /// Holds what the last pass found for itself, too: more can be held beside.
    pub(super) fn hold_all(&mut self) {
        self.n_held = self.list.len();
    }

    #[inline]
    pub(super) fn has(&self, key: u32) -> bool {
        self.place_of[key as usize] != NONE
    }

    /// A stride begins: no place is held.
    pub(super) fn clear(&mut self) {
        self.truncate(0);
        (self.n_held, self.n_old) = (0, 0);
    }

    fn truncate(&mut self, n: usize) {
        for place in self.list.drain(n..) {
            self.place_of[place.key as usize] = NONE;
        }
        self.drawn.truncate(n);
        self.u.truncate(n);
        self.n_filled = self.n_filled.min(n);
    }

    /// Draws the tool as seen from the places that have moved since they were seen.
    pub(super) fn draw(&mut self, tool: &Tool, pose: &DPose3) {
        let old = self.list.iter().zip(&self.u).zip(&mut self.drawn);
        for (k, ((place, u), drawn)) in old.take(self.n_old).enumerate() {
            *drawn = place.contact(k as u32, tool, pose, place.rest + *u);
        }
    }

    /// Forgets what the last pass found for itself. Places found from here on are new: their contacts are of now.
    pub(super) fn begin_pass(&mut self) {
        self.truncate(self.n_held);
        self.n_old = self.n_held;
    }

    /// Holds a place from now on. `u` (m): where it is. Where there is no room the one with the largest gap, if it carries
    /// no force, makes some. False if one was left out.
    pub(super) fn hold(
        &mut self,
        place: Place,
        contact: Contact,
        u: DVec3,
        forces: &Forces,
    ) -> bool {
        debug_assert_eq!(self.n_held, self.list.len(), "held places come first");
        if self.room() > 0 {
            self.push(place, contact, u);
            self.n_held += 1;
            return true;
        }
        let free = (0..self.list.len()).filter(|k| !forces.is_carried(self.list[*k].key));
        let widest = free.max_by(|a, b| self.drawn[*a].gap.total_cmp(&self.drawn[*b].gap));
        if let Some(k) = widest
            && self.drawn[k].gap > contact.gap
        {
            self.place_of[self.list[k].key as usize] = NONE;
            self.place_of[place.key as usize] = k as u32;
            self.list[k] = place;
            self.u[k] = u;
            self.drawn[k] = Contact {
                place: k as u32,
                ..contact
            };
            self.n_filled = self.n_filled.min(k);
        }
        false
    }

    /// Adds a place for this pass alone, or at the end of those that are held.
    pub(super) fn push(&mut self, place: Place, contact: Contact, u: DVec3) {
        let k = self.list.len() as u32;
        // Of several of one key the first.
        let place_of = &mut self.place_of[place.key as usize];
        if *place_of == NONE {
            *place_of = k;
        }
        self.list.push(place);
        self.drawn.push(Contact {
            place: k,
            ..contact
        });
        self.u.push(u);
    }

    /// Sees to it that blocks between the places are there as far as there is memory.
    pub(super) fn fetch(&mut self, pairs: &mut Pairs, part: &ContactPart) {
        let are_nodes = self.list.iter().all(|place| place.as_node().is_some());
        if are_nodes {
            let nodes = self.list.iter().filter_map(Place::as_node);
            self.kept = if pairs.ensure(nodes.clone(), part) {
                self.slots.clear();
                self.slots.extend(nodes.map(|c| pairs.slot_or_first(c)));
                Kept::OfNodes
            } else {
                Kept::Nowhere
            };
            self.n_filled = 0;
            return;
        }
        let nodes = self
            .list
            .iter()
            .flat_map(|place| place.shares().iter().map(|s| s.0));
        let is_kept = self.list.len() <= self.capacity && pairs.ensure(nodes, part);
        if !is_kept {
            (self.kept, self.n_filled) = (Kept::Nowhere, 0);
            return;
        }
        if self.kept != Kept::OfPlaces {
            self.n_filled = 0;
        }
        self.kept = Kept::OfPlaces;
        for j in self.n_filled..self.list.len() {
            for i in 0..=j {
                let block = self.list[i].block(&self.list[j], pairs);
                let at = 9 * (j * self.capacity + i);
                block.write_cols_to_slice(&mut self.blocks[at..at + 9]);
            }
        }
        self.n_filled = self.list.len();
    }

    pub(super) fn compliance<'a>(
        &'a self,
        pairs: &'a Pairs,
        part: &'a ContactPart,
    ) -> Compliance<'a> {
        Compliance {
            places: self,
            pairs,
            part,
        }
    }

    /// Displacements under the forces of contacts at these places; the largest change, m.
    pub(super) fn move_under(
        &mut self,
        contacts: &[Contact],
        forces: &ByContact,
        pairs: &Pairs,
        part: &ContactPart,
    ) -> f64 {
        std::mem::swap(&mut self.u, &mut self.u_before);
        let n = self.list.len();
        let mut u = std::mem::take(&mut self.u);
        u.clear();
        u.resize(n, DVec3::ZERO);
        let compliance = self.compliance(pairs, part);
        let forces = forces.normal.iter().zip(&forces.on_part);
        for (contact, (&force, on_part)) in contacts.iter().zip(forces) {
            if force > 0.0 {
                let j = contact.place as usize;
                for (i, u) in u.iter_mut().enumerate() {
                    *u += compliance.block(i, j) * *on_part;
                }
            }
        }
        self.u = u;
        let changes = self.u.iter().zip(&self.u_before);
        changes
            .map(|(now, before)| (*now - *before).length_squared())
            .fold(0.0, f64::max)
            .sqrt()
    }
}

//! The state between passes and steps: the forces on the part's nodes, and what the nodes do under them.

use contact::{Contact, Place};
use glam::DVec3;

use super::law::ByContact;
use super::pairs::Pairs;
use super::part::Deformed;
use super::{ActiveContact, ContactPart};

/// Nodes whose compliance blocks are kept side by side: 42 MB of them, touched only as far as they are used.
const MOST_PAIRS: usize = 768;

/// No place in the list of loaded nodes.
const NONE: u32 = u32::MAX;

/// Forces on nodes, each node once.
#[derive(Debug)]
pub(super) struct Loads {
    pub(super) active: Vec<ActiveContact>,
    /// By candidate: its place in `active`.
    place_of: Vec<u32>,
}

impl Loads {
    pub(super) fn new(n_candidates: usize) -> Self {
        Self {
            active: Vec::with_capacity(n_candidates),
            place_of: vec![NONE; n_candidates],
        }
    }

    pub(super) fn clear(&mut self) {
        for contact in self.active.drain(..) {
            self.place_of[contact.candidate as usize] = NONE;
        }
    }

    /// Adds a force at a place: along the normal, and in all, N.
    #[inline]
    pub(super) fn add(&mut self, place: &Place, normal_force: f64, on_part: DVec3, sticks: bool) {
        for &(candidate, share) in place.shares() {
            self.load(ActiveContact {
                candidate,
                normal_force: share * normal_force,
                force_on_part: share * on_part,
                sticks,
            });
        }
    }

    /// Adds to what a node carries.
    #[inline]
    fn load(&mut self, more: ActiveContact) {
        let place = &mut self.place_of[more.candidate as usize];
        if let Some(contact) = self.active.get_mut(*place as usize) {
            contact.normal_force += more.normal_force;
            contact.force_on_part += more.force_on_part;
            contact.sticks &= more.sticks;
            return;
        }
        *place = self.active.len() as u32;
        self.active.push(more);
    }

    #[inline]
    pub(super) fn is_loaded(&self, candidate: u32) -> bool {
        self.place_of[candidate as usize] != NONE
    }

    /// What a node carries, if it carries something.
    fn of(&self, candidate: u32) -> Option<&ActiveContact> {
        self.active.get(self.place_of[candidate as usize] as usize)
    }
}

/// Forces on the part, by node and by contact.
#[derive(Debug)]
pub(super) struct Forces {
    loads: Loads,
    /// At the end of the stride before the last, and room for those that are foreseen.
    before: Loads,
    ahead: Loads,
    /// Keys and normal forces (N) of the contacts that carry some, and by key whether it does.
    carried: Vec<(u32, f64)>,
    is_carried: Vec<bool>,
    /// Their places, by number.
    carried_at: Vec<u32>,
    /// Displacement of nodes, as far as it is known.
    known: Known,
    /// Compliance between nodes that are or were near.
    pub(super) pairs: Pairs,
}

impl Forces {
    /// `n_keys`: keys that contacts can have; `max_near`: places of contacts at most.
    pub(super) fn new(n_candidates: usize, n_keys: usize, max_near: usize) -> Self {
        Self {
            loads: Loads::new(n_candidates),
            before: Loads::new(n_candidates),
            ahead: Loads::new(n_candidates),
            carried: Vec::with_capacity(max_near),
            is_carried: vec![false; n_keys],
            carried_at: Vec::with_capacity(max_near),
            known: Known::new(n_candidates),
            pairs: Pairs::new(n_candidates, n_candidates.min(2 * max_near).min(MOST_PAIRS)),
        }
    }

    /// No force, nothing known.
    pub(super) fn clear(&mut self) {
        self.forget();
        self.before.clear();
        self.pairs.reset();
    }

    /// Where forces will be when the tool goes on by `share` of the way of its last stride: linear in that way. Only what
    /// passes start from, and where places are sought; they end where they end.
    pub(super) fn go_ahead(&mut self, share: f64) {
        self.ahead.clear();
        for now in &self.loads.active {
            let mut ahead = *now;
            if let Some(before) = self.before.of(now.candidate) {
                ahead.normal_force += share * (now.normal_force - before.normal_force);
                ahead.force_on_part += share * (now.force_on_part - before.force_on_part);
                // It would let go: a contact does not pull.
                if ahead.normal_force * now.normal_force < 0.0 {
                    continue;
                }
            }
            self.ahead.load(ahead);
        }
        std::mem::swap(&mut self.before, &mut self.loads);
        std::mem::swap(&mut self.loads, &mut self.ahead);
        self.known.forget();
    }

    fn forget(&mut self) {
        self.loads.clear();
        self.carried_at.clear();
        for (key, _) in self.carried.drain(..) {
            self.is_carried[key as usize] = false;
        }
        self.known.forget();
    }

    /// Makes the forces of these contacts the state. Does not allocate.
    pub(super) fn adopt(&mut self, places: &[Place], contacts: &[Contact], forces: &ByContact) {
        self.forget();
        for (i, contact) in contacts.iter().enumerate() {
            let (force, on_part) = (forces.normal[i], forces.on_part[i]);
            if force > 0.0 {
                let place = &places[contact.place as usize];
                self.is_carried[place.key as usize] = true;
                self.carried.push((place.key, force));
                self.carried_at.push(contact.place);
                self.loads.add(place, force, on_part, forces.sticks[i]);
            }
        }
    }

    /// Nodes that carry force, each once.
    pub(super) fn active(&self) -> &[ActiveContact] {
        &self.loads.active
    }

    pub(super) fn loads(&self) -> &Loads {
        &self.loads
    }

    /// Keys and normal forces (N) of the contacts that carry some.
    pub(super) fn carried(&self) -> &[(u32, f64)] {
        &self.carried
    }

    /// Places of the contacts that carry force, by their number in the last pass.
    pub(super) fn carried_at(&self) -> &[u32] {
        &self.carried_at
    }

    #[inline]
    pub(super) fn is_carried(&self, key: u32) -> bool {
        self.is_carried[key as usize]
    }

    pub(super) fn deformed<'a>(&'a self, part: &'a ContactPart) -> Deformed<'a> {
        Deformed {
            part,
            active: &self.loads.active,
            pairs: &self.pairs,
        }
    }

    /// Displacement of a candidate, m; summed once for each state.
    #[inline]
    pub(super) fn displacement(&mut self, part: &ContactPart, candidate: u32) -> DVec3 {
        let i = candidate as usize;
        if let Some(known) = self.known.get(i) {
            return known;
        }
        let displacement = self.deformed(part).displacement(i);
        self.known.set(i, displacement);
        displacement
    }

    /// Where a candidate is, m.
    #[inline]
    pub(super) fn position(&mut self, part: &ContactPart, candidate: u32) -> DVec3 {
        part.rest_positions()[candidate as usize] + self.displacement(part, candidate)
    }
}

/// A state that was, to ask for displacements.
#[derive(Debug)]
pub(super) struct State {
    loads: Loads,
    known: Known,
}

impl State {
    /// No force.
    pub(super) fn new(n_candidates: usize) -> Self {
        Self {
            loads: Loads::new(n_candidates),
            known: Known::new(n_candidates),
        }
    }

    /// Becomes what forces are now. Does not allocate.
    pub(super) fn copy_from(&mut self, forces: &Forces) {
        self.loads.clear();
        for now in &forces.loads.active {
            self.loads.load(*now);
        }
        self.known.forget();
    }

    /// Displacement of a candidate then, m; summed once.
    #[inline]
    pub(super) fn displacement(&mut self, part: &ContactPart, pairs: &Pairs, node: u32) -> DVec3 {
        let i = node as usize;
        if let Some(known) = self.known.get(i) {
            return known;
        }
        let active = &self.loads.active;
        let deformed = Deformed {
            part,
            active,
            pairs,
        };
        let displacement = deformed.displacement(i);
        self.known.set(i, displacement);
        displacement
    }
}

/// Displacements that need not be summed again until the forces change.
#[derive(Debug)]
struct Known {
    /// By candidate, m.
    displacement: Vec<DVec3>,
    /// By candidate: the state its displacement belongs to.
    state_of: Vec<u64>,
    state: u64,
}

impl Known {
    fn new(n_candidates: usize) -> Self {
        Self {
            displacement: vec![DVec3::ZERO; n_candidates],
            state_of: vec![0; n_candidates],
            state: 1,
        }
    }

    /// The forces have changed.
    fn forget(&mut self) {
        self.state += 1;
    }

    fn set(&mut self, candidate: usize, displacement: DVec3) {
        self.displacement[candidate] = displacement;
        self.state_of[candidate] = self.state;
    }

    #[inline]
    fn get(&self, candidate: usize) -> Option<DVec3> {
        (self.state_of[candidate] == self.state).then(|| self.displacement[candidate])
    }
}

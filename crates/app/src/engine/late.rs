//! Places that come near before the columns of their nodes are there: left out of the contact problem, and eased in when
//! the columns have come, so that the force does not jump.

use contact::{Contact, Place};

use super::ContactPart;

/// Steps in which a place that came late takes its part: 50 ms at 1 kHz, slower than a jolt is felt.
const EASE_STEPS: u32 = 50;

/// Only made for parts whose columns are fetched.
#[derive(Debug)]
pub(super) struct Late {
    entries: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    place: Place,
    /// m, how deep it was when it was last left out.
    depth: f64,
    /// Steps until it is where it belongs; begins to fall once it has its columns.
    n_left: u32,
}

impl Late {
    /// Memory for `capacity` places; those beyond it come in at once.
    pub(super) fn new(capacity: usize) -> Self {
        Self {
            entries: Vec::with_capacity(capacity),
        }
    }

    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.entries.clear();
    }

    /// Once in a step: those with their columns come nearer to their place.
    pub(super) fn begin_step(&mut self, part: &ContactPart) {
        self.entries.retain_mut(|entry| {
            entry.n_left -= u32::from(has_columns(&entry.place, part));
            entry.n_left > 0
        });
    }

    /// Opens the gaps of those that came late.
    pub(super) fn open(&self, places: &[Place], contacts: &mut [Contact]) {
        for entry in &self.entries {
            let open = entry.depth * f64::from(entry.n_left) / f64::from(EASE_STEPS);
            let key_of = |contact: &Contact| places[contact.place as usize].key;
            let mut contacts = contacts.iter_mut();
            if let Some(contact) = contacts.find(|contact| key_of(contact) == entry.place.key) {
                contact.gap += open;
            }
        }
    }

    /// Notes a place that cannot be touched yet. Does not allocate.
    pub(super) fn leave_out(&mut self, place: &Place, gap: f64) {
        let depth = (-gap).max(0.0);
        let mut known = self.entries.iter_mut();
        if let Some(entry) = known.find(|entry| entry.place.key == place.key) {
            (entry.place, entry.depth) = (*place, depth);
        } else if self.entries.len() < self.entries.capacity() {
            self.entries.push(Entry {
                place: *place,
                depth,
                n_left: EASE_STEPS,
            });
        }
    }
}

/// Whether all nodes that move the place have their columns in this step.
pub(super) fn has_columns(place: &Place, part: &ContactPart) -> bool {
    place
        .shares()
        .iter()
        .all(|(node, _)| part.is_taken_in(*node))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::stored::{Blocks, Source};

    #[test]
    fn a_late_node_is_left_out_then_eased_in() {
        let mut part = ContactPart::with_fetched(vec![DVec3::ZERO, DVec3::X], 2);
        let column = || Blocks::F64(Source::Owned(vec![1.0; 18]));
        assert!(part.insert(0, column()));
        let places = [Place::node(0, DVec3::ZERO), Place::node(1, DVec3::X)];
        let contact = |place| Contact {
            place,
            gap: -1e-3,
            normal: DVec3::Z,
            point: DVec3::ZERO,
        };
        let mut late = Late::new(8);
        let mut gaps_of_second = Vec::new();
        for step in 0..70 {
            if step == 5 {
                assert!(part.insert(1, column()));
            }
            part.take_in();
            late.begin_step(&part);
            assert_eq!(has_columns(&places[1], &part), step >= 5);
            let mut contacts = vec![contact(0), contact(1)];
            if step < 5 {
                late.leave_out(&places[1], contacts[1].gap);
                contacts.pop();
            }
            late.open(&places, &mut contacts);
            assert_eq!(contacts[0].gap, -1e-3);
            gaps_of_second.extend(contacts.get(1).map(|contact| contact.gap));
        }
        // From open to its depth, in equal steps, and then it stays.
        assert_eq!(gaps_of_second.len(), 65);
        let steps = gaps_of_second.windows(2).map(|w| w[0] - w[1]);
        assert!(
            steps
                .into_iter()
                .all(|s| (-1e-18..=1e-3 / 50.0 + 1e-12).contains(&s))
        );
        assert!(gaps_of_second[0] > -1e-3 / 40.0);
        assert_eq!(gaps_of_second[50..], [-1e-3; 15]);
        assert!(late.entries.is_empty());
    }
}

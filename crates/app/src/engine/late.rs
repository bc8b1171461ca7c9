//! Candidates that come near before their column is there: left out of the contact problem, and eased in when the column
//! has come, so that the force does not jump.

use contact::plane::Plane;

use super::ContactPart;

/// Steps in which a node that came late takes its place: 50 ms at 1 kHz, slower than a jolt is felt.
const EASE_STEPS: u32 = 50;

/// Only made for parts whose columns are fetched.
#[derive(Debug)]
pub(super) struct Late {
    entries: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    candidate: u32,
    /// m, how deep it was when it was last left out.
    depth: f64,
    /// Steps until it is where it belongs; begins to fall once it has its column.
    n_left: u32,
}

impl Late {
    /// Memory for `capacity` candidates; those beyond it come in at once.
    pub(super) fn new(capacity: usize) -> Self {
        Self {
            entries: Vec::with_capacity(capacity),
        }
    }

    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.entries.clear();
    }

    /// Once in a step: those with a column come nearer to their place.
    pub(super) fn begin_step(&mut self, part: &ContactPart) {
        self.entries.retain_mut(|entry| {
            entry.n_left -= u32::from(part.is_taken_in(entry.candidate));
            entry.n_left > 0
        });
    }

    /// Takes out the planes of candidates without a column and opens the gaps of those that came late. Returns the
    /// number taken out. Does not allocate.
    pub(super) fn sort_out(&mut self, planes: &mut Vec<Plane>, part: &ContactPart) -> usize {
        let before = planes.len();
        planes.retain(|plane| {
            let is_there = part.is_taken_in(plane.candidate);
            if !is_there {
                self.leave_out(plane);
            }
            is_there
        });
        for entry in &self.entries {
            let open = entry.depth * f64::from(entry.n_left) / f64::from(EASE_STEPS);
            let mut planes = planes.iter_mut();
            if let Some(plane) = planes.find(|plane| plane.candidate == entry.candidate) {
                plane.gap += open;
            }
        }
        before - planes.len()
    }

    fn leave_out(&mut self, plane: &Plane) {
        let depth = (-plane.gap).max(0.0);
        let mut known = self.entries.iter_mut();
        if let Some(entry) = known.find(|entry| entry.candidate == plane.candidate) {
            entry.depth = depth;
        } else if self.entries.len() < self.entries.capacity() {
            self.entries.push(Entry {
                candidate: plane.candidate,
                depth,
                n_left: EASE_STEPS,
            });
        }
    }
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
        let plane = |candidate| Plane {
            candidate,
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
            let mut planes = vec![plane(0), plane(1)];
            let n_out = late.sort_out(&mut planes, &part);
            assert_eq!(n_out, usize::from(step < 5));
            assert_eq!(planes[0].gap, -1e-3);
            gaps_of_second.extend(planes.get(1).map(|plane| plane.gap));
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

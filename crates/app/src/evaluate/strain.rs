//! The largest strains of a run: recovered at the skin, by kind of place, over all moments.

use std::collections::BTreeSet;

use fem::recovery::Recovery;
use fem::stress::largest_principal;

use super::Story;
use super::skin::{Marks, widened};
use crate::Error;
use crate::fields::FieldSolver;
use crate::prepare::LoadedPart;
use crate::report::{PeakKind, StrainFacts, StrainPeak};
use crate::session::Record;

/// What strain needs of a part; made once.
#[derive(Debug)]
pub(crate) struct StrainReader<'a> {
    loaded: &'a LoadedPart,
    recovery: Recovery<'a>,
    marks: Marks,
    /// By node of the mesh that is solved on: the part's node, where that mesh is another.
    part_nodes: Option<Vec<Option<u32>>>,
}

/// Largest strain of each kind of place, so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct StrainPeaks {
    peaks: Vec<StrainPeak>,
}

/// A moment: which nodes carry contact force, and what the hand feels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment<'m> {
    /// Node indices.
    pub(crate) contacts: &'m [u32],
    /// m.
    pub(crate) travel_m: f64,
    /// N.
    pub(crate) force_n: f64,
}

impl<'a> StrainReader<'a> {
    pub(crate) fn new(loaded: &'a LoadedPart) -> Self {
        let mesh = loaded.solved_mesh();
        let recovery = Recovery::new(mesh);
        let marks = Marks::of(mesh, loaded.solved_supports(), recovery.faces());
        Self {
            part_nodes: loaded.interior.as_ref().map(|i| i.surface_nodes()),
            loaded,
            recovery,
            marks,
        }
    }

    /// The part's node at a node of the mesh that is solved on.
    fn part_node(&self, solved: u32) -> Option<u32> {
        match &self.part_nodes {
            None => Some(solved),
            Some(nodes) => nodes[solved as usize],
        }
    }

    /// The largest strain of each kind of place under a displacement of the mesh that is solved on (3 node + component,
    /// m), at the part's nodes.
    pub(crate) fn peaks(&self, u: &[f64], moment: &Moment<'_>) -> StrainPeaks {
        let strain = self.recovery.strain(u);
        let mut is_near = vec![false; self.loaded.solved_mesh().n_nodes()];
        for &node in &*self.loaded.solved_nodes(moment.contacts) {
            is_near[node as usize] = true;
        }
        // A node between two vertices has few faces of its own, hence twice.
        let is_near = widened(
            self.recovery.faces(),
            &widened(self.recovery.faces(), &is_near),
        );
        let mut best: [Option<(f64, usize)>; 4] = [None; 4];
        for (i, (tensor, &node)) in strain
            .at_nodes()
            .iter()
            .zip(self.recovery.nodes())
            .enumerate()
        {
            if self.part_node(node).is_none() {
                continue;
            }
            let kind = self.kind(node as usize, &is_near);
            let value = largest_principal(tensor);
            let best = &mut best[kind as usize];
            if best.is_none_or(|(most, _)| value > most) {
                *best = Some((value, i));
            }
        }
        let peaks = PeakKind::ALL.into_iter().filter_map(|kind| {
            let (value, i) = best[kind as usize]?;
            let node = self.part_node(self.recovery.nodes()[i])? as usize;
            Some(StrainPeak {
                value,
                error: strain.error_around(i),
                place: self.loaded.mesh.nodes[node],
                node_tag: self.loaded.mesh.node_tags[node],
                travel_m: moment.travel_m,
                force_n: moment.force_n,
                kind,
            })
        });
        StrainPeaks {
            peaks: peaks.collect(),
        }
    }

    fn kind(&self, node: usize, is_near_contact: &[bool]) -> PeakKind {
        if is_near_contact[node] {
            PeakKind::AtContact
        } else if self.marks.held[node] {
            PeakKind::AtHeld
        } else if self.marks.inner[node] {
            PeakKind::AtInnerEdge
        } else {
            PeakKind::Free
        }
    }

    /// Largest principal strain by size at every node of the skin, for pictures; not a number inside.
    pub(crate) fn principal(&self, u: &[f64]) -> Vec<f64> {
        let mut values = vec![f64::NAN; self.loaded.solved_mesh().n_nodes()];
        let strain = self.recovery.strain(u);
        for (tensor, &node) in strain.at_nodes().iter().zip(self.recovery.nodes()) {
            values[node as usize] = largest_principal(tensor);
        }
        values
    }
}

impl StrainPeaks {
    /// Keeps the larger of each kind.
    pub(crate) fn merge(&mut self, other: &Self) {
        for peak in &other.peaks {
            match self.peaks.iter_mut().find(|p| p.kind == peak.kind) {
                Some(own) if own.value >= peak.value => {}
                Some(own) => *own = *peak,
                None => self.peaks.push(*peak),
            }
        }
    }

    /// Largest of the free skin, or of all where there is none; 0 of nothing.
    pub(crate) fn value(&self) -> f64 {
        self.governing().map_or(0.0, |p| p.value)
    }

    /// That of [`Self::value`].
    fn governing(&self) -> Option<StrainPeak> {
        let free = self.peaks.iter().find(|p| p.kind == PeakKind::Free);
        let largest = || self.peaks.iter().max_by(|a, b| a.value.total_cmp(&b.value));
        free.or_else(largest).copied()
    }

    /// All, for the report.
    pub(crate) fn into_vec(self) -> Vec<StrainPeak> {
        self.peaks
    }
}

/// What a run's strains come to.
pub(super) struct Strained {
    pub(super) facts: StrainFacts,
    /// Record of the largest strain; `None` if nothing was strained.
    pub(super) index: Option<usize>,
    /// Largest rotation at the integration points, rad.
    pub(super) max_rotation: f64,
}

impl Story<'_> {
    /// Solves for the sampled records, and for more around the one with the largest strain; `also` sees each of them.
    /// `is_seat`: whether the body is pressed into its seat there, which is told apart.
    pub(super) fn strain(
        &self,
        solver: &FieldSolver<'_>,
        sampled: &[usize],
        is_seat: impl Fn(usize) -> bool,
        also: &mut dyn FnMut(&[f64], &Record),
    ) -> Result<Strained, Error> {
        let recording = &self.driven.recording;
        let mut peaks = StrainPeaks::default();
        let mut of_seat = StrainPeaks::default();
        let mut max_rotation = 0.0f64;
        let mut seen = BTreeSet::new();
        let mut look = |index: usize| {
            if crate::interrupt::is_requested() {
                return Err(Error::Interrupted);
            }
            let record = &recording.records[index];
            let u = solver.displacement(recording, record);
            max_rotation = max_rotation.max(solver.extremes(&u).max_rotation);
            also(u.at_nodes(), record);
            let loaded = &self.prepared.loaded;
            let contacts: Vec<u32> = recording
                .contacts(record)
                .iter()
                .map(|c| loaded.contact_node(c.candidate))
                .collect();
            let here = solver.strain_peaks(
                &u,
                &Moment {
                    contacts: &contacts,
                    travel_m: record.travel,
                    force_n: recording.resistance(record) + 0.0,
                },
            );
            let kept = if is_seat(index) {
                &mut of_seat
            } else {
                &mut peaks
            };
            kept.merge(&here);
            seen.insert(index);
            Ok(here.value())
        };
        let (at_seat, sampled): (Vec<usize>, Vec<usize>) =
            sampled.iter().partition(|&&index| is_seat(index));
        at_seat
            .into_iter()
            .try_for_each(|index| look(index).map(|_| ()))?;
        let values = sampled
            .iter()
            .map(|&index| look(index))
            .collect::<Result<Vec<f64>, Error>>()?;
        let index = search_peak(&sampled, &values, &mut look)?;
        let facts = StrainFacts {
            peaks: peaks.into_vec(),
            at_seat: of_seat.governing(),
            permissible: self.scene.part.material.permissible_strain,
            n_moments: seen.len(),
        };
        Ok(Strained {
            index: index.filter(|_| facts.value() > 0.0),
            facts,
            max_rotation,
        })
    }
}

/// Looks closer around the largest of some sampled steps: golden section between its neighbours, until they are adjacent.
/// `values`: of the sampled steps, which are ascending; `look`: value of any step. Where the largest was found.
///
/// # Errors
/// Those of `look`.
pub(crate) fn search_peak<E>(
    sampled: &[usize],
    values: &[f64],
    mut look: impl FnMut(usize) -> Result<f64, E>,
) -> Result<Option<usize>, E> {
    let Some(k) = (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b])) else {
        return Ok(None);
    };
    let (mut middle, mut most) = (sampled[k], values[k]);
    let mut low = sampled[k.saturating_sub(1)];
    let mut high = sampled[(k + 1).min(sampled.len() - 1)];
    while middle - low > 1 || high - middle > 1 {
        let is_left = middle - low > high - middle;
        let span = if is_left { middle - low } else { high - middle };
        let step = ((0.382 * span as f64) as usize).max(1);
        let next = if is_left {
            middle - step
        } else {
            middle + step
        };
        let value = look(next)?;
        if value > most {
            if is_left {
                high = middle;
            } else {
                low = middle;
            }
            (middle, most) = (next, value);
        } else if is_left {
            low = next;
        } else {
            high = next;
        }
    }
    Ok(Some(middle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_between_samples_is_found_in_few_looks() {
        for summit in [3usize, 111, 250, 617, 998] {
            let force = |i: usize| 1.0 - (i as f64 - summit as f64).abs().powf(1.3);
            let sampled: Vec<usize> = (0..1000).step_by(70).chain([999]).collect();
            let values: Vec<f64> = sampled.iter().map(|&i| force(i)).collect();
            let mut looks = 0;
            let found = search_peak::<()>(&sampled, &values, |i| {
                looks += 1;
                Ok(force(i))
            });
            assert_eq!(found, Ok(Some(summit)));
            assert!(looks <= 20, "{looks}");
        }
        assert_eq!(search_peak::<()>(&[], &[], |_| Ok(0.0)), Ok(None));
    }
}

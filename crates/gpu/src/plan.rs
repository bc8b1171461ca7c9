//! What a GPU is given for a product: the compliance in panels, and a job that lists columns, forces and rows.

use crate::error::Error;
use crate::layout::Layout;
use crate::scaling::power_of_two_below;

/// How a GPU keeps the compliance. Forces and sums are 32-bit there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Storage {
    /// 32 bits: rounding of 2⁻²⁴ for each number.
    F32,
    /// 16 bits: half the memory to read, rounding of 2⁻¹¹ for each number.
    F16,
}

impl Storage {
    /// Bytes of a number.
    pub fn bytes(self) -> u64 {
        match self {
            Self::F32 => 4,
            Self::F16 => 2,
        }
    }
}

/// Numbers of a column are filled up to a multiple of this, so that four are read at once and every column begins
/// where a vector may.
const PAD: usize = 4;

/// Slices of the entries at most, each with partial sums of its own: 32 of them keep a large GPU busy from a few
/// thousand rows on, and reading them again stays small beside the compliance.
const MOST_SLICES: usize = 32;

/// Numbers in the rows of all slices from which more slices bring nothing: some hundred thousand threads of four.
const BUSY: usize = 1 << 18;

/// Entries of a slice at least.
const LEAST_ENTRIES: usize = 4;

/// Words of the head of a job and of an entry in it.
const WORDS: usize = 4;
const HEAD: usize = 2;

/// The compliance cut into panels of whole candidates, none larger than a binding may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Panels {
    pub(crate) layout: Layout,
    /// Numbers of a column in memory.
    pub(crate) stride: usize,
    /// Candidates of a panel; the last one has what is left.
    pub(crate) per_panel: usize,
    pub(crate) n_panels: usize,
    /// Slices that the partial sums have room for; a multiple of four where there are four.
    pub(crate) room: usize,
}

impl Panels {
    /// `limit`: bytes of a binding.
    ///
    /// # Errors
    /// Where not even one candidate fits.
    pub(crate) fn new(layout: Layout, storage: Storage, limit: u64) -> Result<Self, Error> {
        let too_large = || Error::TooLarge {
            n_rows: layout.n_rows(),
            n_candidates: layout.n_candidates(),
        };
        let stride = layout.displacement_len().next_multiple_of(PAD);
        let of_candidate = 3 * stride as u64 * storage.bytes();
        let of_slice = stride as u64 * 4;
        let per_panel = (limit / of_candidate).min(layout.n_candidates().max(1) as u64) as usize;
        // A batch needs room for four sets. Places in a panel are 32-bit in the shader, and its workgroups are counted
        // in 16 bits.
        let room = (limit / of_slice).min(MOST_SLICES as u64) as usize / 4 * 4;
        if per_panel == 0 || room == 0 || stride.div_ceil(64) > 65_535 {
            return Err(too_large());
        }
        let per_panel = per_panel.min(u32::MAX as usize / (3 * stride));
        Ok(Self {
            layout,
            stride,
            per_panel,
            n_panels: layout.n_candidates().div_ceil(per_panel),
            room,
        })
    }

    /// Candidates of a panel.
    pub(crate) fn candidates_of(&self, panel: usize) -> std::ops::Range<usize> {
        let first = panel * self.per_panel;
        first..(first + self.per_panel).min(self.layout.n_candidates())
    }

    /// Words of a job at most: every candidate listed, and every row.
    pub(crate) fn job_words(&self, n_sets: usize) -> usize {
        let of_entry = if n_sets > 1 {
            1 + 3 * n_sets.div_ceil(4)
        } else {
            1
        };
        let vectors = HEAD
            + self.n_panels
            + self.layout.n_candidates() * of_entry
            + self.layout.n_rows().div_ceil(4);
        WORDS * vectors
    }
}

/// Which rows a job asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// All.
    Whole,
    /// The first ones and those listed in the job.
    SomeRows,
    /// All, under so many sets of forces.
    Batch(usize),
}

/// A product that is asked for.
#[derive(Debug, Clone)]
pub(crate) struct Job {
    pub(crate) kind: Kind,
    /// What the shaders read; see multiply.wgsl.
    pub(crate) words: Vec<u32>,
    /// Numbers of the result.
    pub(crate) n_out: usize,
    pub(crate) n_slices: usize,
    /// Panels that have entries.
    pub(crate) panels: Vec<usize>,
    /// The result times this is the displacement in m; a power of two.
    pub(crate) scale: f64,
}

impl Job {
    /// An empty job with room for `n_sets`.
    pub(crate) fn empty(panels: &Panels, n_sets: usize) -> Self {
        Self {
            kind: Kind::Whole,
            words: Vec::with_capacity(panels.job_words(n_sets)),
            n_out: 0,
            n_slices: 0,
            panels: Vec::with_capacity(panels.n_panels),
            scale: 1.0,
        }
    }
}

/// Writes jobs. Holds what that needs, so that writing one does not allocate.
#[derive(Debug)]
pub(crate) struct Planner {
    panels: Panels,
    /// Of each column, a power of two: stored number times this is the compliance in m/N.
    units: Vec<f64>,
    /// Slices are made until so many numbers are summed at a time.
    busy: usize,
    /// Candidates of the job, each once, and by candidate its place among them.
    listed: Vec<u32>,
    place: Vec<u32>,
    /// Forces times unit, by place, set and axis.
    forces: Vec<f64>,
}

const NOWHERE: u32 = u32::MAX;

impl Planner {
    /// `units`: 3 for each candidate. `is_software`: no more slices than needed, since a processor has few threads.
    pub(crate) fn new(panels: Panels, units: Vec<f64>, is_software: bool) -> Self {
        let n_candidates = panels.layout.n_candidates();
        Self {
            panels,
            units,
            busy: if is_software { 1 } else { BUSY },
            listed: Vec::with_capacity(n_candidates),
            place: vec![NOWHERE; n_candidates],
            forces: Vec::with_capacity(3 * n_candidates),
        }
    }

    /// Writes a job; the input has been checked. `rows`: the first ones and those listed, all if `None`.
    pub(crate) fn write(
        &mut self,
        columns: &[u32],
        forces: &[f64],
        rows: Option<(usize, &[u32])>,
        job: &mut Job,
    ) {
        self.gather(1, columns, forces);
        let of_panel = self.most_entries_of_a_panel();
        let n_out = match rows {
            Some((n_first, listed)) => 3 * (n_first + listed.len()),
            None => self.panels.layout.displacement_len(),
        };
        let wanted = self.busy.div_ceil(n_out.max(1));
        job.kind = if rows.is_some() {
            Kind::SomeRows
        } else {
            Kind::Whole
        };
        job.n_out = n_out;
        job.n_slices = wanted
            .min(of_panel.div_ceil(LEAST_ENTRIES))
            .clamp(1, self.panels.room);
        let scale = self.scale();
        // What is kept on the device is in m, except where that would leave the range of 32 bits.
        let on_device = if (2_f64.powi(-60)..2_f64.powi(60)).contains(&scale) {
            scale
        } else {
            1.0
        };
        job.scale = scale / on_device;
        let n_first = rows.map_or(0, |(n_first, _)| n_first);
        self.write_head(job, n_first, on_device as f32, 1);
        self.write_entries(job, 1, scale);
        if let Some((_, listed)) = rows {
            job.words[WORDS + 1] = (job.words.len() / WORDS) as u32;
            job.words.extend_from_slice(listed);
            let whole = job.words.len().next_multiple_of(WORDS);
            job.words.resize(whole, 0);
        }
    }

    /// Writes a job for several sets of forces.
    pub(crate) fn write_batch(
        &mut self,
        n_sets: usize,
        columns: &[u32],
        forces: &[f64],
        job: &mut Job,
    ) {
        self.gather(n_sets, columns, forces);
        job.kind = Kind::Batch(n_sets);
        job.n_out = n_sets * self.panels.stride;
        job.n_slices = 0;
        let scale = self.scale();
        job.scale = scale;
        self.write_head(job, 0, 1.0, n_sets.div_ceil(4));
        self.write_entries(job, n_sets, scale);
    }

    /// Lists each candidate once, with the sum of its forces.
    fn gather(&mut self, n_sets: usize, columns: &[u32], forces: &[f64]) {
        let Self { listed, place, .. } = self;
        listed.clear();
        for column in columns {
            let place = &mut place[*column as usize];
            if *place == NOWHERE {
                *place = listed.len() as u32;
                listed.push(*column);
            }
        }
        self.forces.clear();
        self.forces.resize(3 * n_sets * self.listed.len(), 0.0);
        for (set, forces) in forces.chunks_exact((3 * columns.len()).max(1)).enumerate() {
            for (column, f) in columns.iter().zip(forces.chunks_exact(3)) {
                let entry = self.place[*column as usize] as usize;
                for axis in 0..3 {
                    let unit = self.units[3 * *column as usize + axis];
                    self.forces[3 * (n_sets * entry + set) + axis] += f[axis] * unit;
                }
            }
        }
    }

    /// Power of two that brings the largest force times unit near 1.
    fn scale(&self) -> f64 {
        power_of_two_below(self.forces.iter().fold(0.0, |m: f64, f| m.max(f.abs())))
    }

    fn most_entries_of_a_panel(&self) -> usize {
        let count = |panel: usize| {
            let of_panel = self.panels.candidates_of(panel);
            let is_there = |c: &&u32| of_panel.contains(&(**c as usize));
            self.listed.iter().filter(is_there).count()
        };
        (0..self.panels.n_panels).map(count).max().unwrap_or(0)
    }

    fn write_head(&self, job: &mut Job, n_first: usize, scale: f32, n_groups: usize) {
        job.words.clear();
        job.words.extend([
            job.n_out as u32,
            self.panels.stride as u32,
            job.n_slices as u32,
            n_first as u32,
            scale.to_bits(),
            0,
            n_groups as u32,
            0,
        ]);
        job.words.resize(WORDS * (HEAD + self.panels.n_panels), 0);
    }

    fn write_entries(&mut self, job: &mut Job, n_sets: usize, scale: f64) {
        job.panels.clear();
        for panel in 0..self.panels.n_panels {
            let of_panel = self.panels.candidates_of(panel);
            let first = job.words.len() / WORDS;
            let mut n_entries = 0;
            for (entry, candidate) in self.listed.iter().enumerate() {
                if !of_panel.contains(&(*candidate as usize)) {
                    continue;
                }
                n_entries += 1;
                let local = *candidate - of_panel.start as u32;
                let force = |set: usize, axis: usize| -> u32 {
                    let f = self.forces[3 * (n_sets * entry + set) + axis];
                    ((f / scale) as f32).to_bits()
                };
                if let Kind::Batch(_) = job.kind {
                    job.words.extend([local, 0, 0, 0]);
                    for group in 0..n_sets.div_ceil(4) {
                        for axis in 0..3 {
                            let of_set = |k: usize| {
                                let set = 4 * group + k;
                                if set < n_sets { force(set, axis) } else { 0 }
                            };
                            job.words.extend([0, 1, 2, 3].map(of_set));
                        }
                    }
                } else {
                    job.words
                        .extend([local, force(0, 0), force(0, 1), force(0, 2)]);
                }
            }
            if n_entries > 0 {
                let adds = u32::from(!job.panels.is_empty());
                let of_slice = u32::div_ceil(n_entries, job.n_slices.max(1) as u32);
                let head = WORDS * (HEAD + panel);
                job.words[head..head + WORDS].copy_from_slice(&[
                    first as u32,
                    n_entries,
                    of_slice,
                    adds,
                ]);
                job.panels.push(panel);
            }
        }
        if job.panels.is_empty() {
            // No partial sum is written, so none is added.
            job.n_slices = 0;
            job.words[2] = 0;
        }
        for column in &self.listed {
            self.place[*column as usize] = NOWHERE;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panels_hold_each_candidate_once_and_none_is_larger_than_a_binding() {
        for (n_rows, n_candidates, limit) in
            [(1, 1, 64), (5, 7, 300), (21, 100, 5000), (64, 9, 1 << 27)]
        {
            let layout = Layout::new(n_rows, n_candidates).unwrap();
            for storage in [Storage::F32, Storage::F16] {
                let panels = Panels::new(layout, storage, limit).unwrap();
                let of_candidate = 3 * panels.stride as u64 * storage.bytes();
                let mut next = 0;
                for panel in 0..panels.n_panels {
                    let candidates = panels.candidates_of(panel);
                    assert_eq!(candidates.start, next);
                    assert!(!candidates.is_empty());
                    assert!(candidates.len() as u64 * of_candidate <= limit);
                    next = candidates.end;
                }
                assert_eq!(next, n_candidates);
                assert!(panels.room as u64 * panels.stride as u64 * 4 <= limit);
            }
        }
        let layout = Layout::new(1000, 1).unwrap();
        let refused = Panels::new(layout, Storage::F32, 3000 * 12 - 1);
        assert!(matches!(refused, Err(Error::TooLarge { .. })));
    }

    #[test]
    fn job_lists_each_candidate_once_with_the_sum_of_its_forces() {
        let layout = Layout::new(4, 3).unwrap();
        let panels = Panels::new(layout, Storage::F32, 1 << 20).unwrap();
        let mut planner = Planner::new(panels, vec![0.25; 9], true);
        let mut job = Job::empty(&panels, 1);
        planner.write(
            &[2, 0, 2],
            &[1.0, 2.0, 3.0, 0.5, 0.0, 0.0, 1.0, 1.0, 1.0],
            None,
            &mut job,
        );
        let entry = |k: usize| {
            let words = &job.words[12 + 4 * k..16 + 4 * k];
            let force = |word: &u32| f64::from(f32::from_bits(*word));
            (
                words[0],
                [force(&words[1]), force(&words[2]), force(&words[3])],
            )
        };
        // The largest, 4 N times 0.25, is 1 already.
        assert_eq!(entry(0), (2, [0.5, 0.75, 1.0]));
        assert_eq!(entry(1), (0, [0.125, 0.0, 0.0]));
        assert_eq!(job.words.len(), 20);
        assert_eq!(
            (job.n_out, job.n_slices, job.panels.as_slice()),
            (12, 1, &[0][..])
        );

        planner.write(&[], &[], None, &mut job);
        assert_eq!(
            (job.n_slices, job.panels.len(), job.words.len()),
            (0, 0, 12)
        );
    }

    #[test]
    fn many_entries_are_cut_into_slices_where_there_are_threads_for_them() {
        let layout = Layout::new(100, 400).unwrap();
        let panels = Panels::new(layout, Storage::F32, 1 << 30).unwrap();
        let columns: Vec<u32> = (0..400).collect();
        let slices = |n: usize, is_software: bool| {
            let mut planner = Planner::new(panels, vec![1.0; 1200], is_software);
            let mut job = Job::empty(&panels, 1);
            planner.write(&columns[..n], &vec![1.0; 3 * n], None, &mut job);
            // All entries are in one of the slices.
            let of_slice = job.words[8 + 2] as usize;
            assert!(job.n_slices * of_slice >= n);
            job.n_slices
        };
        assert_eq!((slices(400, true), slices(400, false)), (1, 32));
        assert_eq!((slices(3, false), slices(13, false)), (1, 4));
    }
}

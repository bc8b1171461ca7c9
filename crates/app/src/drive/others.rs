//! Whether a way with friction is the only one, as it may not be where the body wedges.

use device::Phase;

use super::{Drive, Gone};
use crate::Error;

/// Places at most that are looked at, evenly over those at which friction is large: a tenth of a second each.
const MOST_LOOKED_AT: usize = 24;

/// A place at which other forces obey the law of friction as well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OtherAnswer {
    /// m, of the first such place that was found.
    pub travel: f64,
    /// On the way in, at rest or on the way out.
    pub phase: Phase,
    /// N, that resist there on the way that was gone.
    pub force: f64,
    /// N, that would by the other answer.
    pub other_force: f64,
    /// Between the two forces on the tool, in all directions, over the larger of them.
    pub difference: f64,
}

impl Drive<'_> {
    /// Goes a way once more, if friction is large anywhere, and looks for other answers until the first is found.
    pub(super) fn other_answer(&mut self, gone: &Gone) -> Result<Option<OtherAnswer>, Error> {
        let n_doubtful = gone.doubtful.iter().filter(|is| **is).count();
        if n_doubtful == 0 {
            return Ok(None);
        }
        let each = n_doubtful.div_ceil(MOST_LOOKED_AT);
        let mut found = None;
        let mut seen = 0;
        self.engine.reset();
        // To the end, so that the engine is left there.
        let records = &gone.recording.records;
        for (k, (record, is_doubtful)) in records.iter().zip(&gone.doubtful).enumerate() {
            self.look(k, records.len())?;
            let target = self.spec.held.target(&record.handle_pose);
            if let Some(columns) = &mut self.columns {
                columns.fetch_around(self.engine, target);
            }
            let report = self.engine.step(&target);
            if !is_doubtful || found.is_some() {
                continue;
            }
            seen += 1;
            if (seen - 1) % each != 0 {
                continue;
            }
            let Some(added) = self.engine.other_answer() else {
                continue;
            };
            let own = report.contact_force_on_tool();
            let way = self.spec.held.way_of_tool(self.spec.direction);
            found = Some(OtherAnswer {
                travel: record.travel,
                phase: record.phase,
                force: -own.dot(way),
                other_force: -(own + added).dot(way),
                difference: added.length() / own.length().max((own + added).length()),
            });
        }
        Ok(found)
    }
}

//! Other forces that obey the law as well as those of the last pass. Not for the haptic step.

use contact::friction::{Problem, may_have_others, others};
use glam::DVec3;

use super::super::super::rows::Rows;
use super::Coulomb;

impl Coulomb {
    fn problem(&self, rows: &Rows) -> Option<(Problem<'_>, &[f64])> {
        let (m, n) = (rows.m, 3 * rows.m);
        let coefficients = &self.coefficients[..m];
        let matrix = &self.w_matrix[..n * n];
        let problem = Problem::trusted_symmetric(matrix, &self.q[..n], coefficients);
        Some((problem.ok()?, &self.force[..n]))
    }

    /// Whether friction is large enough to look for them.
    pub(in super::super::super) fn may_have_others(&self, rows: &Rows) -> bool {
        let problem = self.problem(rows);
        problem
            .is_some_and(|(problem, forces)| may_have_others(&problem, forces).is_ok_and(|may| may))
    }

    /// What they would add to the force on the tool, N, part's frame; of several the most. `None` where none were found.
    pub(in super::super::super) fn other_force(&self, rows: &Rows) -> Option<DVec3> {
        let (problem, own) = self.problem(rows)?;
        let found = others(&problem, own).ok()?;
        let added = found.iter().map(|forces| {
            let contacts = self.frames.iter().enumerate();
            let on_part = contacts.map(|(i, frame)| {
                let (row, share) = rows.share.patches().map_or((i, 1.0), |p| p.share_of(i));
                let more = [0, 1, 2].map(|k| share * (forces[3 * row + k] - own[3 * row + k]));
                more[0] * frame[0] + more[1] * frame[1] + more[2] * frame[2]
            });
            -on_part.sum::<DVec3>()
        });
        added.max_by(|a, b| a.length().total_cmp(&b.length()))
    }
}

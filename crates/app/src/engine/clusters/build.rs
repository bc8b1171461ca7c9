//! Norms of a compliance that is there as a whole, by all cores, before the first step.

use glam::DMat3;
use rayon::prelude::*;

use super::Clusters;

impl Clusters {
    /// Takes in all columns of a compliance that is there as a whole: `block(i, j)`.
    pub(in crate::engine) fn add_all(&mut self, block: impl Fn(usize, usize) -> DMat3 + Sync) {
        let n = self.len();
        if n == 0 {
            return;
        }
        let mut norms = [&mut self.largest, &mut self.rows, &mut self.columns].map(std::mem::take);
        let [largest, rows, columns] = &mut norms;
        let chunks = largest.par_chunks_mut(n).zip(rows.par_chunks_mut(n));
        let chunks = chunks.zip(columns.par_chunks_mut(n)).enumerate();
        chunks.for_each(|(b, ((largest, rows), columns))| {
            let reference = self.members_of(b)[0] as usize;
            for &j in self.members_of(b) {
                let column = |i: usize| block(i, j as usize);
                let into = [&mut *largest, &mut *rows, &mut *columns];
                self.fold(j, column, |i| block(i, reference), into);
            }
        });
        [self.largest, self.rows, self.columns] = norms;
    }
}

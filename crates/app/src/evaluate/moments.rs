//! Moments of a run that are worth a picture or a look at the strains.

use crate::session::Recording;

/// Steps of which strain and rotation are looked at, besides those that are drawn.
const SAMPLED_STEPS: usize = 40;

/// Records worth a look, by index.
pub(super) struct Moments {
    n: usize,
    touch: Option<usize>,
    pub(super) peak: Option<usize>,
    pub(super) crest: Option<usize>,
    pull: Option<usize>,
    /// Last of insertion and hold.
    home: Option<usize>,
    /// Strongest pull on the way out.
    removal: Option<usize>,
    /// Last of the way out.
    out: Option<usize>,
}

impl Moments {
    /// `snap`: record of the snap's peak, which a seat may be higher than.
    pub(super) fn of(recording: &Recording, snap: Option<usize>) -> Self {
        let records = &recording.records;
        let force: Vec<f64> = records.iter().map(|r| recording.resistance(r)).collect();
        let end = records
            .iter()
            .position(|r| r.phase == device::Phase::Retract)
            .unwrap_or(records.len());
        let touch = records.iter().position(|r| r.report.contacts > 0);
        let largest = || (0..end).max_by(|&a, &b| force[a].total_cmp(&force[b]));
        let peak = touch.and_then(|_| snap.or_else(largest));
        let crest = peak.and_then(|p| (p..end).find(|&i| force[i] <= 0.0));
        let pull = crest.and_then(|c| (c..end).min_by(|&a, &b| force[a].total_cmp(&force[b])));
        let way_out = end..records.len();
        Self {
            n: records.len(),
            touch,
            peak,
            crest,
            pull,
            home: end.checked_sub(1),
            removal: way_out
                .clone()
                .min_by(|&a, &b| force[a].total_cmp(&force[b]))
                .filter(|&i| force[i] < 0.0),
            out: way_out.last(),
        }
    }

    pub(super) fn sampled(&self) -> Vec<usize> {
        let mut all: Vec<usize> = self
            .between(SAMPLED_STEPS)
            .chain(
                [self.peak, self.crest, self.pull, self.removal]
                    .into_iter()
                    .flatten(),
            )
            .collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Evenly from the first touch to the end.
    fn between(&self, count: usize) -> impl Iterator<Item = usize> + '_ {
        let from = self.touch.unwrap_or(0);
        let span = self.n.saturating_sub(from + 1);
        (0..count.min(span)).map(move |k| from + k * span / count.max(1))
    }

    /// The named moments first, then what fills up to `count`, in order of time. `strained`: that of the largest strain.
    pub(super) fn labelled(&self, count: usize, strained: Option<usize>) -> Vec<(String, usize)> {
        let named = [
            (self.peak, "peak"),
            (strained, "most strained"),
            (self.home, "home"),
            (self.removal, "removal"),
            (self.out, "out"),
            (self.pull, "pull"),
            (self.touch, "first contact"),
            (self.crest, "crest"),
        ];
        let mut moments: Vec<(String, usize)> = Vec::new();
        for (index, label) in named {
            if let Some(index) = index.filter(|i| moments.iter().all(|m| m.1 != *i)) {
                moments.push((label.to_owned(), index));
            }
        }
        moments.truncate(count);
        let missing = count.saturating_sub(moments.len());
        let touch = self.touch.unwrap_or(0);
        let rise = self.peak.unwrap_or(self.n).saturating_sub(touch);
        for k in 1..=missing {
            let index = touch + k * rise / (missing + 1);
            if index < self.n && moments.iter().all(|m| m.1 != index) {
                moments.push(("rise".to_owned(), index));
            }
        }
        moments.sort_by_key(|m| m.1);
        moments
    }
}

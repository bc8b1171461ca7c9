//! Whether the machine was busy with other work while it was timed: the same step, repeated, tells.

use serde::{Deserialize, Serialize};

use super::Study;
use crate::report::plot::short;

/// The middle one of a step's times over its shortest: 1.02 to 1.1 on an idle machine, 2 where two programs share a
/// core.
const TYPICAL: f64 = 1.3;

/// Share of the times that are more than [`TWICE`] their step's shortest: below 0.2 % on an idle machine. From half a
/// per cent on, the time that 99.9 % of the steps keep is the machine's, not the program's.
const DISTURBED: f64 = 0.005;

/// A time is out of line beyond this many times the shortest, and by more than a timer's interrupt.
const TWICE: f64 = 2.0;
const INTERRUPT_NS: u64 = 20_000;

/// How alike the times are that the same steps took in several rounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Repeats {
    /// How often each step was timed.
    pub rounds: usize,
    /// Over the steps, the middle of what a step's middle time is of its shortest; >= 1.
    pub typical: f64,
    /// Share of all times that are more than twice their step's shortest.
    pub disturbed: f64,
}

impl Repeats {
    /// `times`: ns, of each step in each round. Steps that were timed once tell nothing; `None` if there are no others.
    pub(super) fn of(times: impl Iterator<Item = Vec<u64>>) -> Option<Self> {
        let (mut ratios, mut rounds) = (Vec::new(), 0);
        let (mut n_times, mut n_disturbed) = (0, 0);
        for mut of_step in times.filter(|t| t.len() > 1) {
            of_step.sort_unstable();
            let shortest = of_step[0].max(1);
            ratios.push(of_step[of_step.len() / 2] as f64 / shortest as f64);
            rounds = rounds.max(of_step.len());
            let limit = ((TWICE * shortest as f64) as u64).max(shortest + INTERRUPT_NS);
            n_times += of_step.len();
            n_disturbed += of_step.iter().filter(|ns| **ns > limit).count();
        }
        Some(Self {
            rounds,
            typical: middle(ratios)?,
            disturbed: n_disturbed as f64 / n_times as f64,
        })
    }

    /// Whether other work disturbed the times.
    pub(super) fn is_busy(&self) -> bool {
        self.typical > TYPICAL || self.disturbed > DISTURBED
    }

    /// What was seen.
    pub(super) fn words(&self) -> String {
        format!(
            "the same step, repeated, took {} times its shortest time in the middle, and more than twice its shortest \
             in {} % of the repeats",
            short(self.typical),
            short(100.0 * self.disturbed)
        )
    }
}

fn middle(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

impl Study {
    /// The repeats of the settings altogether: the middle of each number.
    pub(super) fn repeats(&self) -> Option<Repeats> {
        let all: Vec<Repeats> = self
            .distinct()
            .iter()
            .filter_map(|(_, measured, _)| measured.repeats)
            .collect();
        Some(Repeats {
            rounds: all.iter().map(|r| r.rounds).max()?,
            typical: middle(all.iter().map(|r| r.typical).collect())?,
            disturbed: middle(all.iter().map(|r| r.disturbed).collect())?,
        })
    }

    /// A sentence, if the machine was busy.
    pub fn busy(&self) -> Option<String> {
        let repeats = self.repeats().filter(Repeats::is_busy)?;
        let load = if self.load > 0.0 {
            format!(
                " (load {:.1} on {} cores when it began)",
                self.load, self.cores
            )
        } else {
            String::new()
        };
        Some(format!(
            "The machine was busy: {}{load}. Times are longer than this machine needs, those of 99.9 % above all; \
             errors are as they are. Measure again with --fresh while nothing else runs.",
            repeats.words()
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alike_times_are_those_of_an_idle_machine() {
        let times = (0..1000u64).map(|k| vec![15_000 + k, 15_500 + k, 15_900 + k]);
        let repeats = Repeats::of(times).unwrap();
        assert_eq!(repeats.rounds, 3);
        assert!((repeats.typical - 1.03).abs() < 0.01, "{repeats:?}");
        assert_eq!(repeats.disturbed, 0.0);
        assert!(!repeats.is_busy());
    }

    #[test]
    fn a_shared_core_and_interruptions_are_seen() {
        let shared = Repeats::of((0..100).map(|_| vec![10_000, 21_000, 30_000])).unwrap();
        assert!(shared.is_busy() && shared.typical == 2.1, "{shared:?}");
        // One in a hundred is interrupted for 4 ms, as by another program.
        let often = Repeats::of((0..100u64).map(|k| {
            let last = if k % 25 == 0 { 4_000_000 } else { 10_100 };
            vec![10_000, 10_050, 10_020, last]
        }));
        let often = often.unwrap();
        assert!(often.typical < 1.1 && often.is_busy(), "{often:?}");
        assert_eq!(often.disturbed, 0.01);
    }

    #[test]
    fn what_was_timed_once_tells_nothing() {
        assert_eq!(Repeats::of([vec![1], vec![]].into_iter()), None);
        assert_eq!(Repeats::of(std::iter::empty()), None);
    }
}

//! Does what was sent arrive? The service filters forces and says what it renders.

use glam::DVec3;

/// Time constant of the averages, s.
const AVERAGE_S: f64 = 0.1;

/// Force, root of the mean square, below which nothing is judged, N.
const JUDGED_FROM: f64 = 0.5;

/// Share of the force below which it counts as weakened, and above which it counts as arriving again.
const WEAK_BELOW: f64 = 0.7;
const FINE_ABOVE: f64 = 0.9;

/// Share below which nothing arrives at all.
const NOTHING_BELOW: f64 = 0.02;

/// How long it must be weak, or nothing, before it is said, s. A force that breaks off is found to be nothing before
/// it is found to be weak: its average needs 0.4 s to fall.
const WEAK_S: f64 = 1.0;
const NOTHING_S: f64 = 0.25;

/// What the comparison found, said once until it is over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Verdict {
    /// Far less arrives than is sent: both as root of the mean square, N.
    Weak {
        /// What was sent.
        sent: f64,
        /// The part of what is rendered that points along it.
        felt: f64,
    },
    /// Nothing of it arrives.
    Nothing,
}

/// Compares the forces sent with those felt.
///
/// ```text
/// share = <felt · sent> / <sent · sent>     averages over 0.1 s
/// ```
#[derive(Debug, Clone, Default)]
pub(super) struct Comparison {
    sent_sent: f64,
    felt_sent: f64,
    weak_s: f64,
    nothing_s: f64,
    is_told: bool,
    has_arrived: bool,
}

impl Comparison {
    /// Has any part of a force arrived yet?
    pub(super) fn has_arrived(&self) -> bool {
        self.has_arrived
    }

    /// Takes a force that was sent and what the service said it rendered then, N.
    pub(super) fn compare(&mut self, sent: DVec3, felt: DVec3, elapsed_s: f64) -> Option<Verdict> {
        let elapsed_s = elapsed_s.clamp(0.0, 0.05);
        let keep = (-elapsed_s / AVERAGE_S).exp();
        self.sent_sent = keep * self.sent_sent + (1.0 - keep) * sent.length_squared();
        self.felt_sent = keep * self.felt_sent + (1.0 - keep) * felt.dot(sent);
        if self.sent_sent < JUDGED_FROM * JUDGED_FROM {
            self.weak_s = 0.0;
            self.nothing_s = 0.0;
            return None;
        }
        let share = self.felt_sent / self.sent_sent;
        let count = |time: f64, is_so: bool| if is_so { time + elapsed_s } else { 0.0 };
        self.weak_s = count(self.weak_s, share < WEAK_BELOW);
        self.nothing_s = count(self.nothing_s, share < NOTHING_BELOW);
        self.has_arrived |= share > NOTHING_BELOW;
        if share > FINE_ABOVE {
            self.is_told = false;
        }
        if self.nothing_s >= NOTHING_S {
            *self = Self {
                is_told: true,
                has_arrived: self.has_arrived,
                ..Self::default()
            };
            return Some(Verdict::Nothing);
        }
        if self.weak_s < WEAK_S || self.is_told {
            return None;
        }
        self.is_told = true;
        let sent = self.sent_sent.sqrt();
        Some(Verdict::Weak {
            sent,
            felt: share * sent,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 1e-3;

    /// All verdicts over `periods`, with a force that swings between 1 and 3 N.
    fn run(comparison: &mut Comparison, periods: u32, share: f64) -> Vec<Verdict> {
        (0..periods)
            .filter_map(|n| {
                let sent = DVec3::new(0.0, 0.0, 2.0 + (f64::from(n) * 0.05).sin());
                comparison.compare(sent, sent * share, T)
            })
            .collect()
    }

    #[test]
    fn force_that_arrives_is_not_spoken_of() {
        assert_eq!(run(&mut Comparison::default(), 5000, 1.0), []);
        assert_eq!(run(&mut Comparison::default(), 5000, 0.75), []);
    }

    #[test]
    fn weakened_force_is_told_once_with_both_numbers() {
        let mut comparison = Comparison::default();
        let told = run(&mut comparison, 5000, 0.3);
        let [Verdict::Weak { sent, felt }] = told[..] else {
            panic!("{told:?}");
        };
        // Root of the mean square of 2 + sin: sqrt(4.5) = 2.12 N.
        assert!((sent - 2.12).abs() < 0.25, "{sent}");
        assert!((felt / sent - 0.3).abs() < 1e-9);
        assert!(comparison.has_arrived());
        // Told again only after it has arrived in between.
        assert_eq!(run(&mut comparison, 1000, 0.3), []);
        assert_eq!(run(&mut comparison, 1000, 1.0), []);
        assert_eq!(run(&mut comparison, 2000, 0.3).len(), 1);
    }

    #[test]
    fn force_that_never_arrives_is_nothing() {
        let mut comparison = Comparison::default();
        assert_eq!(run(&mut comparison, 300, 0.0), [Verdict::Nothing]);
        assert!(!comparison.has_arrived());
        // One that breaks off is nothing, too, and not weak.
        run(&mut comparison, 1000, 1.0);
        assert_eq!(run(&mut comparison, 800, 0.0), [Verdict::Nothing]);
        // Rendered the wrong way round is not rendered either.
        let told = run(&mut Comparison::default(), 300, -1.0);
        assert_eq!(told, [Verdict::Nothing]);
    }

    #[test]
    fn small_forces_and_late_answers_are_not_judged() {
        let mut comparison = Comparison::default();
        for n in 0..5000 {
            // Two periods late, as the answer to a frame may tell the force of an earlier one.
            let sent = |n: i32| DVec3::new(3.0 * (f64::from(n) * 0.1).sin(), 0.0, 0.0);
            assert_eq!(comparison.compare(sent(n), sent(n - 2), T), None);
        }
        let mut comparison = Comparison::default();
        for _ in 0..5000 {
            let small = DVec3::new(0.4, 0.0, 0.0);
            assert_eq!(comparison.compare(small, DVec3::ZERO, T), None);
        }
    }
}

//! When to tell a pad to rumble, and how strongly.

/// Force that is told by the whole strength, N: what a hand calls hard on a small part.
pub(super) const FULL_FORCE: f64 = 10.0;

/// Strengths that are told apart: motors of pads do not resolve more.
const STEPS: f64 = 64.0;

/// What to tell the pad.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    /// Rumble at a strength, 65535 being all it can, for [`Rumble::LENGTH_MS`].
    Play(u16),
    /// No rumble.
    Stop,
}

/// Keeps orders rare: each is a transfer to the pad.
///
/// Every rumble has an end of its own, so that none goes on when the program dies; while the force lasts it is
/// renewed well before.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Rumble {
    strength: u16,
    /// Time of the last order, s; none before the first.
    ordered_s: Option<f64>,
}

impl Rumble {
    /// Length of one rumble, ms.
    pub(super) const LENGTH_MS: u16 = 100;

    /// Shortest time between two orders, s: 50 Hz.
    const PERIOD_S: f64 = 0.02;

    /// Age at which a rumble is renewed, s.
    const RENEW_S: f64 = 0.05;

    /// What to tell the pad for a force, N, at a time, s; nothing where it may go on as it is.
    pub(super) fn next(&mut self, force: f64, now_s: f64) -> Option<Order> {
        let age_s = self.ordered_s.map_or(f64::INFINITY, |at| now_s - at);
        if age_s < Self::PERIOD_S {
            return None;
        }
        let strength = strength_of(force);
        let is_same = strength == self.strength;
        if is_same && (strength == 0 || age_s < Self::RENEW_S) {
            return None;
        }
        self.strength = strength;
        self.ordered_s = Some(now_s);
        Some(if strength == 0 {
            Order::Stop
        } else {
            Order::Play(strength)
        })
    }
}

/// Strength for a force, N. What is no number is no force.
fn strength_of(force: f64) -> u16 {
    let share = (force / FULL_FORCE).clamp(0.0, 1.0);
    // A cast of NaN gives 0.
    ((share * STEPS).round() / STEPS * f64::from(u16::MAX)) as u16
}

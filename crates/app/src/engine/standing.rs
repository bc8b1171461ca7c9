//! Whether passes over the contact planes have come to a stand.

/// Of the change of the last pass over that of the one before, below which passes are taken to shrink steadily.
const STEADY: f64 = 0.25;

/// Passes are not taken to shrink faster than this: the first one does all that is linear, and says little of the others.
const FASTEST: f64 = 0.02;

#[derive(Debug)]
pub(super) struct Standing {
    near_distance: f64,
    tolerance: f64,
    /// m, of the pass before.
    change: f64,
}

impl Standing {
    /// m.
    pub(super) fn new(near_distance: f64, tolerance: f64) -> Self {
        Self {
            near_distance,
            tolerance,
            change: f64::INFINITY,
        }
    }

    /// `change` (m): of the last pass. What further passes would change is a geometric series, taken twice over; only once
    /// all that moves is far smaller than the distance at which places get a contact, so that no other can come in. The
    /// first pass has none before it, so that nothing is known of how passes shrink.
    pub(super) fn is_reached(&mut self, change: f64) -> bool {
        let ratio = change / self.change;
        let is_steady =
            self.change.is_finite() && ratio < STEADY && change < 0.01 * self.near_distance;
        let ratio = ratio.max(FASTEST);
        let left = 2.0 * change * ratio / (1.0 - ratio);
        self.change = change;
        change <= self.tolerance || (is_steady && left <= self.tolerance)
    }
}

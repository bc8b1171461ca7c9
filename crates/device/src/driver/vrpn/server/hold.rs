//! Which client holds the device, and what it wants.

use std::time::Instant;

use crate::driver::vrpn::message::ForceField;

/// Age at which a field is dropped, s.
pub(super) const SILENCE_S: f64 = 0.1;

/// What came of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Taken {
    /// It is rendered from now on.
    Yes,
    /// Another client holds the device.
    Held,
    /// It has a number that is not finite.
    NotFinite,
}

/// The field of the client that holds the device.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Hold {
    held: Option<Held>,
}

#[derive(Debug, Clone, Copy)]
struct Held {
    guest: u64,
    field: ForceField,
    at: Instant,
}

impl Hold {
    /// A field of a client. The first one holds the device until it sends the field that is off.
    pub(super) fn take(&mut self, guest: u64, field: ForceField, now: Instant) -> Taken {
        let is_others = self.held.is_some_and(|held| held.guest != guest);
        if !field.is_finite() {
            // Whatever it wanted, it is not what it wants now.
            if !is_others {
                self.held = None;
            }
            return Taken::NotFinite;
        }
        let is_off = field == ForceField::OFF;
        match (is_others, is_off) {
            // A client that only makes sure that there is no force of its own.
            (true, true) => Taken::Yes,
            (true, false) => Taken::Held,
            (false, _) => {
                let at = now;
                self.held = (!is_off).then_some(Held { guest, field, at });
                Taken::Yes
            }
        }
    }

    /// The field to render. `Err`: none from now on, its client fell silent.
    pub(super) fn field(&mut self, now: Instant) -> Result<Option<ForceField>, ()> {
        let Some(held) = self.held else {
            return Ok(None);
        };
        if now.duration_since(held.at).as_secs_f64() > SILENCE_S {
            self.held = None;
            return Err(());
        }
        Ok(Some(held.field))
    }

    /// A client has left. Did it hold the device?
    pub(super) fn leave(&mut self, guest: u64) -> bool {
        let was_its = self.held.is_some_and(|held| held.guest == guest);
        if was_its {
            self.held = None;
        }
        was_its
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn push() -> ForceField {
        ForceField {
            force: [1.0, 0.0, 0.0],
            radius: 1.0,
            ..ForceField::OFF
        }
    }

    #[test]
    fn device_obeys_the_first_until_it_lets_go_leaves_or_falls_silent() {
        let now = Instant::now();
        let mut hold = Hold::default();
        let lets_go: [fn(&mut Hold, Instant); 3] = [
            |hold, now| assert_eq!(hold.take(1, ForceField::OFF, now), Taken::Yes),
            |hold, _| assert!(hold.leave(1)),
            |hold, now| assert_eq!(hold.field(now + Duration::from_millis(150)), Err(())),
        ];
        for let_go in lets_go {
            assert_eq!(hold.take(1, push(), now), Taken::Yes);
            assert_eq!(hold.take(2, push(), now), Taken::Held);
            assert_eq!(hold.take(2, ForceField::OFF, now), Taken::Yes);
            assert!(!hold.leave(2));
            assert_eq!(hold.field(now), Ok(Some(push())));
            let_go(&mut hold, now);
            assert_eq!(hold.field(now), Ok(None));
            assert_eq!(hold.take(2, push(), now), Taken::Yes);
            assert!(hold.leave(2));
        }
    }

    #[test]
    fn field_that_is_not_finite_ends_the_senders_own_force_only() {
        let now = Instant::now();
        let bad = ForceField {
            radius: f32::NAN,
            ..push()
        };
        let mut hold = Hold::default();
        hold.take(1, push(), now);
        assert_eq!(hold.take(2, bad, now), Taken::NotFinite);
        assert_eq!(hold.field(now), Ok(Some(push())));
        assert_eq!(hold.take(1, bad, now), Taken::NotFinite);
        assert_eq!(hold.field(now), Ok(None));
    }
}

//! Rate devices: what is deflected and springs back by itself means a velocity, here integrated into a pose.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use glam::DVec3;
use glamx::DPose3;

use super::link::{Connected, STALE_S};
use super::{Identity, Link, Unavailable};
use crate::error::DeviceError;
use crate::haptic_device::{Command, HandleState, Limits};
use crate::wrench::rotation_from_vector;

/// Half the space that the pose can reach, m. No hardware ends it: it keeps a stick that is held for an hour from
/// carrying the handle out of reach.
const REACH: f64 = 0.5;

/// Largest speed that may be asked for, m/s, and rad/s.
const SPEED_MAX: f64 = 1.0;
const TURN_MAX: f64 = 10.0;

/// What full deflection means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RateSettings {
    /// m/s. Default 0.05: a part of some centimetres is crossed in a second.
    pub(super) speed: f64,
    /// rad/s. Default 0.8: a quarter turn in two seconds.
    pub(super) turn: f64,
}

impl Default for RateSettings {
    fn default() -> Self {
        Self {
            speed: 0.05,
            turn: 0.8,
        }
    }
}

impl RateSettings {
    /// What the user should know of it at once.
    pub(super) fn note(&self) -> String {
        format!(
            "a rate device: full deflection is {:.0} mm/s and {:.2} rad/s (change it with ?speed=M_PER_S and \
             &turn=RAD_PER_S after the place)",
            1e3 * self.speed,
            self.turn
        )
    }
}

/// Splits a place into what the family knows and the settings after the question mark: `PATH?speed=0.1&turn=2`.
pub(super) fn split_place<'a>(
    family: &str,
    place: &'a str,
) -> Result<(&'a str, RateSettings), Unavailable> {
    let (path, options) = place.split_once('?').unwrap_or((place, ""));
    let mut settings = RateSettings::default();
    for option in options.split('&').filter(|option| !option.is_empty()) {
        let (key, value) = option.split_once('=').unwrap_or((option, ""));
        let (slot, largest) = match key {
            "speed" => (&mut settings.speed, SPEED_MAX),
            "turn" => (&mut settings.turn, TURN_MAX),
            _ => return Err(wrong_option(family, place)),
        };
        *slot = value
            .parse()
            .ok()
            .filter(|v| *v > 0.0 && *v <= largest)
            .ok_or_else(|| wrong_option(family, place))?;
    }
    Ok((path, settings))
}

fn wrong_option(family: &str, place: &str) -> Unavailable {
    Unavailable::UnknownName {
        given: format!("{family}:{place}"),
        mend: format!(
            "after the question mark may stand speed=M_PER_S (above 0, at most {SPEED_MAX}) and turn=RAD_PER_S \
             (above 0, at most {TURN_MAX}), joined by &"
        ),
    }
}

/// The limits of a rate device that renders forces up to `peak_force`, N; 0 where it renders none.
pub(super) fn limits(peak_force: f64) -> Limits {
    Limits {
        workspace_half_extents: DVec3::splat(REACH),
        continuous_force: peak_force,
        peak_force,
        peak_torque: 0.0,
        position_resolution: 0.0,
        force_resolution: 0.0,
        rotation_resolution: 0.0,
        max_stiffness: None,
        max_rotational_stiffness: None,
        max_damping: None,
        damping: None,
        coulomb_friction: None,
    }
}

/// A deflection as a share of the full one, in [-1, 1]: zero within `dead`, and from there without a step.
pub(super) fn share(value: f64, full: f64, dead: f64) -> f64 {
    let beyond = value.abs() - dead;
    // Anything that is not a number ends in neither.
    if full > dead && beyond > 0.0 {
        (beyond / (full - dead)).min(1.0).copysign(value)
    } else {
        0.0
    }
}

/// What a rate device says now: x right, y away from the user, z up.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Input {
    /// Share of the full speed along each axis, in [-1, 1].
    pub(super) linear: DVec3,
    /// Share of the full turn about each axis, right-handed, in [-1, 1].
    pub(super) angular: DVec3,
    /// Buttons, bit 0 first.
    pub(super) buttons: u32,
}

/// A handle that integrates deflections, from the origin of its frame.
#[derive(Debug)]
pub(super) struct RateHandle {
    settings: RateSettings,
    pose: DPose3,
}

impl RateHandle {
    pub(super) fn new(settings: RateSettings) -> Self {
        Self {
            settings,
            pose: DPose3::IDENTITY,
        }
    }

    /// Moves on for a time, s. Longer than a sample may be old it does not: nobody saw where that would lead.
    pub(super) fn advance(&mut self, input: &Input, elapsed_s: f64) -> HandleState {
        let elapsed_s = elapsed_s.clamp(0.0, STALE_S);
        let wanted = input.linear * self.settings.speed;
        let at = self.pose.translation;
        let next = (at + wanted * elapsed_s).clamp(DVec3::splat(-REACH), DVec3::splat(REACH));
        // At the end of the reach the handle stands still along that axis.
        let is_stopped = (next.cmpeq(DVec3::splat(REACH)) & wanted.cmpgt(DVec3::ZERO))
            | (next.cmpeq(DVec3::splat(-REACH)) & wanted.cmplt(DVec3::ZERO));
        let linear_velocity = DVec3::select(is_stopped, DVec3::ZERO, wanted);
        let angular_velocity = input.angular * self.settings.turn;
        let turn = rotation_from_vector(angular_velocity * elapsed_s);
        self.pose = DPose3::from_parts(next, (turn * self.pose.rotation).normalize());
        HandleState {
            linear_velocity,
            angular_velocity,
            buttons: input.buttons,
            ..HandleState::at_rest(self.pose)
        }
    }
}

/// Where deflections come from. Times are seconds since the link was opened.
pub(super) trait RateSource {
    /// Waits for news, a millisecond or two, and says what is so now.
    fn poll(&mut self, now_s: f64) -> Result<Input, DeviceError>;

    /// Tells the hand of a force, N, as far as it can.
    fn render(&mut self, _force: f64, _now_s: f64) {}

    /// A message for the user, once each.
    fn message(&mut self) -> Option<String> {
        None
    }

    /// Leaves the device as it was found. Must not fail.
    fn close(&mut self);
}

/// The link of a rate device. The handle outlives it, so that a lost device comes back where it was.
struct RateLink<S> {
    source: S,
    handle: Arc<Mutex<RateHandle>>,
    opened: Instant,
    last_s: f64,
}

impl<S: RateSource> Link for RateLink<S> {
    fn exchange(&mut self, command: &Command) -> Result<Option<HandleState>, DeviceError> {
        let input = self.source.poll(self.opened.elapsed().as_secs_f64())?;
        let now_s = self.opened.elapsed().as_secs_f64();
        self.source.render(command.wrench.force.length(), now_s);
        let elapsed_s = now_s - self.last_s;
        self.last_s = now_s;
        // Only this thread ever takes it.
        let mut handle = self.handle.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(Some(handle.advance(&input, elapsed_s)))
    }

    fn message(&mut self) -> Option<String> {
        self.source.message()
    }

    fn close(&mut self) {
        self.source.close();
    }
}

/// A source as a link on a handle.
pub(super) fn connected<S: RateSource + 'static>(
    identity: Identity,
    source: S,
    handle: &Arc<Mutex<RateHandle>>,
) -> Connected {
    let link = RateLink {
        source,
        handle: Arc::clone(handle),
        opened: Instant::now(),
        last_s: 0.0,
    };
    (identity, Box::new(link))
}

#[cfg(test)]
mod tests;

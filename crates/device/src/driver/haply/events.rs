//! The events of the service, and what they mean for the force.

use std::time::{Duration, Instant};

use serde_json::Value;

use super::messages::plain;
use crate::haptic_device::Readiness;

/// Time that a safety event without an end keeps the force away.
const HOLD: Duration = Duration::from_secs(1);

/// How serious the service says an event is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Level {
    /// `info`, `notice`, and levels that are not known.
    Note,
    /// `warning`.
    Warning,
    /// `error`.
    Error,
    /// `critical`, `panic`.
    Critical,
}

/// One event of the service.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Event {
    /// Its stable name.
    pub(super) name: String,
    pub(super) level: Level,
    /// The device or grip that it is about, where it names one.
    pub(super) device_id: Option<String>,
    /// What of its safety functions has acted.
    pub(super) safety: Option<String>,
    /// In the service's own words.
    pub(super) text: String,
}

impl Event {
    /// Reads a message of the events channel; `None` where it is none.
    pub(super) fn decode(text: &str) -> Option<Self> {
        let value: Value = serde_json::from_str(text).ok()?;
        let word = |value: &Value| value.as_str().map(plain).filter(|word| !word.is_empty());
        Some(Self {
            name: word(value.get("name")?)?,
            level: match value["level"].as_str() {
                Some("warning") => Level::Warning,
                Some("error") => Level::Error,
                Some("critical" | "panic") => Level::Critical,
                _ => Level::Note,
            },
            device_id: word(&value["data"]["device_id"]),
            safety: word(&value["data"]["safety_type"]),
            text: word(&value["message"]).unwrap_or_default(),
        })
    }
}

/// What of the device's own safety keeps the force away.
#[derive(Debug, Clone, Default)]
pub(super) struct Alarms {
    is_braked: bool,
    is_at_risk: bool,
    passing: Option<(Readiness, Instant)>,
}

impl Alarms {
    /// Takes a safety event.
    pub(super) fn safety(&mut self, kind: &str, level: Level, now: Instant) {
        match kind {
            "ebrake_triggered" => self.is_braked = true,
            "ebrake_released" => self.is_braked = false,
            // The level says which way the boundary between low and high risk was crossed.
            "fod_stage_changed" => self.is_at_risk = level >= Level::Warning,
            "stall_detected" => self.hold(Readiness::Tripped("a motor stalled"), now),
            "stability_ceiling" => self.hold(
                Readiness::Tripped("the device came to the limit of its stability"),
                now,
            ),
            _ => self.hold(
                Readiness::Tripped("a safety function of the device acted"),
                now,
            ),
        }
    }

    /// Keeps the force away for a second.
    pub(super) fn hold(&mut self, why: Readiness, now: Instant) {
        self.passing = Some((why, now));
    }

    /// Whether a force may go to the device.
    pub(super) fn readiness(&self, now: Instant) -> Readiness {
        if self.is_braked {
            return Readiness::Tripped("the device's emergency brake is on");
        }
        if self.is_at_risk {
            return Readiness::Tripped("the device's safety stage (FOD) is at high risk");
        }
        match self.passing {
            Some((why, since)) if now.saturating_duration_since(since) < HOLD => why,
            _ => Readiness::Ready,
        }
    }

    /// Is an alarm on that only another event ends?
    pub(super) fn waits_for_an_event(&self) -> bool {
        self.is_braked || self.is_at_risk
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(level: &str, data: &str) -> Event {
        let text = format!(
            r#"{{"name":"device-safety-triggered","category":"device","level":"{level}","data":{data},"message":"FOD stage changed: guard -> hard"}}"#
        );
        Event::decode(&text).unwrap()
    }

    #[test]
    fn event_is_read_with_what_it_is_about() {
        // The shape and the text are those of the maker's documentation of the events channel.
        let read = event(
            "warning",
            r#"{"device_family":"inverse","device_id":"049D","safety_type":"fod_stage_changed"}"#,
        );
        assert_eq!(read.name, "device-safety-triggered");
        assert_eq!(read.level, Level::Warning);
        assert_eq!(read.device_id.as_deref(), Some("049D"));
        assert_eq!(read.safety.as_deref(), Some("fod_stage_changed"));
        assert_eq!(read.text, "FOD stage changed: guard -> hard");
        assert_eq!(event("panic", "{}").level, Level::Critical);
        assert_eq!(event("of another version", "[]").device_id, None);
        for wrong in ["", "[]", "{}", r#"{"name":3}"#, r#"{"name":""}"#] {
            assert_eq!(Event::decode(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn brake_and_risk_last_until_their_end_is_told() {
        let mut alarms = Alarms::default();
        let now = Instant::now();
        let much_later = now + Duration::from_secs(1000);
        assert_eq!(alarms.readiness(now), Readiness::Ready);
        for (on, off, off_level) in [
            ("ebrake_triggered", "ebrake_released", Level::Note),
            ("fod_stage_changed", "fod_stage_changed", Level::Note),
        ] {
            alarms.safety(on, Level::Warning, now);
            assert!(matches!(
                alarms.readiness(much_later),
                Readiness::Tripped(_)
            ));
            assert!(alarms.waits_for_an_event());
            alarms.safety(off, off_level, much_later);
            assert_eq!(alarms.readiness(much_later), Readiness::Ready, "{off}");
        }
    }

    #[test]
    fn alarms_without_an_end_pass_after_a_second() {
        for kind in ["stall_detected", "stability_ceiling", "of another version"] {
            let mut alarms = Alarms::default();
            let now = Instant::now();
            alarms.safety(kind, Level::Warning, now);
            let trips = |after_s: f64| {
                let at = now + Duration::from_secs_f64(after_s);
                matches!(alarms.readiness(at), Readiness::Tripped(_))
            };
            assert!(trips(0.0) && trips(0.9) && !trips(1.1), "{kind}");
            assert!(!alarms.waits_for_an_event());
        }
    }
}

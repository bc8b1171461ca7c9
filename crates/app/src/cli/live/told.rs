//! What a live session tells at its end.

use std::path::Path;

use device::SafetyEvents;
use serde_json::{Value, json};

use super::super::json_text;
use super::ready::Ready;
use crate::report::plot::short;
use crate::session::SnapPeak;
use crate::session::live::LiveReport;
use crate::session::log::Logged;

/// A session that is over.
pub(in crate::cli) struct Told<'a> {
    pub(in crate::cli) ready: &'a Ready,
    pub(in crate::cli) devices: String,
    pub(in crate::cli) report: &'a LiveReport,
    pub(in crate::cli) logged: Option<&'a Logged>,
    pub(in crate::cli) recording: Option<&'a Path>,
}

impl Told<'_> {
    /// For the terminal.
    pub(in crate::cli) fn text(&self) -> String {
        let (snap, servo) = (&self.report.snap, &self.report.servo);
        let us = |s: f64| 1e6 * s;
        let coupling = &self.ready.scene.coupling;
        let pulled = match snap.peak_retention {
            0.0 => "nothing held it".to_owned(),
            force => format!(
                "{force:.3} N at {:.3} mm; came off {}",
                1e3 * snap.travel_at_retention,
                times(snap.n_snaps_out, &snap.snap_out)
            ),
        };
        let mut text = format!(
            "{}\n  device                {}\n  coupling              {} N/m, {} N m/rad, in series with the contact\n  \
             going in              {:.3} N at {:.3} mm of travel at most; snapped in {}\n  \
             pulling out           {}\n  \
             on the hand           {:.3} N at most{}\n  \
             friction              {}\n  \
             loop                  {} periods of {} ms, {} missed ({} in a row at most), {} skipped\n  \
             response              median {:.1} us, 99 % below {:.1} us, longest {:.1} us; woken late by {:.1}, {:.1}, {:.1} us\n",
            self.ready.scene.title,
            self.devices,
            short(coupling.translational_stiffness),
            short(coupling.rotational_stiffness),
            snap.peak_force,
            1e3 * snap.travel_at_peak,
            times(snap.n_snaps_in, &snap.snap_in),
            pulled,
            self.report.largest_rendered,
            self.force_words(),
            self.friction()
                .map_or("none is simulated".to_owned(), |mu| format!(
                    "coefficient {}",
                    short(mu)
                )),
            servo.periods,
            short(1e3 * self.ready.spec.session.period_s),
            servo.missed_deadlines,
            servo.longest_miss_run,
            servo.skipped,
            us(servo.response.p50_s),
            us(servo.response.p99_s),
            us(servo.response.max_s),
            us(servo.wake_delay.p50_s),
            us(servo.wake_delay.p99_s),
            us(servo.wake_delay.max_s),
        );
        text += &format!("  guard                 {}\n", guard_words(&servo.safety));
        if let Some(second) = &self.report.second {
            let words = guard_words(&second.safety);
            text += &format!("  of the second device  {words}\n");
        }
        if let (Some(path), Some(logged)) = (self.recording, self.logged) {
            text += &format!(
                "  recording             {} ({} steps{})\n",
                path.display(),
                logged.n_steps,
                match self.report.n_unlogged {
                    0 => String::new(),
                    n => format!("; {n} more that the disk was too slow for"),
                }
            );
        }
        text
    }

    /// When the force was on.
    fn force_words(&self) -> String {
        let force = &self.report.force;
        match force.since_s {
            None => format!("; it was never on ({})", force.arming),
            Some(since_s) => format!(", on since {since_s:.2} s"),
        }
    }

    /// Coulomb's coefficient, where friction is simulated.
    fn friction(&self) -> Option<f64> {
        let effects = &self.ready.scene.effects;
        effects
            .simulated_friction()
            .map(|mu| mu.kinetic_coefficient)
    }

    /// What makes the numbers doubtful.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let force = &self.report.force;
        if force.n_unarmed_contacts > 0 {
            warnings.push(format!(
                "warning: in {} periods of contact the force was not on yet: begin out of contact, and wait for \"force on\"",
                force.n_unarmed_contacts
            ));
        }
        if let Some(two) = &self.report.two_rates {
            /// Of the peak, by how much problems that take each other's place may differ.
            const SHARE: f64 = 0.1;
            let (_, largest) = two.differences();
            if largest > SHARE * self.report.snap.peak_force {
                warnings.push(format!(
                    "warning: the engine was up to {} periods behind, and its results differ by up to {largest:.2} N from what \
                     was felt meanwhile: forces are not better than that; a faster machine, fewer contacts \
                     (accuracy.max_contacts) or a lower --rate help",
                    two.log.max_staleness
                ));
            }
        }
        warnings
    }

    /// For programs.
    pub(in crate::cli) fn json(&self) -> String {
        let (snap, servo) = (&self.report.snap, &self.report.servo);
        let times =
            |t: &device::TimeSummary| json!({"p50": t.p50_s, "p99": t.p99_s, "max": t.max_s});
        json_text(&json!({
            "title": self.ready.scene.title,
            "scene": self.ready.scene.path,
            "device": self.devices,
            "coupling_N_per_m": self.ready.scene.coupling.translational_stiffness,
            "coupling_Nm_per_rad": self.ready.scene.coupling.rotational_stiffness,
            "coupling_why": self.ready.coupling,
            "peak_insertion_force_N": snap.peak_force,
            "travel_at_peak_m": snap.travel_at_peak,
            "peak_retention_force_N": snap.peak_retention,
            "travel_at_retention_m": snap.travel_at_retention,
            "largest_force_on_hand_N": self.report.largest_rendered,
            "force_on_since_s": self.report.force.since_s,
            "periods_in_contact_without_force": self.report.force.n_unarmed_contacts,
            "snap_in_force_N": snap.snap_in.force,
            "snap_in_travel_m": snap.snap_in.travel,
            "snap_out_force_N": snap.snap_out.force,
            "snap_out_travel_m": snap.snap_out.travel,
            "friction_coefficient": self.friction(),
            "snaps_in": snap.n_snaps_in,
            "snaps_out": snap.n_snaps_out,
            "period_s": self.ready.spec.session.period_s,
            "periods": servo.periods,
            "missed": servo.missed_deadlines,
            "longest_miss_run": servo.longest_miss_run,
            "skipped": servo.skipped,
            "wake_delay_s": times(&servo.wake_delay),
            "compute_s": times(&servo.compute),
            "response_s": times(&servo.response),
            "guard": guard_json(&servo.safety),
            "second_guard": self.report.second.as_ref().map(|s| guard_json(&s.safety)),
            "second_failures": self.report.second.as_ref().map(|s| s.failures),
            "recording": self.recording,
            "recorded_steps": self.logged.map(|l| l.n_steps),
            "unrecorded_steps": self.report.n_unlogged,
        }))
    }
}

/// How often, and how the last time.
fn times(n: u32, last: &SnapPeak) -> String {
    let how = format!("{:.3} N at {:.3} mm", last.force, 1e3 * last.travel);
    match n {
        0 => "never".to_owned(),
        1 => format!("once, past {how}"),
        n => format!("{n} times, the last past {how}"),
    }
}

/// What the guard did, without what it did not.
fn guard_words(events: &SafetyEvents) -> String {
    let seen: Vec<String> = guard(events)
        .iter()
        .filter(|(_, n)| *n > 0)
        .map(|(what, n)| format!("{what} {n}"))
        .collect();
    if seen.is_empty() {
        "nothing to do".to_owned()
    } else {
        seen.join(", ")
    }
}

fn guard_json(events: &SafetyEvents) -> Value {
    let all = guard(events).into_iter();
    let named = all.map(|(what, n)| (what.replace(": ", "_").replace(' ', "_"), json!(n)));
    Value::Object(named.collect())
}

/// What the guard did for the first time and the user should know at once: samples that cannot be, and forces that were
/// cut. `told`: what has been said.
pub(in crate::cli) fn news(
    events: &SafetyEvents,
    told: &mut Vec<&'static str>,
) -> impl Iterator<Item = String> {
    let is_news = |what: &str| {
        what.starts_with("cut") || what.starts_with("samples") || what.contains("not finite")
    };
    let new: Vec<&'static str> = guard(events)
        .into_iter()
        .filter(|(what, n)| *n > 0 && is_news(what) && !told.contains(what))
        .map(|(what, _)| what)
        .collect();
    told.extend(&new);
    new.into_iter()
        .map(|what| format!("guard: {what} (said once; how often is told at the end)"))
}

/// What the guard counts, in words.
fn guard(events: &SafetyEvents) -> Vec<(&'static str, u64)> {
    vec![
        ("samples missing", events.samples_missing),
        ("samples not finite", events.samples_non_finite),
        ("samples not unit", events.samples_non_unit),
        ("samples too fast", events.samples_too_fast),
        ("samples back in time", events.samples_back_in_time),
        ("wrenches not finite", events.wrenches_non_finite),
        ("wrenches shortened", events.wrenches_clamped),
        ("wrenches slowed", events.wrenches_rate_limited),
        ("stalls", events.stalls),
        ("damped for passivity", events.passivity_damped),
        ("shortened for passivity", events.energy_limited),
        ("shortened for heat", events.heat_limited),
        ("weakened for age", events.answers_stale),
        ("stiffness shortened", events.stiffness_limited),
        ("cut: device not ready", events.trips_not_ready),
        ("cut: no hand", events.trips_hand_absent),
        ("cut: samples lost", events.trips_samples_lost),
        ("cut: handle too fast", events.trips_too_fast),
        ("cut: loop stood still", events.trips_stalled),
    ]
}

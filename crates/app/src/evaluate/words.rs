//! Settings, checks, troubles and notes of a run, in words.

use contact::friction::Coefficients;

use super::Story;
use crate::effects::Verdict;
use crate::prepare::PreparedCompliance;
use crate::prepare::budget::bytes;
use crate::report::part_curve::Place;
use crate::report::{PartCurve, coefficient_in_words};
use crate::scene::{EffectChoice, Guide, ToolShape};
use crate::session::{Record, Recording};

impl Story<'_> {
    /// What did not go as it should, in words.
    pub(super) fn troubles(&self) -> Vec<String> {
        let mut all = of_steps(&self.driven.recording, "places of the part's own curve");
        if let Some(felt) = &self.felt {
            all.extend(of_steps(felt.recording, "steps"));
            all.extend(of_session(felt.recording));
            all.extend(felt.shape.choice().warning());
            all.extend(felt.shape.given_up().map(str::to_owned));
        }
        all
    }

    /// Where the way of the drive ended early.
    pub(super) fn stopped(&self) -> Option<String> {
        let at = self.driven.stopped_at?;
        Some(format!(
            "the way ended at {:.4} of {} mm: there the tool met nodes that are held in the direction of the push, and \
             neither gives way",
            1e3 * at,
            1e3 * self.scene.drive.travel,
        ))
    }

    pub(super) fn settings(&self) -> Vec<(String, String)> {
        let scene = self.scene;
        let (drive, material) = (&scene.drive, &scene.part.material);
        let shape = match &scene.tool.shape {
            ToolShape::Sphere { radius } => format!("sphere, radius {} mm", 1e3 * radius),
            ToolShape::Cylinder {
                radius,
                half_length: None,
            } => {
                format!("cylinder without end, radius {} mm", 1e3 * radius)
            }
            ToolShape::Cylinder {
                radius,
                half_length: Some(h),
            } => {
                format!(
                    "cylinder, radius {} mm, length {} mm",
                    1e3 * radius,
                    2e3 * h
                )
            }
            ToolShape::Box { half_extents: h } => {
                format!("box {} x {} x {} mm", 2e3 * h.x, 2e3 * h.y, 2e3 * h.z)
            }
            ToolShape::Capsule {
                radius,
                half_length,
            } => {
                format!(
                    "capsule, radius {} mm, length {} mm",
                    1e3 * radius,
                    2e3 * half_length
                )
            }
            ToolShape::HalfSpace => "half-space".to_owned(),
            ToolShape::Mesh { file, field, .. } => {
                let field = field.map(|f| format!(", distances within {:e} m", f.error));
                format!("{}{}", file.display(), field.unwrap_or_default())
            }
        };
        let pair = |label: &str, value: String| (label.to_owned(), value);
        let mut settings = vec![
            pair("mesh", scene.part.mesh.display().to_string()),
            pair(
                "material",
                format!(
                    "{}E {}, Poisson's ratio {}{}",
                    material
                        .name
                        .as_ref()
                        .map(|n| format!("{n}, "))
                        .unwrap_or_default(),
                    scene.pressure_words(material.young_modulus),
                    material.poisson_ratio,
                    material
                        .source
                        .as_ref()
                        .map(|source| format!(" ({source})"))
                        .unwrap_or_default(),
                ),
            ),
            pair(
                "quadrature",
                format!("{:?}", scene.part.quadrature).to_lowercase(),
            ),
            pair("tool", shape),
            pair("held and moved", self.held_words()),
            pair(
                "drive",
                format!(
                    "{} mm in steps of {:.4} mm, finer where the force bends, {}{}",
                    1e3 * drive.travel,
                    1e3 * drive.step,
                    match drive.guide {
                        Guide::Axis => "along its direction only",
                        Guide::Free =>
                            "free across its direction and to turn, on the coupling's springs",
                    },
                    if drive.retract { ", and out again" } else { "" },
                ),
            ),
        ];
        settings.extend(self.hand_settings());
        settings.extend([
            pair("accuracy", scene.accuracy.words()),
            pair("elements", self.order_words()),
            pair("compliance", self.compliance_words()),
        ]);
        if let Some(felt) = &self.felt {
            settings.push(pair("rates", felt.recording.rates.words()));
            settings.push(pair("multiply", felt.shape.choice().words_in_full()));
        }
        settings
    }

    /// Of the elements.
    fn order_words(&self) -> String {
        let loaded = &self.prepared.loaded;
        match &loaded.interior {
            None => format!("order {}", loaded.mesh.order),
            Some(interior) => format!(
                "order {}, solved with order {} inside ({} nodes)",
                loaded.mesh.order,
                interior.mesh.order,
                interior.mesh.n_nodes()
            ),
        }
    }

    /// Which body, and where it is held in its own frame.
    fn held_words(&self) -> String {
        let (held, scene) = (&self.driven.held, self.scene);
        let (unit, scale) = scene.length_unit();
        let grip = (held.grip / scale)
            .to_array()
            .map(|x| format!("{:.4}", x + 0.0));
        let why = match scene.grip {
            Some(_) => "as holds.grip says",
            None => "the centre of its bounding box",
        };
        format!(
            "{}, at ({}) {unit} of its file, {why}",
            format!("{:?}", scene.handle).to_lowercase(),
            grip.join(", "),
        )
    }

    /// What there is of a hand.
    fn hand_settings(&self) -> Vec<(String, String)> {
        let (Some(hand), scene) = (&self.scene.hand, self.scene) else {
            return Vec::new();
        };
        let pair = |label: &str, value: String| (label.to_owned(), value);
        vec![
            pair(
                "hand",
                format!(
                    "{} mm at {} mm/s, {} on {} and {}",
                    1e3 * hand.travel,
                    1e3 * hand.speed,
                    scene.mass_words(hand.mass),
                    scene.stiffness_words(hand.stiffness),
                    scene.damping_words(hand.damping)
                ),
            ),
            pair(
                "virtual coupling",
                format!(
                    "{}, {}",
                    scene.stiffness_words(scene.coupling.translational_stiffness),
                    scene.rotational_stiffness_words(scene.coupling.rotational_stiffness)
                ),
            ),
            pair(
                "device",
                format!(
                    "simulated Virtuose 6D, {} ms period, {}",
                    1e3 * scene.device.servo_period,
                    if scene.device.real_time {
                        "in real time"
                    } else {
                        "as fast as possible"
                    }
                ),
            ),
        ]
    }

    fn compliance_words(&self) -> String {
        let kept = bytes(self.prepared.compliance.bytes());
        let scalar = match self.prepared.loaded.spec.contact_scalar {
            gpu::Scalar::F64 => "64",
            gpu::Scalar::F32 => "32",
        };
        match &self.prepared.compliance {
            PreparedCompliance::All(_) => format!("{kept}, the step reads {scalar} bits"),
            PreparedCompliance::Near(demand) => format!(
                "{kept} with the factor, {scalar} bits, {} of {} columns fetched",
                demand.part().n_columns(),
                demand.part().n_compliant()
            ),
        }
    }

    pub(super) fn checks(&self) -> Vec<(String, String)> {
        let checks = &self.prepared.checks;
        let pair = |label: &str, value: String| (label.to_owned(), value);
        vec![
            pair(
                "compliance, asymmetry over largest entry",
                format!("{:.1e}", checks.symmetry_rel),
            ),
            pair(
                "compliance, residual |K x - e|",
                format!("{:.1e}", checks.residual_rel),
            ),
            pair(
                "compliance, smallest over largest Cholesky pivot",
                format!("{:.1e}", checks.smallest_pivot_rel),
            ),
        ]
    }

    pub(super) fn notes(&self) -> Vec<String> {
        let mut notes = vec![
            "The part's own curve is that of a testing machine: the held body goes along its path rigidly, and contact is \
             solved for in each place from the one before."
                .to_owned(),
            format!(
                "Contact is {} and quasi-static, displacements are linear; strain is recovered at the skin (superconvergent \
                 patch recovery), rotation is the largest at the integration points.",
                match &self.driven.friction {
                    None => "frictionless".to_owned(),
                    Some(of) => format!(
                        "with Coulomb's friction (coefficient {}, exact cone)",
                        coefficient_in_words(of)
                    ),
                }
            ),
        ];
        if self.felt.is_some() {
            notes.push(
                "Travel is that of the held body in the simulation; the handle of the hand is ahead of it by the force \
                 over the stiffness of the virtual coupling, which acts in series with the part."
                    .to_owned(),
            );
        }
        notes.extend(self.picked.clone());
        let felt = self.felt.map(|felt| felt.recording);
        if let Some(two) = felt.and_then(|felt| felt.two_rates.as_ref()) {
            let (median, largest) = two.differences();
            let times = two.step_us();
            notes.push(format!(
                "The force is that of frozen contact problems, solved in every period for the newest pose, with \
                 differences at hand-overs faded in 4 to 20 ms: {} hand-overs, {median:.1e} N apart by the median and \
                 {largest:.1e} N at most, up to {} periods old. Whole steps with contact took {:.0} us by the median, \
                 {:.0} us at most. In {} periods a bound on all motion could not rule out that a node without a plane \
                 had touched. Pictures show the part under the forces of these problems.",
                two.log.hand_overs.len(),
                two.log.max_staleness,
                times.map_or(0.0, |t| t.p50),
                times.map_or(0.0, |t| t.max),
                two.log.beyond_margin,
            ));
        }
        notes
    }
}

/// An effect that the scene calls for and that is left out, in a sentence with its number.
pub(super) fn called_for(verdict: &Verdict, choice: EffectChoice) -> Option<String> {
    let number = verdict
        .number
        .map(|n| format!(" ({n:.2} beyond {:.2})", verdict.threshold));
    let leaves_out = match choice {
        EffectChoice::Off if verdict.effect.is_simulated() => "[effects] leaves out",
        _ => "this version does not simulate",
    };
    verdict.missing.then(|| {
        format!(
            "this scene calls for {}, which {leaves_out}{}: {}",
            verdict.effect.name().replace('_', " "),
            number.unwrap_or_default(),
            verdict.why
        )
    })
}

/// Friction that is in the curve: what it changed, beside what was expected.
pub(super) fn friction_in(
    expected: Verdict,
    coefficients: &Coefficients,
    curve: &PartCurve,
    plain: &PartCurve,
) -> Verdict {
    let change = |name: &str, with: Option<Place>, without: Option<Place>| {
        let (with, without) = (with?.force_n, without?.force_n);
        let percent = 100.0 * (with / without - 1.0);
        (without > 0.0).then(|| format!(" {name} {with:.3} N for {without:.3} N ({percent:+.0} %)"))
    };
    let parts = [
        change("in", curve.insertion(), plain.insertion()),
        change("out", curve.removal.peak(), plain.removal.peak()),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    let estimate = expected.number.map_or_else(String::new, |share| {
        format!("; {:+.0} % in was expected of the ramp", 100.0 * share)
    });
    Verdict {
        on: true,
        missing: false,
        why: format!(
            "simulated with a coefficient of {}:{}{estimate}",
            coefficient_in_words(coefficients),
            parts.join(",")
        ),
        ..expected
    }
}

/// Counts of what went wrong, in words, where it did.
fn counted<'w>(all: impl IntoIterator<Item = (u64, &'w str)>, of: &str) -> Vec<String> {
    let some = all.into_iter().filter(|(n, _)| *n > 0);
    some.map(|(n, what)| format!("{n} {of}{what}")).collect()
}

/// Troubles of single steps. `of`: what they are called.
fn of_steps(recording: &Recording, of: &str) -> Vec<String> {
    let records = &recording.records;
    let count = |test: &dyn Fn(&Record) -> bool| records.iter().filter(|r| test(r)).count() as u64;
    let all = [
        (
            count(&|r| !r.report.converged),
            " whose contact planes did not come to a stand",
        ),
        (
            count(&|r| r.report.without_column > 0),
            " in which a node near the tool could not be touched, because its column was not fetched yet or there is no \
             memory for more",
        ),
        (
            count(&|r| !r.report.lcp_solved),
            " whose contact problem was not solved to its tolerance",
        ),
        (
            count(&|r| r.report.dropped > 0),
            " with eight times more near nodes than accuracy.max_contacts, or nodes without a distance",
        ),
        (
            count(&|r| r.report.merged_badly),
            " with near nodes beyond accuracy.max_contacts whose shared rows may be wrong by more than \
             accuracy.merge_tolerance",
        ),
    ];
    counted(all, of)
}

/// Troubles of loop and device.
fn of_session(recording: &Recording) -> Vec<String> {
    let safety = &recording.servo.safety;
    let faded = recording.two_rates.as_ref().map_or(0, |two| two.log.faded);
    let all = [
        (
            faded,
            "periods in which the wrench was faded because the engine's result was too old",
        ),
        (
            safety.samples_rejected(),
            "poses of the device were refused",
        ),
        (
            safety.wrenches_clamped,
            "wrenches were cut to the device's limits",
        ),
        (
            safety.wrenches_rate_limited,
            "wrenches were slowed to the device's largest rate",
        ),
        (
            recording.device.thermally_limited,
            "wrenches were cut to what the device bears for long",
        ),
    ];
    counted(all, "")
}

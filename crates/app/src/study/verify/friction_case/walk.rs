//! The tool on its way through the listed poses, one step of the engine for each increment.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use glamx::DPose3;

use crate::engine::{ActiveContact, ContactPart, Engine, StepReport};
use crate::study::verify::Failure;
use crate::study::verify::case::Case;
use crate::study::verify::contact_case::{Touchable, engine_of, pose, stride, touches_at_rest};

/// rad, between the direction that a pose lists and the one that turns lead to. Only turns count; a direction that says
/// otherwise is a slip, one of six digits is not.
const SAME_DIRECTION: f64 = 1e-5;

/// What is there at a listed pose.
#[derive(Clone, Debug, Default)]
pub(super) struct Listed {
    /// N, on the tool.
    pub(super) force: DVec3,
    /// N m, on the tool about its reference point.
    pub(super) torque: DVec3,
    /// J, by friction since the last listed pose.
    pub(super) dissipated: f64,
    /// J.
    pub(super) elastic_energy: f64,
    /// J, of the hand since the start: trapezoid over increments.
    pub(super) work: f64,
    pub(super) sticking: u32,
    pub(super) slipping: u32,
    pub(super) active: Vec<ActiveContact>,
}

/// The whole way.
#[derive(Debug)]
pub(super) struct Walk {
    pub(super) listed: Vec<Listed>,
    /// The first increment that came to no end, in words.
    pub(super) unsettled: Option<String>,
    /// The first listed pose at which other forces obey the law as well, in words.
    pub(super) other: Option<String>,
}

impl Walk {
    /// Whether every increment came to its end.
    pub(super) fn is_settled(&self) -> bool {
        self.unsettled.is_none()
    }
}

/// Where the tool goes between two listed poses.
struct Leg {
    from: DVec3,
    to: DVec3,
    /// rad, rotation vector.
    turn: DVec3,
}

/// Walks through all poses of the case. `friction`: `None` for none.
pub(super) fn walk(
    case: &Case,
    ready: &Touchable,
    part: &Arc<ContactPart>,
    substeps: u32,
    friction: Option<f64>,
) -> Result<Walk, Failure> {
    let legs = legs(case)?;
    let mut at = match case.poses.first() {
        Some(first) => pose(first)?,
        None => DPose3::IDENTITY,
    };
    if touches_at_rest(ready, &at) {
        return Err(Failure::Error(
            "case.toml: [[pose]] number 1 overlaps the part; the path starts where the tool is clear of it".into(),
        ));
    }
    let near = 2.0 * stride(ready);
    let mut walker = engine_of(part, &ready.tool, case.iterations, near, friction)?;
    walker.step(&at);
    let mut walk = Walk {
        listed: vec![Listed::default()],
        unsettled: None,
        other: None,
    };
    for leg in legs {
        let mut listed = Listed {
            dissipated: 0.0,
            ..walk.listed.last().cloned().unwrap_or_default()
        };
        for k in 1..=substeps {
            if crate::interrupt::is_requested() {
                return Err(Failure::Error("interrupted".into()));
            }
            let before = at;
            at = leg.after(k, substeps, &before);
            let report = walker.step(&at);
            listed.add(
                &report,
                at.translation - before.translation,
                leg.turn / f64::from(substeps),
            );
            if walk.unsettled.is_none() {
                walk.unsettled = unsettled(&report, walk.listed.len() + 1, k, substeps);
            }
        }
        listed.look_at(&walker);
        if walk.other.is_none() {
            walk.other = other_answer(&walker, listed.force, walk.listed.len() + 1);
        }
        walk.listed.push(listed);
    }
    Ok(walk)
}

/// From pose to pose; a direction that is listed must be the one that the turns lead to.
fn legs(case: &Case) -> Result<Vec<Leg>, Failure> {
    let mut legs = Vec::new();
    let Some(first) = case.poses.first() else {
        return Ok(legs);
    };
    let mut rotation = pose(first)?.rotation;
    for (k, pair) in case.poses.windows(2).enumerate() {
        let turn = DVec3::from_array(pair[1].turn.unwrap_or_default());
        rotation = turned(rotation, turn);
        if pair[1].axis_direction.is_some() {
            let listed = pose(&pair[1])?.rotation * DVec3::Z;
            let off = (rotation * DVec3::Z).angle_between(listed);
            if off > SAME_DIRECTION {
                return Err(Failure::Error(format!(
                    "case.toml: [[pose]] number {}: its direction is {off:.1e} rad from the one that the turns up to it lead \
                     to; give the `turn` of the step, or the direction after it",
                    k + 2
                )));
            }
        }
        legs.push(Leg {
            from: DVec3::from_array(pair[0].axis_point),
            to: DVec3::from_array(pair[1].axis_point),
            turn,
        });
    }
    Ok(legs)
}

impl Leg {
    /// Where increment `k` of `n` ends, which began at `before`.
    fn after(&self, k: u32, n: u32, before: &DPose3) -> DPose3 {
        DPose3 {
            // The last one ends at the listed point to the bit.
            translation: if k == n {
                self.to
            } else {
                self.from.lerp(self.to, f64::from(k) / f64::from(n))
            },
            rotation: turned(before.rotation, self.turn / f64::from(n)),
        }
    }
}

fn turned(rotation: DQuat, turn: DVec3) -> DQuat {
    if turn == DVec3::ZERO {
        rotation
    } else {
        (DQuat::from_scaled_axis(turn) * rotation).normalize()
    }
}

impl Listed {
    /// One increment more, over which the tool went this way and turned so.
    fn add(&mut self, report: &StepReport, way: DVec3, turn: DVec3) {
        let [fx, fy, fz, tx, ty, tz] = report.contact_wrench_on_tool;
        let (force, torque) = (DVec3::new(fx, fy, fz), DVec3::new(tx, ty, tz));
        self.work -= 0.5 * ((self.force + force).dot(way) + (self.torque + torque).dot(turn));
        (self.force, self.torque) = (force, torque);
        self.dissipated += report.dissipated;
        self.sticking = report.sticking;
        self.slipping = report.contacts - report.sticking.min(report.contacts);
    }

    /// What the last increment left in the part.
    fn look_at(&mut self, walker: &Engine) {
        self.active = walker.active_contacts().to_vec();
        let work = |c: &ActiveContact| {
            c.force_on_part
                .dot(walker.displacement(c.candidate as usize))
        };
        self.elastic_energy = 0.5 * self.active.iter().map(work).sum::<f64>();
    }

    /// N.
    pub(super) fn normal_force_sum(&self) -> f64 {
        self.active.iter().map(|c| c.normal_force).sum()
    }
}

/// Other forces than `own` (N, on the tool), in words.
fn other_answer(walker: &Engine, own: DVec3, pose: usize) -> Option<String> {
    let other = own + walker.other_answer()?;
    Some(format!(
        "from pose {pose} on, other forces obey the law of friction as well: on the tool {:.4?} N here, {:.4?} N there",
        own.to_array(),
        other.to_array()
    ))
}

/// Why the answer of an increment is not one, in words.
fn unsettled(report: &StepReport, pose: usize, k: u32, substeps: u32) -> Option<String> {
    if report.converged && report.lcp_solved && !report.rejected && report.dropped == 0 {
        return None;
    }
    Some(format!(
        "on the way to pose {pose}, increment {k} of {substeps}: {} within {} passes (certificate {:.1e})",
        if report.rejected {
            "the pose is none"
        } else if report.dropped > 0 {
            "contacts were left out"
        } else if report.lcp_solved {
            "the contact planes did not come to a stand"
        } else {
            "no forces were found that obey the law of friction"
        },
        report.passes,
        report.certificate
    ))
}

//! A setting with two rates, driven along the path: what the loop renders, and how long its ticks take.

use std::time::Instant;

use device::Wrench;

use super::penetration;
use super::{Course, Measured, Ready, Rounds, Setting, Stop, Times, contact_edges, displaced};
use crate::engine::{Stage, StepReport};
use crate::session::fast::FastSettings;
use crate::session::part_extent;
use crate::session::slow::Stepped;
use crate::{Error, interrupt};

/// As for whole steps, but that the step is a tick, hand-overs included. The drawn shape is that of the engine's last
/// step, at other moments than those of the reference: it is not compared.
pub(super) fn measure(
    ready: &mut Ready,
    setting: &Setting,
    course: &Course,
    every: u64,
    timed_s: f64,
) -> Result<Measured, Error> {
    let Ready {
        prepared,
        engine,
        shape,
    } = ready;
    let way = course.way(setting.increment);
    let settings = FastSettings {
        period_s: setting.scene.device.servo_period,
        force_resolution: device::Limits::virtuose_6d().force_resolution,
        lever: part_extent(&prepared.loaded.mesh),
        n_ticks: way.len(),
    };
    let edges = contact_edges(prepared);
    let moments = course.moments();
    let mut found = Measured::nothing_yet(prepared, course.n_places());
    let mut drawn = Vec::new();
    let mut rounds = Rounds::new(way.len(), timed_s);
    // The first round is for what is computed; it also warms up, and takes nothing from the time of the others.
    let mut is_timed = false;
    while !is_timed || rounds.begins_another() {
        if interrupt::is_requested() {
            return Err(Error::Interrupted);
        }
        engine.reset();
        let mut stepped = Stepped::new(engine, &way[0].target, every, settings)?;
        for (k, Stop { target, place }) in way.iter().enumerate() {
            let begun = Instant::now();
            let answer = stepped.tick(k as u64, target, on_tool);
            let tick = begun.elapsed();
            if stepped.work(engine, k as u64, target).is_some() {
                let begun = Instant::now();
                shape.update(engine.active_contacts())?;
                drawn.push(begun.elapsed().as_nanos() as u64);
            }
            if is_timed {
                rounds.spent_s += tick.as_secs_f64();
                if answer.report.contacts > 0 {
                    rounds.has_contact(k, tick.as_nanos() as u64);
                }
                continue;
            }
            let report = &answer.report;
            found.contacts = found.contacts.max(report.contacts);
            found.not_converged += usize::from(!report.converged);
            found.certificate = found.certificate.max(report.certificate);
            let Some(place) = place else {
                continue;
            };
            let contacts = stepped.fast().active_contacts();
            let part = engine.part();
            let displacement = |i: usize| part.displacement(i, contacts);
            let of_part = contacts.iter().map(|c| {
                let u = displacement(c.candidate as usize);
                0.5 * c.force_on_part.dot(u)
            });
            let of_guide = engine.energy_of_guide(&report.contact_wrench_on_tool);
            let energy = of_guide + of_part.sum::<f64>();
            found.potential.push(energy);
            found.wrench.push(answer.wrench_on_handle.to_array());
            if moments.contains(place) {
                let places = displaced(part.rest_positions(), displacement);
                let deepest = penetration(engine.tool(), &places, &report.tool_pose, &edges);
                found.penetration = found.penetration.max(deepest);
            }
        }
        is_timed = true;
    }
    found.n_timed = rounds.all().count();
    found.step = Times::of_ns(rounds.all());
    found.shape = Times::of_ns(drawn.into_iter());
    found.repeats = rounds.repeats();
    // A tick has no stages of its own.
    found.stages[Stage::Lcp as usize] = found.step;
    Ok(found)
}

fn on_tool(report: &StepReport) -> Wrench {
    Wrench::from_array(&report.contact_wrench_on_tool)
}

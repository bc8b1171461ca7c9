//! A tool that touched nothing.

use glam::DVec3;

use super::units::short;
use super::warning;
use crate::engine::Engine;
use crate::prepare::PreparedPart;
use crate::report::Warning;
use crate::scene::Scene;
use crate::session::Recording;

/// Moments at which distances are taken.
const MOMENTS: usize = 60;

/// The nearest approach of a run without contact.
struct Nearest {
    distance: f64,
    travel: f64,
    node: u32,
}

/// No step had contact.
pub(super) fn nothing_touched(
    scene: &Scene,
    prepared: &PreparedPart,
    engine: &Engine,
    recording: &Recording,
) -> Option<Warning> {
    let records = &recording.records;
    if records.iter().any(|r| r.report.contacts > 0) {
        return None;
    }
    let loaded = &prepared.loaded;
    let of_contact = [loaded.candidates.as_slice(), &loaded.held].concat();
    let of_rest: Vec<u32> = loaded
        .rows
        .iter()
        .copied()
        .filter(|node| {
            let is_in = |nodes: &[u32]| nodes.binary_search(node).is_ok();
            !is_in(&loaded.candidates) && !is_in(&loaded.held)
        })
        .collect();
    let contact = nearest(&of_contact, prepared, engine, recording)?;
    let place = |node: u32| {
        let x = 1e3 * DVec3::from_array(loaded.mesh.nodes[node as usize]);
        format!(
            "node {} at ({}, {}, {}) mm",
            loaded.mesh.node_tags[node as usize],
            short(x.x),
            short(x.y),
            short(x.z)
        )
    };
    let names: Vec<&str> = scene.part.contact.iter().map(|g| g.name.as_str()).collect();
    let mut text = format!(
        "nothing touched: the nearest that the tool came to the nodes of {} is {} mm, at {} mm of travel, to {}",
        names.join(", "),
        short(1e3 * contact.distance),
        short(1e3 * contact.travel),
        place(contact.node),
    );
    match nearest(&of_rest, prepared, engine, recording).filter(|rest| rest.distance < 0.0) {
        Some(rest) => {
            text += &format!(
                "; it went {} mm into faces that are not in part.contact ({}): name their group there",
                short(-1e3 * rest.distance),
                place(rest.node),
            );
        }
        None => text += "; check tool.position, direction, travel and the units",
    }
    Some(warning("no-contact", contact.distance, text))
}

fn nearest(
    nodes: &[u32],
    prepared: &PreparedPart,
    engine: &Engine,
    recording: &Recording,
) -> Option<Nearest> {
    let records = &recording.records;
    let step = records.len().div_ceil(MOMENTS).max(1);
    let moments = records.iter().step_by(step).chain(records.last());
    moments
        .flat_map(|record| {
            let pose = record.report.tool_pose;
            nodes.iter().map(move |&node| {
                let x = DVec3::from_array(prepared.loaded.mesh.nodes[node as usize]);
                Nearest {
                    distance: engine.tool().signed_distance(&pose, x).signed_distance,
                    travel: record.travel,
                    node,
                }
            })
        })
        .filter(|found| found.distance.is_finite())
        .min_by(|a, b| a.distance.total_cmp(&b.distance))
}

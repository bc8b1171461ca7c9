//! The formulas' numbers beside the computed ones.

use crate::drive::Driven;
use crate::report::{Handbook, HandbookRow};
use crate::scene::Scene;
use crate::scene::handbook::Measured;
use crate::session::{Record, Recording};

/// What `[handbook]` says, if the scene has one. Its formulas are without friction, and so is the curve that they stand
/// beside, unless they say otherwise. `strain`: the largest principal one.
pub(super) fn beside(scene: &Scene, ways: &Driven, strain: f64) -> Option<Handbook> {
    let friction = ways.friction.map_or(0.0, |of| of.kinetic_coefficient);
    let handbook = scene.handbook.as_ref()?;
    let prediction = handbook.predict(&scene.part.material, friction);
    let driven = &ways.plain().recording;
    let records = &driven.records;
    let largest = |of: &dyn Fn(&Record) -> f64| records.iter().map(of).fold(0.0, f64::max);
    let is_way_out = |r: &Record| r.phase == device::Phase::Retract;
    let pulls_out = records.iter().any(is_way_out);
    let insertion = |of: &Recording| {
        let way_in = of.records.iter().filter(|r| !is_way_out(r));
        Some(way_in.map(|r| of.resistance(r)).fold(0.0, f64::max))
    };
    let measured = |what| match what {
        Measured::Insertion => insertion(driven),
        Measured::InsertionWithFriction => insertion(&ways.recording),
        // Resistance to the way out pulls along the way in.
        Measured::Removal => pulls_out.then(|| {
            largest(&|r| match is_way_out(r) {
                true => -driven.resistance(r),
                false => 0.0,
            })
        }),
        Measured::Across => Some(largest(&|r| {
            let on_body = r.wrench_on_handle.force;
            on_body.reject_from(driven.direction).length()
        })),
        Measured::Strain => Some(strain),
    };
    let compared = prediction.rows.iter().filter_map(|row| {
        Some(HandbookRow {
            label: row.label.to_owned(),
            handbook: in_units(row.what, row.value),
            computed: in_units(row.what, measured(row.what)?),
            unit: match row.what {
                Measured::Strain => "%".to_owned(),
                _ => "N".to_owned(),
            },
        })
    });
    let touch = records.iter().find(|r| r.report.contacts > 0);
    let touch = touch.map_or(0.0, |r| r.travel);
    Some(Handbook {
        name: prediction.name.clone(),
        rows: compared.collect(),
        curve: prediction
            .curve
            .iter()
            .map(|(travel, force)| (travel + touch, *force))
            .collect(),
    })
}

/// Strains are told in percent.
fn in_units(what: Measured, value: f64) -> f64 {
    match what {
        Measured::Strain => 100.0 * value,
        _ => value,
    }
}

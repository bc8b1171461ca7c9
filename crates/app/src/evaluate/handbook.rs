//! The formulas' numbers beside the computed ones.

use glam::DVec3;

use crate::report::{Handbook, HandbookRow, Phase, StepRow};
use crate::scene::Scene;
use crate::scene::handbook::Measured;

/// What `[handbook]` says, if the scene has one. `direction`: of the insertion, of unit length;
/// `strain`: the largest principal one.
pub(super) fn beside(
    scene: &Scene,
    rows: &[StepRow],
    direction: DVec3,
    strain: f64,
) -> Option<Handbook> {
    let prediction = scene.handbook.as_ref()?.predict(&scene.part.material);
    let largest = |of: &dyn Fn(&StepRow) -> f64| rows.iter().map(of).fold(0.0, f64::max);
    let pulls_out = rows.iter().any(|r| r.phase == Phase::Retract);
    let measured = |what| match what {
        Measured::Insertion => Some(largest(&|r| r.force_n)),
        // Resistance to the way out pulls along the way in.
        Measured::Removal => pulls_out.then(|| {
            largest(&|r| match r.phase {
                Phase::Retract => -r.force_n,
                _ => 0.0,
            })
        }),
        Measured::Across => Some(largest(&|r| {
            r.force_on_handle.reject_from(direction).length()
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
    let touch = rows.iter().find(|r| r.contacts > 0);
    let touch = touch.map_or(0.0, |r| r.travel_m);
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

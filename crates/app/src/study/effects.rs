//! What the physical effects of a scene change and cost: each run with it and without, timed in turns.

use std::fmt::Write as _;
use std::time::Instant;

use contact::tool::Tool;
use serde::Serialize;

use crate::drive::{self, Driven, Seen};
use crate::effects::{Effect, Motion, Observed, Verdict};
use crate::engine::Engine;
use crate::fields::FieldSolver;
use crate::prepare::PreparedPart;
use crate::report::part_curve::{PartCurve, Place};
use crate::report::plot::{self, Look, Series};
use crate::scene::{EffectChoice, Scene};
use crate::{Error, interrupt, setup};

/// Places of the way in which the part's rotation is looked at.
const ROTATIONS: usize = 20;

/// Rounds of the way in which both engines are timed; the shortest time of a place counts.
const ROUNDS: usize = 5;

/// A number without the effect and with it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Without.
    pub off: f64,
    /// With it.
    pub on: f64,
}

/// One effect of a scene.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Its key in `[effects]`.
    pub effect: &'static str,
    /// Size that was estimated without simulating it.
    pub number: Option<f64>,
    /// From which it is called for.
    pub threshold: f64,
    /// `on`, `off`, or `missing` where it is called for and not simulated.
    pub decision: &'static str,
    /// In words.
    pub why: String,
    /// N, peak of the way in.
    pub insertion: Option<Change>,
    /// N, peak of the way out.
    pub retention: Option<Change>,
    /// µs, median over the places with contact of the shortest of some rounds, both engines in turns.
    pub step_us: Option<Change>,
    /// Bytes reserved for it.
    pub memory: Option<usize>,
}

/// All effects of a scene.
#[derive(Clone, Debug, Serialize)]
pub struct EffectStudy {
    /// One for each effect.
    pub rows: Vec<Row>,
    #[serde(skip)]
    plain: Points,
    #[serde(skip)]
    rubbing: Option<Points>,
}

/// Travel (m) and force (N) along a way.
type Points = Vec<(f64, f64)>;

/// Looks at every effect; friction is simulated wherever there is a coefficient, whatever it changes.
///
/// # Errors
/// As driving and preparing; Ctrl-C.
pub fn run(
    scene: &Scene,
    prepared: &PreparedPart,
    tool: &Tool,
    progress: &dyn fem::Progress,
) -> Result<EffectStudy, Error> {
    let has_friction = scene.effects.friction_coefficients().is_some();
    let forced = scene.with_friction(has_friction);
    let (engine, driven) = drive::of_scene(&forced, prepared, tool.clone(), progress)?;
    let plain = driven.plain();
    let observed = observed(scene, prepared, plain, engine.tool(), progress)?;
    let mut rows: Vec<Row> = Effect::ALL
        .iter()
        .map(|effect| row(scene, &effect.judge(&observed)))
        .collect();
    if has_friction && let Some(row) = rows.first_mut() {
        let (with, without) = (PartCurve::of(&driven.rows()), PartCurve::of(&plain.rows()));
        row.insertion = change(without.insertion(), with.insertion());
        row.retention = change(without.removal.peak(), with.removal.peak());
        let mut off = setup::drive_engine(
            &scene.with_friction(false),
            prepared,
            tool.clone(),
            scene.accuracy.max_contacts,
        )?;
        let mut on =
            setup::drive_engine(&forced, prepared, tool.clone(), scene.accuracy.max_contacts)?;
        row.memory = Some(on.friction_bytes());
        row.step_us = timed(&mut off, &mut on, &driven)?;
    }
    Ok(EffectStudy {
        rows,
        plain: points(plain),
        rubbing: driven.frictionless.is_some().then(|| points(&driven)),
    })
}

fn points(driven: &Driven) -> Points {
    let rows = driven.rows();
    rows.iter().map(|row| (row.travel_m, row.force_n)).collect()
}

fn change(off: Option<Place>, on: Option<Place>) -> Option<Change> {
    let (off, on) = (off?.force_n, on?.force_n);
    Some(Change { off, on })
}

fn row(scene: &Scene, verdict: &Verdict) -> Row {
    let choice = verdict.effect.choice(&scene.effects);
    let is_on = verdict.effect.is_simulated()
        && scene.effects.friction_coefficients().is_some()
        && (choice == EffectChoice::On || (choice == EffectChoice::Auto && verdict.missing));
    Row {
        effect: verdict.effect.name(),
        number: verdict.number,
        threshold: verdict.threshold,
        decision: match (is_on, verdict.missing) {
            (true, _) => "on",
            (false, true) => "missing",
            (false, false) => "off",
        },
        why: verdict.why.clone(),
        insertion: None,
        retention: None,
        step_us: None,
        memory: None,
    }
}

/// What the way without friction shows, and what the hand would do by its numbers.
fn observed(
    scene: &Scene,
    prepared: &PreparedPart,
    plain: &Driven,
    tool: &Tool,
    progress: &dyn fem::Progress,
) -> Result<Observed, Error> {
    let solver = FieldSolver::new(prepared, progress)?;
    let records = &plain.recording.records;
    let each = (records.len() / ROTATIONS).max(1);
    let looked_at = records
        .iter()
        .filter(|r| r.report.contacts > 0)
        .step_by(each);
    let rotations = looked_at.map(|record| {
        let u = solver.displacement(&plain.recording, record);
        solver.extremes(&u).max_rotation
    });
    let max_rotation = rotations.fold(0.0, f64::max);
    let Seen {
        ramp,
        release,
        has_passed,
    } = Seen::of(plain);
    let feature =
        crate::evaluate::shortest_edge(&prepared.loaded.mesh).min(tool.characteristic_size());
    let motion_per_feature = scene.hand.as_ref().map_or(Motion::None, |hand| {
        Motion::BySpeed(hand.speed * scene.device.servo_period / feature)
    });
    Ok(Observed {
        max_rotation,
        ramp,
        release,
        has_passed,
        friction_coefficient: scene.effects.largest_friction(),
        motion_per_feature,
    })
}

/// Both engines along the same way, in turns at each place.
fn timed(off: &mut Engine, on: &mut Engine, driven: &Driven) -> Result<Option<Change>, Error> {
    let records = &driven.recording.records;
    let targets: Vec<_> = records
        .iter()
        .map(|r| driven.held.target(&r.handle_pose))
        .collect();
    let mut shortest = vec![[u64::MAX; 2]; targets.len()];
    let mut touches = vec![false; targets.len()];
    for _ in 0..ROUNDS {
        off.reset();
        on.reset();
        for (k, target) in targets.iter().enumerate() {
            for (engine, least) in [&mut *off, &mut *on].into_iter().zip(&mut shortest[k]) {
                let begun = Instant::now();
                let report = engine.step(target);
                *least = (*least).min(begun.elapsed().as_nanos() as u64);
                touches[k] |= report.contacts > 0;
            }
        }
        if interrupt::is_requested() {
            return Err(Error::Interrupted);
        }
    }
    let median = |which: usize| {
        let touching = shortest
            .iter()
            .zip(&touches)
            .filter(|(_, touches)| **touches);
        let mut times: Vec<u64> = touching.map(|(ns, _)| ns[which]).collect();
        times.sort_unstable();
        times.get(times.len() / 2).map(|ns| 1e-3 * *ns as f64)
    };
    Ok(median(0).zip(median(1)).map(|(off, on)| Change { off, on }))
}

impl EffectStudy {
    /// For the terminal.
    pub fn table(&self) -> String {
        let mut text = format!(
            "{:<22}{:>10}{:>11}  {:<9}{:>20}{:>20}{:>20}{:>12}\n",
            "effect", "number", "threshold", "decision", "in (N)", "out (N)", "step (us)", "memory"
        );
        let change = |change: Option<Change>| {
            change.map_or_else(String::new, |c| {
                format!("{} -> {}", plot::short(c.off), plot::short(c.on))
            })
        };
        for row in &self.rows {
            let memory = row
                .memory
                .map_or_else(String::new, |b| crate::prepare::budget::bytes(b as f64));
            let number = row.number.map_or_else(String::new, plot::short);
            let _ = writeln!(
                text,
                "{:<22}{number:>10}{:>11}  {:<9}{:>20}{:>20}{:>20}{memory:>12}",
                row.effect.replace('_', " "),
                plot::short(row.threshold),
                row.decision,
                change(row.insertion),
                change(row.retention),
                change(row.step_us),
            );
        }
        for row in &self.rows {
            let _ = writeln!(text, "  {}: {}", row.effect.replace('_', " "), row.why);
        }
        text
    }

    /// `effects.csv`: SI, but for times.
    pub fn csv(&self) -> String {
        let mut text = "effect,number,threshold,decision,insertion_off_N,insertion_on_N,retention_off_N,retention_on_N,\
                        step_off_us,step_on_us,memory_bytes\n"
            .to_owned();
        let cell = |value: Option<f64>| value.map_or_else(String::new, |v| format!("{v}"));
        for row in &self.rows {
            let pair =
                |c: Option<Change>| format!("{},{}", cell(c.map(|c| c.off)), cell(c.map(|c| c.on)));
            let memory = row.memory.map_or_else(String::new, |b| b.to_string());
            let _ = writeln!(
                text,
                "{},{},{},{},{},{},{},{memory}",
                row.effect,
                cell(row.number),
                row.threshold,
                row.decision,
                pair(row.insertion),
                pair(row.retention),
                pair(row.step_us),
            );
        }
        text
    }

    /// Force over travel with friction and without.
    ///
    /// # Errors
    /// What the plot library says.
    pub fn plot(&self) -> Result<String, Error> {
        let series = |name: &str, points: &Points, look| Series {
            name: name.to_owned(),
            points: points.clone(),
            look,
        };
        let mut all = vec![match &self.rubbing {
            Some(rubbing) => series("with friction", rubbing, Look::In),
            None => series("in and out", &self.plain, Look::In),
        }];
        if self.rubbing.is_some() {
            all.push(series("without friction", &self.plain, Look::Frictionless));
        }
        plot::force_travel(&all, None, plot::Format::Wide)
            .map_err(|e| Error::Input(format!("the plot of the effects: {e}")))
    }
}

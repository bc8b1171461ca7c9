//! The part's own curve: the held body goes along its path rigidly, in steps of travel, as in a testing machine.
//!
//! No hand, no device, no time. Each place is solved from the one before, so that the branch of the way is followed.
//! Where the force bends, steps are halved and the whole way is gone again, because the state at a place is that of the
//! way there. In, a rest, and out again if asked for.

mod friction;
mod others;

use std::sync::Arc;
use std::time::Instant;

use contact::friction::Coefficients;
use contact::tool::Tool;
use device::Phase;
use glam::DVec3;
use glamx::DPose3;

use crate::engine::{Engine, StepReport};
use crate::follow::{Follower, Reach};
use crate::prepare::{Demand, PreparedCompliance, PreparedPart};
use crate::report::{self, DriveRow};
use crate::scene::{EffectChoice, Scene};
use crate::session::rates::ChosenRates;
use crate::session::{Entry, Held, Record, Recording, part_extent, refuse_overlap};
use crate::{Error, interrupt, setup};
pub(crate) use friction::Seen;
pub use others::OtherAnswer;

/// Of the largest force, how far a force may be from the line between its neighbours: a peak is then known better.
const BEND: f64 = 2e-3;

/// Rounds in which steps are halved: a step becomes a sixty-fourth where it bends most.
const HALVINGS: u32 = 6;

/// Places of one way at most. A force that bends everywhere, such as one that steps from node to node, stays as coarse as
/// that makes it.
const MOST_PLACES: usize = 6000;

/// Of the part's size, a depth in what cannot give way that is rounding.
const TOUCH: f64 = 1e-9;

/// Rows of a contact problem at least.
const ROWS: usize = 1500;

/// Places between two looks at the interrupt.
const PER_LOOK: usize = 32;

/// The way of the held body.
#[derive(Clone, Copy, Debug)]
pub struct DriveSpec {
    /// The body that is driven.
    pub held: Held,
    /// Unit vector, world.
    pub direction: DVec3,
    /// m, > 0.
    pub travel: f64,
    /// m, > 0.
    pub step: f64,
    /// Whether it comes out again.
    pub retract: bool,
}

/// A driven way.
#[derive(Debug)]
pub struct Driven {
    /// One record for each place: in, one at rest, out. Its times are 0.
    pub recording: Recording,
    /// The body that was driven.
    pub held: Held,
    /// m, where the way ended because neither tool nor part could give way further on.
    pub stopped_at: Option<f64>,
    /// How often the way was gone.
    pub n_rounds: u32,
    /// Coulomb's coefficients, where friction is in it.
    pub friction: Option<Coefficients>,
    /// Where friction is so large that the way may be another from there on.
    pub other: Option<OtherAnswer>,
    /// By record: what part and springs hold, J.
    pub stored: Vec<f64>,
    /// The same way without friction, where friction is in this one.
    pub frictionless: Option<Box<Driven>>,
}

impl Driven {
    /// The way without friction: itself, where there is none.
    pub fn plain(&self) -> &Self {
        self.frictionless.as_deref().unwrap_or(self)
    }

    /// Places of the way as a report is given them.
    pub fn rows(&self) -> Vec<DriveRow> {
        let recording = &self.recording;
        let row = |(r, stored): (&Record, &f64)| DriveRow {
            phase: match r.phase {
                Phase::Approach => report::Phase::Approach,
                Phase::Retract => report::Phase::Retract,
                Phase::Hold | Phase::Done => report::Phase::Hold,
            },
            travel_m: r.travel,
            force_n: recording.resistance(r) + 0.0,
            sideways_m: r.sideways,
            turn_rad: r.turn,
            contacts: r.report.contacts,
            sticking: r.report.sticking,
            dissipated_j: r.report.dissipated,
            stored_j: *stored,
            is_converged: r.report.converged && r.report.lcp_solved && r.report.dropped == 0,
            certificate: r.report.certificate,
        };
        recording
            .records
            .iter()
            .zip(&self.stored)
            .map(row)
            .collect()
    }
}

/// Drives a scene's held body; with the engine as it is at the end. With a coefficient of friction first without it, to see
/// what friction would change; then with it, where that is much or the scene asks for it.
///
/// # Errors
/// A tool that overlaps the part at the start; an engine that refuses its settings; Ctrl-C.
pub fn of_scene(
    scene: &Scene,
    prepared: &PreparedPart,
    tool: Tool,
    progress: &dyn fem::Progress,
) -> Result<(Engine, Driven), Error> {
    let plain = scene.with_friction(false);
    let (engine, frictionless) = of_resolved(&plain, prepared, tool.clone(), progress)?;
    if !friction::is_called_for(&scene.effects, &frictionless) {
        return Ok((engine, frictionless));
    }
    let (engine, driven) = of_resolved(&scene.with_friction(true), prepared, tool, progress)?;
    let driven = Driven {
        frictionless: Some(Box::new(frictionless)),
        ..driven
    };
    Ok((engine, driven))
}

/// Whether a scene is driven with friction, where it says so itself; `None` where its way without friction decides.
pub(crate) fn states_friction(scene: &Scene) -> Option<bool> {
    if scene.effects.simulated_friction().is_some() {
        return Some(true);
    }
    let is_off = scene.effects.friction == EffectChoice::Off;
    let has_none = scene
        .with_friction(true)
        .effects
        .simulated_friction()
        .is_none();
    (is_off || has_none).then_some(false)
}

/// Whether [`of_scene`] drives a scene with friction in the end.
///
/// # Errors
/// As [`of_scene`].
pub(crate) fn calls_for_friction(
    scene: &Scene,
    prepared: &PreparedPart,
    tool: Tool,
    progress: &dyn fem::Progress,
) -> Result<bool, Error> {
    if let Some(stated) = states_friction(scene) {
        return Ok(stated);
    }
    let (_, frictionless) = of_resolved(&scene.with_friction(false), prepared, tool, progress)?;
    Ok(friction::is_called_for(&scene.effects, &frictionless))
}

/// As [`of_scene`] with friction on or off and not left open.
fn of_resolved(
    scene: &Scene,
    prepared: &PreparedPart,
    tool: Tool,
    progress: &dyn fem::Progress,
) -> Result<(Engine, Driven), Error> {
    let held = setup::held(scene, prepared, &tool);
    let mesh = &prepared.loaded.mesh;
    refuse_overlap(&setup::clearance(scene), mesh, &tool, &held.tool_pose)?;
    // There is no period to keep: nodes need not share rows.
    let rows = scene.accuracy.max_contacts.max(ROWS);
    let mut engine = setup::drive_engine(scene, prepared, tool, rows)?;
    let driven = run(&setup::drive(scene, held), prepared, &mut engine, progress)?;
    let friction = scene.effects.simulated_friction();
    Ok((engine, Driven { friction, ..driven }))
}

/// Goes the way in and out.
///
/// # Errors
/// Ctrl-C.
pub fn run(
    spec: &DriveSpec,
    prepared: &PreparedPart,
    engine: &mut Engine,
    progress: &dyn fem::Progress,
) -> Result<Driven, Error> {
    let tolerance = TOUCH * part_extent(&prepared.loaded.mesh) + engine.tool().error_bound();
    let mut way = Way::even(spec);
    let finest = spec.step * 0.5f64.powi(HALVINGS as i32);
    let columns = Columns::of(prepared, engine);
    let mut drive = Drive {
        spec,
        engine,
        columns,
        tolerance,
        progress,
    };
    let mut n_rounds = 0;
    loop {
        n_rounds += 1;
        let gone = drive.once(&way)?;
        // A node that came near before its column was there is felt in the next round.
        let is_whole = (gone.recording.records.iter()).all(|r| r.report.without_column == 0);
        let is_finer = n_rounds <= HALVINGS && way.halve_bends(&gone, finest);
        if !is_finer && (is_whole || n_rounds > HALVINGS) {
            return Ok(Driven {
                other: drive.other_answer(&gone)?,
                recording: gone.recording,
                held: spec.held,
                stopped_at: gone.stopped_at,
                n_rounds,
                friction: None,
                stored: gone.stored,
                frictionless: None,
            });
        }
    }
}

/// Travels of the places, m.
struct Way {
    /// Ascending, from 0.
    inwards: Vec<f64>,
    /// Descending, to 0; empty without a way out.
    outwards: Vec<f64>,
}

impl Way {
    fn even(spec: &DriveSpec) -> Self {
        let n = (spec.travel / spec.step - 1e-9).ceil().max(1.0) as usize;
        let inwards: Vec<f64> = (0..=n)
            .map(|k| (k as f64 * spec.step).min(spec.travel))
            .collect();
        let outwards = inwards.iter().rev().copied();
        Self {
            outwards: if spec.retract {
                outwards.collect()
            } else {
                Vec::new()
            },
            inwards,
        }
    }

    /// Halves the steps where the force bends, or where the way was stopped, down to the finest. Whether any was.
    fn halve_bends(&mut self, gone: &Gone, finest: f64) -> bool {
        let records = &gone.recording.records;
        let force = |i: usize| gone.recording.resistance(&records[i]);
        let largest = (0..records.len()).map(|i| force(i).abs());
        let tolerance = BEND * largest.fold(0.0, f64::max);
        let points = |phase: Phase| -> Vec<(f64, f64)> {
            let of_phase = (0..records.len()).filter(|&i| records[i].phase == phase);
            of_phase.map(|i| (gone.asked[i], force(i))).collect()
        };
        let (inwards, outwards) = (points(Phase::Approach), points(Phase::Retract));
        let mut is_finer = refine(&mut self.inwards, &bends(&inwards, tolerance), finest);
        is_finer |= refine(&mut self.outwards, &bends(&outwards, tolerance), finest);
        if let Some(stop) = gone.stopped_at {
            is_finer |= refine(&mut self.inwards, &[(stop, gone.met_at)], finest);
        }
        is_finer
    }
}

/// Intervals of travel beside the places at which the force is off the line between its neighbours.
fn bends(points: &[(f64, f64)], tolerance: f64) -> Vec<(f64, f64)> {
    let bent = points.windows(3).filter(|w| {
        let [(x0, f0), (x1, f1), (x2, f2)] = [w[0], w[1], w[2]];
        let share = (x1 - x0) / (x2 - x0);
        let straight = f0 + share * (f2 - f0);
        (f1 - straight).abs() > tolerance
    });
    bent.flat_map(|w| [(w[0].0, w[1].0), (w[1].0, w[2].0)])
        .collect()
}

/// Puts a place amid each of the given steps of a way that is longer than twice the finest. Whether there was one.
fn refine(way: &mut Vec<f64>, steps: &[(f64, f64)], finest: f64) -> bool {
    if way.len() > MOST_PLACES {
        return false;
    }
    let is_inwards = way.first() < way.last();
    let before = way.len();
    for &(a, b) in steps {
        if (b - a).abs() > 1.5 * finest {
            way.push(0.5 * (a + b));
        }
    }
    way.sort_unstable_by(f64::total_cmp);
    way.dedup();
    if !is_inwards {
        way.reverse();
    }
    way.len() > before
}

/// A way that was gone once.
struct Gone {
    recording: Recording,
    /// By record: the travel that was asked for, m.
    asked: Vec<f64>,
    /// By record, J.
    stored: Vec<f64>,
    stopped_at: Option<f64>,
    /// m, place at which it could not be.
    met_at: f64,
    /// By record: whether friction is large enough for other answers.
    doubtful: Vec<bool>,
}

struct Drive<'a> {
    spec: &'a DriveSpec,
    engine: &'a mut Engine,
    columns: Option<Columns>,
    tolerance: f64,
    progress: &'a dyn fem::Progress,
}

impl Drive<'_> {
    fn once(&mut self, way: &Way) -> Result<Gone, Error> {
        self.engine.reset();
        let n = way.inwards.len() + way.outwards.len() + 1;
        let mut gone = Gone {
            recording: Recording::with_room(self.spec.direction, (n, 64), ChosenRates::driven()),
            asked: Vec::with_capacity(n),
            stored: Vec::with_capacity(n),
            stopped_at: None,
            met_at: 0.0,
            doubtful: Vec::with_capacity(n),
        };
        let mut reached = 0.0;
        for (k, &travel) in way.inwards.iter().enumerate() {
            self.look(k, n)?;
            let report = self.place(travel, Phase::Approach, &mut gone);
            if report.rigid_depth > self.tolerance {
                // A machine stands here. What was solved with the tool in what cannot give way is no place of its way.
                gone.drop_last();
                gone.stopped_at = Some(reached);
                gone.met_at = travel;
                break;
            }
            reached = travel;
        }
        self.place(reached, Phase::Hold, &mut gone);
        let out = way.outwards.iter().filter(|travel| **travel <= reached);
        for (k, &travel) in out.enumerate() {
            self.look(way.inwards.len() + k, n)?;
            self.place(travel, Phase::Retract, &mut gone);
        }
        Ok(gone)
    }

    fn look(&self, done: usize, total: usize) -> Result<(), Error> {
        if done.is_multiple_of(PER_LOOK) {
            self.progress.advance("drive", done, total);
            if interrupt::is_requested() || self.progress.is_cancelled() {
                return Err(Error::Interrupted);
            }
        }
        Ok(())
    }

    /// Solves for one place and records it.
    fn place(&mut self, travel: f64, phase: Phase, gone: &mut Gone) -> StepReport {
        let held = &self.spec.held;
        let handle = held.along(travel * self.spec.direction);
        let target = held.target(&handle);
        if let Some(columns) = &mut self.columns {
            columns.fetch_around(self.engine, target);
        }
        let begun = Instant::now();
        let report = self.engine.step(&target);
        let entry = Entry {
            time_s: 0.0,
            phase,
            handle_pose: handle,
            wrench_on_handle: held.wrench_on_handle(&handle, &report),
            step_ns: begun.elapsed().as_nanos() as u64,
        };
        let contacts = self.engine.active_contacts();
        gone.recording.push(&entry, held, &report, contacts);
        gone.asked.push(travel);
        gone.stored.push(stored(self.engine, &report));
        gone.doubtful.push(self.engine.may_have_other_answers());
        report
    }
}

/// J, in the part, which answers linearly, and in the springs of a guide.
fn stored(engine: &Engine, report: &StepReport) -> f64 {
    let contacts = engine.active_contacts().iter();
    let of_part = contacts.map(|c| {
        let displacement = engine.displacement(c.candidate as usize);
        0.5 * c.force_on_part.dot(displacement)
    });
    of_part.sum::<f64>() + engine.energy_of_guide(&report.contact_wrench_on_tool)
}

impl Gone {
    fn drop_last(&mut self) {
        // The first place stays, so that there is always one.
        if self.asked.len() > 1 {
            self.asked.pop();
            self.stored.pop();
            self.doubtful.pop();
            self.recording.records.pop();
        }
    }
}

/// Where columns of the compliance come one by one: those around the tool, before each place.
struct Columns {
    demand: Arc<Demand>,
    follower: Follower,
    drawn: Vec<f64>,
}

impl Columns {
    fn of(prepared: &PreparedPart, engine: &Engine) -> Option<Self> {
        match &prepared.compliance {
            PreparedCompliance::All(_) => None,
            PreparedCompliance::Near(demand) => Some(Self {
                demand: Arc::clone(demand),
                follower: Follower::new(demand, Reach::of(engine), false),
                drawn: vec![0.0; 3 * prepared.loaded.rows.len()],
            }),
        }
    }

    fn fetch_around(&mut self, engine: &Engine, tool_at: DPose3) {
        self.demand
            .draw_into(engine.active_contacts(), &mut self.drawn);
        self.follower.look(tool_at, &self.drawn);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_halved_beside_a_bend_and_nowhere_else() {
        let mut way: Vec<f64> = (0..=10).map(f64::from).collect();
        let force = |x: f64| if x < 5.0 { x } else { 10.0 - x };
        for halved in 1..=3 {
            let points: Vec<(f64, f64)> = way.iter().map(|&x| (x, force(x))).collect();
            assert!(refine(&mut way, &bends(&points, 1e-3), 0.1));
            assert_eq!(way.len(), 11 + 2 * halved);
            assert!(way.is_sorted());
        }
        let mut straight = vec![3.0, 2.0, 1.0, 0.0];
        assert!(!refine(
            &mut straight,
            &bends(&[(0.0, 1.0), (1.0, 2.0), (2.0, 3.0)], 1e-3),
            0.1
        ));
        assert!(refine(&mut straight, &[(2.0, 3.0)], 0.1));
        assert_eq!(straight, [3.0, 2.5, 2.0, 1.0, 0.0]);
        assert!(!refine(&mut straight, &[(2.0, 2.1)], 0.1));
    }
}

//! One setting, driven along the scene's path: what it computes and how long it takes.

mod samples;
mod two_rates;

use std::time::Instant;

use contact::tool::Tool;
use fem::Hierarchy;
use glam::DVec3;
use glamx::DPose3;
use serde::{Deserialize, Serialize};

use super::busy::Repeats;
use super::course::{Course, Stop};
use super::point::Setting;
use crate::engine::{Engine, N_STAGES, Stage};
use crate::prepare::{PrepareOptions, PreparedPart, prepare};
use crate::progress::Ui;
use crate::report::summary::Percentiles;
use crate::scene::Rates;
use crate::shape::Shape;
use crate::{Error, interrupt, setup};
pub(super) use samples::Samples;

/// Least time of timed steps with contact, s, and most rounds.
const TIMED_S: f64 = 0.6;
const MOST_ROUNDS: usize = 20;

/// The same steps are timed this often whatever it takes, and this often unless that takes [`MOST_TIME`] of the time that
/// is given.
const FEWEST_ROUNDS: usize = 2;
const REPEATED_ROUNDS: usize = 4;
const MOST_TIME: f64 = 10.0;

/// Percentiles of a time, µs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// Median.
    pub p50: f64,
    /// 99 % are below.
    pub p99: f64,
    /// 99.9 % are below.
    pub p999: f64,
    /// Longest.
    pub max: f64,
}

impl Times {
    /// `None`: nothing was timed.
    fn of_ns(ns: impl Iterator<Item = u64>) -> Option<Self> {
        Percentiles::of_ns(ns).map(|p| Self {
            p50: p.p50,
            p99: p.p99,
            p999: p.p999,
            max: p.max,
        })
    }
}

/// Times (ns) of the same steps in several rounds.
#[derive(Debug)]
struct Rounds {
    /// By step.
    of_step: Vec<Vec<u64>>,
    spent_s: f64,
    timed_s: f64,
    n_rounds: usize,
}

impl Rounds {
    fn new(n_steps: usize, timed_s: f64) -> Self {
        Self {
            of_step: vec![Vec::new(); n_steps],
            spent_s: 0.0,
            timed_s,
            n_rounds: 0,
        }
    }

    /// Whether another round is to be made. Each step is timed several times whatever the time that is given, so that no
    /// setting stays without times and other work on the machine is seen.
    fn begins_another(&mut self) -> bool {
        let is_enough = match self.n_rounds {
            n if n < FEWEST_ROUNDS => false,
            n if n < REPEATED_ROUNDS => self.spent_s > MOST_TIME * self.timed_s,
            n => n >= MOST_ROUNDS || self.spent_s > self.timed_s,
        };
        self.n_rounds += usize::from(!is_enough);
        !is_enough
    }

    fn has_contact(&mut self, step: usize, ns: u64) {
        self.of_step[step].push(ns);
    }

    fn all(&self) -> impl Iterator<Item = u64> {
        self.of_step.iter().flatten().copied()
    }

    fn repeats(self) -> Option<Repeats> {
        Repeats::of(self.of_step.into_iter())
    }
}

/// What a setting gives and takes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Nodes of the mesh.
    pub nodes: usize,
    /// Elements.
    pub elements: usize,
    /// Order of the elements.
    pub order: u8,
    /// Bytes of what the step and the drawn shape read.
    pub bytes: f64,
    /// s, of preparing, the cache aside.
    pub prepare_s: f64,
    /// Steps with contact that were timed.
    pub n_timed: usize,
    /// Whole step; `None` if no step with contact was timed.
    pub step: Option<Times>,
    /// Drawn shape; `None` if it was not timed.
    pub shape: Option<Times>,
    /// By stage, in the order of [`Stage::ALL`]; `None` for those that were not timed.
    pub stages: Vec<Option<Times>>,
    /// How alike repeated steps were; `None` if none was repeated.
    pub repeats: Option<Repeats>,
    /// Interface nodes that were free at most, where some are not.
    pub free_nodes: usize,
    /// Contacts at most.
    pub contacts: u32,
    /// Steps whose planes did not come to a stand.
    pub not_converged: usize,
    /// Largest natural residual.
    pub certificate: f64,
    /// m, deepest that a node was inside the tool.
    pub penetration: f64,
    /// On the tool about the point at which it is held, by place: force (N) and torque (N m).
    pub wrench: Vec<[f64; 6]>,
    /// J, strain energy and that of a free guide's springs, by place.
    pub potential: Vec<f64>,
    /// m, drawn displacement at the samples by moment; empty if the mesh does not have them.
    pub displacement: Vec<f64>,
}

impl Measured {
    fn nothing_yet(prepared: &PreparedPart, n_places: usize) -> Self {
        Self {
            nodes: prepared.loaded.mesh.n_nodes(),
            elements: prepared.loaded.mesh.n_elements(),
            order: prepared.loaded.mesh.order as u8,
            bytes: prepared.bytes(),
            prepare_s: prepared.total_seconds(),
            n_timed: 0,
            step: None,
            shape: None,
            stages: vec![None; N_STAGES],
            repeats: None,
            free_nodes: 0,
            contacts: 0,
            not_converged: 0,
            certificate: 0.0,
            penetration: 0.0,
            wrench: Vec::with_capacity(n_places),
            potential: Vec::with_capacity(n_places),
            displacement: Vec::new(),
        }
    }
}

/// A part that is prepared, with what is driven.
pub(super) struct Ready {
    pub(super) prepared: PreparedPart,
    engine: Engine,
    shape: Shape,
}

/// Prepares a setting.
///
/// # Errors
/// As preparing and the engine; the study tells them beside the other settings.
pub(super) fn ready(
    setting: &Setting,
    options: &PrepareOptions,
    ui: &Ui<'_>,
) -> Result<Ready, Error> {
    let mut spec = setup::part_spec(&setting.scene)?;
    spec.refinements = setting.refinements;
    let prepared = prepare(&spec, options, ui)?;
    let (tool, _) = setup::tool(&setting.scene)?;
    let rows = setting.scene.accuracy.max_contacts;
    let engine = setup::drive_engine(&setting.scene, &prepared, tool, rows)?;
    let shape = Shape::new(&prepared, &setting.scene.accuracy, None)?;
    Ok(Ready {
        prepared,
        engine,
        shape,
    })
}

/// Drives a setting along the course: once for its results, then for its times, but for what only serves as a reference.
///
/// # Errors
/// Ctrl-C.
pub(super) fn measure(
    ready: &mut Ready,
    setting: &Setting,
    course: &Course,
    samples: &Samples,
    timed_s: Option<f64>,
) -> Result<Measured, Error> {
    let timed_s = timed_s.unwrap_or(TIMED_S);
    if let Rates::Every(every) = setting.scene.accuracy.rates {
        return two_rates::measure(ready, setting, course, u64::from(every), timed_s);
    }
    let way = course.way(setting.increment);
    // The first round is for what is computed; it also warms up.
    let mut found = computed(ready, &way, course, samples)?;
    if setting.increment.is_compared() {
        time(ready, &way, timed_s, &mut found)?;
    }
    Ok(found)
}

/// What a setting computes.
fn computed(
    ready: &mut Ready,
    way: &[Stop],
    course: &Course,
    samples: &Samples,
) -> Result<Measured, Error> {
    let Ready {
        prepared,
        engine,
        shape,
    } = ready;
    let rows = samples.in_part(prepared);
    let edges = contact_edges(prepared);
    let moments = course.moments();
    let mut found = Measured::nothing_yet(prepared, course.n_places());
    engine.reset();
    for stop in way {
        let report = engine.step(&stop.target);
        found.contacts = found.contacts.max(report.contacts);
        found.not_converged += usize::from(!report.converged);
        found.certificate = found.certificate.max(report.certificate);
        let Some(place) = stop.place else {
            continue;
        };
        found.wrench.push(report.contact_wrench_on_tool);
        let of_guide = engine.energy_of_guide(&report.contact_wrench_on_tool);
        let contacts = engine.active_contacts().to_vec();
        let of_part: f64 = contacts
            .iter()
            .map(|c| {
                0.5 * c
                    .force_on_part
                    .dot(engine.displacement(c.candidate as usize))
            })
            .sum();
        found.potential.push(of_guide + of_part);
        let u = shape.update(engine.active_contacts())?;
        if moments.contains(&place)
            && let Some(rows) = &rows
        {
            for weights in rows {
                for c in 0..3 {
                    let of_row = |(row, w): &(usize, f64)| w * u[3 * row + c];
                    found.displacement.push(weights.iter().map(of_row).sum());
                }
            }
        }
        let free = shape.n_free().unwrap_or(0);
        found.free_nodes = found.free_nodes.max(free);
        if moments.contains(&place) {
            if interrupt::is_requested() {
                return Err(Error::Interrupted);
            }
            let rest = engine.part().rest_positions().to_vec();
            let displaced = displaced(&rest, |i| engine.displacement(i));
            let deepest = penetration(engine.tool(), &displaced, &report.tool_pose, &edges);
            found.penetration = found.penetration.max(deepest);
        }
    }
    Ok(found)
}

/// How long a setting takes.
fn time(ready: &mut Ready, way: &[Stop], timed_s: f64, found: &mut Measured) -> Result<(), Error> {
    let Ready { engine, shape, .. } = ready;
    let mut of_stage = vec![Vec::new(); N_STAGES];
    let mut drawn = Vec::new();
    let mut rounds = Rounds::new(way.len(), timed_s);
    while rounds.begins_another() {
        if interrupt::is_requested() {
            return Err(Error::Interrupted);
        }
        engine.reset();
        let mut before = found.wrench.iter();
        for (k, stop) in way.iter().enumerate() {
            let begun = Instant::now();
            let report = engine.step(&stop.target);
            let stepped = begun.elapsed();
            shape.update(engine.active_contacts())?;
            let all = begun.elapsed();
            rounds.spent_s += all.as_secs_f64();
            if stop.place.is_some() {
                let wrench = Some(&report.contact_wrench_on_tool);
                debug_assert_eq!(before.next(), wrench, "rounds are alike");
            }
            if report.contacts == 0 {
                continue;
            }
            for (stage, ns) in report.stage_ns.iter().enumerate() {
                of_stage[stage].push(*ns);
            }
            rounds.has_contact(k, stepped.as_nanos() as u64);
            drawn.push((all - stepped).as_nanos() as u64);
        }
    }
    found.n_timed = drawn.len();
    found.stages = Stage::ALL
        .iter()
        .map(|stage| Times::of_ns(of_stage[*stage as usize].iter().copied()))
        .collect();
    found.step = Times::of_ns(rounds.all());
    found.shape = Times::of_ns(drawn.into_iter());
    found.repeats = rounds.repeats();
    Ok(())
}

/// Edges between candidates, as candidates from one vertex to the other.
fn contact_edges(prepared: &PreparedPart) -> Vec<Vec<usize>> {
    let mut candidate_of = vec![None; prepared.loaded.mesh.n_nodes()];
    for (i, node) in prepared.loaded.candidates.iter().enumerate() {
        candidate_of[*node as usize] = Some(i);
    }
    let hierarchy = Hierarchy::of(&prepared.loaded.mesh);
    let of_edge = |edge: &fem::Edge| -> Option<Vec<usize>> {
        let nodes = [edge.vertices[0]]
            .into_iter()
            .chain(edge.nodes.iter().copied())
            .chain([edge.vertices[1]]);
        nodes.map(|node| candidate_of[node as usize]).collect()
    };
    hierarchy.edges().iter().filter_map(of_edge).collect()
}

/// Places of the candidates, m.
fn displaced(rest: &[DVec3], mut displacement: impl FnMut(usize) -> DVec3) -> Vec<DVec3> {
    let places = rest.iter().enumerate();
    places.map(|(i, x)| *x + displacement(i)).collect()
}

/// m, how far the deepest candidate, or point between two on an edge, is inside the tool.
fn penetration(tool: &Tool, displaced: &[DVec3], tool_pose: &DPose3, edges: &[Vec<usize>]) -> f64 {
    let depth = |x: DVec3| -tool.signed_distance(tool_pose, x).signed_distance;
    let at_nodes = displaced.iter().map(|x| depth(*x));
    let between = edges.iter().flat_map(|edge| {
        let places: Vec<DVec3> = edge.iter().map(|i| displaced[*i]).collect();
        [0.25, 0.5, 0.75].map(|t| depth(on_edge(&places, t)))
    });
    at_nodes.chain(between).fold(0.0, f64::max)
}

/// The point at `t` of the curve through equally spaced places (Lagrange's interpolation).
fn on_edge(places: &[DVec3], t: f64) -> DVec3 {
    let n = places.len();
    let node = |k: usize| k as f64 / (n - 1) as f64;
    (0..n)
        .map(|k| {
            let others = (0..n).filter(|j| *j != k);
            let weight: f64 = others
                .map(|j| (t - node(j)) / (node(k) - node(j)))
                .product();
            weight * places[k]
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_of_three_places_is_a_parabola() {
        let places = [0.0, 0.5, 1.0].map(|t| DVec3::new(t, t * t, 1.0));
        let x = on_edge(&places, 0.25);
        assert!((x - DVec3::new(0.25, 0.0625, 1.0)).length() < 1e-15);
    }

    #[test]
    fn times_are_those_of_their_rank() {
        let times = Times::of_ns((1..=1000).map(|k| 1000 * k)).unwrap();
        assert!((times.p50 - 500.0).abs() <= 1.0, "{times:?}");
        assert!((times.p999 - 999.0).abs() <= 1.0, "{times:?}");
        assert_eq!(times.max, 1000.0);
        assert_eq!(Times::of_ns(std::iter::empty()), None);
    }

    /// A slow machine, or a slow setting: the first round alone is beyond the time that is given.
    #[test]
    fn steps_are_timed_and_repeated_however_slow_they_are() {
        let mut rounds = Rounds::new(1, 0.1);
        while rounds.begins_another() {
            rounds.spent_s += 60.0;
            rounds.has_contact(0, 60_000_000_000);
        }
        assert_eq!(rounds.n_rounds, FEWEST_ROUNDS);
        assert_eq!(rounds.repeats().unwrap().rounds, FEWEST_ROUNDS);
        let mut quick = Rounds::new(1, 0.1);
        while quick.begins_another() {
            quick.spent_s += 1e-3;
        }
        assert_eq!(quick.n_rounds, MOST_ROUNDS);
        assert_eq!(quick.repeats(), None, "no step has contact");
    }
}

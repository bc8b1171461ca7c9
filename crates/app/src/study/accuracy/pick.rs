//! `accuracy = { budget_us = ... }`: the most accurate settings whose steps keep a budget here.

use super::busy::Repeats;
use super::compare::{Scales, distance};
use super::course::Course;
use super::law;
use super::measure::{Samples, measure, ready};
use super::point::{Setting, base, set_accuracy, set_order};
use crate::Error;
use crate::prepare::PrepareOptions;
use crate::progress::Ui;
use crate::report::plot::short;
use crate::scene::{Accuracy, ContactIterations, Multiply, MultiplyScalar, Preset, Scene};
use crate::session::part_extent;

/// Errors that differ by less than this are equal but for chance.
const AS_GOOD: f64 = 1.02;

/// s of timed steps for each rung: some ten thousand steps on a small part.
const TIMED_S: f64 = 0.3;

/// A rung of the ladder as measured.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rung {
    /// In words.
    pub name: String,
    /// Half and 99.9 % of the steps are faster, µs; `None` if the path has no contact.
    pub times_us: Option<(f64, f64)>,
    /// Order of the elements.
    pub order: u8,
    /// How alike repeated steps were.
    pub repeats: Option<Repeats>,
    /// Error of the wrench against the top rung.
    pub error: f64,
}

/// What was chosen, and why not the next better one.
#[derive(Clone, Debug, PartialEq)]
pub struct Picked {
    /// Position on the ladder.
    pub rung: usize,
    /// One line for the user.
    pub why: String,
}

/// The scene with its budget made into settings; as it is if it has none. The line says what was
/// picked.
///
/// # Errors
/// A budget that no setting keeps, naming the nearest; as preparing; Ctrl-C.
pub fn resolved(
    scene: Scene,
    options: &PrepareOptions,
    ui: &Ui<'_>,
) -> Result<(Scene, Option<String>), Error> {
    let Some(budget) = scene.accuracy.budget_us else {
        return Ok((scene, None));
    };
    // Steps are those of the scene's run: with friction where it has some.
    let (with_law, _) = law::decided(&scene, options, ui)?;
    let ladder = ladder(&with_law);
    let course = Course::of(&with_law);
    let (mut rungs, mut paths) = (Vec::new(), Vec::new());
    let (mut samples, mut lever) = (None, 1.0);
    let mut kept = Vec::new();
    for (name, setting) in ladder {
        ui.status(&format!("accuracy.budget_us: measuring {name}"));
        let mut ready = match ready(&setting, options, ui) {
            Ok(ready) => ready,
            Err(e) if e.is_interrupt() => return Err(e),
            // An order that this mesh cannot have is no choice; the lowest one tells what is wrong.
            Err(e) if setting.scene.part.order == Some(1) => return Err(e),
            Err(_) => continue,
        };
        lever = part_extent(&ready.prepared.loaded.mesh);
        let samples = samples.get_or_insert_with(|| Samples::of(&ready.prepared));
        let found = measure(&mut ready, &setting, &course, samples, Some(TIMED_S))?;
        rungs.push(Rung {
            name,
            times_us: found.step.map(|t| (t.p50, t.p999)),
            order: found.order,
            repeats: found.repeats,
            error: 0.0,
        });
        paths.push(found.wrench);
        kept.push(setting);
    }
    ui.end_status();
    let scales = Scales::of(&with_law, lever);
    for (rung, path) in rungs.iter_mut().zip(&paths) {
        rung.error = distance(path, &paths[0], &scales);
    }
    let picked = pick(&rungs, budget)
        .map_err(|why| Error::Input(format!("{}: {why}", scene.path.display())))?;
    let mut chosen = kept[picked.rung].scene.clone();
    chosen.effects = scene.effects;
    chosen.accuracy.budget_us = None;
    chosen.accuracy.multiply = scene.accuracy.multiply;
    chosen.accuracy.scalar = MultiplyScalar::Auto;
    Ok((chosen, Some(picked.why)))
}

/// From the most accurate to the fastest.
fn ladder(scene: &Scene) -> Vec<(String, Setting)> {
    let mut rungs = Vec::new();
    for order in [3u8, 2, 1] {
        for times in [None, Some(3), Some(2), Some(1)] {
            let mut setting = base(scene, None);
            setting.scene.accuracy.budget_us = None;
            let preset = if order == 3 {
                Some(Preset::Exact)
            } else {
                None
            };
            set_accuracy(&mut setting.scene, Accuracy::of(preset));
            setting.scene.accuracy.preset = None;
            set_order(&mut setting.scene, order);
            // The budget is that of the step, which the display's multiply is no part of.
            setting.scene.accuracy.multiply = Multiply::Cpu;
            let planes = match times {
                None => "planes converged".to_owned(),
                Some(1) => "1 pass".to_owned(),
                Some(n) => format!("{n} passes"),
            };
            if let Some(n) = times {
                setting.scene.accuracy.contact_iterations = ContactIterations::Times(n);
            }
            rungs.push((format!("order {order}, {planes}"), setting));
        }
    }
    rungs
}

impl Rung {
    /// µs; a path without contact keeps any budget.
    fn p999_us(&self) -> f64 {
        self.times_us.map_or(0.0, |times| times.1)
    }

    /// What its steps take.
    fn words(&self) -> String {
        match self.times_us {
            Some((p50, p999)) => format!(
                "99.9 % of whose steps take less than {} us here and half less than {} us",
                short(p999),
                short(p50)
            ),
            None => "of whose steps none was timed, because the path has no contact".to_owned(),
        }
    }
}

/// The rung with the least error that keeps the budget.
fn pick(rungs: &[Rung], budget_us: f64) -> Result<Picked, String> {
    let keeps = |rung: &Rung| rung.p999_us() <= budget_us;
    let by_error = |a: &&usize, b: &&usize| rungs[**a].error.total_cmp(&rungs[**b].error);
    let all: Vec<usize> = (0..rungs.len()).collect();
    let least = all
        .iter()
        .filter(|k| keeps(&rungs[**k]))
        .map(|k| rungs[*k].error)
        .fold(f64::INFINITY, f64::min);
    // Of those that are as good but for chance, the highest.
    let as_good = |k: &&usize| keeps(&rungs[**k]) && rungs[**k].error <= AS_GOOD * least;
    let Some(&best) = all.iter().find(as_good) else {
        let nearest = rungs
            .iter()
            .min_by(|a, b| a.p999_us().total_cmp(&b.p999_us()));
        return Err(match nearest {
            Some(rung) => format!(
                "no setting keeps accuracy.budget_us = {budget_us}: the nearest is {}, {}; allow {} or more{}",
                rung.name,
                rung.words(),
                (1.2 * rung.p999_us()).ceil(),
                busy(rungs),
            ),
            None => "no setting could be measured".to_owned(),
        });
    };
    let rung = &rungs[best];
    let better = all
        .iter()
        .filter(|k| !keeps(&rungs[**k]) && rungs[**k].error < rung.error)
        .max_by(by_error);
    let next = better.map_or(String::new(), |k| {
        let (name, p999) = (&rungs[*k].name, short(rungs[*k].p999_us()));
        format!("; {name}, the next more accurate, needs {p999} us")
    });
    let apart = match best {
        0 => "the most accurate of all".to_owned(),
        _ => format!("{} % from {}", short(100.0 * rung.error), rungs[0].name),
    };
    Ok(Picked {
        rung: best,
        why: format!(
            "accuracy.budget_us = {budget_us}: picked {}, {}, {apart}{next}{}{}",
            rung.name,
            rung.words(),
            linear(rung, rungs),
            busy(rungs),
        ),
    })
}

/// A warning of linear elements, with what those of the next order need.
fn linear(rung: &Rung, rungs: &[Rung]) -> String {
    let higher = rungs
        .iter()
        .filter(|other| other.order > 1)
        .min_by(|a, b| a.p999_us().total_cmp(&b.p999_us()));
    match higher {
        Some(other) if rung.order == 1 => format!(
            "; warning: linear elements are far too stiff in bending, so forces are wrong by a factor, not by some per \
             cent: do not rely on them; budget_us = {} allows {}",
            (1.2 * other.p999_us()).ceil(),
            other.name
        ),
        _ if rung.order == 1 => {
            "; warning: linear elements are far too stiff in bending, so forces are wrong by a \
                                 factor; this mesh cannot be raised to order 2"
                .to_owned()
        }
        _ => String::new(),
    }
}

/// A warning if other work disturbed the measurement.
fn busy(rungs: &[Rung]) -> String {
    let busy: Vec<&Repeats> = rungs
        .iter()
        .filter_map(|rung| rung.repeats.as_ref())
        .filter(|repeats| repeats.is_busy())
        .collect();
    match busy.first() {
        Some(repeats) if 2 * busy.len() > rungs.len() => format!(
            "; the machine was busy meanwhile ({}): measure again while nothing else runs",
            repeats.words()
        ),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rungs() -> Vec<Rung> {
        [
            ("order 3", 300.0, 0.0),
            ("order 2", 120.0, 0.05),
            ("order 2, 1 pass", 40.0, 0.2),
            ("order 1", 30.0, 3.0),
        ]
        .map(|(name, p999_us, error)| Rung {
            name: name.to_owned(),
            times_us: Some((0.5 * p999_us, p999_us)),
            order: name.as_bytes()[6] - b'0',
            repeats: None,
            error,
        })
        .to_vec()
    }

    #[test]
    fn the_most_accurate_that_keeps_the_budget_is_picked_and_the_next_is_named() {
        let picked = pick(&rungs(), 200.0).unwrap();
        assert_eq!(picked.rung, 1);
        assert_eq!(
            picked.why,
            "accuracy.budget_us = 200: picked order 2, 99.9 % of whose steps take less than 120 us here and half \
             less than 60 us, 5 % from order 3; order 3, the next more accurate, needs 300 us"
        );
        assert_eq!(pick(&rungs(), 1000.0).unwrap().rung, 0);
        let linear = pick(&rungs(), 35.0).unwrap();
        assert_eq!(linear.rung, 3);
        let warning = "wrong by a factor, not by some per cent: do not rely on them; budget_us = 48 allows order 2, 1 pass";
        assert!(linear.why.contains(warning), "{}", linear.why);
        // A lower rung that is better by chance only is not picked.
        let mut close = rungs();
        close[2].error = 0.0499;
        assert_eq!(pick(&close, 200.0).unwrap().rung, 1);
    }

    #[test]
    fn a_budget_that_nothing_keeps_names_the_nearest() {
        assert_eq!(
            pick(&rungs(), 10.0).unwrap_err(),
            "no setting keeps accuracy.budget_us = 10: the nearest is order 1, 99.9 % of whose steps take less than \
             30 us here and half less than 15 us; allow 36 or more"
        );
    }

    #[test]
    fn a_path_without_contact_keeps_any_budget_and_no_time_is_told() {
        let mut untouched = rungs();
        for rung in &mut untouched {
            (rung.times_us, rung.error) = (None, 0.0);
        }
        let picked = pick(&untouched, 1.0).unwrap();
        assert_eq!(picked.rung, 0);
        assert!(
            picked.why.contains("the path has no contact"),
            "{}",
            picked.why
        );
        assert!(!picked.why.contains("0 us"), "{}", picked.why);
    }

    #[test]
    fn a_busy_machine_is_told() {
        let mut busy = rungs();
        for rung in &mut busy {
            rung.repeats = Some(Repeats {
                rounds: 4,
                typical: 1.8,
                disturbed: 0.04,
            });
        }
        let why = pick(&busy, 200.0).unwrap().why;
        assert!(
            why.contains("busy meanwhile (the same step, repeated, took 1.8 times"),
            "{why}"
        );
    }
}

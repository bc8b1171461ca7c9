//! Time of one frictional contact problem of 5 to 80 contacts, cold and warm.
//!
//! A tool presses into an elastic half-space or onto a cantilever and slides: first all contacts stick, then the outer ones
//! slip, at last all. Measured are the steps nearest to half of the closed contacts slipping, the last ones, where all
//! do, and the first kind again under a wavy tool that leaves contacts open. Cold: from q alone; warm: from the forces of
//! the step before, as in the haptic loop.
//!
//! `cargo bench -p snapin-contact --bench friction` runs it on one thread and prints the table; with
//! `SNAPIN_WRITE_DOCS=1` it writes it into `docs/contact.md` as well.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and ends where it cannot go on"
)]

#[path = "../../tests/support/elastic.rs"]
mod elastic;

use std::fmt::Write;
use std::hint::black_box;
use std::time::Instant;

use contact::friction::{Problem, Scratch, Settings, Solution, State, solve};
use elastic::{Path, Set};

const FRICTION: f64 = 0.3;
/// Steps of a path: five press, in about 25 more all contacts come to slip.
const STEPS: usize = 45;
/// Of each step the fastest of as many runs counts: what else runs on the machine only adds.
const RUNS: usize = 200;

/// One step of a path: the problem, and the forces before it.
struct Step {
    q: Vec<f64>,
    is_solved: bool,
    before: Vec<f64>,
    counts: [usize; 3],
}

impl Step {
    fn slipping(&self) -> f64 {
        self.counts[2] as f64 / (self.counts[1] + self.counts[2]).max(1) as f64
    }
}

fn main() {
    faer::set_global_parallelism(faer::Par::Seq);
    let mut text = String::new();
    text.push_str(
        "| contacts | set | open, stick, slip | **cold** | Newton | sweeps | **warm** | Newton | sweeps | certificate |\n\
         | --: | --- | --: | --: | --: | --: | --: | --: | --: | --: |\n",
    );
    let (mut n_steps, mut n_unsolved) = (0, 0);
    for n in [5, 15, 40, 80] {
        for (name, set) in [("half-space", Set::half_space(n)), ("beam", Set::beam(n))] {
            let (flat, uneven) = (steps(&set, false), steps(&set, true));
            let mut add = |what: &str, steps: &[&Step]| {
                line(&mut text, &set, &format!("{name}, {what}"), steps);
            };
            // The cantilever's contacts let go together.
            if name == "half-space" {
                add("half slip", &near(&flat, 0.5));
            }
            add("all slip", &near(&flat, 1.0));
            add("uneven", &near(&uneven, 0.5));
            for step in flat.iter().chain(&uneven) {
                n_steps += 1;
                n_unsolved += usize::from(!step.is_solved);
            }
        }
    }
    writeln!(
        text,
        "\nOf the {n_steps} steps of all paths {n_unsolved} did not reach 1e-12."
    )
    .unwrap();
    println!("{text}");
    if std::env::var_os("SNAPIN_WRITE_DOCS").is_some() {
        let page = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/contact.md");
        let old = std::fs::read_to_string(&page).unwrap();
        let (begin, end) = (
            "<!-- measured friction: begin -->\n",
            "<!-- measured friction: end -->",
        );
        let (before, rest) = old.split_once(begin).unwrap();
        let (_, after) = rest.split_once(end).unwrap();
        std::fs::write(page, format!("{before}{begin}{text}{end}{after}")).unwrap();
    }
}

/// The five steps of sliding in which the share of slipping contacts is nearest to `share`, the last ones of equals.
fn near(steps: &[Step], share: f64) -> Vec<&Step> {
    let mut sliding: Vec<&Step> = steps.iter().skip(Path::PRESS).rev().collect();
    let off = |step: &Step| (step.slipping() - share).abs();
    sliding.sort_by(|a, b| off(a).total_cmp(&off(b)));
    sliding.truncate(5);
    sliding
}

/// A path over the set, of a tool that touches all along or of one that is wavy and leaves contacts open.
fn steps(set: &Set, is_uneven: bool) -> Vec<Step> {
    let n = set.n();
    let middle = [0, 1].map(|k: usize| set.places.iter().map(|p| p[k]).sum::<f64>() / n as f64);
    let far = |p: &[f64; 2]| (p[0] - middle[0]).hypot(p[1] - middle[1]);
    let size = set.places.iter().map(far).fold(0.0, f64::max);
    let depth = 2e-5;
    // What a slender part needs to touch all along: the tool has the shape that even forces give it.
    let sag: Vec<f64> = (0..n)
        .map(|i| (0..n).map(|j| set.matrix[9 * n * j + 3 * i]).sum())
        .collect();
    let most = sag.iter().copied().fold(0.0, f64::max);
    // Waves as high as twice an even force presses in one contact by itself, beyond what its neighbour sees of it.
    let own = set.matrix[0] - set.matrix[9 * n].min(set.matrix[0]);
    let wave = if is_uneven {
        2.0 * own * depth / most
    } else {
        0.0
    };
    let shape = (0..n)
        .map(|i| depth * (1.0 - sag[i] / most) + wave * ((i * 7) % 5) as f64 / 4.0)
        .collect();
    let mut path = Path {
        shape,
        depth,
        slide: 0.0,
        turn: 0.0,
    };
    // All slip after about 25 steps: the tangential way at which the forces are as large as friction allows.
    let mu = vec![FRICTION; n];
    let pressed = walk(set, &path, &mu, Path::PRESS);
    let last = &pressed[Path::PRESS - 1];
    let rows = 3 * n;
    let drag: f64 = (0..n)
        .map(|i| {
            (0..n)
                .map(|j| set.matrix[(3 * j + 1) * rows + 3 * i + 1] * FRICTION * last.1[3 * j])
                .sum::<f64>()
        })
        .fold(0.0, f64::max);
    path.slide = drag / 25.0;
    path.turn = 0.3 * path.slide / size;
    let all = walk(set, &path, &mu, STEPS);
    let mut before = vec![0.0; rows];
    all.into_iter()
        .map(|(q, forces, counts, residual)| Step {
            q,
            is_solved: residual <= 1e-12,
            before: std::mem::replace(&mut before, forces),
            counts,
        })
        .collect()
}

/// q, forces, counts of states, natural residual.
type Walked = (Vec<f64>, Vec<f64>, [usize; 3], f64);

fn walk(set: &Set, path: &Path, mu: &[f64], n_steps: usize) -> Vec<Walked> {
    let n = set.n();
    let mut scratch = Scratch::new(n);
    let (mut forces, mut slip) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
    let mut displacement = vec![0.0; 3 * n];
    (0..n_steps)
        .map(|step| {
            let q = path.q(set, step, &displacement);
            let problem = Problem::new(&set.matrix, &q, mu).unwrap();
            let settings = Settings::default();
            let start = step > 0;
            let solution = solve(
                &problem,
                &settings,
                &mut scratch,
                start,
                &mut forces,
                &mut slip,
            )
            .unwrap();
            for ((u, slip), q) in displacement.iter_mut().zip(&slip).zip(&q) {
                *u = slip - q;
            }
            let mut counts = [0; 3];
            for state in scratch.states() {
                counts[match state {
                    State::Open => 0,
                    State::Stick => 1,
                    State::Slip => 2,
                }] += 1;
            }
            let residual = solution.certificate.natural_residual;
            (q, forces.clone(), counts, residual)
        })
        .collect()
}

fn line(text: &mut String, set: &Set, name: &str, steps: &[&Step]) {
    let cold = measured(set, steps, false);
    let warm = measured(set, steps, true);
    let mean = |of: fn(&Solution) -> usize, measured: &Measured| {
        let sum: usize = measured.solutions.iter().map(of).sum();
        sum as f64 / measured.solutions.len() as f64
    };
    let certificate = cold
        .solutions
        .iter()
        .chain(&warm.solutions)
        .fold(0.0, |max: f64, s| max.max(s.certificate.natural_residual));
    let [open, stick, slip] = steps[0].counts;
    writeln!(
        text,
        "| {} | {name} | {open}, {stick}, {slip} | **{}** | {:.1} | {:.1} | **{}** | {:.1} | {:.1} | {certificate:.0e} |",
        set.n(),
        short(cold.time),
        mean(|s| s.newton_steps, &cold),
        mean(|s| s.sweeps, &cold),
        short(warm.time),
        mean(|s| s.newton_steps, &warm),
        mean(|s| s.sweeps, &warm),
    )
    .unwrap();
}

struct Measured {
    /// Median over the steps of each one's fastest run, µs.
    time: f64,
    solutions: Vec<Solution>,
}

fn measured(set: &Set, steps: &[&Step], is_warm: bool) -> Measured {
    let n = set.n();
    let mu = vec![FRICTION; n];
    let mut scratch = Scratch::new(n);
    let settings = Settings::default();
    let (mut forces, mut slip) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
    let (mut times, mut solutions) = (vec![], vec![]);
    for step in steps {
        let mut fastest = f64::INFINITY;
        for run in 0..RUNS {
            forces.copy_from_slice(&step.before);
            let start = Instant::now();
            // The check of the data is part of the time.
            let problem = Problem::trusted_symmetric(&set.matrix, &step.q, &mu).unwrap();
            let solution = solve(
                &problem,
                &settings,
                &mut scratch,
                is_warm,
                &mut forces,
                &mut slip,
            )
            .unwrap();
            fastest = fastest.min(start.elapsed().as_secs_f64() * 1e6);
            black_box(&forces);
            if run == 0 {
                solutions.push(solution);
            }
        }
        times.push(fastest);
    }
    times.sort_by(f64::total_cmp);
    Measured {
        time: times[times.len() / 2],
        solutions,
    }
}

/// Two or three digits.
fn short(time: f64) -> String {
    if time < 10.0 {
        format!("{time:.1}")
    } else {
        format!("{time:.0}")
    }
}

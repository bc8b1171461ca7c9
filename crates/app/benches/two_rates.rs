//! A tick of two rates beside a whole step, and what it errs.
//!
//! Measures: a rigid sphere of 100 mm pressed into an elastic half-space with 3025 nodes and slid over it by 20 um a
//! step (as `scale.rs`), held by a virtual coupling of 20 N/mm. The engine's result is there 2 to 20 periods after its
//! target. Only periods with contact count. `cargo bench -p snapin --bench two_rates` runs it on one core and prints
//! the table; with `SNAPIN_WRITE_DOCS=1` it writes it into `docs/performance.md`.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and ends where it cannot go on"
)]

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use contact::tool::{Sphere, Tool};
use device::{VirtualCoupling, Wrench};
use glam::DVec3;
use glamx::DPose3;
use half_space::{CELL, half_space};
use snapin::engine::{ContactIterations, ContactPart, Engine, EngineSettings, Plan, StepReport};
use snapin::machine::Machine;
use snapin::session::fast::FastSettings;
use snapin::session::slow::Stepped;

#[path = "shared/half_space.rs"]
#[allow(
    dead_code,
    reason = "the other bench also takes parts with some columns only"
)]
mod half_space;

const RADIUS: f64 = 0.1;
const STRIDE: f64 = 2e-5;
const STEPS: u32 = 700;
const BEGIN: u32 = 300;

fn engine(part: &Arc<ContactPart>) -> Engine {
    let settings = EngineSettings {
        contact_iterations: ContactIterations::Converged,
        displacement_tolerance: 1e-9,
        near_distance: 0.0004 * 2.0 * RADIUS,
        max_contacts: 1024,
        merge_tolerance: 0.05,
        lcp: contact::lcp::Settings::default(),
        max_stride: 0.02 * 2.0 * RADIUS,
    };
    let tool = Tool::Sphere(Sphere::new(RADIUS).unwrap());
    let coupling = VirtualCoupling::new(2e4, 1e3).unwrap();
    Engine::new(Plan::new(Arc::clone(part), tool, Some(coupling), settings)).unwrap()
}

/// Presses by the depth of so many contacts if the coupling did not yield, and slides.
fn target(contacts: f64, step: u32) -> DPose3 {
    let depth = contacts * CELL * CELL / (std::f64::consts::PI * RADIUS);
    let t = f64::from(step);
    let pressed = (t / 300.0).min(1.0) * (1.0 + 0.02 * (0.05 * t).sin());
    let slid = STRIDE * (t - 300.0).max(0.0) - 0.005;
    DPose3::from_translation(DVec3::new(slid, 0.3 * slid, RADIUS - pressed * depth))
}

fn on_handle(report: &StepReport) -> Wrench {
    -Wrench::from_array(&report.coupling_wrench_on_tool)
}

fn quantile(times: &mut [f64], share: f64) -> f64 {
    times.sort_by(f64::total_cmp);
    times[((times.len() - 1) as f64 * share).round() as usize]
}

fn main() {
    let part = half_space(55);
    let mut text = format!(
        "Measured on {}, one core used. Microseconds; errors relative to the root mean square of the force.\n\n\
         | contacts | results after | rows | whole step, median | p99 | freezing, median | **tick, median** | p99 | \
         error | held result instead |\n{}|\n",
        Machine::read().summary(),
        "| --: ".repeat(10),
    );
    for contacts in [60.0, 200.0, 400.0, 800.0] {
        let mut whole = engine(&part);
        let (mut times, mut forces, mut touching) = (vec![], vec![], vec![]);
        for step in 0..STEPS {
            let begun = Instant::now();
            let report = whole.step(&target(contacts, step));
            times.push(1e-3 * begun.elapsed().as_nanos() as f64);
            touching.push(f64::from(report.contacts));
            forces.push(on_handle(&report).force);
        }
        let begin = BEGIN as usize;
        let times = &mut times[begin..];
        let whole_us = [0.5, 0.99].map(|share| quantile(times, share));
        let norm: f64 = forces[begin..].iter().map(|f| f.length_squared()).sum();
        for every in [2_u64, 5, 10, 20] {
            let mut other = engine(&part);
            let settings = FastSettings {
                period_s: 1e-3,
                force_resolution: 0.2,
                lever: 0.05,
                n_ticks: STEPS as usize,
            };
            let start = target(contacts, 0);
            let mut stepped = Stepped::new(&mut other, &start, every, settings).unwrap();
            let (mut ticks, mut freezing, mut rows) = (vec![], vec![], 0);
            let (mut error, mut held) = (0.0, 0.0);
            for step in 0..STEPS {
                let at = target(contacts, step);
                let begun = Instant::now();
                let answer = stepped.tick(u64::from(step), &at, on_handle);
                let tick_us = 1e-3 * begun.elapsed().as_nanos() as f64;
                let solved = stepped.work(&mut other, u64::from(step), &at);
                if step < BEGIN {
                    continue;
                }
                ticks.push(tick_us);
                if let Some(solved) = solved {
                    freezing.push(1e-3 * solved.freeze_ns as f64);
                    rows = rows.max(solved.n_rows);
                }
                let right = forces[step as usize];
                error += (answer.wrench_on_handle.force - right).length_squared();
                let last = (u64::from(step) / every - 1) * every;
                held += (forces[last as usize] - right).length_squared();
            }
            text += &format!(
                "| {:.0} | {every} | {rows} | {:.0} | {:.0} | {:.0} | **{:.0}** | {:.0} | {:.1e} | {:.1e} |\n",
                touching[begin..].iter().sum::<f64>() / f64::from(STEPS - BEGIN),
                whole_us[0],
                whole_us[1],
                quantile(&mut freezing, 0.5),
                quantile(&mut ticks.clone(), 0.5),
                quantile(&mut ticks, 0.99),
                (error / norm).sqrt(),
                (held / norm).sqrt(),
            );
        }
    }
    println!("{text}");
    if std::env::var_os("SNAPIN_WRITE_DOCS").is_some() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/performance.md");
        let old = std::fs::read_to_string(&page).unwrap();
        let (begin, end) = ("<!-- two rates: begin -->\n", "<!-- two rates: end -->");
        let (before, rest) = old.split_once(begin).unwrap();
        let (_, after) = rest.split_once(end).unwrap();
        std::fs::write(page, format!("{before}{begin}{text}{end}{after}")).unwrap();
    }
}

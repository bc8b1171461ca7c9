//! Time of `engine::step` on the paper's clip, stage by stage, with contacts active.
//!
//! Measures: scenes/clip.toml (about 686 nodes, 293 quadratic elements), the tube pushed in from
//! first touch to home in 1000 steps of the script, 20 times over; only steps that carry contact
//! count; contact at nodes, at nodes with the scene's friction, and at places that move with the tube. Printed beside what the paper
//! measured on a Pentium 4 at 2.4 GHz (Duriez et al. 2004, 5.2). `cargo bench -p snapin` runs it on one core.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and ends where it cannot go on"
)]

use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use glamx::DPose3;
use snapin::engine::{Engine, Stage};
use snapin::machine::Machine;
use snapin::prepare::{PrepareOptions, PreparedPart, prepare};
use snapin::progress::Ui;
use snapin::scene::{ContactAt, Scene};
use snapin::setup;

const STEPS: u32 = 1000;
const ROUNDS: u32 = 20;

struct Clip {
    prepared: PreparedPart,
    engine: Engine,
    start: DPose3,
    way: DVec3,
}

fn clip(contact_at: ContactAt, has_friction: bool) -> Clip {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/clip.toml");
    let mut scene = Scene::load(&path).unwrap().with_friction(has_friction);
    scene.accuracy.contact_at = contact_at;
    let mut unseen = std::io::sink();
    let ui = Ui::new(&mut unseen, false);
    let prepared = prepare(
        &setup::part_spec(&scene).unwrap(),
        &PrepareOptions::default(),
        &ui,
    )
    .unwrap();
    let (tool, _) = setup::tool(&scene).unwrap();
    let engine = setup::engine(&scene, &prepared, tool).unwrap();
    let way = scene.drive.travel * scene.drive.direction;
    Clip {
        prepared,
        engine,
        start: scene.tool.pose_part_tool,
        way,
    }
}

impl Clip {
    fn target(&self, step: u32) -> DPose3 {
        let share = f64::from(step) / f64::from(STEPS);
        DPose3 {
            translation: self.start.translation + share * self.way,
            ..self.start
        }
    }
}

fn main() {
    println!("{}", Machine::read().summary());
    for (contact_at, has_friction) in [
        (ContactAt::Nodes, false),
        (ContactAt::Nodes, true),
        (ContactAt::Places, false),
    ] {
        measure(contact_at, has_friction);
    }
}

fn measure(contact_at: ContactAt, has_friction: bool) {
    let mut clip = clip(contact_at, has_friction);
    let mut stages: Vec<Vec<u64>> = vec![Vec::new(); Stage::ALL.len()];
    let mut totals = Vec::new();
    // By step of the script: the least of all rounds, which is what the step itself takes.
    let mut own = vec![u64::MAX; STEPS as usize + 1];
    let (mut passes, mut contacts) = (0, 0);
    for _ in 0..ROUNDS {
        clip.engine.reset();
        for step in 0..=STEPS {
            let target = clip.target(step);
            let begun = Instant::now();
            let report = clip.engine.step(&target);
            let total = begun.elapsed().as_nanos() as u64;
            if report.contacts == 0 {
                continue;
            }
            totals.push(total);
            own[step as usize] = own[step as usize].min(total);
            passes += report.passes;
            contacts += report.contacts;
            for (times, ns) in stages.iter_mut().zip(report.stage_ns) {
                times.push(ns);
            }
        }
    }
    println!(
        "contact at {contact_at:?}, {}: {} nodes, {} elements; {} steps with contact, on average {:.1} contacts and {:.1} passes",
        if has_friction {
            "with friction"
        } else {
            "without friction"
        },
        clip.prepared.loaded.mesh.n_nodes(),
        clip.prepared.loaded.mesh.n_elements(),
        totals.len(),
        f64::from(contacts) / totals.len() as f64,
        f64::from(passes) / totals.len() as f64,
    );
    println!(
        "{:<28}{:>12}{:>12}{:>12}{:>16}",
        "stage (us)", "median", "p99", "p99.9", "paper (ms)"
    );
    let sum = |indices: &[Stage], stages: &[Vec<u64>]| -> Vec<u64> {
        (0..totals.len())
            .map(|k| indices.iter().map(|s| stages[*s as usize][k]).sum())
            .collect()
    };
    let collision = sum(&[Stage::Proximity, Stage::Planes], &stages);
    let lcp = sum(&[Stage::Delassus, Stage::Lcp, Stage::Update], &stages);
    for (stage, times) in Stage::ALL.iter().zip(stages) {
        row(stage.name(), times, "");
    }
    row("collision (first two)", collision, "2.5");
    row("LCP (last three)", lcp, "0.2");
    row(
        "surface multiply (60 Hz)",
        multiply_times(&mut clip),
        "0.01",
    );
    row("whole step", totals, "2.71");
    own.retain(|ns| *ns < u64::MAX);
    row("its own work, least of 20", own, "");
}

/// Displacement of the whole surface under the forces at the peak.
fn multiply_times(clip: &mut Clip) -> Vec<u64> {
    let loaded = &clip.prepared.loaded;
    let layout = gpu::Layout::new(loaded.rows.len(), loaded.candidates.len()).unwrap();
    let whole = clip.prepared.compliance.all().unwrap();
    let mut multiply = gpu::on_cpu(layout, &whole.stretches(), gpu::Scalar::F64).unwrap();
    clip.engine.reset();
    for step in 0..=STEPS / 4 {
        let target = clip.target(step);
        clip.engine.step(&target);
    }
    let active = clip.engine.active_contacts();
    let columns: Vec<u32> = active.iter().map(|c| c.candidate).collect();
    let forces: Vec<f64> = active
        .iter()
        .flat_map(|c| c.force_on_part.to_array())
        .collect();
    let mut displacement = vec![0.0; 3 * loaded.rows.len()];
    (0..5000)
        .map(|_| {
            let begun = Instant::now();
            multiply
                .multiply_into(&columns, &forces, &mut displacement)
                .unwrap();
            begun.elapsed().as_nanos() as u64
        })
        .collect()
}

fn row(name: &str, mut times: Vec<u64>, paper: &str) {
    times.sort_unstable();
    let at = |q: f64| 1e-3 * times[(q * (times.len() - 1) as f64) as usize] as f64;
    println!(
        "{name:<28}{:>12.2}{:>12.2}{:>12.2}{paper:>16}",
        at(0.5),
        at(0.99),
        at(0.999)
    );
}

//! Time of a step with its drawn shape, from linear over p-adaptive to full quadratic elements.
//!
//! Measures: the clip of scenes/clip.toml on its mesh, the medium and the fine one, pushed in from
//! first touch to home in 1000 steps, several times over; only steps that carry contact count. The
//! shape (displacement of the whole surface) is made in every step here, as the paper does; a session
//! makes it at display rate. `cargo bench -p snapin --bench p_method` runs it on one core.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and ends where it cannot go on"
)]

use std::path::Path;
use std::time::Instant;

use glamx::DPose3;
use snapin::engine::Engine;
use snapin::machine::Machine;
use snapin::prepare::{PrepareOptions, cache, prepare};
use snapin::progress::Ui;
use snapin::scene::{Adaptive, FreeNodes, Multiply, Scene};
use snapin::setup;
use snapin::shape::Shape;

const STEPS: u32 = 1000;
const ROUNDS: u32 = 8;

struct Variant {
    name: String,
    is_adaptive: bool,
    n_nodes: usize,
    engine: Engine,
    shape: Shape,
    targets: Vec<DPose3>,
    steps: Vec<u64>,
    shapes: Vec<u64>,
    sums: Vec<u64>,
    free: usize,
}

fn main() {
    println!("{}", Machine::read().summary());
    println!("microseconds; variants take turns, so that a drift of the machine meets all alike\n");
    println!(
        "{:<34}{:>8}{:>8}{:>10}{:>10}{:>11}{:>10}{:>12}",
        "", "nodes", "free", "step p50", "p99.9", "shape p50", "p99.9", "sum p50"
    );
    for mesh in ["clip.msh", "clip-medium.msh", "clip-fine.msh"] {
        println!("{mesh}");
        let on = |radius| Adaptive::On(FreeNodes::Radius(radius));
        let mut variants = vec![variant(mesh, "linear", 1, Adaptive::Off)];
        for radius in [0.0, 2e-3, 4e-3] {
            let name = format!("quadratic, select {} mm", 1e3 * radius);
            variants.push(variant(mesh, &name, 2, on(radius)));
        }
        variants.push(variant(mesh, "full quadratic", 2, Adaptive::Off));
        // The first round warms up.
        for round in 0..=ROUNDS {
            for variant in &mut variants {
                variant.push_in(round > 0);
            }
        }
        variants.iter_mut().for_each(Variant::print);
    }
}

fn variant(mesh: &str, name: &str, order: u8, adaptive: Adaptive) -> Variant {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut scene = Scene::load(&scenes.join("clip.toml")).unwrap();
    scene.part.mesh = scenes.join(mesh);
    scene.part.order = Some(order);
    scene.accuracy.adaptive = adaptive;
    scene.accuracy.multiply = Multiply::Cpu;
    let mut unseen = std::io::sink();
    let ui = Ui::new(&mut unseen, false);
    let options = PrepareOptions {
        cache_dir: cache::default_dir(),
        ..PrepareOptions::default()
    };
    let prepared = prepare(&setup::part_spec(&scene).unwrap(), &options, &ui).unwrap();
    let (tool, _) = setup::tool(&scene).unwrap();
    let start = scene.tool.pose_part_tool;
    let way = scene.drive.travel * scene.drive.direction;
    Variant {
        name: name.to_owned(),
        is_adaptive: adaptive != Adaptive::Off,
        n_nodes: prepared.loaded.mesh.n_nodes(),
        engine: setup::engine(&scene, &prepared, tool).unwrap(),
        shape: Shape::new(&prepared, &scene.accuracy, None).unwrap(),
        targets: (0..=STEPS)
            .map(|step| DPose3 {
                translation: start.translation + f64::from(step) / f64::from(STEPS) * way,
                ..start
            })
            .collect(),
        steps: Vec::new(),
        shapes: Vec::new(),
        sums: Vec::new(),
        free: 0,
    }
}

impl Variant {
    fn push_in(&mut self, counts: bool) {
        self.engine.reset();
        for target in &self.targets {
            let begun = Instant::now();
            let report = self.engine.step(target);
            let stepped = begun.elapsed();
            self.shape.update(self.engine.active_contacts()).unwrap();
            let all = begun.elapsed();
            if counts && report.contacts > 0 {
                self.steps.push(stepped.as_nanos() as u64);
                self.shapes.push((all - stepped).as_nanos() as u64);
                self.sums.push(all.as_nanos() as u64);
                let free = self.shape.n_free().unwrap_or(0);
                self.free = self.free.max(free);
            }
        }
    }

    fn print(&mut self) {
        let at = |times: &mut Vec<u64>, q: f64| {
            times.sort_unstable();
            1e-3 * times[(q * (times.len() - 1) as f64) as usize] as f64
        };
        println!(
            "  {:<32}{:>8}{:>8}{:>10.1}{:>10.1}{:>11.1}{:>10.1}{:>12.1}",
            self.name,
            self.n_nodes,
            if self.is_adaptive {
                self.free.to_string()
            } else {
                "-".to_owned()
            },
            at(&mut self.steps, 0.5),
            at(&mut self.steps, 0.999),
            at(&mut self.shapes, 0.5),
            at(&mut self.shapes, 0.999),
            at(&mut self.sums, 0.5),
        );
    }
}

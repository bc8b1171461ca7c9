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
use snapin::machine::Machine;
use snapin::prepare::{PrepareOptions, cache, prepare};
use snapin::progress::Ui;
use snapin::scene::{Adaptive, FreeNodes, PMethod, Scene};
use snapin::setup;
use snapin::shape::Shape;

const STEPS: u32 = 1000;
const ROUNDS: u32 = 8;

fn main() {
    println!("{}", Machine::read().summary());
    println!("microseconds; step + shape lies between linear and full quadratic for \"select\"\n");
    println!(
        "{:<34}{:>8}{:>10}{:>10}{:>10}{:>10}{:>10}{:>12}",
        "", "nodes", "free", "step p50", "p99.9", "shape p50", "p99.9", "step+shape"
    );
    for mesh in ["clip.msh", "clip-medium.msh", "clip-fine.msh"] {
        println!("{mesh}");
        let on = |method, radius| Adaptive::On {
            method,
            free: FreeNodes::Radius(radius),
        };
        measure(mesh, "linear", 1, Adaptive::Off);
        for radius in [0.0, 2e-3, 4e-3] {
            let name = format!("quadratic, select {} mm", 1e3 * radius);
            measure(mesh, &name, 2, on(PMethod::Select, radius));
        }
        measure(mesh, "full quadratic", 2, Adaptive::Off);
        if mesh != "clip-fine.msh" {
            let name = "quadratic, constrain 2 mm";
            measure(mesh, name, 2, on(PMethod::Constrain, 2e-3));
        }
    }
}

fn measure(mesh: &str, name: &str, order: u8, adaptive: Adaptive) {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut scene = Scene::load(&scenes.join("clip.toml")).unwrap();
    scene.part.mesh = scenes.join(mesh);
    scene.part.order = Some(order);
    scene.accuracy.adaptive = adaptive;
    let mut unseen = std::io::sink();
    let ui = Ui::new(&mut unseen, false);
    let options = PrepareOptions {
        cache_dir: cache::default_dir(),
        rebuild: false,
    };
    let prepared = prepare(&setup::part_spec(&scene).unwrap(), &options, &ui).unwrap();
    let (tool, _) = setup::tool(&scene).unwrap();
    let mut engine = setup::engine(&scene, &prepared, tool).unwrap();
    let mut shape = Shape::new(&prepared, &scene.accuracy).unwrap();
    let start = scene.tool.pose_part_tool;
    let way = scene.hand.travel * scene.hand.direction;
    let (mut steps, mut shapes, mut sums) = (Vec::new(), Vec::new(), Vec::new());
    let mut free = 0;
    for round in 0..=ROUNDS {
        engine.reset();
        for step in 0..=STEPS {
            let share = f64::from(step) / f64::from(STEPS);
            let target = DPose3 {
                translation: start.translation + share * way,
                ..start
            };
            let begun = Instant::now();
            let report = engine.step(&target);
            let stepped = begun.elapsed();
            shape.update(&mut engine).unwrap();
            let all = begun.elapsed();
            // The first round warms up.
            if round > 0 && report.contacts > 0 {
                steps.push(stepped.as_nanos() as u64);
                shapes.push((all - stepped).as_nanos() as u64);
                sums.push(all.as_nanos() as u64);
                free = free.max(shape.n_free().unwrap_or(report.free_nodes as usize));
            }
        }
    }
    let at = |times: &mut Vec<u64>, q: f64| {
        times.sort_unstable();
        1e-3 * times[(q * (times.len() - 1) as f64) as usize] as f64
    };
    println!(
        "  {name:<32}{:>8}{:>10}{:>10.1}{:>10.1}{:>10.1}{:>10.1}{:>12.1}",
        prepared.loaded.mesh.n_nodes(),
        if adaptive == Adaptive::Off {
            "-".to_owned()
        } else {
            free.to_string()
        },
        at(&mut steps, 0.5),
        at(&mut steps, 0.999),
        at(&mut shapes, 0.5),
        at(&mut shapes, 0.999),
        at(&mut sums, 0.5),
    );
}

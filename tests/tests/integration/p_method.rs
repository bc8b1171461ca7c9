//! The p-method on the shipped clip: what "select" and "constrain" promise.
//!
//! Source: Duriez et al. 2004, section 3.2. Goal: forces of "select" do not depend on the free set; a
//! constrained part with all nodes free is the full one; switching free nodes while the tool slides
//! changes the wrench by no more than the stated bound.

use glamx::DPose3;
use snapin::engine::{Engine, FreeSettings, StepReport, switch_bound};
use snapin::prepare::PreparedPart;
use snapin::scene::{Adaptive, FreeNodes, Multiply, PMethod, Scene};
use snapin::setup;
use snapin::shape::{Shape, largest};
use snapin_tests::root;

struct Clip {
    scene: Scene,
    prepared: PreparedPart,
}

fn clip(adaptive: Adaptive) -> Clip {
    let mut scene = Scene::load(&root().join("scenes/clip.toml")).unwrap();
    scene.accuracy.adaptive = adaptive;
    scene.accuracy.multiply = Multiply::Cpu;
    let prepared = snapin_tests::prepared(&scene);
    Clip { scene, prepared }
}

impl Clip {
    fn engine(&self) -> Engine {
        let (tool, _) = setup::tool(&self.scene).unwrap();
        setup::engine(&self.scene, &self.prepared, tool).unwrap()
    }

    fn shape(&self) -> Shape {
        Shape::new(&self.prepared, &self.scene.accuracy, None).unwrap()
    }

    /// The tool's target after this share of the travel.
    fn target(&self, share: f64) -> DPose3 {
        let start = self.scene.tool.pose_part_tool;
        DPose3 {
            translation: start.translation
                + share * self.scene.drive.travel * self.scene.drive.direction,
            ..start
        }
    }
}

fn on(method: PMethod, radius: f64) -> Adaptive {
    Adaptive::On {
        method,
        free: FreeNodes::Radius(radius),
    }
}

fn force(report: &StepReport) -> f64 {
    report.contact_force_on_tool().length()
}

/// Size of a change of the wrench as the engine counts it; the clip's tool turns by next to nothing.
fn change(a: &StepReport, b: &StepReport) -> f64 {
    (a.contact_force_on_tool() - b.contact_force_on_tool()).length()
}

#[test]
fn select_with_all_free_draws_the_full_shape_and_with_none_a_near_one_at_the_same_force() {
    let whole = clip(Adaptive::Off);
    let (mut engine, mut full) = (whole.engine(), whole.shape());
    let all = clip(on(PMethod::Select, 1.0));
    let none = clip(on(PMethod::Select, 0.0));
    let (mut engine_all, mut shape_all) = (all.engine(), all.shape());
    let (mut engine_none, mut shape_none) = (none.engine(), none.shape());
    let (mut worst_all, mut worst_none, mut at_most) = (0.0f64, 0.0f64, 0.0f64);
    for k in 0..=200 {
        let target = whole.target(f64::from(k) / 200.0);
        let report = engine.step(&target);
        for engine in [&mut engine_all, &mut engine_none] {
            let other = engine.step(&target);
            assert_eq!(
                report.contact_wrench_on_tool, other.contact_wrench_on_tool,
                "forces do not depend on the free set"
            );
        }
        let u = full.update(&mut engine).unwrap().to_vec();
        let difference = |other: &[f64]| -> f64 {
            let pairs: Vec<f64> = u.iter().zip(other).map(|(a, b)| a - b).collect();
            largest(&pairs)
        };
        let of_all = difference(shape_all.update(&mut engine_all).unwrap());
        let of_none = difference(shape_none.update(&mut engine_none).unwrap());
        // Free nodes take some updates to be chosen and to move.
        if k > 60 && report.contacts > 0 {
            worst_all = worst_all.max(of_all / largest(&u));
        }
        worst_none = worst_none.max(of_none);
        at_most = at_most.max(largest(&u));
    }
    assert_eq!(shape_none.n_free(), Some(0));
    assert!(worst_all < 1e-13, "{worst_all}");
    // Interpolation on an edge of length l: l²/8 max|u''|. The clip's arm bends by u'' = 12 u / L²
    // at most (a cantilever's 3 u / L², four times for its curve), l / L is 1 / 5.
    let bound = 12.0 / 8.0 / 25.0 * at_most;
    assert!(
        worst_none > 0.0 && worst_none < bound,
        "{worst_none} {bound}"
    );
}

#[test]
fn a_constrained_part_with_all_nodes_free_is_the_full_part() {
    let whole = clip(Adaptive::Off);
    let free = clip(on(PMethod::Constrain, 1.0));
    let plain = whole.engine();
    let coupling = plain.coupling().copied();
    // Planes of both converged far beyond what a scene asks for, so that only the operators differ.
    let mut engine_settings = plain.settings().clone();
    engine_settings.displacement_tolerance = 1e-14;
    let part = whole.prepared.contact_part();
    let (tool, _) = setup::tool(&whole.scene).unwrap();
    let mut engine = Engine::new(part, tool, coupling, engine_settings.clone()).unwrap();
    let (coarse, data) = free.prepared.constrained_part(
        free.prepared.bubbles.as_ref().unwrap(),
        free.prepared.compliance.all().unwrap(),
    );
    let mut settings = FreeSettings::within(1.0);
    settings.max_free = data.positions.len();
    let (tool, _) = setup::tool(&free.scene).unwrap();
    let mut constrained =
        Engine::constrained(coarse, data, settings, tool, coupling, engine_settings).unwrap();
    let mut shape = free.shape();
    let mut full = whole.shape();
    let target = whole.target(0.45);
    let stiff = force(&constrained.step(&target));
    let mut report = constrained.step(&target);
    let n_bubbles = free.prepared.bubbles.as_ref().unwrap().bubbles.len();
    // The factor of all nodes is made over a few thousand steps, and blended in.
    for _ in 0..4000 {
        report = constrained.step(&target);
    }
    assert_eq!(report.free_nodes as usize, n_bubbles);
    let reference = engine.step(&target);
    assert!(force(&reference) > 1.0, "in contact");
    assert!(
        stiff > 1.05 * force(&reference),
        "constrained is stiffer: {stiff}"
    );
    assert!(
        change(&reference, &report) < 1e-9 * force(&reference),
        "{:?} {:?}",
        reference.contact_wrench_on_tool,
        report.contact_wrench_on_tool
    );
    let (u, v) = (
        full.update(&mut engine).unwrap().to_vec(),
        shape.update(&mut constrained).unwrap(),
    );
    let difference: Vec<f64> = u.iter().zip(v).map(|(a, b)| a - b).collect();
    assert!(largest(&difference) < 1e-9 * largest(&u));
}

#[test]
fn switching_free_nodes_keeps_the_wrench_within_its_bound() {
    let constrained = clip(on(PMethod::Constrain, 4e-3));
    let mut engine = constrained.engine();
    let (mut n_changes, mut last_free, mut largest_change) = (0, 0, 0.0f64);
    for k in 0..=1500 {
        let report = engine.step(&constrained.target(f64::from(k) / 1500.0));
        assert!(!report.switch_forced, "step {k}: {}", report.switch_change);
        n_changes += u32::from(report.free_nodes != last_free);
        last_free = report.free_nodes;
        largest_change = largest_change.max(report.switch_change);
    }
    assert!(n_changes > 5, "{n_changes} switches");
    assert!(largest_change > 0.0 && largest_change <= switch_bound(f64::INFINITY));

    // Held still, all that changes the wrench is switching: seen from outside.
    let mut engine = constrained.engine();
    for stop in [0.3, 0.35, 0.4, 0.45, 0.5] {
        let target = constrained.target(stop);
        let mut before = engine.step(&target);
        let mut moved = 0.0;
        for _ in 0..200 {
            let report = engine.step(&target);
            let step = change(&before, &report);
            let bound = switch_bound(force(&before));
            assert!(step <= 1.001 * bound + 1e-6, "{stop}: {step} {bound}");
            moved += step;
            before = report;
        }
        assert!(stop < 0.35 || moved > 0.0, "{stop}: nothing was switched");
    }
}

//! The p-method on the shipped clip: which nodes are free changes what is drawn, and no force.
//!
//! Source: Duriez et al. 2004, section 3.2.

use glamx::DPose3;
use snapin::engine::Engine;
use snapin::prepare::PreparedPart;
use snapin::scene::{Adaptive, FreeNodes, Multiply, Scene};
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

fn within(radius: f64) -> Adaptive {
    Adaptive::On(FreeNodes::Radius(radius))
}

#[test]
fn with_all_free_it_draws_the_full_shape_and_with_none_a_near_one_at_the_same_force() {
    let whole = clip(Adaptive::Off);
    let (mut engine, mut full) = (whole.engine(), whole.shape());
    let all = clip(within(1.0));
    let none = clip(within(0.0));
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
        let u = full.update(engine.active_contacts()).unwrap().to_vec();
        let difference = |other: &[f64]| -> f64 {
            let pairs: Vec<f64> = u.iter().zip(other).map(|(a, b)| a - b).collect();
            largest(&pairs)
        };
        let of_all = difference(shape_all.update(engine_all.active_contacts()).unwrap());
        let of_none = difference(shape_none.update(engine_none.active_contacts()).unwrap());
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

use std::path::Path;

use super::*;
use crate::prepare::{PrepareOptions, prepare};
use crate::progress::Ui;
use crate::scene::Scene;
use crate::session::{self, Recording};
use crate::setup;

/// An adapter that is late each time is given up in the run: told once, counted, and no force is touched.
#[test]
fn an_adapter_that_is_given_up_in_a_run_is_told_and_changes_no_force() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/clip.toml");
    let mut scene = Scene::load(&path).unwrap();
    scene.accuracy.multiply = Multiply::Cpu;
    let hand = scene.hand.as_mut().unwrap();
    (hand.hold, hand.retract) = (0.0, false);
    let mut unseen = std::io::sink();
    let ui = Ui::new(&mut unseen, false);
    let spec = setup::part_spec(&scene).unwrap();
    let prepared = prepare(&spec, &PrepareOptions::default(), &ui).unwrap();
    let run = |shape: &mut Shape| -> Recording {
        let (tool, _) = setup::tool(&scene).unwrap();
        let held = setup::held(&scene, &prepared, &tool);
        let mut engine = setup::engine(&scene, &prepared, tool).unwrap();
        let spec = setup::session(&scene, held).unwrap();
        session::run(&spec, &prepared, &mut engine, shape, &fem::Silent).unwrap()
    };
    let mut shape = Shape::new(&prepared, &scene.accuracy, None).unwrap();
    let expected = run(&mut shape);
    assert_eq!((shape.given_up(), shape.n_late()), (None, 0));

    let PreparedCompliance::All(whole) = &prepared.compliance else {
        panic!("the clip fits into memory");
    };
    let layout = Layout::new(prepared.loaded.rows.len(), prepared.loaded.candidates.len()).unwrap();
    let Some(late) = choice::impatient(layout, &whole.stretches()) else {
        eprintln!("no adapter: {}", gpu::Adapters::find());
        return;
    };
    shape.kind = Kind::Full(late);
    // One run is enough, unless the machine is so busy that the adapter has not answered the first call at its end.
    for _ in 0..100 {
        let found = run(&mut shape);
        for (a, b) in found.records.iter().zip(&expected.records) {
            assert_eq!(a.wrench_on_handle, b.wrench_on_handle, "step {}", a.step);
        }
        let (a, b) = (
            found.max_surface_displacement,
            expected.max_surface_displacement,
        );
        assert!((a / b - 1.0).abs() < 1e-6, "{a} and {b} m");
        if shape.given_up().is_some() {
            break;
        }
    }
    let remark = shape.given_up().unwrap();
    assert!(
        remark.ends_with("; the processor multiplies from now on"),
        "{remark}"
    );
    assert!(shape.n_late() > 0);
}

//! How the compliance is kept: numbers of 32 bits, columns on demand, files mapped. What is kept must not change what is
//! felt.

use std::sync::Arc;

use contact::tool::Tool;
use glamx::DPose3;
use snapin::engine::{ContactPart, Engine, Plan};
use snapin::prepare::{ColumnChoice, PreparedCompliance, PreparedPart};
use snapin::scene::{Adaptive, Columns, FreeNodes, Scalar, Scene};
use snapin::setup;
use snapin::stored::{Blocks, Source};
use snapin_tests::{arg, csv, root, snapin};

fn clip(columns: Columns, scalar: Scalar) -> (Scene, PreparedPart, Tool) {
    let mut scene = Scene::load(&root().join("scenes/clip.toml")).unwrap();
    scene.accuracy.columns = columns;
    scene.accuracy.contact_scalar = scalar;
    let prepared = snapin_tests::prepared(&scene);
    let (tool, _) = setup::tool(&scene).unwrap();
    (scene, prepared, tool)
}

/// Force along the approach, N, on the way in.
fn forces(scene: &Scene, engine: &mut Engine) -> Vec<f64> {
    let start = scene.tool.pose_part_tool;
    (0..=300)
        .map(|k| {
            let way = 0.6 * scene.drive.travel * f64::from(k) / 300.0;
            let target = DPose3 {
                translation: start.translation + way * scene.drive.direction,
                ..start
            };
            let report = engine.step(&target);
            assert!(report.lcp_solved && report.without_column == 0);
            report.contact_force_on_tool().dot(scene.drive.direction)
        })
        .collect()
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let largest = a.iter().fold(0.0, |m: f64, f| m.max(f.abs()));
    assert!(largest > 1.0, "{largest} N");
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
        / largest
}

/// Rounding C to 32 bits changes each entry by 6e-8 of itself, and the force by the condition of the contact problem
/// times that: some hundred on the clip.
#[test]
fn the_force_with_32_bit_compliance_differs_in_the_sixth_digit() {
    let (scene, prepared, tool) = clip(Columns::All, Scalar::F64);
    let exact = forces(&scene, &mut setup::engine(&scene, &prepared, tool).unwrap());
    let (scene, prepared, tool) = clip(Columns::All, Scalar::F32);
    let rounded = forces(&scene, &mut setup::engine(&scene, &prepared, tool).unwrap());
    let difference = largest_difference(&exact, &rounded);
    assert!((1e-12..1e-5).contains(&difference), "{difference}");
}

/// A run whose columns are fetched ahead of the tool gives the curve of one that had them all; only the solutions'
/// round-off differs, and planes are converged to a nanometre (1e-5 N). A corner between the nodes asks for the
/// columns of nodes that are not near themselves.
#[test]
fn fetched_columns_give_the_force_of_all() {
    for (scene, mesh) in [("clip.toml", "clip.msh"), ("edge.toml", "hook.msh")] {
        compare_fetched(scene, mesh);
    }
}

fn compare_fetched(scene: &str, mesh: &str) {
    let dir = tempfile::tempdir().unwrap();
    let scenes = root().join("scenes");
    let text = std::fs::read_to_string(scenes.join(scene)).unwrap();
    std::fs::copy(scenes.join(mesh), dir.path().join(mesh)).unwrap();
    let force = |columns: &str| {
        let scene = dir.path().join(format!("{columns}.toml"));
        let text = text.replace(
            "[tool]",
            &format!("[accuracy]\ncolumns = \"{columns}\"\n\n[tool]"),
        );
        std::fs::write(&scene, text).unwrap();
        let out = dir.path().join(columns);
        let result = snapin(&["run", arg(&scene), "--out", arg(&out), "--no-cache"]);
        assert_eq!(result.code, 0, "{}{}", result.out, result.err);
        assert!(
            !result.err.contains("could not be touched"),
            "{}",
            result.err
        );
        let curve = csv(&out.join("force-travel.csv"));
        let column = curve.iter().find(|c| c.0 == "force_N").unwrap();
        (column.1.clone(), result.err)
    };
    let (all, _) = force("all");
    let (near, said) = force("near");
    assert!(
        said.contains("columns are fetched when the tool comes near"),
        "{said}"
    );
    let difference = largest_difference(&all, &near);
    assert!(difference < 1e-6, "{scene}: {difference}");
}

/// Columns come from another thread while steps are made. The tool is felt by what is there, nothing that is not there
/// carries force, and once all are there the force is that of the whole part.
#[test]
fn columns_that_come_late_are_eased_in_from_another_thread() {
    let (scene, prepared, tool) = clip(Columns::All, Scalar::F64);
    let whole = prepared.compliance.all().unwrap();
    let complete = prepared.contact_part();
    let n = complete.n_candidates();
    let part = Arc::new(ContactPart::with_fetched(
        complete.rest_positions().to_vec(),
        n,
    ));
    let usual = setup::engine(&scene, &prepared, tool.clone()).unwrap();
    let (settings, coupling) = (usual.settings().clone(), usual.coupling().copied());
    let mut reference = Engine::new(Plan::new(
        complete,
        tool.clone(),
        coupling,
        settings.clone(),
    ))
    .unwrap();
    let mut engine = Engine::new(Plan::new(Arc::clone(&part), tool, coupling, settings)).unwrap();
    let start = scene.tool.pose_part_tool;
    let at = |share: f64| DPose3 {
        translation: start.translation + share * scene.drive.travel * scene.drive.direction,
        ..start
    };
    let column = |j: usize| {
        let blocks: Vec<f64> = (0..n).flat_map(|i| whole.block(i, j).to_vec()).collect();
        Blocks::F64(Source::Owned(blocks))
    };
    for k in 0..200 {
        let report = engine.step(&at(0.25 * f64::from(k) / 200.0));
        assert_eq!(report.contacts, 0);
    }
    let report = engine.step(&at(0.25));
    assert!(report.without_column > 0 && report.contacts == 0);
    let mut before = 0.0;
    let mut largest_jump = 0.0_f64;
    std::thread::scope(|scope| {
        let fetching = scope.spawn(|| {
            for j in 0..n {
                assert!(part.insert(j as u32, column(j)));
                assert!(!part.insert(j as u32, column(j)), "there already");
            }
        });
        while !fetching.is_finished() {
            let report = engine.step(&at(0.25));
            let force = report.contact_force_on_tool().length();
            largest_jump = largest_jump.max((force - before).abs());
            before = force;
            for contact in engine.active_contacts() {
                assert!(part.has_column(contact.candidate));
            }
        }
    });
    for _ in 0..60 {
        let report = engine.step(&at(0.25));
        let force = report.contact_force_on_tool().length();
        largest_jump = largest_jump.max((force - before).abs());
        before = force;
    }
    let mut expected = 0.0;
    for k in 0..=200 {
        let report = reference.step(&at(0.25 * f64::from(k) / 200.0));
        expected = report.contact_force_on_tool().length();
    }
    assert!(expected > 1.0, "{expected} N");
    assert!(
        (before - expected).abs() < 1e-5 * expected,
        "{before} and {expected} N"
    );
    assert!(
        largest_jump < 0.1 * expected,
        "{largest_jump} of {expected} N in a step"
    );
}

/// A part with room for few columns says that a node could not be touched, and its force stays finite.
#[test]
fn a_full_store_is_no_error() {
    let (_, prepared, _) = clip(Columns::Near, Scalar::F32);
    let PreparedCompliance::Near(demand) = &prepared.compliance else {
        panic!("columns are fetched");
    };
    let n = demand.part().n_columns();
    assert!(n >= 32 && n < demand.part().n_candidates());
    let few = ContactPart::with_fetched(demand.part().rest_positions().to_vec(), 1);
    let n_rows = demand.part().n_candidates();
    let column = || Blocks::rounded(&vec![1e-6; 9 * n_rows]);
    assert!(few.insert(3, column()));
    assert!(!few.insert(4, column()));
    assert_eq!((few.n_columns(), few.has_column(4)), (1, false));
}

/// The accuracy study tries the p-method on every scene, also where columns are fetched: it is never left out in silence.
#[test]
fn the_p_method_has_all_columns() {
    let mut scene = Scene::load(&root().join("scenes/clip.toml")).unwrap();
    scene.accuracy.columns = Columns::Near;
    assert_eq!(
        setup::part_spec(&scene).unwrap().columns,
        ColumnChoice::Near
    );
    scene.accuracy.adaptive = Adaptive::On(FreeNodes::Radius(1e-3));
    assert_eq!(setup::part_spec(&scene).unwrap().columns, ColumnChoice::All);
}

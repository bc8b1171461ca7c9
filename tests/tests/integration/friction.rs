//! Coulomb friction in the step and in the part's own curve.

use std::fs;
use std::path::Path;

use glam::DVec3;
use glamx::DPose3;
use serde_json::Value;
use snapin::engine::{Engine, StepReport};
use snapin::prepare::PreparedPart;
use snapin::scene::{Scene, StaticFriction};
use snapin::setup;
use snapin_tests::{Outcome, arg, csv, root, shipped, snapin};

/// The shipped clip, prepared.
struct Clip {
    scene: Scene,
    prepared: PreparedPart,
}

impl Clip {
    fn new() -> Self {
        let (scene, prepared) = shipped("clip.toml");
        Self { scene, prepared }
    }

    fn scene(&self, friction: Option<f64>) -> Scene {
        let mut scene = self.scene.with_friction(friction.is_some());
        scene.effects.friction_coefficient = friction;
        scene
    }

    /// The tube's pose is imposed; static friction falls over 0.05 mm.
    fn weakening(&self, at_rest: f64, sliding: f64) -> Engine {
        let mut scene = self.scene(Some(sliding));
        scene.effects.static_friction = Some(StaticFriction {
            coefficient: at_rest,
            weakening_distance: 5e-5,
        });
        let (tool, _) = setup::tool(&self.scene).unwrap();
        setup::drive_engine(&scene, &self.prepared, tool, 200).unwrap()
    }

    /// The tube's pose is imposed.
    fn driven(&self, friction: Option<f64>) -> Engine {
        let (tool, _) = setup::tool(&self.scene).unwrap();
        setup::drive_engine(&self.scene(friction), &self.prepared, tool, 200).unwrap()
    }

    /// The tube hangs on its coupling.
    fn held(&self, friction: Option<f64>) -> Engine {
        let (tool, _) = setup::tool(&self.scene).unwrap();
        setup::engine(&self.scene(friction), &self.prepared, tool).unwrap()
    }

    /// The tube's pose when its axis is at this place of the plane, mm.
    fn at(&self, x: f64, y: f64) -> DPose3 {
        let start = self.scene.tool.pose_part_tool;
        DPose3 {
            translation: DVec3::new(1e-3 * x, 1e-3 * y, start.translation.z),
            ..start
        }
    }
}

fn force_y(report: &StepReport) -> f64 {
    report.contact_force_on_tool().y
}

#[test]
fn a_vanishing_coefficient_gives_the_frictionless_forces() {
    let clip = Clip::new();
    let (mut plain, mut rubbing) = (clip.driven(None), clip.driven(Some(1e-12)));
    assert!(!plain.has_friction() && rubbing.has_friction());
    let mut most = 0.0_f64;
    for k in 0..130 {
        let target = clip.at(0.0, 13.0 - 0.1 * f64::from(k));
        let (a, b) = (plain.step(&target), rubbing.step(&target));
        assert!(b.lcp_solved && b.converged, "{k}: {}", b.certificate);
        let difference = a.contact_force_on_tool() - b.contact_force_on_tool();
        most = most.max(a.contact_force_on_tool().length());
        assert!(
            difference.length() < 1e-9 * most.max(1.0),
            "{k}: {difference}"
        );
    }
    assert!(most > 8.0);
}

/// In the plane of the clip and about its axis the tube wanders as a hand might that trembles.
#[test]
fn friction_never_gives_energy_and_forces_stay_bounded() {
    const STEPS: usize = 100_000;
    let clip = Clip::new();
    let mut engine = clip.held(Some(0.3));
    let mut state = 7_u64;
    let mut random = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let (mut x, mut y, mut turn) = (0.0_f64, 12.0_f64, 0.0_f64);
    let (mut unsolved, mut unsettled) = (0, 0);
    let (mut touching, mut largest) = (0, 0.0_f64);
    for step in 0..STEPS {
        // Up to 50 mm/s, across, along and about the axis.
        x = (x + 0.05 * random()).clamp(-1.0, 1.0);
        y = (y + 0.05 * random()).clamp(0.0, 13.0);
        turn += 0.01 * random();
        let mut target = clip.at(x, y);
        target.rotation *= glam::DQuat::from_rotation_z(turn);
        let report = engine.step(&target);
        let force = report.contact_force_on_tool().length();
        assert!(force.is_finite() && force < 200.0, "{step}: {force} N");
        // Round-off of what the forces do; an answer that is not solved says so.
        let gives = report.dissipated < -1e-12;
        assert!(
            !gives || !report.lcp_solved,
            "{step}: {} J",
            report.dissipated
        );
        touching += usize::from(report.contacts > 0);
        largest = largest.max(force);
        unsolved += usize::from(!report.lcp_solved);
        unsettled += usize::from(!report.converged);
        assert!(!report.lcp_solved || report.certificate < 1e-8, "{step}");
    }
    assert!(
        touching > STEPS / 2 && largest > 5.0,
        "{touching}, {largest} N"
    );
    assert!(
        unsolved * 4000 < STEPS && unsettled * 1000 < STEPS,
        "{unsolved} unsolved and {unsettled} unsettled of {STEPS}"
    );
}

/// Increments are implicit: the curve changes in proportion to their size.
#[test]
fn smaller_increments_change_the_curve_at_first_order() {
    let clip = Clip::new();
    let curve = |per_place: u32| -> Vec<f64> {
        let mut engine = clip.driven(Some(0.2));
        let place = |k: u32| 13.0 - 0.2 * f64::from(k) / f64::from(per_place);
        engine.step(&clip.at(0.0, place(0)));
        let steps =
            (1..=60 * per_place).map(|k| (k, force_y(&engine.step(&clip.at(0.0, place(k))))));
        steps
            .filter(|(k, _)| k % per_place == 0)
            .map(|(_, force)| force)
            .collect()
    };
    let distance = |a: &[f64], b: &[f64]| -> f64 {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>().sqrt()
    };
    let finest = curve(32);
    let errors = [1, 2, 4, 8].map(|n| distance(&curve(n), &finest));
    // An eighth of the increment, an eighth of the error; where nodes land it is no clean order.
    assert!(
        errors[3] < 0.25 * errors[0] && errors[2] < errors[0],
        "{errors:?}"
    );
    assert!(errors[0] > 0.0);
}

/// While contacts stick the part is as stiff as if it were glued to the tube: a hand that trembles feels all of the force.
#[test]
fn turning_back_sticks_before_it_slips_the_other_way() {
    let clip = Clip::new();
    let mut engine = clip.driven(Some(0.2));
    for k in 0..=80 {
        engine.step(&clip.at(0.0, 13.0 - 0.05 * f64::from(k)));
    }
    let turned = engine.step(&clip.at(0.0, 9.0));
    let before = force_y(&turned);
    let back: Vec<StepReport> = (1..=10)
        .map(|k| engine.step(&clip.at(0.0, 9.0 + 0.01 * f64::from(k))))
        .collect();
    assert!(
        before > 10.0 && back[0].sticking > 0,
        "{before} N, {} stick",
        back[0].sticking
    );
    let after = force_y(&back[5]);
    assert!(after < 0.3 * before, "{before} N, then {after}");
}

/// Static friction is overcome once; then the tube slides as with kinetic friction alone, until it turns back.
#[test]
fn static_friction_holds_until_it_slips_and_again_after_turning_back() {
    let clip = Clip::new();
    // In to 11 mm, in steps of 20 um, then back by 0.6 mm in steps of 5 um.
    let curve = |mut engine: Engine| -> Vec<f64> {
        let into = (0..=100).map(|k| 13.0 - 0.02 * f64::from(k));
        let out = (1..=120).map(|k| 11.0 + 0.005 * f64::from(k));
        let places = into.chain(out);
        places
            .map(|y| {
                let report = engine.step(&clip.at(0.0, y));
                assert!(report.lcp_solved && report.dissipated > -1e-12, "{y}");
                force_y(&report)
            })
            .collect()
    };
    let kinetic = curve(clip.driven(Some(0.2)));
    let held = curve(clip.driven(Some(0.4)));
    let both = curve(clip.weakening(0.4, 0.2));
    assert_eq!(curve(clip.weakening(0.2, 0.2)), kinetic);
    let (into, end) = (kinetic[100], kinetic.len() - 1);
    assert!(into > 5.0 && held[100] > 1.2 * into);
    // Long since sliding, in and out.
    for at in [100, end] {
        let scale = into.abs();
        assert!(
            (both[at] - kinetic[at]).abs() < 0.01 * scale,
            "{at}: {} and {}",
            both[at],
            kinetic[at]
        );
    }
    // How far the force falls as the tube turns: farther than with kinetic friction, and no farther than static holds.
    let lowest = |curve: &[f64]| curve[101..].iter().copied().fold(f64::INFINITY, f64::min);
    let (least, most) = (lowest(&kinetic), lowest(&held));
    let reached = lowest(&both);
    assert!(
        reached < least - 0.25 * (least - most) && reached > most - 1e-3,
        "{most} {reached} {least}"
    );
}

/// A scene of the clip with these effects, run.
fn run(folder: &Path, effects: &str) -> (Outcome, Value) {
    run_with(folder, |scene| format!("{scene}{effects}"))
}

/// A scene of the clip, changed and run.
fn run_with(folder: &Path, change: impl Fn(String) -> String) -> (Outcome, Value) {
    let scenes = root().join("scenes");
    let text = fs::read_to_string(scenes.join("clip.toml")).unwrap();
    let drive = text.find("[drive]").unwrap();
    let mesh = scenes.join("clip.msh").display().to_string();
    let text = text[..drive].replace("\"clip.msh\"", &format!("{mesh:?}"));
    let more = "[drive]\ndirection = [0, -1, 0]\ntravel = 0.014\n\
                [output]\nframes = 1\npictures = false\nvtu = false\nmcap = false\n";
    let file = folder.join("clip.toml");
    fs::write(&file, change(format!("{text}{more}"))).unwrap();
    let out = folder.join("out");
    let outcome = snapin(&["run", arg(&file), "--no-cache", "--out", arg(&out)]);
    let summary = fs::read_to_string(out.join("summary.json")).unwrap_or_default();
    (outcome, serde_json::from_str(&summary).unwrap_or_default())
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// In and out, against independent programs on a mesh of the same clip: 15.44 for 9.23 N in, 14.65 for 8.76 out.
#[test]
fn insertion_and_retention_with_friction_stand_beside_those_without() {
    let folder = tempfile::tempdir().unwrap();
    let (outcome, summary) = run(folder.path(), "[effects]\nfriction_coefficient = 0.2\n");
    assert_eq!(outcome.code, 0, "{}", outcome.err);
    assert_eq!(summary["verdict"]["outcome"], "snaps");
    let friction = &summary["curve"]["friction"];
    let into = number(&summary["curve"]["peak_insertion_force_N"]);
    let plain_in = number(&friction["frictionless_peak_insertion_force_N"]);
    assert!((plain_in - 8.444).abs() < 5e-3, "{plain_in}");
    assert!(
        (into / plain_in / (15.438 / 9.230) - 1.0).abs() < 0.01,
        "{into}"
    );
    let out = number(&summary["peak_retention_force_N"]);
    let plain_out = number(&friction["frictionless_peak_removal_force_N"]);
    // The removal is at other nodes of another mesh: 4 % apart.
    assert!(
        (out / plain_out / (14.650 / 8.763) - 1.0).abs() < 0.05,
        "{out}"
    );
    assert!(number(&summary["travel_at_retention_m"]) > 9e-3);
    assert!(summary["locking"].is_null());
    let put_in = number(&friction["put_in_J"]);
    let lost = number(&friction["unaccounted_J"]);
    assert!(lost.abs() < 5e-3 * put_in, "{lost} of {put_in} J");
    assert!((number(&summary["dissipated_work_J"]) / 0.1355 - 1.0).abs() < 0.1);
    assert_eq!(summary["effects"]["friction"]["on"], true);
    // The estimate is within a factor of 1.5 of the change.
    let estimate = number(&summary["effects"]["friction"]["number"]);
    let change = into / plain_in - 1.0;
    assert!(
        estimate / change < 1.5 && change / estimate < 1.5,
        "{estimate} {change}"
    );
    assert!(
        outcome
            .out
            .contains("friction              coefficient 0.2: in"),
        "{}",
        outcome.out
    );
    let out = folder.path().join("out");
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(
        page.contains("without friction") && page.contains("Friction with a coefficient of 0.2")
    );
    let columns = csv(&out.join("curve.csv"));
    let (_, dissipated) = columns
        .iter()
        .find(|(name, _)| name == "dissipated_J")
        .unwrap();
    assert!(dissipated.iter().all(|joule| *joule > -1e-12));
}

#[test]
fn friction_is_simulated_from_where_it_changes_the_force_by_a_tenth() {
    let folder = tempfile::tempdir().unwrap();
    let decided = |effects: &str| {
        let (outcome, summary) = run(folder.path(), &format!("[effects]\n{effects}\n"));
        assert_eq!(outcome.code, 0, "{}", outcome.err);
        let friction = &summary["effects"]["friction"];
        (
            friction["on"].as_bool(),
            number(&friction["number"]),
            summary,
        )
    };
    let (on, share, summary) = decided("friction_coefficient = 0.034");
    assert!(on == Some(false) && share < 0.1, "{share}");
    assert!(summary["curve"]["friction"].is_null());
    let (on, share, _) = decided("friction_coefficient = 0.036");
    assert!(on == Some(true) && share > 0.1, "{share}");
    let (on, ..) = decided("friction_coefficient = 0.02\nfriction = \"on\"");
    assert_eq!(on, Some(true));
    let (_, _, summary) = decided("friction_coefficient = 0.3\nfriction = \"off\"");
    assert!(summary["curve"]["friction"].is_null());
    // Left out on purpose, and told.
    let (number, expected) = (number(&summary["curve"]["peak_insertion_force_N"]), 8.444);
    assert!((number - expected).abs() < 5e-3, "{number}");
    let told = summary["warnings"].to_string();
    assert!(
        told.contains("calls for friction, which [effects] leaves out"),
        "{told}"
    );
}

#[test]
fn a_pair_of_materials_has_its_coefficient_and_an_unknown_one_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let with_tool = |material: &str| {
        let material = format!("[tool]\nmaterial = \"{material}\"\n");
        run_with(folder.path(), |scene| {
            let tool = scene.find("[tool]").unwrap();
            let rest = scene[tool..].find('\n').unwrap() + tool + 1;
            format!("{}{material}{}", &scene[..tool], &scene[rest..])
        })
    };
    let (outcome, summary) = with_tool("steel");
    assert_eq!(outcome.code, 0, "{}", outcome.err);
    let friction = &summary["curve"]["friction"];
    assert!((number(&friction["coefficient"]) - 0.275).abs() < 1e-12);
    assert!(
        friction["source"]
            .as_str()
            .unwrap()
            .contains("POM on steel")
    );
    let (outcome, _) = with_tool("steal");
    assert_eq!(outcome.code, 2);
    assert!(
        outcome.err.contains("the nearest is `steel`"),
        "{}",
        outcome.err
    );
}

#[test]
fn effects_tells_what_friction_changes_and_costs() {
    let folder = tempfile::tempdir().unwrap();
    let scene = root().join("scenes/clip.toml");
    let out = folder.path().join("out");
    let words = [
        "effects",
        arg(&scene),
        "--no-cache",
        "--json",
        "--out",
        arg(&out),
    ];
    let outcome = snapin(&words);
    assert_eq!(outcome.code, 0, "{}", outcome.err);
    let study: Value = serde_json::from_str(&outcome.out).unwrap();
    let rows = study["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 8);
    let friction = &rows[0];
    assert_eq!(
        (&friction["effect"], &friction["decision"]),
        (&"friction".into(), &"on".into())
    );
    let insertion = &friction["insertion"];
    let share = number(&insertion["on"]) / number(&insertion["off"]) - 1.0;
    let ratio = number(&friction["number"]) / share;
    assert!(ratio > 1.0 / 1.5 && ratio < 1.5, "{ratio}");
    assert!(number(&friction["step_us"]["on"]) > 0.0 && number(&friction["memory"]) > 0.0);
    for row in &rows[1..] {
        assert_ne!(row["decision"], "on");
        assert!(row["insertion"].is_null() && row["step_us"].is_null());
    }
    for file in ["effects.csv", "effects.json", "force-travel.svg"] {
        assert!(out.join(file).is_file(), "{file}");
    }
}

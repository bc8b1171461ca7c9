//! Two rates: a frozen contact problem against the step it is from and against whole steps elsewhere, and sessions in
//! which the loop solves frozen problems against those in which it solves whole steps.

mod friction;

use device::Wrench;
use glam::{DQuat, DVec3};
use glamx::DPose3;
use snapin::engine::{Engine, StepReport};
use snapin::prepare::PreparedPart;
use snapin::scene::{ContactAt, Rates, Scene};
use snapin::session::fast::{FastLoop, FastSettings};
use snapin::session::handover::Handed;
use snapin::session::{self, Recording};
use snapin::setup;
use snapin::shape::Shape;
use snapin_tests::{arg, root, shipped, snapin};

fn held(scene: &Scene, part: &PreparedPart) -> session::Held {
    let (tool, _) = setup::tool(scene).unwrap();
    setup::held(scene, part, &tool)
}

fn engine(scene: &Scene, part: &PreparedPart) -> Engine {
    let (tool, _) = setup::tool(scene).unwrap();
    setup::engine(scene, part, tool).unwrap()
}

/// The tool at a share of the scene's travel.
fn at(scene: &Scene, share: f64) -> DPose3 {
    let start = scene.tool.pose_part_tool;
    DPose3 {
        translation: start.translation + share * scene.drive.travel * scene.drive.direction,
        ..start
    }
}

/// Size of a wrench's difference over the wrench's, torques by a lever of 10 mm.
fn apart(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    let size = |w: &dyn Fn(usize) -> f64| {
        (0..6)
            .map(|i| (w(i) / if i < 3 { 1.0 } else { 0.01 }).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    size(&|i| a[i] - b[i]) / size(&|i| b[i])
}

/// A problem that was just frozen answers as the step did, to round-off, all along the way in and out; also after it
/// has been asked for other targets.
#[test]
fn a_frozen_problem_answers_at_its_own_target_as_the_step_did() {
    for (name, contact_at) in [
        ("clip.toml", ContactAt::Nodes),
        ("clip.toml", ContactAt::Places),
        ("hook.toml", ContactAt::Nodes),
    ] {
        let (mut scene, part) = shipped(name);
        scene.accuracy.contact_at = contact_at;
        let mut engine = engine(&scene, &part);
        let mut problem = engine.frozen_problem();
        let mut touched = 0;
        for k in (0..=120).chain((0..120).rev()) {
            let target = at(&scene, f64::from(k) / 120.0);
            let report = engine.step(&target);
            engine.freeze_into(&report, 1e-4, &mut problem);
            let aside = DPose3 {
                translation: target.translation + 1e-4 * DVec3::new(0.3, -0.9, 0.2),
                rotation: DQuat::from_scaled_axis(DVec3::new(1e-3, 0.0, -2e-3)) * target.rotation,
            };
            // Gaps measured anew are those of one more pass: as near as the engine's own nanometre.
            let renewed = problem.solve(&target).report.contact_wrench_on_tool;
            let change = (0..3).map(|i| (renewed[i] - report.contact_wrench_on_tool[i]).abs());
            assert!(change.fold(0.0, f64::max) < 1e-4, "{name} at {k}");
            problem.solve(&aside);
            engine.freeze_into(&report, 1e-4, &mut problem);
            problem.keep_planes();
            let answer = problem.solve(&target);
            problem.solve(&aside);
            let again = problem.solve(&target);
            assert!(answer.is_within && answer.report.lcp_solved);
            if report.contacts == 0 {
                assert_eq!(answer.report.contact_wrench_on_tool, [0.0; 6]);
                continue;
            }
            touched += 1;
            for answer in [answer, again] {
                let error = apart(
                    &answer.report.contact_wrench_on_tool,
                    &report.contact_wrench_on_tool,
                );
                assert!(error < 1e-9, "{name} at {k}: {error:e}");
                let way = answer.report.tool_pose.translation - report.tool_pose.translation;
                // What the last pass moved the tool by is below the engine's own nanometre.
                assert!(way.length() < 1e-9, "{name} at {k}: {way}");
                assert!(answer.report.wrench_mismatch_rel(0.01) < 1e-9);
            }
        }
        assert!(touched > 50, "{name}: {touched}");
    }
}

/// Away from its own target, a problem that keeps its planes errs by first order in the way: halving the way halves
/// the error against a whole step there, because loaded planes turn. One that measures its gaps anew goes on to the
/// whole step's answer, with the operator of another place: twelve solves leave what the engine's own tolerance of a
/// nanometre is worth.
#[test]
fn measured_gaps_lead_to_the_answer_of_a_whole_step() {
    let (scene, part) = shipped("clip.toml");
    let directions = [
        (DVec3::new(0.0, -1.0, 0.0), DVec3::ZERO),
        (DVec3::new(0.6, 0.8, 0.0), DVec3::ZERO),
        (DVec3::ZERO, DVec3::new(0.0, 30.0, 20.0)),
        (DVec3::new(0.0, -0.5, 0.5), DVec3::new(20.0, 0.0, 10.0)),
    ];
    let mut ratios = Vec::new();
    for share in [0.25, 0.32, 0.4, 0.47] {
        for (shift, turn) in directions {
            let frozen_at = at(&scene, share);
            let errors = |size: f64| {
                let mut engine = engine(&scene, &part);
                for k in 0..40 {
                    engine.step(&at(&scene, share * f64::from(k) / 40.0));
                }
                let mut problem = engine.frozen_problem();
                let report = engine.step(&frozen_at);
                assert!(report.contacts > 0);
                let target = DPose3 {
                    translation: frozen_at.translation + size * shift,
                    rotation: DQuat::from_scaled_axis(size * turn) * frozen_at.rotation,
                };
                engine.freeze_into(&report, 4e-4, &mut problem);
                problem.keep_planes();
                let kept = problem.solve(&target).report.contact_wrench_on_tool;
                engine.freeze_into(&report, 4e-4, &mut problem);
                assert!(problem.is_renewed());
                let mut renewed = problem.solve(&target);
                for _ in 0..12 {
                    renewed = problem.solve(&target);
                }
                let whole = engine.step(&target).contact_wrench_on_tool;
                let renewed = renewed.report.contact_wrench_on_tool;
                [apart(&kept, &whole), apart(&renewed, &whole)]
            };
            let (coarse, fine) = (errors(4e-5), errors(2e-5));
            for [_, renewed] in [coarse, fine] {
                assert!(renewed < 1e-5, "{share} {shift} {turn}: {renewed:e}");
            }
            ratios.push(coarse[0] / fine[0]);
        }
    }
    ratios.sort_unstable_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    assert!((1.8..2.3).contains(&median), "{ratios:?}");
}

/// A session of the clip with these rates, without friction.
fn session_of(rates: Rates) -> Recording {
    let (scene, part) = shipped("clip.toml");
    session_in(scene.with_friction(false), &part, rates)
}

fn session_in(mut scene: Scene, part: &PreparedPart, rates: Rates) -> Recording {
    scene.accuracy.rates = rates;
    scene.hand.as_mut().unwrap().hold = 0.02;
    let mut engine = engine(&scene, part);
    let mut shape = Shape::new(part, &scene.accuracy, None).unwrap();
    session::run(
        &setup::session(&scene, held(&scene, part)).unwrap(),
        part,
        &mut engine,
        &mut shape,
        &fem::Silent,
    )
    .unwrap()
}

fn forces(recording: &Recording) -> Vec<f64> {
    let records = recording.records.iter();
    records.map(|r| recording.resistance(r)).collect()
}

/// Forces of frozen problems are those of whole steps, though results come 5 to 20 ms late: over the whole session
/// within a thousandth, where holding the last result would be wrong by a third at 20 ms, and the peak to a
/// ten-thousandth. (The device rounds forces to 0.2 N, so that hands go ways that differ by micrometres.) Every hand-over is logged, no answer is older than twice the delay, and no hand-over makes a difference
/// of more than the device's resolution of 0.2 N.
#[test]
fn two_rates_render_what_whole_steps_would() {
    let one = session_of(Rates::One);
    assert!(one.two_rates.is_none());
    let reference = forces(&one);
    let peak = reference.iter().copied().fold(0.0, f64::max);
    let norm = reference.iter().map(|f| f * f).sum::<f64>();
    let distance = |felt: &[f64]| {
        let squares = felt.iter().zip(&reference).map(|(a, b)| (a - b).powi(2));
        (squares.sum::<f64>() / norm).sqrt()
    };
    for every in [20, 10, 5] {
        let recording = session_of(Rates::Every(every));
        let felt = forces(&recording);
        assert_eq!(felt.len(), reference.len());
        let felt_peak = felt.iter().copied().fold(0.0, f64::max);
        let every = every as usize;
        // The result of the target before last, as it would be held between hand-overs.
        let held_from = |k: usize| (k / every).saturating_sub(1) * every;
        let held: Vec<f64> = (0..reference.len())
            .map(|k| reference[held_from(k)])
            .collect();
        let (error, error_held) = (distance(&felt), distance(&held));
        assert!(
            (felt_peak / peak - 1.0).abs() < 1e-4,
            "every {every}: {felt_peak} and {peak}"
        );
        assert!(error < 1e-3, "every {every}: {error:e}");
        assert!(
            error < 0.03 * error_held,
            "every {every}: {error:e} and {error_held:e}"
        );

        let two = recording.two_rates.as_ref().unwrap();
        assert_eq!(two.log.max_staleness as usize, 2 * every - 1);
        assert_eq!(two.log.faded, 0);
        assert_eq!(two.steps.len(), recording.records.len().div_ceil(every));
        assert_eq!(two.log.hand_overs.len(), two.steps.len() - 1);
        for hand_over in &two.log.hand_overs {
            assert_eq!(hand_over.tick as usize % every, 0);
            assert_eq!(hand_over.age as usize, every);
            assert!(hand_over.difference < 0.2, "{hand_over:?}");
        }
        assert!(two.log.hand_overs.iter().any(|h| h.difference > 0.0));
    }
}

/// A loop at a target in the rise of the clip, with a problem that keeps its planes from 0.2 mm before, and one frozen
/// there.
fn loop_with_a_difference() -> (FastLoop, Box<Handed>, DPose3) {
    let (scene, part) = shipped("clip.toml");
    let mut engine = engine(&scene, &part);
    for k in 0..40 {
        engine.step(&at(&scene, 0.4 * f64::from(k) / 40.0));
    }
    let target = at(&scene, 0.4);
    let before = DPose3 {
        translation: target.translation - 2e-4 * scene.drive.direction,
        ..target
    };
    let mut freeze = |tick, at: &DPose3| {
        let report = engine.step(at);
        let mut problem = engine.frozen_problem();
        engine.freeze_into(&report, 4e-4, &mut problem);
        problem.keep_planes();
        Box::new(Handed { tick, problem })
    };
    let (old, new) = (freeze(0, &before), freeze(10, &target));
    let settings = FastSettings {
        period_s: 1e-3,
        force_resolution: 0.2,
        lever: 0.02,
        n_ticks: 1000,
    };
    (FastLoop::new(old, settings).unwrap(), new, target)
}

fn on_handle(report: &StepReport) -> Wrench {
    -Wrench::from_array(&report.contact_wrench_on_tool)
}

/// A driven hand-over that makes a difference of some tenths of a newton at a target that stands still: no tick
/// changes the wrench by more than half the device's resolution, or what is needed to be there in 20 ms; then the new
/// problem's wrench is rendered, unchanged. The difference and both ages are logged.
#[test]
fn a_difference_at_a_hand_over_is_slewed() {
    let (mut fast, new, target) = loop_with_a_difference();
    let mut spare = Some(new);
    let mut felt = Vec::new();
    for tick in 0..60 {
        let arrived = if tick == 12 { spare.take() } else { None };
        let answer = fast.tick(tick, &target, arrived, on_handle);
        assert_eq!(answer.spent.is_some(), tick == 12);
        assert_eq!(answer.staleness, if tick < 12 { tick } else { tick - 10 });
        felt.push(answer.wrench_on_handle);
    }
    let difference = (felt[11] - felt[59]).force.length();
    assert!(difference > 0.3, "{difference}");
    let step = (difference / 20.0).max(0.1);
    for (tick, pair) in felt.windows(2).enumerate() {
        let change = (pair[1] - pair[0]).force.length();
        assert!(
            change <= step * 1.001,
            "{tick}: {change} N, {step} N allowed"
        );
    }
    assert!((felt[32] - felt[59]).force.length() < 1e-12);
    let log = fast.into_log();
    assert_eq!(log.hand_overs.len(), 1);
    let hand_over = log.hand_overs[0];
    assert_eq!(
        (hand_over.tick, hand_over.age, hand_over.replaced_at_age),
        (12, 2, 12)
    );
    assert!(hand_over.difference >= difference * 0.999);
}

/// No new problem for 200 ms: the wrench stays for a tenth of a second, goes smoothly to nothing within 50 ms, and
/// comes back without a jump when the engine answers again.
#[test]
fn a_stale_wrench_fades_and_comes_back() {
    let (mut fast, new, target) = loop_with_a_difference();
    let mut spare = Some(new);
    let mut felt = Vec::new();
    for tick in 0..290 {
        let arrived = (tick == 200)
            .then(|| spare.take())
            .flatten()
            .map(|mut handed| {
                handed.tick = 195;
                handed
            });
        let answer = fast.tick(tick, &target, arrived, on_handle);
        felt.push(answer.wrench_on_handle.force.length());
    }
    let full = felt[0];
    assert!(full > 1.0);
    assert!(felt[..=100].iter().all(|f| (f - full).abs() < 1e-12));
    assert!(felt[150..200].iter().all(|f| *f == 0.0));
    let largest = felt
        .windows(2)
        .map(|w| (w[1] - w[0]).abs())
        .fold(0.0, f64::max);
    // A smooth step over 50 ms is steepest in its middle, with 1.5 times its mean; coming back takes 20 ms.
    assert!(largest <= full * 1.1 / 20.0, "{largest} of {full}");
    assert!(felt[230] > 0.8 * full);
    assert_eq!(fast.log().faded, 99);
    assert_eq!(fast.log().max_staleness, 199);
}

/// Two runs give the same bits: nothing depends on a clock.
#[test]
fn two_rates_without_a_clock_repeat() {
    let (a, b) = (session_of(Rates::Every(7)), session_of(Rates::Every(7)));
    let bits = |recording: &Recording| -> Vec<[u64; 6]> {
        let records = recording.records.iter();
        records
            .map(|r| r.wrench_on_handle.to_array().map(f64::to_bits))
            .collect()
    };
    assert_eq!(bits(&a), bits(&b));
    let (a, b) = (a.two_rates.unwrap(), b.two_rates.unwrap());
    assert_eq!(a.log.hand_overs, b.log.hand_overs);
}

/// No step with contact fits 7 us (0.7 of a period of 10 us) on any machine of today: two rates are chosen, and it
/// is told why. At a period of 1 ms without a clock to keep there is one.
#[test]
fn steps_that_do_not_fit_the_period_lead_to_two_rates() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::copy(root().join("scenes/clip.msh"), dir.path().join("clip.msh")).unwrap();
    let text = std::fs::read_to_string(root().join("scenes/clip.toml")).unwrap();
    let run = |name: &str, text: &str, more: &[&str]| {
        let scene = dir.path().join(format!("{name}.toml"));
        std::fs::write(&scene, text).unwrap();
        let out = dir.path().join(name);
        let mut words = vec!["run", arg(&scene), "--out", arg(&out), "--no-cache"];
        words.extend(more);
        let outcome = snapin(&words);
        assert_eq!(outcome.code, 0, "{}{}", outcome.out, outcome.err);
        let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
        (summary["rates"].clone(), outcome.err)
    };
    let fast =
        format!("{text}\n[device]\nservo_period = 1e-5\n").replace("hold = 0.3", "hold = 0.0");
    let (rates, said) = run("fast", &fast, &["--real-time"]);
    assert_eq!(rates["rates"], 2, "{rates}");
    assert!(said.contains("two rates"), "{said}");
    assert!(
        rates["two"]["hand_overs"].as_u64().unwrap() > 100,
        "{rates}"
    );
    let (rates, _) = run("plain", &text, &[]);
    assert_eq!(rates["rates"], 1, "{rates}");
}

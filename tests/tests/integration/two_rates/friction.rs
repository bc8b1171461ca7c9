//! Two rates with friction: frozen problems slip from the answer before.

use super::*;

fn rubbing(name: &str, contact_at: ContactAt) -> (Scene, PreparedPart) {
    let (mut scene, part) = shipped(name);
    scene.accuracy.contact_at = contact_at;
    let mut scene = scene.with_friction(true);
    scene.effects.friction_coefficient = Some(0.2);
    (scene, part)
}

/// A problem that was just frozen has the forces of the step, and nothing slips where the target stands still, all along
/// the way in and out.
#[test]
fn a_frozen_problem_with_friction_holds_what_the_step_left() {
    for (name, contact_at) in [
        ("clip.toml", ContactAt::Nodes),
        ("clip.toml", ContactAt::Places),
        ("hook.toml", ContactAt::Nodes),
    ] {
        let (scene, part) = rubbing(name, contact_at);
        let mut engine = engine(&scene, &part);
        assert!(engine.has_friction());
        let mut problem = engine.frozen_problem();
        let mut touched = 0;
        for k in (0..=120).chain((0..120).rev()) {
            let target = at(&scene, f64::from(k) / 120.0);
            let report = engine.step(&target);
            for keeps_planes in [false, true] {
                engine.freeze_into(&report, 1e-4, &mut problem);
                if keeps_planes {
                    problem.keep_planes();
                }
                for _ in 0..3 {
                    let answer = problem.solve(&target);
                    let wrench = answer.report.contact_wrench_on_tool;
                    let change =
                        (0..3).map(|i| (wrench[i] - report.contact_wrench_on_tool[i]).abs());
                    let change = change.fold(0.0, f64::max);
                    // As near as the engine's own nanometre.
                    assert!(change < 2e-4, "{name} at {k}: {change:e} N");
                    assert!(
                        answer.report.lcp_solved && answer.is_within,
                        "{name} at {k}: {} {} {}",
                        answer.report.certificate,
                        answer.is_within,
                        keeps_planes
                    );
                    // The tube is pinched: normal forces are several times their resultant.
                    let force = report.contact_force_on_tool().length();
                    let slip = answer.report.dissipated.abs() / force.max(1e-3);
                    assert!(slip < 1e-8, "{name} at {k}: {slip:e} m");
                }
            }
            touched += usize::from(report.contacts > 0);
        }
        assert!(touched > 50, "{name}: {touched}");
    }
}

/// An increment from the same state, on along the way, back and across: the frozen problem answers as a whole step does.
#[test]
fn a_frozen_problem_slips_as_a_whole_step_does() {
    let (scene, part) = rubbing("clip.toml", ContactAt::Nodes);
    let mut changed = 0;
    let mut worst = [0.0_f64; 2];
    for share in [0.25, 0.32, 0.4, 0.47] {
        for shift in [
            DVec3::new(0.0, -1.0, 0.0),
            DVec3::new(0.0, 1.0, 0.0),
            DVec3::new(0.6, -0.8, 0.0),
            DVec3::new(0.0, -0.5, 0.5),
        ] {
            let mut engine = engine(&scene, &part);
            for k in 0..400 {
                engine.step(&at(&scene, share * f64::from(k) / 400.0));
            }
            let frozen_at = at(&scene, share);
            let report = engine.step(&frozen_at);
            let target = DPose3 {
                translation: frozen_at.translation + 2e-5 * shift,
                ..frozen_at
            };
            let mut problem = engine.frozen_problem();
            engine.freeze_into(&report, 4e-4, &mut problem);
            assert!(problem.is_renewed());
            let renewed = problem.solve(&target).report;
            engine.freeze_into(&report, 4e-4, &mut problem);
            problem.keep_planes();
            let kept = problem.solve(&target).report;
            let whole = engine.step(&target);
            let before = &report.contact_wrench_on_tool;
            changed += usize::from(apart(before, &whole.contact_wrench_on_tool) > 1e-2);
            for (worst, answer) in worst.iter_mut().zip([renewed, kept]) {
                let wrench = &answer.contact_wrench_on_tool;
                *worst = worst.max(apart(wrench, &whole.contact_wrench_on_tool));
                assert!(answer.lcp_solved && answer.dissipated > -1e-12);
            }
        }
    }
    let [renewed, kept] = worst;
    assert!(changed >= 8, "{changed}");
    assert!(renewed < 1e-3 && kept < 0.05, "{renewed:e} and {kept:e}");
}

/// The hand feels in and out what whole steps would give it, though results come 5 to 20 ms late.
#[test]
fn two_rates_render_friction_as_whole_steps_would() {
    let (scene, part) = rubbing("clip.toml", ContactAt::Nodes);
    let one = session_in(scene.clone(), &part, Rates::One);
    let reference = forces(&one);
    let peak = reference.iter().copied().fold(0.0, f64::max);
    let norm = reference.iter().map(|f| f * f).sum::<f64>();
    for every in [20, 5] {
        let recording = session_in(scene.clone(), &part, Rates::Every(every));
        let felt = forces(&recording);
        let squares = felt.iter().zip(&reference).map(|(a, b)| (a - b).powi(2));
        let error = (squares.sum::<f64>() / norm).sqrt();
        let felt_peak = felt.iter().copied().fold(0.0, f64::max);
        assert!(peak > 10.0);
        assert!(
            (felt_peak / peak - 1.0).abs() < 5e-3 && error < 1e-2,
            "every {every}: {felt_peak} and {peak} N, {error:e}"
        );
        let two = recording.two_rates.as_ref().unwrap();
        assert_eq!(two.log.faded, 0);
    }
}

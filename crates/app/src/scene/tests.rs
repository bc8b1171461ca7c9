//! What a scene says, and what it is told when it is wrong. Here what is of no one section.

mod accuracy;
mod handbook;
mod motion;
mod part;
mod tool;

use std::path::Path;

use glam::DVec3;

use super::*;

const CLIP: &str = r#"title = "Clip"

[part]
mesh = "clip.msh"
fixed = "fixed"
contact = "contact"

[part.material]
young_modulus = 2.7e9
poisson_ratio = 0.35

[tool]
shape = "cylinder"
radius = 0.01
position = [0.0, 0.014, 0.005]

[hand]
direction = [0.0, -2.0, 0.0]
speed = 0.02
travel = 0.014
"#;

/// Reads a scene's text as if it were `clip.toml` in a folder with a mesh.
fn read(text: impl Into<Vec<u8>>) -> Result<Scene, SceneError> {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("clip.msh"), "").unwrap();
    std::fs::write(dir.path().join("tool.stl"), "").unwrap();
    Scene::from_bytes(text.into(), &dir.path().join("clip.toml"))
}

fn with(from: &str, to: &str) -> Result<Scene, SceneError> {
    assert!(CLIP.contains(from), "{from}");
    read(CLIP.replacen(from, to, 1))
}

fn adding(text: &str) -> Result<Scene, SceneError> {
    read(format!("{CLIP}{text}"))
}

/// Message of the refusal, without the folder that the test runs in.
fn refusal(result: Result<Scene, SceneError>) -> String {
    let text = result.unwrap_err().to_string();
    let start = text.find("clip.toml").expect("names the file");
    text[start..].to_owned()
}

/// Every refusal starts as expected and is one line.
fn refuses<const N: usize>(cases: [(Result<Scene, SceneError>, &str); N]) {
    for (result, expected) in cases {
        let text = refusal(result);
        assert!(
            text.starts_with(expected),
            "\n  is       {text}\n  expected {expected}"
        );
        assert!(!text.contains('\n'), "{text}");
    }
}

/// All that a plain scene says, and every default.
#[test]
fn scene_has_what_is_written_and_the_defaults() {
    let scene = read(CLIP).unwrap();
    assert_eq!(scene.title, "Clip");
    assert_eq!((scene.units, scene.length_scale), (Units::Si, 1.0));
    assert_eq!(scene.part.order, None);
    assert_eq!(scene.part.mesh.file_name().unwrap(), "clip.msh");
    assert_eq!(scene.part.quadrature, QuadratureRule::Converged);
    let group = |name: &str, line| GroupName {
        name: name.to_owned(),
        line,
    };
    assert_eq!(
        scene.part.fixed,
        [Fixed {
            group: group("fixed", 5),
            components: [true; 3]
        }]
    );
    assert_eq!(scene.part.contact, [group("contact", 6)]);
    assert_eq!(scene.part.material.young_modulus, 2.7e9);
    assert_eq!(
        scene.tool.shape,
        ToolShape::Cylinder {
            radius: 0.01,
            half_length: None
        }
    );
    assert_eq!(
        scene.tool.pose_part_tool.translation,
        DVec3::new(0.0, 0.014, 0.005)
    );
    assert_eq!(scene.handle, Handle::Tool);
    let hand = scene.hand.as_ref().unwrap();
    assert_eq!(hand.direction, DVec3::NEG_Y);
    assert_eq!(
        (hand.mass, hand.stiffness, hand.damping),
        (0.5, 2000.0, 63.0)
    );
    assert_eq!((hand.hold, hand.retract), (0.0, false));
    assert_eq!(
        (hand.rotational_inertia, hand.rotational_stiffness),
        (1e-3, 20.0)
    );
    assert_eq!(hand.rotational_damping, 0.28);
    assert_eq!(scene.coupling.translational_stiffness, 1e4);
    assert_eq!(scene.coupling.rotational_stiffness, 20.0);
    assert_eq!(
        (scene.device.servo_period, scene.device.real_time),
        (1e-3, false)
    );
    assert_eq!(
        scene.accuracy.contact_iterations,
        ContactIterations::Converged
    );
    assert_eq!(scene.accuracy.max_contacts, 500);
    assert_eq!(scene.effects, Effects::default());
    assert_eq!(
        scene.output,
        Output {
            frames: 6,
            camera: None,
            pictures: true,
            vtu: true,
            mcap: true
        }
    );
    assert_eq!(scene.handbook, None);
}

/// The same scene in mm is the same scene.
#[test]
fn units_mm_say_the_same_as_si() {
    let si = read(CLIP).unwrap();
    let mm = read(
        r#"title = "Clip"
units = "mm-N-MPa"
part = { mesh = "clip.msh", fixed = "fixed", contact = "contact", material = { young_modulus = 2700, poisson_ratio = 0.35, density = 1.41e-9 } }
tool = { shape = "cylinder", radius = 10, position = [0, 14, 5] }
hand = { direction = [0, -2, 0], speed = 20, travel = 14, mass = 5e-4, stiffness = 2, damping = 0.063, rotational_inertia = 1, rotational_stiffness = 20e3, rotational_damping = 280 }
coupling = { translational_stiffness = 10, rotational_stiffness = 2e4 }
"#,
    )
    .unwrap();
    let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-14, "{a} {b}");
    assert_eq!(mm.length_scale, 1e-3);
    near(mm.part.material.young_modulus, 2.7e9);
    near(mm.part.material.density.unwrap(), 1410.0);
    near(mm.tool.pose_part_tool.translation.y, 0.014);
    let [mm_hand, si_hand] = [&mm, &si].map(|scene| scene.hand.as_ref().unwrap());
    near(mm_hand.speed, si_hand.speed);
    near(mm_hand.travel, si_hand.travel);
    near(mm_hand.mass, si_hand.mass);
    near(mm_hand.stiffness, si_hand.stiffness);
    near(mm_hand.damping, si_hand.damping);
    near(mm_hand.rotational_inertia, si_hand.rotational_inertia);
    near(mm_hand.rotational_stiffness, si_hand.rotational_stiffness);
    near(mm_hand.rotational_damping, si_hand.rotational_damping);
    near(
        mm.coupling.translational_stiffness,
        si.coupling.translational_stiffness,
    );
    near(
        mm.coupling.rotational_stiffness,
        si.coupling.rotational_stiffness,
    );
    assert_eq!(mm.device, si.device);
}

#[test]
fn refusals_name_line_key_and_mend() {
    refuses([
        (
            adding("[efects]\n"),
            "clip.toml:21: unknown key `efects`; the nearest is `effects`",
        ),
        (
            with("title = \"Clip\"", "units = \"mm\""),
            "clip.toml:1: units has no choice `mm`; the nearest is `SI`, all are `SI`, `mm-N-MPa`",
        ),
        (
            read(&CLIP[..CLIP.find("[hand]").unwrap()]),
            "clip.toml:1: section [drive] is missing: nothing says where the held body goes; add `[drive]` with `direction = [0.0, -1.0, 0.0]` and `travel = ...`",
        ),
        (
            with("title = \"Clip\"", "title = 'Clip"),
            "clip.toml:1: not TOML: ",
        ),
        (
            with("travel", "speed"),
            "clip.toml:20: not TOML: duplicate key",
        ),
        (
            adding("[effects]\nfriction = true"),
            "clip.toml:22: friction: not a word; write one in quotes",
        ),
        (
            read("part = 3"),
            "clip.toml:1: part: invalid type: integer `3`, expected a section",
        ),
        (
            adding("[output]\n\"vt`u\" = 1"),
            "clip.toml:22: unknown key `vt`u`; the nearest is `vtu`",
        ),
        (
            adding("[output]\n\"vtu\\n\" = 1"),
            "clip.toml:22: unknown key `vtu\\n`; the nearest is `vtu`",
        ),
        (
            adding("[effects]\nfriction = \"on\"\n"),
            "clip.toml:22: friction is \"on\" and has no coefficient; write friction_coefficient in [effects], or name both \
             materials: part.material.name and tool.material",
        ),
        (
            adding("[effects]\ngravity = \"on\"\n"),
            "clip.toml:22: this version does not simulate gravity; use \"auto\" to be told its size",
        ),
        (
            adding("[effects]\nfriction = \"on\"\nfriction_coefficient = -0.1\n"),
            "clip.toml:23: friction_coefficient -0.1 must not be negative; write 0 or more",
        ),
        (
            adding("[effects]\nfriction_coefficient = nan\n"),
            "clip.toml:22: friction_coefficient is NaN; write a number",
        ),
        (
            adding("[effects]\nfriction_coefficient = 0.3\nstatic_friction_coefficient = 0.2\n"),
            "clip.toml:23: static_friction_coefficient 0.2 is below 0.3, the coefficient of sliding; write 0.3 or more, or \
             leave it out",
        ),
        (
            adding("[effects]\nstatic_friction_coefficient = 0.2\n"),
            "clip.toml:22: static_friction_coefficient has no friction_coefficient beside it, that of sliding; write \
             friction_coefficient too, or both materials",
        ),
        (
            adding("[effects]\nfriction_coefficient = 0.2\nslip_weakening_distance = 1e-4\n"),
            "clip.toml:23: slip_weakening_distance is the way from static_friction_coefficient to friction_coefficient; write \
             static_friction_coefficient too, or leave it out",
        ),
        (
            adding(
                "[effects]\nfriction_coefficient = 0.2\nstatic_friction_coefficient = 0.3\nslip_weakening_distance = 0\n",
            ),
            "clip.toml:24: slip_weakening_distance 0 must be above 0; write a positive number",
        ),
        (
            adding("[effects]\nfriction = \"onn\"\n"),
            "clip.toml:22: friction has no choice `onn`; the nearest is `on`",
        ),
        (
            adding("[device]\nservo_period = 1\n"),
            "clip.toml:22: servo_period 1 s is not between 1e-5 and 0.1; haptic devices take 0.001",
        ),
        (
            adding("[output]\nframes = -1\n"),
            "clip.toml:22: frames -1 is out of range; write 0 to 1000",
        ),
        (
            adding("[output]\ncamera = [0, 0, 0]\n"),
            "clip.toml:22: camera [0.0, 0.0, 0.0] has no direction; write where it points, such as [0.0, -1.0, 0.0]",
        ),
    ]);
}

#[test]
fn unreadable_and_binary_scenes_are_refused() {
    let error = Scene::load(Path::new("no-such.toml")).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("no-such.toml: cannot read the scene: "),
        "{error}"
    );
    assert_eq!(error.line(), None);
    let text = refusal(read(b"title = \"a\"\n\n\xff\xfe".to_vec()));
    assert_eq!(text, "clip.toml:3: not UTF-8 text; save the scene as UTF-8");
}

/// Numbers that overflow or vanish in SI are refused, not passed on.
#[test]
fn numbers_beyond_si_are_refused() {
    for young in ["1e305", "1.79e308"] {
        let text = format!("units = \"mm-N-MPa\"\n{}", CLIP.replace("2.7e9", young));
        let text = refusal(read(text));
        assert!(
            text.contains("is beyond what SI numbers can hold; check the units"),
            "{text}"
        );
    }
    let text = format!(
        "units = \"mm-N-MPa\"\n{}",
        CLIP.replace("radius = 0.01", "radius = 5e-324")
    );
    assert!(refusal(read(text)).starts_with("clip.toml:15: radius 5e-324 is beyond"));
}

/// Whatever bytes come, the answer is a scene or a refusal with a line that the file has.
#[test]
fn mutated_bytes_never_panic() {
    let whole = format!(
        "{CLIP}[accuracy]\ncontact_iterations = 3\n[effects]\nfriction = \"auto\"\n\
         [handbook]\nlength = 0.02\nthickness = 0.002\nwidth = 0.006\nundercut = 0.001\n\
         lead_angle_deg = 30\nfriction = 0.2\n"
    );
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("clip.msh"), "").unwrap();
    let path = dir.path().join("clip.toml");
    let judge = |bytes: Vec<u8>| {
        let n_lines = 1 + bytes.iter().filter(|&&byte| byte == b'\n').count();
        if let Err(error) = Scene::from_bytes(bytes, &path) {
            assert!(
                error
                    .line()
                    .is_some_and(|line| (1..=n_lines).contains(&line)),
                "{error}"
            );
            assert!(!error.to_string().contains('\n'), "{error}");
        }
    };
    let replacements = b"\0\xff\n\"'=[]{}.,#-9eE \xc3";
    for at in 0..whole.len() {
        for &byte in replacements {
            let mut bytes = whole.clone().into_bytes();
            bytes[at] = byte;
            judge(bytes.clone());
            bytes.remove(at);
            judge(bytes);
        }
        judge(whole.as_bytes()[..at].to_vec());
        let mut bytes = whole.clone().into_bytes();
        bytes.splice(at..at, "é".bytes());
        judge(bytes);
    }
}

/// Every scene that is shipped.
#[test]
fn shipped_scenes_are_valid() {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut n_scenes = 0;
    for entry in std::fs::read_dir(&dir).unwrap() {
        let path = entry.unwrap().path();
        if path
            .extension()
            .is_some_and(|extension| extension == "toml")
        {
            let scene = Scene::load(&path).unwrap();
            let command = format!(
                "cargo run --release -- run scenes/{}",
                path.file_name().unwrap().to_str().unwrap()
            );
            assert!(scene.source.contains(&command), "{command}");
            n_scenes += 1;
        }
    }
    assert!(n_scenes >= 2);
}

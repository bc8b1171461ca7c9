//! What a scene says, and what it is told when it is wrong.

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
fn fixed_takes_names_and_tables() {
    let scene = with(
        "fixed = \"fixed\"",
        "fixed = [\n  \"foot\",\n  { group = \"symmetry\", components = [\"x\", \"z\"] },\n]",
    )
    .unwrap();
    let [foot, symmetry] = scene.part.fixed.as_slice() else {
        panic!("two groups")
    };
    assert_eq!((foot.group.name.as_str(), foot.group.line), ("foot", 6));
    assert_eq!(
        (symmetry.group.line, symmetry.components),
        (7, [true, false, true])
    );
    let scene = with("contact = \"contact\"", "contact = [\"lips\", \"inside\"]").unwrap();
    assert_eq!(scene.part.contact[1].name, "inside");
}

/// Where local +z points, for each way to say it.
#[test]
fn tool_axis_and_rotation_turn_local_z() {
    let z = |scene: Scene| scene.tool.pose_part_tool.rotation * DVec3::Z;
    let radius = "radius = 0.01";
    let axis = |text: &str| with(radius, &format!("{radius}\n{text}")).unwrap();
    assert!((z(axis("axis = [3, 0, 0]")) - DVec3::X).length() < 1e-15);
    assert!((z(axis("axis = [0, 0, -1e-300]")) - DVec3::NEG_Z).length() < 1e-15);
    assert!((z(axis("axis = [0, 1e300, 0]")) - DVec3::Y).length() < 1e-15);
    // Half a turn about x.
    assert!((z(axis("rotation = [1e200, 0, 0, 0]")) - DVec3::NEG_Z).length() < 1e-15);
}

#[test]
fn tool_shapes_take_their_own_keys() {
    let shape = |text: &str| with("shape = \"cylinder\"\nradius = 0.01", text);
    let parsed = |text: &str| shape(text).unwrap().tool.shape;
    assert_eq!(
        parsed("shape = \"sphere\"\nradius = 1"),
        ToolShape::Sphere { radius: 1.0 }
    );
    assert_eq!(parsed("shape = \"half-space\""), ToolShape::HalfSpace);
    assert_eq!(
        parsed("shape = \"box\"\nhalf_extents = [1, 2, 3]"),
        ToolShape::Box {
            half_extents: DVec3::new(1.0, 2.0, 3.0)
        }
    );
    assert_eq!(
        parsed("shape = \"capsule\"\nradius = 1\nhalf_length = 2"),
        ToolShape::Capsule {
            radius: 1.0,
            half_length: 2.0
        }
    );
    let ToolShape::Mesh {
        file,
        line,
        scale,
        field,
    } = parsed("shape = \"mesh\"\nfile = \"tool.stl\"\nscale = 0.001\nfield_error = 1e-6")
    else {
        panic!("mesh")
    };
    assert_eq!(
        (file.file_name().unwrap().to_str(), line, scale),
        (Some("tool.stl"), 14, 1e-3)
    );
    assert_eq!(
        field.map(|field| (field.error, field.line)),
        Some((1e-6, 16))
    );
}

/// Every refusal, word for word.
#[test]
fn refusals_name_line_key_and_mend() {
    let nu = "poisson_ratio = 0.35";
    let shape = "shape = \"cylinder\"\nradius = 0.01";
    let cases = [
        (
            with(nu, "poisson_ratio = 0.5"),
            "clip.toml:10: poisson_ratio 0.5 must be below 0.5; for rubber-like parts use 0.49 with order = 3",
        ),
        (
            with(nu, "poisson_ratio = -1"),
            "clip.toml:10: poisson_ratio -1 must be above -1; plastics have 0.3 to 0.45",
        ),
        (
            with(nu, "poisson_ratio = nan"),
            "clip.toml:10: poisson_ratio is NaN; write a number",
        ),
        (
            with("2.7e9", "-inf"),
            "clip.toml:9: young_modulus is -inf; write a number",
        ),
        (
            with("2.7e9", "0"),
            "clip.toml:9: young_modulus 0 must be above 0; write a positive number",
        ),
        (
            with("young_modulus", "youngs_modulus"),
            "clip.toml:9: unknown key `youngs_modulus`; the nearest is `young_modulus`",
        ),
        (
            adding("[efects]\n"),
            "clip.toml:21: unknown key `efects`; the nearest is `effects`",
        ),
        (
            with("\"cylinder\"", "\"cilinder\""),
            "clip.toml:13: shape has no choice `cilinder`; the nearest is `cylinder`",
        ),
        (
            with("title = \"Clip\"", "units = \"mm\""),
            "clip.toml:1: units has no choice `mm`; the nearest is `SI`, all are `SI`, `mm-N-MPa`",
        ),
        (
            with(nu, ""),
            "clip.toml:8: key `poisson_ratio` is missing in [part.material]; add `poisson_ratio = ...`",
        ),
        (
            with("mesh = \"clip.msh\"", ""),
            "clip.toml:3: key `mesh` is missing in [part]; add `mesh = ...`",
        ),
        (
            read(&CLIP[..CLIP.find("[hand]").unwrap()]),
            "clip.toml:1: section [drive] is missing: nothing says where the held body goes; add `[drive]` with `direction = [0.0, -1.0, 0.0]` and `travel = ...`",
        ),
        (
            with("0.02", "\"fast\""),
            "clip.toml:19: speed: invalid type: string \"fast\", expected a number",
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
            with("[0.0, -2.0, 0.0]", "[0, 0, 0]"),
            "clip.toml:18: direction [0.0, 0.0, 0.0] has no direction; write where it points, such as [0.0, -1.0, 0.0]",
        ),
        (
            with("[0.0, -2.0, 0.0]", "[0, inf, 0]"),
            "clip.toml:18: direction y is inf; write a number",
        ),
        (
            with("[0.0, -2.0, 0.0]", "[0, 1]"),
            "clip.toml:18: direction: invalid length 2, expected 3 numbers",
        ),
        (
            with("[0.0, -2.0, 0.0]", "[0, 1, 0, 0]"),
            "clip.toml:18: direction: invalid length 4, expected 3 numbers",
        ),
        (
            with("radius = 0.01", "radius = 0.01\nrotation = [0, 0, 0, 1, 0]"),
            "clip.toml:15: rotation: invalid length 5, expected 4 numbers",
        ),
        (
            with("radius = 0.01", "half_extents = [1, 1, 1, 1]"),
            "clip.toml:14: half_extents: invalid length 4, expected 3 numbers",
        ),
        (
            with("mesh = \"clip.msh\"", "order = 99999999999999999999"),
            "clip.toml:4: order: invalid type: integer `99999999999999999999`, expected a whole number that fits 64 bits",
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
            with("speed = 0.02", "speed = 1e-9"),
            "clip.toml:19: travel, speed and hold make 1.4e10 steps of 0.001 s, more than 1e7; move faster or hold for less",
        ),
        (
            with("radius = 0.01", "radius = 0.01\naxis = [0, 0, 0]"),
            "clip.toml:15: axis [0.0, 0.0, 0.0] has no direction",
        ),
        (
            with("radius = 0.01", "radius = 0.01\nrotation = [0, 0, 0, 0]"),
            "clip.toml:15: rotation [0, 0, 0, 0] turns nowhere",
        ),
        (
            with(
                "radius = 0.01",
                "radius = 0.01\naxis = [0, 0, 1]\nrotation = [0, 0, 0, 1]",
            ),
            "clip.toml:16: axis and rotation are both given; keep one of them",
        ),
        (
            with("radius = 0.01", "half_extents = [1, 1, 1]"),
            "clip.toml:14: half_extents does not belong to shape \"cylinder\"; remove it; its own keys: radius and half_length",
        ),
        (
            with("radius = 0.01\n", ""),
            "clip.toml:12: shape \"cylinder\" needs radius in [tool]; add `radius = ...`",
        ),
        (
            with(shape, "shape = \"half-space\"\nradius = 1"),
            "clip.toml:14: radius does not belong to shape \"half-space\"; remove it; its own keys: none",
        ),
        (
            with(shape, "shape = \"mesh\"\nfile = \"tool.step\""),
            "clip.toml:14: tool file tool.step is neither .stl nor .obj; export the tool as STL or OBJ",
        ),
        (
            with("fixed = \"fixed\"", "fixed = []"),
            "clip.toml:5: fixed names no group; name a physical group of the mesh",
        ),
        (
            with(
                "fixed = \"fixed\"",
                "fixed = [{ group = \"a\", components = [] }]",
            ),
            "clip.toml:5: components of `a` are empty; name some of \"x\", \"y\", \"z\", or leave the key out for all",
        ),
        (
            with(
                "fixed = \"fixed\"",
                "fixed = [{ group = \"a\", components = [\"w\"] }]",
            ),
            "clip.toml:5: components has no choice `w`; the nearest is `x`, all are `x`, `y`, `z`",
        ),
        (
            with("fixed = \"fixed\"", "fixed = [{ grup = \"a\" }]"),
            "clip.toml:5: unknown key `grup`; the nearest is `group`",
        ),
        (
            with("fixed = \"fixed\"", "fixed = 3"),
            "clip.toml:5: fixed: invalid type: integer `3`",
        ),
        (
            with("contact = \"contact\"", "contact = \"\""),
            "clip.toml:6: contact has an empty group name; name a physical group of the mesh",
        ),
        (
            with("fixed = \"fixed\"", "fixed = \"fixed\"\norder = 4"),
            "clip.toml:6: order 4 is out of range; write 1 to 3",
        ),
        (
            adding("mass = -0.1\n"),
            "clip.toml:21: mass -0.1 must be above 0; write a positive number",
        ),
        (
            adding("hold = -1\n"),
            "clip.toml:21: hold -1 must not be negative; write 0 or more",
        ),
        (
            adding("[effects]\nfriction = \"on\"\n"),
            "clip.toml:22: this version does not simulate friction; use \"auto\" to be told its size",
        ),
        (
            adding("[effects]\nfriction = \"onn\"\n"),
            "clip.toml:22: friction has no choice `onn`; the nearest is `on`",
        ),
        (
            with("title = \"Clip\"", "accuracy = \"quick\""),
            "clip.toml:1: accuracy has no choice `quick`; the nearest is `exact`, all are `fast`, `balanced`, `exact`",
        ),
        (
            adding("[accuracy]\norder = 1\npreset = \"best\"\n"),
            "clip.toml:23: preset has no choice `best`; the nearest is `fast`",
        ),
        (
            read(format!(
                "accuracy = {{ order = 3 }}\n{}",
                CLIP.replace("\n\n[part]", "\n[part]\norder = 2")
            )),
            "clip.toml:1: accuracy.order 3 and part.order 2 differ; leave one of the two out",
        ),
        (
            adding("[accuracy]\nbudget_us = 0\n"),
            "clip.toml:22: budget_us 0 must be above 0; write a positive number",
        ),
        (
            adding("[accuracy]\nbudget_us = 200.0\norder = 2\n"),
            "clip.toml:22: budget_us chooses order itself, but order is written too; leave out budget_us or order",
        ),
        (
            adding("[accuracy]\nadaptive = -1.0\n"),
            "clip.toml:22: adaptive radius -1 must not be negative; write 0 or more",
        ),
        (
            adding("[accuracy]\nadaptive = \"on\"\n"),
            "clip.toml:22: adaptive has no choice `on`; the nearest is `off`, all are `off`",
        ),
        (
            adding("[accuracy]\nadaptive = {}\n"),
            "clip.toml:22: adaptive says nothing of which nodes are free; write radius, indicator or budget_us",
        ),
        (
            adding("[accuracy]\nadaptive = { radius = 1.0, indicator = 0.1 }\n"),
            "clip.toml:22: adaptive says more than once which nodes are free; keep one of radius, indicator and budget_us",
        ),
        (
            adding("[accuracy]\nadaptive = { raduis = 1.0 }\n"),
            "clip.toml:22: unknown key `raduis`; the nearest is `radius`",
        ),
        (
            adding("[accuracy]\nadaptive = 1\ncolumns = \"near\"\n"),
            "clip.toml:23: columns \"near\" and adaptive do not go together; leave columns out, or write adaptive = \"off\"",
        ),
        (
            adding("[accuracy]\nrates = \"two\"\n"),
            "clip.toml:22: rates has no choice `two`; the nearest is `auto`, all are `auto`, `one`",
        ),
        (
            adding("[accuracy]\nrates = { every = 0 }\n"),
            "clip.toml:22: rates.every 0 is out of range; write 1 to 50",
        ),
        (
            adding("[accuracy]\nrates = { every = 30 }\n[device]\nservo_period = 2e-3\n"),
            "clip.toml:22: rates.every 30 periods of 0.002 s are 0.06 s, more than 0.05 s; write 25 or less",
        ),
        (
            adding("[accuracy]\nmultiply = \"gpu\"\nscalar = \"f64\"\n"),
            "clip.toml:23: scalar \"f64\" does not go with multiply \"gpu\", which keeps 32 or 16 bits; write scalar = \"f32\" or \"f16\" or leave it out, or write multiply = \"cpu\"",
        ),
        (
            adding("[accuracy]\ncolumns = \"near\"\nmultiply = \"gpu\"\n"),
            "clip.toml:22: columns \"near\" does not go with multiply \"gpu\", which needs the whole compliance; leave one of the two out",
        ),
        (
            adding("[accuracy]\nmultiply = \"opencl\"\n"),
            "clip.toml:22: multiply has no choice `opencl`; the nearest is `",
        ),
        (
            adding("[accuracy]\ncontact_scalar = \"f16\"\n"),
            "clip.toml:22: contact_scalar has no choice `f16`; the nearest is `f64`, all are `f64`, `f32`",
        ),
        (
            adding("[accuracy]\ncontact_iterations = 0\n"),
            "clip.toml:22: contact_iterations 0 is out of range; write 1 to 50",
        ),
        (
            adding("[accuracy]\ncontact_iterations = \"convergd\"\n"),
            "clip.toml:22: contact_iterations has no choice `convergd`; the nearest is `converged`",
        ),
        (
            adding("[accuracy]\nmax_contacts = 100000\n"),
            "clip.toml:22: max_contacts 100000 is out of range; write 1 to 5000",
        ),
        (
            adding("[accuracy]\nmerge_tolerance = 5\n"),
            "clip.toml:22: merge_tolerance 5 is more than all of the force; write a share from above 0 to 1",
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
        (
            adding(
                "[handbook]\nlength = 0.02\nthickness = 0.002\nwidth = 0.006\nundercut = 0.001\nlead_angle_deg = 90\nfriction = 0\n",
            ),
            "clip.toml:26: lead_angle_deg 90 must be below 90; ramps have 20 to 45",
        ),
        (
            adding(
                "[handbook]\nlength = 0.02\nthickness = 0.002\nwidth = 0.006\nundercut = 0.001\nlead_angle_deg = 70\nfriction = 0.5\n",
            ),
            "clip.toml:27: friction 0.5 locks a ramp of 70 degrees; friction times tan(lead angle) must be below 1",
        ),
        (
            adding("[handbook]\nkind = \"annular\"\nthickness = 0.001\nlength = 0.02\n"),
            "clip.toml:24: length does not belong to kind \"annular\"; remove it; its own keys: thickness, share, undercut, lead_angle_deg, edge_radius, return_angle_deg, diameter, bead_height, from_end",
        ),
        (
            adding("[handbook]\nkind = \"ring\"\nthickness = 0.001\n"),
            "clip.toml:21: kind \"ring\" needs opening_deg in [handbook]; add `opening_deg = ...`",
        ),
        (
            adding(
                "[handbook]\nthickness = 0.002\nlength = 0.02\nwidth = 0.006\nundercut = 0.001\nlead_angle_deg = 30\nshare = 2\n",
            ),
            "clip.toml:27: share 2 is more than the whole joint; write 1 for a whole joint, 0.5 for half of it, 0.25 for a quarter",
        ),
        (
            adding(
                "[handbook]\nkind = \"ring\"\nthickness = 0.001\nwidth = 0.01\nradius = 0.0101\nopening_deg = 170\n",
            ),
            "clip.toml:14: rod_radius 0.01 passes the opening untouched; radius sin(opening_deg / 2) must be below it",
        ),
        (
            adding(
                "[handbook]\nkind = \"ring\"\nthickness = 0.001\nwidth = 0.01\nradius = 0.0101\nopening_deg = 100\nroot_angle_deg = 140\n",
            ),
            "clip.toml:27: root_angle_deg 140 leaves no arm before the lip at 130; both count from the foot's middle",
        ),
        (
            adding(
                "[handbook]\nkind = \"annular\"\nthickness = 0.001\ndiameter = 0.02\nundercut = 0.0002\nlead_angle_deg = 80\nbead_height = 0.001\n",
            ),
            "clip.toml:26: a ramp of 80 degrees closes this bead; the formula has no answer for so high a bead on so steep a ramp: lower one of them",
        ),
    ];
    for (result, expected) in cases {
        let text = refusal(result);
        assert!(
            text.starts_with(expected),
            "\n  is       {text}\n  expected {expected}"
        );
        assert!(!text.contains('\n'), "{text}");
    }
}

/// A preset is what its settings are, and a key beside it takes precedence.
#[test]
fn a_preset_sets_all_and_a_key_beside_it_wins() {
    let scene = with("title = \"Clip\"", "accuracy = \"exact\"").unwrap();
    assert_eq!(scene.part.order, Some(3));
    assert_eq!(scene.accuracy, Accuracy::of(Some(Preset::Exact)));
    let scene = adding("[accuracy]\npreset = \"fast\"\nscalar = \"f32\"\n").unwrap();
    assert_eq!(scene.part.order, None);
    assert_eq!(scene.accuracy.scalar, MultiplyScalar::F32);
    assert_eq!(
        scene.accuracy.contact_iterations,
        ContactIterations::Times(2)
    );
    let scene = adding("[accuracy]\ncontact_scalar = \"f32\"\ncolumns = \"near\"\n").unwrap();
    assert_eq!(scene.accuracy.contact_scalar, Scalar::F32);
    assert_eq!(scene.accuracy.columns, Columns::Near);
    let scene = with("title = \"Clip\"", "accuracy = { budget_us = 200 }").unwrap();
    assert_eq!(scene.accuracy.budget_us, Some(200.0));
}

/// Where the multiply runs and in which numbers; without a word the program chooses both.
#[test]
fn the_multiply_is_told_by_where_and_by_its_numbers() {
    let multiply = |keys: &str| {
        let accuracy = adding(&format!("[accuracy]\n{keys}\n")).unwrap().accuracy;
        (accuracy.multiply, accuracy.scalar)
    };
    assert_eq!(multiply(""), (Multiply::Auto, MultiplyScalar::Auto));
    assert_eq!(
        multiply("multiply = \"auto\"\nscalar = \"auto\""),
        (Multiply::Auto, MultiplyScalar::Auto)
    );
    assert_eq!(
        multiply("multiply = \"cpu\"\nscalar = \"f64\""),
        (Multiply::Cpu, MultiplyScalar::F64)
    );
    assert_eq!(
        multiply("multiply = \"gpu\"\nscalar = \"f16\""),
        (Multiply::Gpu, MultiplyScalar::F16)
    );
    assert_eq!(
        multiply("preset = \"balanced\"\nmultiply = \"gpu\""),
        (Multiply::Gpu, MultiplyScalar::Auto)
    );
}

/// The p-method is told by a radius or by a table, lengths in the scene's units.
#[test]
fn adaptive_is_off_a_radius_or_a_table() {
    let adaptive = |value: &str| {
        let text = format!("units = \"mm-N-MPa\"\naccuracy.adaptive = {value}\n{CLIP}");
        read(text).unwrap().accuracy.adaptive
    };
    assert_eq!(adaptive("\"off\""), Adaptive::Off);
    assert_eq!(adaptive("2"), Adaptive::On(FreeNodes::Radius(2e-3)));
    assert_eq!(
        adaptive("{ indicator = 0.01 }"),
        Adaptive::On(FreeNodes::Indicator(0.01))
    );
    assert_eq!(
        adaptive("{ budget_us = 50 }"),
        Adaptive::On(FreeNodes::BudgetUs(50.0))
    );
}

/// A mesh that is not there is told with the line that names it.
#[test]
fn missing_mesh_is_told_with_its_line() {
    let error = Scene::from_bytes(CLIP.into(), Path::new("no-such/clip.toml")).unwrap_err();
    let expected = Path::new("no-such").join("clip.msh");
    assert!(
        error
            .to_string()
            .contains(&format!("mesh file {} does not exist", expected.display()))
    );
    assert_eq!(error.line(), Some(4));
    let text = refusal(with("\"clip.msh\"", "\"\""));
    assert!(text.starts_with("clip.toml:4: mesh file "), "{text}");
    assert!(
        text.contains(" is a folder; paths are relative to the scene file"),
        "{text}"
    );
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

#[test]
fn unknown_group_names_the_nearest() {
    let scene = read(CLIP).unwrap();
    let error = scene.unknown_group(&scene.part.contact[0], ["contacts", "body"]);
    let text = refusal(Err(error));
    assert_eq!(
        text,
        "clip.toml:6: the mesh has no group `contact`; the nearest is `contacts`"
    );
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

/// `[drive]` and `[hand]` lend each other the way.
#[test]
fn drive_and_hand_lend_each_other_direction_and_travel() {
    let hand = CLIP.find("[hand]").unwrap();
    let alone = |section: &str| read(format!("{}{section}", &CLIP[..hand])).unwrap();
    let lent = read(CLIP).unwrap();
    let of_hand = lent.hand.as_ref().unwrap();
    assert_eq!(lent.drive.travel, of_hand.travel);
    assert_eq!(lent.drive.direction, of_hand.direction);
    assert_eq!(lent.drive.step, of_hand.travel / 300.0);
    assert!(lent.drive.retract && lent.drive.guide == Guide::Axis);
    let drive = "[drive]\ndirection = [0, 0, 3]\ntravel = 0.002\nstep = 1e-5\nguide = \"free\"\nretract = false\n";
    let scene = alone(drive);
    assert!(scene.hand.is_none());
    assert_eq!(
        (scene.drive.direction, scene.drive.travel),
        (DVec3::Z, 2e-3)
    );
    assert_eq!((scene.drive.step, scene.drive.guide), (1e-5, Guide::Free));
    assert!(!scene.drive.retract);
    let both = alone(&format!("{drive}[hand]\nspeed = 0.01\nstiffness = 500\n"));
    let of_drive = both.hand.unwrap();
    assert_eq!((of_drive.direction, of_drive.travel), (DVec3::Z, 2e-3));
    // 2 sqrt(0.5 kg 500 N/m), to two digits.
    assert_eq!(of_drive.damping, 32.0);
}

#[test]
fn limits_and_the_grip_are_in_the_scenes_units() {
    let text = format!("units = \"mm-N-MPa\"\n{CLIP}");
    let more = "[limits]\ninsertion_below = 9\nstrain_below = 0.02\nstrain_use = \"repeatedly\"\n\
                [holds]\ngrip = [1, 2, 3]\n";
    let scene = read(format!("{text}{more}")).unwrap();
    assert_eq!(scene.limits.insertion_below, Some(9.0));
    assert_eq!(
        (scene.limits.removal_above, scene.limits.strain_below),
        (None, Some(0.02))
    );
    assert_eq!(scene.limits.strain_use, StrainUse::Repeatedly);
    assert!((scene.grip.unwrap() - DVec3::new(1e-3, 2e-3, 3e-3)).length() < 1e-18);
}

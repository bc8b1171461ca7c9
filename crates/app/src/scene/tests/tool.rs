//! `[tool]`: shapes and where they start.

use super::*;

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

#[test]
fn refusals_name_line_key_and_mend() {
    let shape = "shape = \"cylinder\"\nradius = 0.01";
    refuses([
        (
            with("\"cylinder\"", "\"cilinder\""),
            "clip.toml:13: shape has no choice `cilinder`; the nearest is `cylinder`",
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
    ]);
}

//! `[part]`: groups, material, what the mesh does not have.

use super::*;

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
fn unknown_group_names_the_nearest() {
    let scene = read(CLIP).unwrap();
    let error = scene.unknown_group(&scene.part.contact[0], ["contacts", "body"]);
    let text = refusal(Err(error));
    assert_eq!(
        text,
        "clip.toml:6: the mesh has no group `contact`; the nearest is `contacts`"
    );
}

const MATERIAL: &str = "[part.material]\nyoung_modulus = 2.7e9\npoisson_ratio = 0.35\n";

/// One word says the whole material, in any units; what is written beside a name takes precedence.
#[test]
fn material_is_a_word_or_keys_with_the_rest_by_name() {
    let word = with(MATERIAL, "material = \"POM\"\n")
        .unwrap()
        .part
        .material;
    assert_eq!((word.young_modulus, word.poisson_ratio), (2.85e9, 0.35));
    assert_eq!(word.permissible_strain, Some(0.06));
    assert_eq!(word.density, None);
    assert_eq!(
        word.source.as_deref(),
        Some(
            "E at small strain by the data sheet of Hostaform C 9021, Poisson's ratio and permissible strain by Bayer's snap-fit guide"
        )
    );
    let mm = CLIP.replace(MATERIAL, "material = \" pom \"\n");
    let mm = read(format!("units = \"mm-N-MPa\"\n{mm}")).unwrap();
    assert_eq!(mm.part.material.young_modulus, 2.85e9);

    let text = "material = { name = \"PC\", poisson_ratio = 0.38, density = 1200 }\n";
    let beside = with(MATERIAL, text).unwrap().part.material;
    assert_eq!((beside.young_modulus, beside.poisson_ratio), (2.4e9, 0.38));
    assert_eq!(beside.density, Some(1200.0));
    assert_eq!(
        beside.source.as_deref(),
        Some(
            "E at small strain by the data sheet of Makrolon 2405, permissible strain by Bayer's snap-fit guide"
        )
    );

    // All written: nothing of the table, and a name of one's own stays one.
    let written = "name = \"ABS\"\npermissible_strain = 0.01\nyoung_modulus = 2.7e9";
    let written = with("young_modulus = 2.7e9", written)
        .unwrap()
        .part
        .material;
    assert_eq!(written.young_modulus, 2.7e9);
    assert_eq!(written.permissible_strain, Some(0.01));
    assert_eq!(written.source, None);
    let own = "name = \"POM GF25\"\nyoung_modulus = 2.7e9";
    let own = with("young_modulus = 2.7e9", own).unwrap().part.material;
    assert_eq!((own.permissible_strain, own.source), (None, None));
}

/// The word serves the pair's friction too.
#[test]
fn material_by_a_word_has_its_friction() {
    let text = CLIP.replace(MATERIAL, "material = \"POM\"\n");
    let text = text.replace("radius = 0.01", "radius = 0.01\nmaterial = \"steel\"");
    let effects = read(text).unwrap().effects;
    assert!((effects.friction_coefficient.unwrap() - 0.275).abs() < 1e-12);
}

#[test]
fn refusals_of_a_material_name_line_key_and_mend() {
    let material = |text: &str| with(MATERIAL, text);
    refuses([
        (
            material("material = \"PON\"\n"),
            "clip.toml:8: key `young_modulus` is missing and \"PON\" is in no table of materials; the nearest is `POM`; or \
             add `young_modulus = ...` in [part.material]",
        ),
        (
            material("material = \"PA66\"\n"),
            "clip.toml:8: PA66 is known for its friction (as PA), but its young_modulus is in no table; add \
             `young_modulus = ...` in [part.material]; without fibres and fillers POM, PC, ABS have it",
        ),
        (
            material("[part.material]\nyoung_modulus = 9e9\nname = \"POM GF25\"\n"),
            "clip.toml:10: POM GF25 is known for its friction (as POM), but its poisson_ratio is in no table; add \
             `poisson_ratio = ...`",
        ),
        (
            material("material = 3\n"),
            "clip.toml:8: material: invalid type: integer `3`, expected the name of a plastic or a section [part.material]",
        ),
        (
            material("material = { nam = \"POM\" }\n"),
            "clip.toml:8: unknown key `nam`; the nearest is `name`",
        ),
        (
            material(""),
            "clip.toml:3: key `material` is missing in [part]; add `material = ...`",
        ),
    ]);
}

#[test]
fn refusals_name_line_key_and_mend() {
    let nu = "poisson_ratio = 0.35";
    refuses([
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
            with(nu, ""),
            "clip.toml:8: key `poisson_ratio` is missing in [part.material]; add `poisson_ratio = ...`, or name one of POM, PC, ABS",
        ),
        (
            with("mesh = \"clip.msh\"", ""),
            "clip.toml:3: key `mesh` is missing in [part]; add `mesh = ...`",
        ),
        (
            with("mesh = \"clip.msh\"", "order = 99999999999999999999"),
            "clip.toml:4: order: invalid type: integer `99999999999999999999`, expected a whole number that fits 64 bits",
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
    ]);
}

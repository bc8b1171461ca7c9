//! Input that cannot be used is refused with file, place and mend, exit code 2, and nothing lost.

use std::fs;
use std::path::{Path, PathBuf};

use snapin_tests::{Outcome, arg, root, snapin};

/// A folder with the clip's scene and mesh, the scene changed by `edit`.
fn scene_with(dir: &Path, edit: impl Fn(&str) -> String) -> PathBuf {
    for file in ["clip.toml", "clip.msh"] {
        fs::copy(root().join("scenes").join(file), dir.join(file)).unwrap();
    }
    let path = dir.join("clip.toml");
    let text = fs::read_to_string(&path).unwrap();
    let edited = edit(&text);
    assert_ne!(text, edited, "the edit changed nothing");
    fs::write(&path, edited).unwrap();
    path
}

fn run(scene: &Path) -> Outcome {
    let out = scene.with_file_name("result");
    let outcome = snapin(&["run", arg(scene), "--out", arg(&out), "--no-cache"]);
    assert!(!out.exists(), "a refused run leaves no result");
    let left: Vec<_> = fs::read_dir(scene.parent().unwrap())
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.contains("partial"))
        .collect();
    assert!(left.is_empty(), "left behind: {left:?}");
    outcome
}

/// Replaces the value of a key, wherever it stands.
fn set(text: &str, key: &str, value: &str) -> String {
    text.lines()
        .map(|line| {
            if line
                .trim_start()
                .strip_prefix(key)
                .is_some_and(|rest| rest.trim_start().starts_with('='))
            {
                format!("{key} = {value}\n")
            } else {
                format!("{line}\n")
            }
        })
        .collect()
}

#[test]
fn a_wrong_value_names_file_line_and_mend() {
    // key, value, what the message must name beside the file and a line number
    let cases = [
        ("poisson_ratio", "0.5", "below 0.5"),
        ("poisson_ratio", "nan", "poisson_ratio"),
        ("young_modulus", "0.0", "young_modulus"),
        ("young_modulus", "-2.7e9", "young_modulus"),
        ("young_modulus", "\"stiff\"", "young_modulus"),
        ("radius", "inf", "radius"),
        ("speed", "0.0", "speed"),
        ("mesh", "\"nowhere.msh\"", "nowhere.msh"),
        ("shape", "\"cilinder\"", "cylinder"),
        ("direction", "[0.0, 0.0, 0.0]", "direction"),
    ];
    for (key, value, names) in cases {
        let dir = tempfile::tempdir().unwrap();
        let scene = scene_with(dir.path(), |text| set(text, key, value));
        let outcome = run(&scene);
        assert_eq!(outcome.code, 2, "{key} = {value}: {}", outcome.err);
        assert!(
            outcome.err.contains("clip.toml:"),
            "{key} = {value}: {}",
            outcome.err
        );
        assert!(
            outcome.err.contains(names),
            "{key} = {value}: {}",
            outcome.err
        );
        let place = outcome.err.split("clip.toml:").nth(1).unwrap();
        assert!(
            place.starts_with(|c: char| c.is_ascii_digit()),
            "no line: {}",
            outcome.err
        );
    }
}

#[test]
fn an_unknown_key_names_the_nearest_one() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene_with(dir.path(), |text| {
        text.replacen("poisson_ratio", "poison_ratio", 1)
    });
    let outcome = run(&scene);
    assert_eq!(outcome.code, 2);
    assert!(
        outcome.err.contains("poison_ratio") && outcome.err.contains("poisson_ratio"),
        "{}",
        outcome.err
    );
}

#[test]
fn a_region_that_is_not_in_the_mesh_names_those_that_are() {
    for key in ["fixed", "contact"] {
        let dir = tempfile::tempdir().unwrap();
        let scene = scene_with(dir.path(), |text| set(text, key, "\"nose\""));
        let outcome = run(&scene);
        assert_eq!(outcome.code, 2, "{}", outcome.err);
        for word in ["nose", key, "surface", "clip.msh"] {
            assert!(outcome.err.contains(word), "{key}: {}", outcome.err);
        }
    }
}

#[test]
fn a_tool_that_starts_inside_the_part_is_refused_with_the_mend() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene_with(dir.path(), |text| {
        set(text, "position", "[0.0, 0.010, 0.005]")
    });
    let outcome = run(&scene);
    assert_eq!(outcome.code, 2, "{}", outcome.err);
    assert!(
        outcome.err.contains("starts inside") && outcome.err.contains("tool.position"),
        "{}",
        outcome.err
    );
}

#[test]
fn a_damaged_mesh_is_refused_wherever_it_is_damaged() {
    let mesh = fs::read(root().join("scenes/clip.msh")).unwrap();
    for keep in [
        0,
        10,
        60,
        400,
        mesh.len() / 4,
        mesh.len() / 2,
        mesh.len() - 200,
    ] {
        let dir = tempfile::tempdir().unwrap();
        let scene = scene_with(dir.path(), |text| format!("{text}\n# cut\n"));
        fs::write(dir.path().join("clip.msh"), &mesh[..keep]).unwrap();
        let outcome = run(&scene);
        assert_eq!(outcome.code, 2, "cut to {keep} bytes: {}", outcome.err);
        assert!(outcome.err.contains("clip.msh"), "{}", outcome.err);
    }
}

#[test]
fn a_folder_of_other_files_and_an_earlier_result_are_kept() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene_with(dir.path(), |text| set(text, "poisson_ratio", "0.5"));
    let out = dir.path().join("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join("summary.json"), "earlier").unwrap();
    let outcome = snapin(&["run", arg(&scene), "--out", arg(&out), "--no-cache"]);
    assert_eq!(outcome.code, 2);
    assert_eq!(
        fs::read_to_string(out.join("summary.json")).unwrap(),
        "earlier"
    );

    let thesis = dir.path().join("thesis");
    fs::create_dir(&thesis).unwrap();
    fs::write(thesis.join("chapter.tex"), "years").unwrap();
    let good = root().join("scenes/clip.toml");
    let outcome = snapin(&["run", arg(&good), "--out", arg(&thesis), "--no-cache"]);
    assert_eq!(outcome.code, 2, "{}", outcome.err);
    assert!(outcome.err.contains("--out"), "{}", outcome.err);
    assert!(thesis.join("chapter.tex").exists());

    let file = dir.path().join("file");
    fs::write(&file, "x").unwrap();
    let outcome = snapin(&[
        "run",
        arg(&good),
        "--out",
        arg(&file.join("below")),
        "--no-cache",
    ]);
    assert_eq!(outcome.code, 2, "{}", outcome.err);
}

#[test]
fn a_damaged_cache_is_rebuilt_with_a_line_that_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let cache = dir.path().join("cache");
    let scene = root().join("scenes/clip.toml");
    let prepare = || snapin(&["prepare", arg(&scene), "--cache", arg(&cache)]);
    assert_eq!(prepare().code, 0);
    let file = fs::read_dir(&cache)
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let good = fs::read(&file).unwrap();
    let outcome = prepare();
    assert!(outcome.out.contains("read from"), "{}", outcome.out);

    let mut flipped = good.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 1;
    for damaged in [&flipped[..], &good[..good.len() / 3], &[]] {
        fs::write(&file, damaged).unwrap();
        let outcome = prepare();
        assert_eq!(outcome.code, 0, "{}", outcome.err);
        assert!(outcome.err.contains("prepared anew"), "{}", outcome.err);
        assert!(
            fs::read(&file).unwrap() == good,
            "the rebuilt part has the same bytes"
        );
    }
}

#[test]
fn wrong_arguments_are_usage_errors() {
    for args in [
        &["run"][..],
        &["fly"],
        &["run", "scenes/none.toml"],
        &["verify", "/nonexistent"],
    ] {
        let outcome = snapin(args);
        assert_eq!(outcome.code, 2, "{args:?}");
        assert!(!outcome.err.is_empty());
    }
}

#[test]
fn a_part_that_is_not_held_is_refused_with_the_free_motion() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene_with(dir.path(), |text| {
        text.lines()
            .filter(|l| !l.trim_start().starts_with("fixed"))
            .map(|l| format!("{l}\n"))
            .collect()
    });
    let outcome = run(&scene);
    assert_eq!(outcome.code, 2, "{}", outcome.err);
    assert!(
        outcome.err.contains("fixed") && outcome.err.contains("clip.toml:"),
        "{}",
        outcome.err
    );

    let dir = tempfile::tempdir().unwrap();
    let held_along_x = "[{ group = \"fixed\", components = [\"x\"] }]";
    let scene = scene_with(dir.path(), |text| set(text, "fixed", held_along_x));
    let outcome = run(&scene);
    assert_eq!(outcome.code, 2, "{}", outcome.err);
    assert!(
        outcome.err.contains("shift along y") && outcome.err.contains("fixed"),
        "{}",
        outcome.err
    );
}

/// One quadratic element that is valid, bent over so far that its vertices alone are inside out.
fn bent_over_mesh() -> String {
    // Barycentric coordinates of Gmsh's ten nodes.
    let edges = [[0, 1], [1, 2], [0, 2], [0, 3], [2, 3], [1, 3]];
    let mut nodes: Vec<[f64; 4]> = (0..4)
        .map(|v| std::array::from_fn(|k| f64::from(u8::from(k == v))))
        .collect();
    nodes.extend(edges.map(|[a, b]| {
        std::array::from_fn(|k| 0.5 * f64::from(u8::from(k == a) + u8::from(k == b)))
    }));
    let numbers: String = (1..=10).map(|tag| format!("{tag}\n")).collect();
    let places: String = nodes
        .iter()
        .map(|l| {
            let (r, y, t) = (0.1 * l[1], l[2], l[3]);
            let (x, z) = (t * t + r * (1.0 - 2.1 * t), t - 1.05 * t * t - 2.0 * r * t);
            format!("{x} {y} {z}\n")
        })
        .collect();
    format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n\
         $PhysicalNames\n3\n2 1 \"fixed\"\n2 2 \"contact\"\n3 3 \"body\"\n$EndPhysicalNames\n\
         $Entities\n0 0 2 1\n1 0 0 0 1 1 1 1 1 0\n2 0 0 0 1 1 1 1 2 0\n1 0 0 0 1 1 1 1 3 0\n\
         $EndEntities\n$Nodes\n1 10 1 10\n3 1 0 10\n{numbers}{places}$EndNodes\n\
         $Elements\n3 3 1 12\n2 1 9 1\n1 1 3 2 7 6 5\n2 2 9 1\n2 2 3 4 6 9 10\n3 1 11 1\n\
         12 1 2 3 4 5 6 7 8 9 10\n$EndElements\n"
    )
}

#[test]
fn an_order_at_which_an_element_turns_over_is_refused_with_its_tag() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("bent.msh"), bent_over_mesh()).unwrap();
    let scene = scene_with(dir.path(), |text| {
        set(&set(text, "mesh", "\"bent.msh\""), "order", "1")
    });
    let outcome = run(&scene);
    assert_eq!(outcome.code, 2, "{}", outcome.err);
    for part in [
        "bent.msh: element 12 becomes inverted or flat at order 1",
        "ask for order = 2",
    ] {
        assert!(outcome.err.contains(part), "{}", outcome.err);
    }
}

/// A margin of nothing and one that takes in the whole part; both mend by leaving it out.
#[test]
fn a_distance_of_near_nodes_of_nothing_or_beyond_the_part_is_refused() {
    for (value, expected) in [("0.0", "near_distance"), ("0.5", "leave it out")] {
        let dir = tempfile::tempdir().unwrap();
        let scene = scene_with(dir.path(), |text| {
            let key = format!("[accuracy]\nnear_distance = {value}\n\n[tool]");
            text.replace("[tool]", &key)
        });
        let outcome = run(&scene);
        assert_eq!(outcome.code, 2, "{}", outcome.err);
        let says = |part: &str| outcome.err.contains(part);
        assert!(says("clip.toml") && says(expected), "{}", outcome.err);
    }
}

//! The largest strain of a run: that of the beam, the same for each order, with its place and what the material bears.

use std::path::Path;

use serde_json::Value;
use snapin_tests::{arg, root, snapin};

/// Two arms that bend by 1 mm each while they snap through a window; see `tests/data/strain/README.md`.
fn buckle(folder: &Path, order: u32, material: &str) -> (String, Value) {
    let data = root().join("tests/data/strain");
    let text = format!(
        "title = \"buckle\"\nunits = \"mm-N-MPa\"\n\n[part]\nmesh = {:?}\norder = {order}\nfixed = \"base\"\n\
         contact = \"hooks\"\n\n[part.material]\nyoung_modulus = 1600\npoisson_ratio = 0.4\n{material}\n\n\
         [tool]\nshape = \"mesh\"\nfile = {:?}\nposition = [0, 20.5, 0]\n\n\
         [hand]\ndirection = [0, -1, 0]\nspeed = 60\ntravel = 6\nhold = 0.02\nstiffness = 200\nmass = 3e-4\n\
         damping = 0.5\n\n[coupling]\ntranslational_stiffness = 500\n\n[output]\nframes = 4\nvtu = false\nmcap = false\n",
        data.join("two-arms.msh"),
        data.join("window.stl"),
    );
    let scene = folder.join("buckle.toml");
    std::fs::write(&scene, text).unwrap();
    let out = folder.join("result");
    let result = snapin(&["run", arg(&scene), "--out", arg(&out), "--no-cache"]);
    assert_eq!(result.code, 0, "{}\n{}", result.out, result.err);
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    (result.out, serde_json::from_str(&summary).unwrap())
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

/// Integration points had 0.41 % at order 2 and 0.64 % at order 3. Beam: ε = 1.5 h y / L² = 0.59 % at a rigid root; the
/// base gives way as well, so that the arm has a little less. The inner edges at the roots have no fillet and are told
/// apart.
#[test]
fn a_buckles_strain_is_the_beams_at_either_order() {
    let beam = 1.5 * 1.5 * 1.0 / (19.5 * 19.5);
    let bars = [2, 3].map(|order| {
        let folder = tempfile::tempdir().unwrap();
        let (text, summary) = buckle(folder.path(), order, "permissible_strain = 0.04");
        let strain = &summary["strain"];
        let (value, error) = (number(&strain["value"]), number(&strain["error"]));
        assert_eq!(number(&summary["max_principal_strain"]), value);
        assert!((value / beam - 1.0).abs() < 0.15, "order {order}: {value}");
        assert!(error > 0.01 * value && error < 0.25 * value, "{error}");
        assert!(
            (value - beam).abs() < 2.0 * error,
            "order {order}: {value} ± {error}"
        );
        assert_eq!(strain["kind"], "free");
        // At a root of an arm, on its skin, while the hook is on the window's rim.
        let place: Vec<f64> = strain["place_m"]
            .as_array()
            .unwrap()
            .iter()
            .map(number)
            .collect();
        assert!(place[1] > 0.0 && place[1] < 4e-3, "{place:?}");
        let off = [4.5e-3, 6e-3].map(|x| (place[0].abs() - x).abs());
        assert!(off.iter().any(|d| *d < 1e-6), "{place:?}");
        assert!(
            (2e-3..5e-3).contains(&number(&strain["travel_m"])),
            "{strain}"
        );
        for key in ["at_contact", "at_held", "at_inner_edge"] {
            assert!(number(&strain[key]["value"]) > 0.0, "{key}");
        }
        assert!(number(&strain["at_inner_edge"]["place_m"][1]) < 3e-3);
        let once = number(&strain["safety_once"]);
        assert!((once * value / 0.04 - 1.0).abs() < 1e-12);
        assert!((number(&strain["safety_repeated"]) / once - 0.6).abs() < 1e-12);
        assert!(
            text.contains("largest strain") && text.contains("safety"),
            "{text}"
        );
        let frames: Vec<String> = std::fs::read_dir(folder.path().join("result/frames"))
            .unwrap()
            .map(|f| f.unwrap().file_name().into_string().unwrap())
            .collect();
        let pictures = frames.iter().filter(|f| f.ends_with("-strain.png"));
        assert_eq!(pictures.count(), 1, "{frames:?}");
        let report = std::fs::read_to_string(folder.path().join("result/report.html")).unwrap();
        assert!(report.contains("inner edge without a fillet"));
        (value, error)
    });
    let [(two, bar_two), (three, bar_three)] = bars;
    assert!((two - three).abs() < bar_two + bar_three, "{bars:?}");
}

#[test]
fn without_a_permissible_strain_the_safety_is_said_to_be_missing() {
    let folder = tempfile::tempdir().unwrap();
    let (text, summary) = buckle(folder.path(), 1, "");
    assert!(text.contains("no permissible strain given"), "{text}");
    let strain = &summary["strain"];
    assert!(strain["permissible"].is_null() && strain["safety_once"].is_null());
    assert!(number(&strain["value"]) > 0.0);
}

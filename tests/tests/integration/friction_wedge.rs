//! Friction beyond a wedge's angle, where the law has several answers: that is told, and not where there is one.

use std::fs;

use serde_json::Value;
use snapin_tests::{arg, root, snapin};

/// Summary and error stream of the clip with this coefficient, driven over the first touch.
fn run(friction: f64) -> (Value, String) {
    let folder = tempfile::tempdir().unwrap();
    let scenes = root().join("scenes");
    let text = fs::read_to_string(scenes.join("clip.toml")).unwrap();
    let drive = text.find("[drive]").unwrap();
    let mesh = scenes.join("clip.msh").display().to_string();
    let text = text[..drive].replace("\"clip.msh\"", &format!("{mesh:?}"));
    let more = format!(
        "[drive]\ndirection = [0, -1, 0]\ntravel = 0.0014\nretract = false\n\
         [effects]\nfriction = \"on\"\nfriction_coefficient = {friction}\n\
         [output]\nframes = 0\npictures = false\nvtu = false\nmcap = false\n"
    );
    let file = folder.path().join("clip.toml");
    fs::write(&file, text + &more).unwrap();
    let out = folder.path().join("out");
    let outcome = snapin(&["run", arg(&file), "--no-cache", "--out", arg(&out)]);
    assert_eq!(outcome.code, 0, "{}", outcome.err);
    let summary = fs::read_to_string(out.join("summary.json")).unwrap();
    (serde_json::from_str(&summary).unwrap(), outcome.err)
}

/// The mouth's tangent is 0.71 at the first touch, at 1.1 mm of travel. With 1.6 > 1 / 0.71 two independent programs end at
/// different answers there, and all stored increments have others; with 1.0 neither they nor random starts found any.
#[test]
fn a_wedge_tells_that_it_has_several_answers() {
    let (summary, err) = run(1.6);
    let warnings = summary["warnings"].as_array().unwrap();
    let told = warnings.iter().find(|w| w["id"] == "several-answers");
    let told = told.unwrap_or_else(|| panic!("{err}"));
    let text = told["text"].as_str().unwrap();
    assert!(
        text.starts_with("with a friction coefficient of 1.6 the body can wedge: 1.1"),
        "{text}"
    );
    let difference = told["number"].as_f64().unwrap();
    assert!(difference > 1e-3 && difference < 2.0, "{difference}");
    assert!(err.contains(text), "{err}");
    assert_eq!(summary["verdict"]["outcome"], "incomplete");
    for friction in [0.2, 1.0] {
        let (summary, err) = run(friction);
        assert!(
            !summary["warnings"].to_string().contains("several-answers"),
            "{err}"
        );
    }
}

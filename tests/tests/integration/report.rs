//! The page of a run, as a reader meets it.

use std::path::Path;

use snapin_tests::{arg, root, snapin};

/// The hook, pulled out again: the scene in the folder `dir`, its result in `dir/out`.
fn pulled_out(dir: &Path) -> String {
    let scenes = root().join("scenes");
    let text = std::fs::read_to_string(scenes.join("hook.toml")).unwrap();
    let text = text.replace("hold = 0.2\n", "hold = 0.05\nretract = true\n");
    assert!(text.contains("retract = true"));
    std::fs::copy(scenes.join("hook.msh"), dir.join("hook.msh")).unwrap();
    std::fs::write(dir.join("hook.toml"), text).unwrap();
    let out = dir.join("out");
    let result = snapin(&[
        "run",
        arg(&dir.join("hook.toml")),
        "--out",
        arg(&out),
        "--no-cache",
    ]);
    assert_eq!(result.code, 0, "{}", result.err);
    std::fs::read_to_string(out.join("report.html")).unwrap()
}

/// Travel (mm) and force (N) in the caption of a frame's displacement.
fn caption(page: &str, frame: &str) -> (f64, f64) {
    let start = format!("<figcaption>{frame}: displacement, ");
    let at = page.find(&start).unwrap_or_else(|| panic!("no {frame}")) + start.len();
    let words = &page[at..page[at..].find('<').unwrap() + at];
    let (travel, force) = words.split_once(" mm of travel, ").unwrap();
    let force = force.strip_suffix(" N").unwrap();
    (travel.parse().unwrap(), force.parse().unwrap())
}

/// Field case: a buckle's frame `home` was drawn at -0.000184 mm, after pull-out, and another's force was captioned
/// "-0.000000000003 N".
#[test]
fn frames_of_a_part_that_is_pulled_out_are_named_by_what_the_hand_does() {
    let dir = tempfile::tempdir().unwrap();
    let page = pulled_out(dir.path());
    let (home, _) = caption(&page, "home");
    let (removal, pull) = caption(&page, "removal");
    let (out, at_rest) = caption(&page, "out");
    assert!(home > 7.0, "{home} of 7.5 mm");
    assert!(removal < home && pull < -0.5, "{removal} mm, {pull} N");
    assert!(out.abs() < 0.05 && at_rest == 0.0, "{out} mm, {at_rest} N");
    assert!(!page.contains("-0.00000"));
    assert!(!page.contains("missed deadlines"));
}

#[test]
fn the_page_and_the_summary_say_when_and_from_what_they_were_made() {
    let dir = tempfile::tempdir().unwrap();
    let page = pulled_out(dir.path());
    let summary = std::fs::read_to_string(dir.path().join("out/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let made = summary["made"].as_str().unwrap();
    assert!(made.starts_with("20") && made.ends_with('Z'), "{made}");
    assert!(page.contains(&format!("<time datetime=\"{made}\">")));
    let hash = summary["input_hash"].as_str().unwrap();
    assert_eq!(hash.len(), 64);
    assert!(page.contains(&format!("input {}<", &hash[..16])));
    assert_eq!(summary["missed_deadlines"], 0);
    // Each picture is a link to its file.
    let mut links = 0;
    for (at, start) in page.match_indices("<a href=\"") {
        let file = &page[at + start.len()..];
        let file = &file[..file.find('"').unwrap()];
        assert!(dir.path().join("out").join(file).is_file(), "{file}");
        links += 1;
    }
    assert!(links >= 12, "{links}");
}

//! The folder of prepared parts from the command line: its bound, `snapin cache`, what it refuses.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use snapin_tests::{Outcome, arg, root, snapin};

fn prepare(scene: &str, cache: &Path, limit: &str) -> Outcome {
    let scene = root().join("scenes").join(scene);
    let args = [
        "prepare",
        arg(&scene),
        "--cache",
        arg(cache),
        "--cache-limit",
        limit,
    ];
    let outcome = snapin(&args);
    assert_eq!(outcome.code, 0, "{}", outcome.err);
    outcome
}

fn parts(cache: &Path) -> Vec<PathBuf> {
    let all = fs::read_dir(cache)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    all.filter(|path| path.extension().is_some_and(|end| end == "cache"))
        .collect()
}

fn list(cache: &Path) -> Value {
    let outcome = snapin(&["cache", "--cache", arg(cache), "--json"]);
    assert_eq!(outcome.code, 0, "{}", outcome.err);
    serde_json::from_str(&outcome.out).unwrap()
}

#[test]
fn the_cache_keeps_its_bound_and_what_was_used_last() {
    let dir = tempfile::tempdir().unwrap();
    let cache = dir.path().join("cache");
    prepare("clip.toml", &cache, "2GB");
    prepare("hook.toml", &cache, "2GB");
    assert_eq!(parts(&cache).len(), 2);
    // The clip was prepared first, but is used last.
    let all = list(&cache);
    assert_eq!(all["entries"][0]["mesh"], "hook");
    prepare("clip.toml", &cache, "2GB");
    let all = list(&cache);
    assert_eq!(all["entries"][0]["mesh"], "clip");
    assert_eq!(all["limit_bytes"], 2_000_000_000u64);
    // A third part, of the clip's size: the hook goes, the clip stays.
    let clip = all["entries"][0]["bytes"].as_u64().unwrap();
    let text = fs::read_to_string(root().join("scenes/clip.toml")).unwrap();
    let softer = text.replace("poisson_ratio = 0.35", "poisson_ratio = 0.3");
    assert_ne!(softer, text);
    fs::write(dir.path().join("clip.toml"), softer).unwrap();
    fs::copy(root().join("scenes/clip.msh"), dir.path().join("clip.msh")).unwrap();
    let softer = dir.path().join("clip.toml");
    let outcome = prepare(arg(&softer), &cache, &format!("{}", 2 * clip));
    assert!(
        outcome.err.contains("1 prepared part that was not used"),
        "{}",
        outcome.err
    );
    assert_eq!(parts(&cache).len(), 2);
    let all = list(&cache);
    for entry in all["entries"].as_array().unwrap() {
        assert_eq!(entry["mesh"], "clip");
    }
    // Whatever the bound, the part in use is kept, and only that.
    prepare("clip.toml", &cache, "0");
    assert_eq!(parts(&cache).len(), 1);
    assert!(prepare("clip.toml", &cache, "0").out.contains("read from"));
}

#[test]
fn the_cache_is_listed_and_cleared_and_files_of_others_stay() {
    let dir = tempfile::tempdir().unwrap();
    let cache = dir.path().join("cache");
    let empty = snapin(&["cache", "list", "--cache", arg(&cache)]);
    assert_eq!(empty.code, 0);
    assert!(empty.out.contains("0 prepared parts"), "{}", empty.out);
    prepare("clip.toml", &cache, "none");
    fs::write(cache.join("thesis.tex"), "years of work").unwrap();
    let listed = snapin(&["cache", "--cache", arg(&cache)]);
    for text in ["1 prepared part,", "at most 2.0 GB", "clip", "now"] {
        assert!(listed.out.contains(text), "{text}: {}", listed.out);
    }
    let none = snapin(&[
        "cache",
        "clear",
        "--older-than",
        "30",
        "--cache",
        arg(&cache),
    ]);
    assert!(none.out.contains("removed 0 files"), "{}", none.out);
    let all = snapin(&["cache", "clear", "--cache", arg(&cache), "--json"]);
    let removed: Value = serde_json::from_str(&all.out).unwrap();
    assert_eq!(removed["removed"], 1);
    assert_eq!(fs::read_dir(&cache).unwrap().count(), 1);
    assert!(cache.join("thesis.tex").exists());
}

#[test]
fn what_is_no_size_no_days_and_no_folder_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let scene = root().join("scenes/clip.toml");
    for size in ["2 apples", "-1GB", ""] {
        let limit = format!("--cache-limit={size}");
        let refused = snapin(&["prepare", arg(&scene), "--no-cache", &limit]);
        assert_eq!(refused.code, 2, "{}", refused.out);
        assert!(refused.err.contains("is no size"), "{}", refused.err);
    }
    for days in ["x", "-3", "nan", "1e300"] {
        let days = format!("--older-than={days}");
        let refused = snapin(&["cache", "clear", &days, "--cache", arg(dir.path())]);
        assert_eq!(refused.code, 2, "{}", refused.out);
        assert!(refused.err.contains("no number of days"), "{}", refused.err);
    }
    let file = dir.path().join("file");
    fs::write(&file, "x").unwrap();
    for action in ["list", "clear"] {
        let refused = snapin(&["cache", action, "--cache", arg(&file)]);
        assert_eq!(refused.code, 2);
        assert!(refused.err.contains(arg(&file)), "{}", refused.err);
    }
    // A part is prepared all the same, and why it is not kept is told.
    let outcome = snapin(&["prepare", arg(&scene), "--cache", arg(&file)]);
    assert_eq!(outcome.code, 0, "{}", outcome.err);
    assert!(
        outcome.err.contains("cannot keep the prepared part"),
        "{}",
        outcome.err
    );
}

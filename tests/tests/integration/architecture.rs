//! Which crate may know which: read from the manifests, so that a new arrow is noticed.

use std::collections::BTreeSet;
use std::fs;

use snapin_tests::root;

fn workspace_dependencies(manifest: &str) -> BTreeSet<String> {
    let text = fs::read_to_string(root().join(manifest)).unwrap();
    let table: toml::Table = text.parse().unwrap();
    let names = ["fem", "contact", "device", "gpu", "snapin"];
    ["dependencies", "dev-dependencies", "build-dependencies"]
        .iter()
        .filter_map(|section| table.get(*section)?.as_table())
        .flat_map(|t| t.keys().cloned())
        .filter(|key| names.contains(&key.as_str()))
        .collect()
}

#[test]
fn only_the_app_knows_other_crates() {
    for name in ["fem", "contact", "device", "gpu"] {
        let known = workspace_dependencies(&format!("crates/{name}/Cargo.toml"));
        assert!(known.is_empty(), "{name} must not know {known:?}");
    }
    let app = workspace_dependencies("crates/app/Cargo.toml");
    assert_eq!(
        app,
        ["contact", "device", "fem", "gpu"]
            .map(str::to_owned)
            .into()
    );
}

#[test]
fn every_crate_takes_the_lints_of_the_workspace() {
    for name in [
        "crates/fem",
        "crates/contact",
        "crates/device",
        "crates/gpu",
        "crates/app",
        "tests",
    ] {
        let text = fs::read_to_string(root().join(name).join("Cargo.toml")).unwrap();
        assert!(text.contains("[lints]\nworkspace = true"), "{name}");
    }
}

/// What the haptic step calls must not wait for anybody: no lock, no condition, no channel, no thread.
#[test]
fn nothing_the_step_calls_can_lock() {
    const WAITS: [&str; 10] = [
        "Mutex", "RwLock", "Condvar", "OnceLock", "LazyLock", "mpsc", "Barrier", "thread::",
        "park(", "rayon",
    ];
    let mut n_files = 0;
    let mut folders = vec![
        root().join("crates/app/src/engine"),
        root().join("crates/contact/src"),
    ];
    // Of the session, what the loop calls where the engine runs beside it.
    let mut files: Vec<_> = ["engine", "session/fast", "session/handover", "session/slew"]
        .iter()
        .map(|file| root().join(format!("crates/app/src/{file}.rs")))
        .collect();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if !path.ends_with("build.rs") && !path.ends_with("tests.rs") {
                // Distance fields and norms are built in parallel, before the first step. Tests may share what they build.
                files.push(path);
            }
        }
    }
    for path in files {
        let text = std::fs::read_to_string(&path).unwrap();
        let (code, _) = text.split_once("#[cfg(test)]").unwrap_or((&text, ""));
        n_files += 1;
        for waits in WAITS {
            assert!(!code.contains(waits), "{}: {waits}", path.display());
        }
    }
    assert!(n_files > 20, "{n_files} files only");
}

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

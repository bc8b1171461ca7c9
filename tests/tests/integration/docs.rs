//! What the documents name exists: files, commands, keys.

use std::fs;

use snapin_tests::{root, snapin};

#[test]
fn every_file_that_a_document_links_to_exists() {
    for document in [
        "README.md",
        "ARCHITECTURE.md",
        "CONTRIBUTING.md",
        "docs/decisions.md",
        "docs/scene.md",
        "scenes/README.md",
    ] {
        let path = root().join(document);
        let text = fs::read_to_string(&path).unwrap();
        for link in text
            .split("](")
            .skip(1)
            .filter_map(|rest| rest.split(')').next())
        {
            let file = link.split('#').next().unwrap();
            if file.is_empty() || file.contains("://") {
                continue;
            }
            assert!(
                path.parent().unwrap().join(file).exists(),
                "{document} links to {file}"
            );
        }
    }
}

#[test]
fn the_key_reference_is_what_the_program_prints() {
    let printed = snapin(&["scene", "--markdown"]);
    assert_eq!(printed.code, 0);
    let committed = fs::read_to_string(root().join("docs/scene.md")).unwrap();
    assert_eq!(
        printed.out, committed,
        "make it anew: cargo run -- scene --markdown > docs/scene.md"
    );
}

#[test]
fn every_command_in_the_readme_is_one() {
    let text = fs::read_to_string(root().join("README.md")).unwrap();
    let help = snapin(&["--help"]).out;
    for line in text
        .lines()
        .filter_map(|l| l.trim().strip_prefix("| `snapin "))
    {
        let command = line.split([' ', '`']).next().unwrap();
        assert!(help.contains(&format!("  {command} ")), "{command}");
    }
}

//! The real binary: exit codes, streams, Ctrl-C. What it computes is tested in-process elsewhere.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

fn scene() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/clip.toml")
}

fn snapin(dir: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_snapin"));
    command
        .current_dir(dir)
        .env("SNAPIN_CACHE", dir.join("cache"));
    command
}

fn run(dir: &Path, args: &[&str]) -> Output {
    snapin(dir).args(args).output().unwrap()
}

#[test]
fn exit_codes_and_streams() {
    let dir = tempfile::tempdir().unwrap();
    let help = run(dir.path(), &[]);
    assert_eq!(help.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&help.stderr).contains("Usage"));
    assert_eq!(run(dir.path(), &["--version"]).status.code(), Some(0));
    let missing = run(dir.path(), &["run", "none.toml"]);
    assert_eq!(missing.status.code(), Some(2));
    assert!(missing.stdout.is_empty() && !missing.stderr.is_empty());
    let doctor = run(dir.path(), &["doctor", "--json"]);
    assert_eq!(doctor.status.code(), Some(0));
    let found: serde_json::Value = serde_json::from_slice(&doctor.stdout).unwrap();
    assert!(found["findings"].as_array().unwrap().len() > 3);
}

#[test]
fn the_summary_is_json_and_no_progress_bar_leaves_a_terminal() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene();
    let output = run(dir.path(), &["run", scene.to_str().unwrap(), "--json"]);
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(summary["peak_insertion_force_N"].as_f64().unwrap() > 1.0);
    assert!(
        !output.stderr.contains(&0x1b),
        "no escape sequences off a terminal"
    );
    assert!(
        dir.path().join("out/clip/report.html").is_file(),
        "the default folder"
    );
}

/// The hand is real time here, so the run lasts a second; it is interrupted within it.
#[cfg(unix)]
#[test]
fn ctrl_c_ends_with_130_and_keeps_the_earlier_result() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("summary.json"), "earlier").unwrap();
    let child = snapin(dir.path())
        .args([
            "run",
            scene().to_str().unwrap(),
            "--real-time",
            "--out",
            "out",
        ])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Begun once the folder in the making is there.
    let begun = || std::fs::read_dir(dir.path()).unwrap().count() >= 2;
    while !begun() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    let killed = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{err}");
    assert!(err.contains("Ctrl-C"), "{err}");
    assert_eq!(
        std::fs::read_to_string(out.join("summary.json")).unwrap(),
        "earlier"
    );
    let left = std::fs::read_dir(dir.path())
        .unwrap()
        .filter(|e| {
            e.as_ref()
                .unwrap()
                .file_name()
                .to_string_lossy()
                .contains("partial")
        })
        .count();
    assert_eq!(left, 0, "nothing half-written is left");
}

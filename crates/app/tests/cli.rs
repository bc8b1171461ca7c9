//! The real binary: exit codes, streams, Ctrl-C. What it computes is tested in-process elsewhere.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use snapin::report::mcap_file;

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

#[cfg(unix)]
fn names(dir: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(dir).unwrap();
    entries
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect()
}

/// Begins a run that lasts a second and kills it, without any warning, while its folder is in the making.
#[cfg(unix)]
fn kill_a_run(dir: &Path, out: &str) {
    let mut child = snapin(dir)
        .args([
            "run",
            scene().to_str().unwrap(),
            "--real-time",
            "--out",
            out,
        ])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mark = format!("partial-{}", child.id());
    while !names(dir).iter().any(|name| name.ends_with(&mark)) {
        assert!(child.try_wait().unwrap().is_none(), "it ended too early");
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(
        names(dir).iter().any(|name| name.ends_with(&mark)),
        "a killed run leaves its folder"
    );
}

#[cfg(unix)]
#[test]
fn leftovers_of_a_killed_run_are_swept_at_the_next_start_and_own_files_survive() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene();
    let run_into = |out: &str| {
        let output = run(dir.path(), &["run", scene.to_str().unwrap(), "--out", out]);
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{err}");
    };
    let leftovers = || {
        let mut all = names(dir.path());
        all.retain(|name| name.contains("partial") || name.contains(".old"));
        all
    };
    kill_a_run(dir.path(), "out");
    run_into("out");
    assert_eq!(leftovers(), [""; 0]);

    let out = dir.path().join("out");
    std::fs::write(out.join("notes.txt"), "mine").unwrap();
    std::fs::write(out.join("frames/mine.png"), "mine").unwrap();
    kill_a_run(dir.path(), "out");
    let own =
        || ["notes.txt", "frames/mine.png"].map(|f| std::fs::read_to_string(out.join(f)).unwrap());
    assert_eq!(own(), ["mine", "mine"]);
    // Another result in the same place, while one is being made: what is being made stays.
    let mut child = snapin(dir.path())
        .args([
            "run",
            scene.to_str().unwrap(),
            "--real-time",
            "--out",
            "slow",
        ])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mark = format!(".slow.partial-{}", child.id());
    while !names(dir.path()).contains(&mark) {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    run_into("other");
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(dir.path().join("slow/report.html").is_file());
    run_into("out");
    assert_eq!(own(), ["mine", "mine"]);
    assert!(out.join("report.html").is_file());
    assert_eq!(leftovers(), [""; 0]);
}

/// Two programs in one cache whose bound leaves room for neither's part beside the other: both end well, again and again.
#[test]
fn two_programs_share_a_cache_that_is_too_small() {
    let dir = tempfile::tempdir().unwrap();
    let hook = scene().with_file_name("hook.toml");
    let start = |scene: &Path| {
        snapin(dir.path())
            .args(["prepare", scene.to_str().unwrap()])
            .env("SNAPIN_CACHE_LIMIT", "0")
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    for _ in 0..3 {
        let both = [start(&scene()), start(&hook)];
        for child in both {
            let output = child.wait_with_output().unwrap();
            let err = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(0), "{err}");
            assert!(!err.contains("damaged") && !err.contains("cannot"), "{err}");
        }
    }
    let wrong = snapin(dir.path())
        .args(["prepare", scene().to_str().unwrap()])
        .env("SNAPIN_CACHE_LIMIT", "much")
        .output()
        .unwrap();
    assert_eq!(wrong.status.code(), Some(2));
    let err = String::from_utf8_lossy(&wrong.stderr);
    assert!(
        err.contains("SNAPIN_CACHE_LIMIT: \"much\" is no size"),
        "{err}"
    );
}

/// Without any driver "gpu" is refused with what was looked for, "auto" runs on the processor and says so, and so does
/// the doctor.
#[test]
fn without_drivers_gpu_is_refused_and_auto_runs_on_the_processor() {
    let dir = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(scene()).unwrap();
    let folder = scene().parent().unwrap().canonicalize().unwrap();
    let text = text.replace("mesh = \"", &format!("mesh = \"{}/", folder.display()));
    for (name, word) in [("gpu", "gpu"), ("auto", "auto"), ("cpu", "cpu")] {
        let text = format!("{text}\n[accuracy]\nmultiply = \"{word}\"\n");
        std::fs::write(dir.path().join(format!("{name}.toml")), text).unwrap();
    }
    let without_drivers = |args: &[&str]| {
        let mut command = snapin(dir.path());
        for name in [
            "VK_ICD_FILENAMES",
            "VK_DRIVER_FILES",
            "__EGL_VENDOR_LIBRARY_FILENAMES",
            "LIBGL_DRIVERS_PATH",
        ] {
            command.env(name, "/nonexistent");
        }
        // OpenGL is linked to its own drivers on some systems.
        let output = command
            .env("WGPU_BACKEND", "vulkan")
            .args(args)
            .output()
            .unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (
            output.status.code(),
            text(&output.stdout),
            text(&output.stderr),
        )
    };
    let (code, out, err) = without_drivers(&["run", "gpu.toml"]);
    assert_eq!(code, Some(2), "{out}{err}");
    assert!(
        err.contains("accuracy.multiply is \"gpu\"") && err.contains("looked for"),
        "{err}"
    );
    assert!(!dir.path().join("out/gpu").exists(), "nothing is written");

    let (code, out, err) = without_drivers(&["run", "auto.toml"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(
        out.contains("multiply              the processor, 64 bits: there is no graphics adapter"),
        "{out}"
    );
    assert!(!err.contains("adapter"), "no warning of it: {err}");
    let summary = std::fs::read(dir.path().join("out/auto/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    assert_eq!(summary["multiply"]["why"], "no_adapter");
    assert_eq!(summary["multiply"]["gpu"], false);
    let page = std::fs::read_to_string(dir.path().join("out/auto/report.html")).unwrap();
    assert!(page.contains("looked for adapters of Vulkan, found none"));

    let (code, out, _) = without_drivers(&["run", "cpu.toml"]);
    assert_eq!(code, Some(0));
    assert!(
        out.contains("the processor, 64 bits, as asked for"),
        "{out}"
    );

    let (code, out, _) = without_drivers(&["doctor"]);
    assert_eq!(code, Some(0));
    assert!(
        out.contains("on the processor; looked for adapters of Vulkan, found none"),
        "{out}"
    );
}

/// With an adapter, one in software too, "gpu" gives the forces of the processor to the last bit.
#[test]
fn gpu_runs_where_there_is_an_adapter_and_gives_the_same_forces() {
    let dir = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(scene()).unwrap();
    let folder = scene().parent().unwrap().canonicalize().unwrap();
    let text = text.replace("mesh = \"", &format!("mesh = \"{}/", folder.display()));
    for word in ["gpu", "cpu"] {
        let text = format!("{text}\n[accuracy]\nmultiply = \"{word}\"\n");
        std::fs::write(dir.path().join(format!("{word}.toml")), text).unwrap();
    }
    let doctor = run(dir.path(), &["doctor", "--json"]);
    let found: serde_json::Value = serde_json::from_slice(&doctor.stdout).unwrap();
    let findings = found["findings"].as_array().unwrap();
    let of = |subject: &str| findings.iter().filter(|f| f["subject"] == subject).count();
    assert_eq!(of("multiply"), 1);
    let gpu = run(dir.path(), &["run", "gpu.toml"]);
    let err = String::from_utf8_lossy(&gpu.stderr);
    if of("adapter") == 0 {
        eprintln!("no adapter: {err}");
        assert_eq!(gpu.status.code(), Some(2), "{err}");
        assert!(err.contains("looked for"), "{err}");
        return;
    }
    assert_eq!(gpu.status.code(), Some(0), "{err}");
    let cpu = run(dir.path(), &["run", "cpu.toml"]);
    assert_eq!(cpu.status.code(), Some(0));
    let forces = |name: &str| {
        let file = format!("out/{name}/force-travel.csv");
        std::fs::read_to_string(dir.path().join(file)).unwrap()
    };
    assert!(forces("gpu") == forces("cpu"), "forces differ");
    let summary = std::fs::read(dir.path().join("out/gpu/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    assert_eq!(summary["multiply"]["why"], "asked");
    assert_eq!(summary["multiply"]["gpu"], true);
}

/// The clip with a hand that goes in within a second and then holds for a minute.
fn scene_that_lasts(dir: &Path) -> PathBuf {
    let text = std::fs::read_to_string(scene()).unwrap();
    let folder = scene().parent().unwrap().to_string_lossy().into_owned();
    let text = text
        .replace("\"clip", &format!("\"{folder}/clip"))
        .replace("hold = 0.3", "hold = 60.0");
    let path = dir.join("lasting.toml");
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn a_live_session_with_the_simulated_device_tells_its_curve_and_keeps_every_step() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene();
    let args = ["live", scene.to_str().unwrap(), "--json"];
    for n in ["001", "002"] {
        let output = run(dir.path(), &args);
        let err = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{err}");
        let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(
            told["peak_insertion_force_N"].as_f64().unwrap() > 5.0,
            "{told}"
        );
        assert_eq!(told["snaps_in"], 1);
        assert_eq!(told["unrecorded_steps"], 0);
        // An earlier session is not written over.
        let file = dir.path().join(format!("out/clip-live/session-{n}.mcap"));
        let read = mcap_file::read(&std::fs::read(file).unwrap()).unwrap();
        assert!(read.is_whole);
        assert_eq!(told["recorded_steps"], read.messages.len());
        let kept = std::fs::read(dir.path().join(format!("out/clip-live/session-{n}.json")));
        assert_eq!(kept.unwrap(), output.stdout);
    }
}

#[test]
fn a_live_session_refuses_what_it_cannot_do_and_says_what_it_can() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene();
    let scene = scene.to_str().unwrap();
    for (args, word) in [
        (&["--device", "phantom"][..], "snapin devices"),
        (&["--device", "simulated:phantom"], "simulated:"),
        (&["--rate", "5"], "between 100 and 10000"),
        (&["--rate", "nan"], "between 100 and 10000"),
        (&["--axes", "+x+x+z"], "right-handed"),
        (&["--axes", "+x+y-z"], "right-handed"),
        (&["--for", "-1"], "above 0"),
        (&["--max-force", "0"], "above 0"),
        (&["--clutch", "0"], "1..=32"),
    ] {
        let args: Vec<&str> = ["live", scene, "--no-recording"]
            .iter()
            .chain(args)
            .copied()
            .collect();
        let output = run(dir.path(), &args);
        let err = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {err}");
        assert!(err.contains(word), "{args:?}: {err}");
    }
    let devices = run(dir.path(), &["devices"]);
    assert_eq!(devices.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&devices.stdout).contains("simulated"));
}

/// Killed without any warning while it records: the file opens and holds what is older than a second.
#[cfg(unix)]
#[test]
fn a_recording_whose_program_is_killed_holds_all_but_the_last_second() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene_that_lasts(dir.path());
    let mut child = snapin(dir.path())
        .args(["live", scene.to_str().unwrap(), "--out", "rec"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let file = dir.path().join("rec/session-001.mcap");
    let steps = || {
        let bytes = std::fs::read(&file).unwrap_or_default();
        mcap_file::read(&bytes).map_or(0, |read| read.messages.len())
    };
    let mut before = 0;
    while before < 500 {
        assert!(child.try_wait().unwrap().is_none(), "it ended too early");
        std::thread::sleep(std::time::Duration::from_millis(20));
        before = steps();
    }
    std::thread::sleep(std::time::Duration::from_secs(1));
    child.kill().unwrap();
    child.wait().unwrap();
    let read = mcap_file::read(&std::fs::read(&file).unwrap()).unwrap();
    assert!(!read.is_whole);
    // Something younger than a second was there when it was killed.
    assert!(read.messages.len() > before, "{}", read.messages.len());
    let numbers: Vec<u64> = read.messages.iter().map(|m| m.step).collect();
    assert!(numbers.iter().enumerate().all(|(k, n)| *n == k as u64));
}

/// Ctrl-C is how a live session ends: what was felt is told and kept.
#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_live_session_well() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene_that_lasts(dir.path());
    let child = snapin(dir.path())
        .args(["live", scene.to_str().unwrap(), "--out", "rec", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let file = dir.path().join("rec/session-001.mcap");
    while std::fs::metadata(&file).map_or(0, |m| m.len()) < 100_000 {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let killed = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{err}");
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let read = mcap_file::read(&std::fs::read(&file).unwrap()).unwrap();
    assert!(read.is_whole);
    assert_eq!(told["recorded_steps"], read.messages.len());
}

/// Half of a part pushes the tool aside, which the other half would balance: a hand feels the curve of a testing machine
/// all the same.
#[test]
fn a_live_session_of_half_a_part_keeps_the_tool_on_its_axis() {
    let dir = tempfile::tempdir().unwrap();
    let scene = scene().with_file_name("cable.toml");
    let scene = scene.to_str().unwrap();
    let told = |args: &[&str]| -> serde_json::Value {
        let output = run(dir.path(), args);
        let err = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{err}");
        serde_json::from_slice(&output.stdout).unwrap()
    };
    let peak = |told: &serde_json::Value| told["peak_insertion_force_N"].as_f64().unwrap();
    let machine = told(&["run", scene, "--json"]);
    let felt = told(&["live", scene, "--json"]);
    assert_eq!(felt["snaps_in"], 1, "{felt}");
    let (felt, machine) = (peak(&felt), peak(&machine));
    assert!(
        (felt / machine - 1.0).abs() < 0.02,
        "{felt} and {machine} N"
    );
    let two = [
        "live",
        scene,
        "--second-device",
        "simulated",
        "--no-recording",
    ];
    assert_eq!(run(dir.path(), &two).status.code(), Some(2));
}

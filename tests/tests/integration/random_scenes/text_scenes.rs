//! Whole scenes, written at random, through the public entry: a result or a refusal in words, nothing else.

use std::path::Path;

use snapin_tests::brick::Random;
use snapin_tests::{arg, snapin};

use super::{PartCase, for_each_seed, parts};

fn numbers(v: [f64; 3]) -> String {
    format!("[{:?}, {:?}, {:?}]", v[0], v[1], v[2])
}

fn tool_keys(random: &mut Random) -> String {
    let mut size = || random.decades(2e-4, 0.1);
    let (a, b, c) = (size(), size(), size());
    match random.below(6) {
        0 => format!("shape = \"sphere\"\nradius = {a:?}"),
        1 => format!("shape = \"cylinder\"\nradius = {a:?}"),
        2 => format!("shape = \"cylinder\"\nradius = {a:?}\nhalf_length = {b:?}"),
        3 => format!("shape = \"box\"\nhalf_extents = {}", numbers([a, b, c])),
        4 => format!("shape = \"capsule\"\nradius = {a:?}\nhalf_length = {b:?}"),
        _ => "shape = \"half-space\"".to_owned(),
    }
}

/// Extents of the tool along world z, whatever its turn, at most.
fn reach(keys: &str) -> f64 {
    let lengths = keys
        .split(['=', '[', ']', ',', '\n'])
        .filter_map(|word| word.trim().parse::<f64>().ok());
    lengths.map(|x| x * x).sum::<f64>().sqrt() + keys.matches("capsule").count() as f64 * 0.1
}

fn effects_keys(random: &mut Random) -> String {
    if random.chance(0.5) {
        return String::new();
    }
    let choice = random.pick(&["on", "off", "auto"]);
    let coefficient = random.decades(1e-3, 3.0);
    let mut keys =
        format!("[effects]\nfriction = \"{choice}\"\nfriction_coefficient = {coefficient:?}\n");
    if random.chance(0.3) {
        let at_rest = coefficient * random.decades(1.0, 4.0);
        keys += &format!("static_friction_coefficient = {at_rest:?}\n");
    }
    keys + "\n"
}

fn accuracy_keys(random: &mut Random) -> String {
    let mut keys = String::new();
    let mut add = |line: String| keys += &format!("{line}\n");
    let of = [
        "",
        "columns = \"near\"",
        "contact_scalar = \"f32\"",
        "adaptive = 0.002",
        "rates = { every = 3 }",
        "contact_iterations = 2",
    ];
    add(random.pick(&of).to_owned());
    if random.chance(0.3) {
        add(format!("near_distance = {:?}", random.decades(1e-6, 0.03)));
    }
    if random.chance(0.4) {
        add(format!("max_contacts = {}", random.pick(&[1, 2, 5, 40])));
    }
    if random.chance(0.3) {
        add(format!("contact_iterations = {}", random.pick(&[1, 2, 4])));
    }
    if random.chance(0.3) {
        add("tool_features = \"off\"".to_owned());
    }
    add("multiply = \"cpu\"".to_owned());
    keys
}

fn scene(random: &mut Random, case: &PartCase) -> String {
    let tool = tool_keys(random);
    let holds_part = random.chance(0.3);
    let [x, y, z] = case.size;
    // Some start in the part, which has to be refused.
    let above = if random.chance(0.9) {
        reach(&tool)
    } else {
        0.3 * reach(&tool)
    };
    let above = if tool.contains("half-space") {
        1e-4
    } else {
        above
    };
    let position = [
        x * random.unit(),
        y * random.unit(),
        z + above + random.decades(1e-6, 1e-3),
    ];
    let axis = if tool.contains("half-space") {
        [0.0, 0.0, -1.0]
    } else if random.chance(0.5) {
        random.pick(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    } else {
        random.direction()
    };
    let down = if holds_part { 1.0 } else { -1.0 };
    let travel = random.decades(1e-4, 1e-2);
    format!(
        "[part]\nmesh = \"{}.msh\"\n{}\nmaterial = {{ young_modulus = {:?}, poisson_ratio = 0.3 }}\n\n\
         [tool]\n{tool}\nposition = {}\naxis = {}\n\n[holds]\nhandle = \"{}\"\n\n\
         [hand]\ndirection = {}\nspeed = {:?}\ntravel = {travel:?}\nretract = {}\n\n\
         [coupling]\ntranslational_stiffness = {:?}\n\n[accuracy]\n{}\n{}[output]\nframes = 0\n",
        case.name,
        case.keys,
        random.decades(1e7, 1e10),
        numbers(position),
        numbers(axis),
        if holds_part { "part" } else { "tool" },
        numbers([0.2 * random.unit(), 0.0, down]),
        travel * random.decades(10.0, 60.0),
        random.chance(0.3),
        random.decades(1e3, 1e5),
        accuracy_keys(random),
        effects_keys(random),
    )
}

fn run(folder: &Path, seed: u64, text: &str) -> Result<bool, String> {
    let path = folder.join(format!("scene-{seed}.toml"));
    std::fs::write(&path, text).unwrap();
    let out = folder.join(format!("result-{seed}"));
    let cache = folder.join("cache");
    let outcome = snapin(&[
        "run",
        arg(&path),
        "--out",
        arg(&out),
        "--cache",
        arg(&cache),
    ]);
    let left = std::fs::read_dir(folder).unwrap();
    let half = left
        .map(|entry| entry.unwrap().file_name())
        .find(|name| name.to_string_lossy().contains("partial"));
    let said = format!("{}\n{}\n{text}", outcome.err, outcome.out);
    match outcome.code {
        0 if out.join("summary.json").is_file() && half.is_none() => {
            std::fs::remove_dir_all(&out).unwrap();
            Ok(true)
        }
        2 if !outcome.err.is_empty() && !out.exists() && half.is_none() => Ok(false),
        code => Err(format!("code {code}, {half:?} left: {said}")),
    }
}

#[test]
fn random_scenes_end_with_a_result_or_a_refusal() {
    let folder = tempfile::tempdir().unwrap();
    let parts = parts();
    for case in &parts {
        let mesh = format!("{}.msh", case.name);
        std::fs::write(folder.path().join(mesh), &case.msh).unwrap();
    }
    let (mut n_runs, mut n_done) = (0, 0);
    for_each_seed(40, |seed, random| {
        let case = &parts[random.below(parts.len())];
        let text = scene(random, case);
        n_runs += 1;
        n_done += u32::from(run(folder.path(), seed, &text)?);
        Ok(())
    });
    assert!(
        n_done > n_runs / 2,
        "{n_done} of {n_runs} scenes had a result"
    );
}

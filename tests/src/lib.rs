//! What the tests of the whole share: the program run in-process, and the shipped files.

pub mod brick;

use std::path::{Path, PathBuf};

use snapin::prepare::{PrepareOptions, PreparedPart, prepare};
use snapin::progress::Ui;
use snapin::scene::Scene;
use snapin::setup;

/// Root of the checkout.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// What a run of the program left.
#[derive(Debug)]
pub struct Outcome {
    /// Exit code.
    pub code: u8,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

/// Runs the program in this process with the given arguments (without its name).
pub fn snapin(args: &[&str]) -> Outcome {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let with_name = std::iter::once("snapin").chain(args.iter().copied());
    let code = snapin::run(with_name, &mut out, &mut err);
    Outcome {
        code,
        out: String::from_utf8_lossy(&out).into_owned(),
        err: String::from_utf8_lossy(&err).into_owned(),
    }
}

/// A path as an argument.
pub fn arg(path: &Path) -> &str {
    path.to_str()
        .unwrap_or_else(|| panic!("test paths are UTF-8: {}", path.display()))
}

/// A scene's part, prepared without a cache.
pub fn prepared(scene: &Scene) -> PreparedPart {
    let mut unseen = std::io::sink();
    let ui = Ui::new(&mut unseen, false);
    setup::part_spec(scene)
        .and_then(|spec| prepare(&spec, &PrepareOptions::default(), &ui))
        .unwrap_or_else(|e| panic!("{}: {e}", scene.path.display()))
}

/// A shipped scene and its part.
pub fn shipped(name: &str) -> (Scene, PreparedPart) {
    let path = root().join("scenes").join(name);
    let scene = Scene::load(&path).unwrap_or_else(|e| panic!("{e}"));
    let part = prepared(&scene);
    (scene, part)
}

/// Columns of a CSV file with a header line, by name.
pub fn csv(path: &Path) -> Vec<(String, Vec<f64>)> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut lines = text.lines();
    let mut columns: Vec<(String, Vec<f64>)> = lines
        .next()
        .unwrap_or("")
        .split(',')
        .map(|name| (name.to_owned(), Vec::new()))
        .collect();
    for line in lines {
        for (column, cell) in columns.iter_mut().zip(line.split(',')) {
            column.1.push(cell.parse().unwrap_or(f64::NAN));
        }
    }
    columns
}

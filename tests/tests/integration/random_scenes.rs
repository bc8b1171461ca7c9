//! Random tools against small parts: whatever their shape, size and place, the program neither panics nor gives numbers
//! that are none, and a step that says it is solved and settled leaves no node inside the tool.
//!
//! Parts are prepared once, a thousand short runs go through the engine, and some whole scenes through the public entry.
//! A failure names its seed; `SNAPIN_SEEDS=100000 cargo test -p snapin-tests random` tries as many, and
//! `SNAPIN_FIRST_SEED` begins with another one.

mod engine_runs;
mod text_scenes;

use std::panic::{AssertUnwindSafe, catch_unwind};

use snapin_tests::brick::{Brick, Random, Takes};

/// Seeds to try, from the environment where it names more.
pub(crate) fn seeds(n: u64) -> std::ops::Range<u64> {
    let of = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
    let first = of("SNAPIN_FIRST_SEED").unwrap_or(0);
    first..first + of("SNAPIN_SEEDS").unwrap_or(n)
}

/// Runs a case for each seed and names those that fail, all of them.
fn for_each_seed(n: u64, mut case: impl FnMut(u64, &mut Random) -> Result<(), String>) {
    let mut failed = Vec::new();
    for seed in seeds(n) {
        let outcome = catch_unwind(AssertUnwindSafe(|| case(seed, &mut Random::new(seed))));
        match outcome {
            Ok(Ok(())) => {}
            Ok(Err(why)) => failed.push(format!("seed {seed}: {why}")),
            Err(_) => failed.push(format!("seed {seed}: panicked, see above")),
        }
    }
    assert!(
        failed.is_empty(),
        "{} of the seeds fail:\n{}",
        failed.len(),
        failed.join("\n")
    );
}

/// A part of some bricks and what a scene says of it.
struct PartCase {
    name: &'static str,
    msh: String,
    /// Keys of `[part]` but for the mesh and the material.
    keys: &'static str,
    /// m, lowest and highest corner.
    size: [f64; 3],
}

/// A bar held at one end, one on a plate that is held and named as contact too, a plate on rollers, a hook and a frame.
fn parts() -> Vec<PartCase> {
    let solid = |_: [usize; 3]| false;
    let all = |of: &dyn Fn([f64; 3]) -> bool, corners: &[[f64; 3]]| corners.iter().all(|x| of(*x));
    let left = |c: &[[f64; 3]]| all(&|x| x[0] < 1e-9, c);
    let bottom = |c: &[[f64; 3]]| all(&|x| x[2] < 1e-9, c);
    let skin = |_: &[[f64; 3]]| true;
    let root = |c: &[[f64; 3]]| all(&|x| x[0] < 0.0201, c);
    let top = |c: &[[f64; 3]]| all(&|x| x[2] > 0.0099, c);
    let part =
        |name, keys, cells, size, is_hole: &dyn Fn([usize; 3]) -> bool, volumes: &[Takes<'_>]| {
            let faces: [Takes<'_>; 4] = [
                ("left", &left),
                ("bottom", &bottom),
                ("top", &top),
                ("skin", &skin),
            ];
            PartCase {
                name,
                msh: Brick {
                    cells,
                    size,
                    is_hole,
                }
                .msh(&faces, volumes),
                keys,
                size,
            }
        };
    let bar = [0.04, 0.01, 0.01];
    vec![
        part(
            "bar",
            "fixed = \"left\"\ncontact = \"top\"",
            [6, 2, 2],
            bar,
            &solid,
            &[],
        ),
        part(
            "bar-order-2",
            "order = 2\nfixed = \"left\"\ncontact = \"skin\"",
            [4, 1, 1],
            bar,
            &solid,
            &[],
        ),
        part(
            "held-half",
            "order = 2\nfixed = \"root\"\ncontact = \"top\"",
            [4, 2, 1],
            bar,
            &solid,
            &[("root", &root)],
        ),
        part(
            "rollers",
            "order = 2\nfixed = [\"left\", { group = \"bottom\", components = [\"z\"] }]\ncontact = \"skin\"",
            [4, 2, 1],
            bar,
            &solid,
            &[],
        ),
        part(
            "hook",
            "order = 3\nfixed = \"left\"\ncontact = [\"skin\"]",
            [5, 1, 2],
            bar,
            &|[i, _, k]| k == 1 && i != 4,
            &[],
        ),
        part(
            "frame",
            "order = 1\nfixed = \"bottom\"\ncontact = \"body\"",
            [5, 2, 4],
            [0.04, 0.01, 0.02],
            &|[i, _, k]| (1..4).contains(&i) && (1..3).contains(&k),
            &[],
        ),
    ]
}

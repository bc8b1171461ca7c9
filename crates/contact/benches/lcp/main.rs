//! Time of one complementarity problem, beside dense Cholesky factors of the same matrix and beside peers.
//!
//! Measures: (1) a rigid sphere in a quadratic elastic block, 15 to 441 rows; (2) a smooth and a rough sphere
//! pressed into an elastic half-space, 4 to 1024 rows; (3) 30 haptic steps of the second, warm. Columns: Cholesky of
//! all rows and of the active rows (the floor: any exact method must solve with them), the solver
//! cold and warm, its methods one by one, Clarabel (a QP crate).
//!
//! `cargo bench -p snapin-contact --bench lcp` runs it on one thread (two minutes), prints the tables and writes them with
//! the plot to `target/lcp/`; with `SNAPIN_WRITE_DOCS=1` into `docs/contact.md` and `docs/images/` as well.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and ends where it cannot go on"
)]

mod measure;
mod plot;
mod problems;

use std::fmt::Write;
use std::path::Path;

use faer::Par;
use measure::{Row, SequenceRow};
use problems::{Pressed, realistic};

fn main() {
    faer::set_global_parallelism(Par::Seq);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let realistic: Vec<Row> = realistic()
        .iter()
        .map(|p| measure::row(&p.matrix, &p.q))
        .collect();
    let (mut smooth, mut rough, mut sequences) = (vec![], vec![], vec![]);
    for side in [2, 3, 4, 7, 10, 16, 21, 32] {
        let pressed = Pressed::new(side);
        let gaps = |roughness: f64| pressed.gaps(0.05, 0.3, roughness);
        smooth.push(measure::row(&pressed.matrix, &gaps(0.0)));
        rough.push(measure::row(&pressed.matrix, &gaps(0.5)));
        for (name, roughness) in [("smooth", 0.0), ("rough", 0.5)] {
            if pressed.m() >= 16 {
                let steps = pressed.sequence(roughness);
                sequences.push(measure::sequence(name, &pressed.matrix, &steps));
            }
        }
    }
    let mut text = String::new();
    let machine = machine();
    writeln!(
        text,
        "Measured on one thread of: {machine}. Microseconds, medians.\n"
    )
    .unwrap();
    writeln!(
        text,
        "A rigid sphere in a quadratic elastic block (`crates/contact/tests/data/lcp`), cold:\n"
    )
    .unwrap();
    table(&mut text, &realistic);
    writeln!(text, "\nA sphere pressed into an elastic half-space, cold; the rough one has waves of half its depth:\n").unwrap();
    table(&mut text, &smooth);
    text.push('\n');
    table(&mut text, &rough);
    writeln!(
        text,
        "\n30 haptic steps of the same spheres, sliding and bobbing, means per step:\n"
    )
    .unwrap();
    sequence_table(&mut text, &sequences);
    println!("{text}");

    let plot = plot::times(&rough, &sequences);
    let folder = root.join("target/lcp");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("lcp.md"), &text).unwrap();
    std::fs::write(folder.join("lcp-time.svg"), &plot).unwrap();
    if std::env::var_os("SNAPIN_WRITE_DOCS").is_some() {
        let page = root.join("docs/contact.md");
        let old = std::fs::read_to_string(&page).unwrap();
        let (begin, end) = ("<!-- measured: begin -->\n", "<!-- measured: end -->");
        let (before, rest) = old.split_once(begin).unwrap();
        let (_, after) = rest.split_once(end).unwrap();
        std::fs::write(page, format!("{before}{begin}{text}{end}{after}")).unwrap();
        std::fs::write(root.join("docs/images/lcp-time.svg"), plot).unwrap();
    }
}

fn table(text: &mut String, rows: &[Row]) {
    text.push_str(
        "| m | active | Cholesky, all rows | Cholesky, active | **cold** | ratio | rounds | \
         rows moved | **warm** | ratio | active set (pivots) | Gauss-Seidel (sweeps) | Clarabel | certificate |\n",
    );
    text.push_str(
        "| --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: |\n",
    );
    for row in rows {
        let counted = |x: Option<(f64, usize)>| {
            x.map_or("".to_owned(), |(time, n)| format!("{} ({n})", short(time)))
        };
        writeln!(
            text,
            "| {} | {} | {} | {} | **{}** | {:.2} | {} | {} | **{}** | {:.2} | {} ({}) | {} | {} | {:.0e} |",
            row.m,
            row.n_active,
            short(row.all_rows),
            short(row.active_rows),
            short(row.cold),
            row.cold / row.all_rows,
            row.cold_solution.rounds,
            row.cold_solution.pivots,
            short(row.warm),
            row.warm / row.all_rows,
            short(row.active_set),
            row.active_set_pivots,
            counted(row.gauss_seidel),
            row.clarabel.map_or(String::new(), short),
            row.cold_solution.certificate.natural_residual,
        )
        .unwrap();
    }
}

fn sequence_table(text: &mut String, rows: &[SequenceRow]) {
    text.push_str(
        "| sphere | m | active | Cholesky, all rows | Cholesky, active | cold | rounds | rows moved | \
         **warm** | ratio | rounds | rows moved | **kept factor** | ratio |\n",
    );
    text.push_str(
        "| --- | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: | --: |\n",
    );
    for row in rows {
        writeln!(
            text,
            "| {} | {} | {:.0} | {} | {} | {} | {:.1} | {:.1} | **{}** | {:.2} | {:.1} | {:.1} | **{}** | {:.2} |",
            row.name,
            row.m,
            row.n_active,
            short(row.all_rows),
            short(row.active_rows),
            short(row.cold.time),
            row.cold.rounds,
            row.cold.pivots,
            short(row.warm.time),
            row.warm.time / row.all_rows,
            row.warm.rounds,
            row.warm.pivots,
            short(row.kept.time),
            row.kept.time / row.all_rows,
        )
        .unwrap();
    }
}

/// Two or three digits.
fn short(time: f64) -> String {
    if time < 10.0 {
        format!("{time:.1}")
    } else {
        format!("{time:.0}")
    }
}

/// The processor's name, where the system tells it.
fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info
        .lines()
        .find_map(|line| line.strip_prefix("model name"));
    let name = name
        .and_then(|rest| rest.split_once(':'))
        .map(|(_, name)| name.trim().to_owned());
    name.unwrap_or_else(|| std::env::consts::ARCH.to_owned())
}

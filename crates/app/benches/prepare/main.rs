//! Time and memory of preparing a part, by stage, against its size and against a plain sparse solver.
//!
//! Measures: the clip on its three meshes, and solid blocks of quadratic tetrahedra held at one end.
//! "all": every node that is not held can touch, the dense compliance of the whole part. Beside it,
//! what one gets from the sparse Cholesky of faer used as its documentation says: minimum degree on
//! the unknowns, factor, all columns in full, in panels of 96 by as many threads.
//! `cargo bench -p snapin --bench prepare` (some minutes) prints the table; with
//! `SNAPIN_WRITE_DOCS=1` it writes it into `docs/performance.md`, and the plot beside it.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and ends where it cannot go on"
)]

mod plain;
#[path = "../shared/plot.rs"]
mod plot;
mod times;

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use fem::{Compliance, Material, Mesh, Order, OrderedStiffness, Quadrature, Silent, Supports};
use snapin::machine::Machine;
use snapin::prepare::budget;

/// A part is prepared this often, in turns with the plain solver; medians are shown.
const ROUNDS: usize = 3;

struct Part {
    name: String,
    mesh: Mesh,
    supports: Supports,
    candidates: Vec<u32>,
    rows: Vec<u32>,
}

struct Measured {
    name: String,
    nodes: usize,
    candidates: usize,
    rows: usize,
    free: usize,
    entries: usize,
    plain_entries: usize,
    /// Seconds: assemble, order, factor, columns, checks.
    stages: [f64; 5],
    /// Seconds: order and factor, columns.
    plain: [f64; 2],
    /// Largest difference to the plain solver over the largest entry.
    difference: f64,
}

fn scenes() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes")
}

/// As `scenes/clip.toml` holds and touches it.
fn clip(name: &str) -> Part {
    let mesh = fem::mesh::gmsh::read(&scenes().join(name)).unwrap();
    let mut supports = Supports::new(mesh.n_nodes());
    for &node in &mesh.group("fixed").unwrap().nodes {
        supports.fix_node(node, [true; 3]);
    }
    let candidates = mesh.group("contact").unwrap().nodes.clone();
    part(name, mesh, supports, candidates)
}

/// `n` cells of 1 mm along each axis, six tetrahedra each, held at x = 0.
fn block(n: [usize; 3], is_all: bool) -> Part {
    let linear = linear_block(n);
    let mesh = linear.with_order(Order::Quadratic).unwrap();
    let mut supports = Supports::new(mesh.n_nodes());
    for (node, x) in (0..).zip(&mesh.nodes) {
        supports.fix_node(node, [x[0] < 1e-9; 3]);
    }
    let candidates = if is_all {
        (0..mesh.n_nodes() as u32).collect()
    } else {
        mesh.surface_nodes()
    };
    let kind = if is_all { "all" } else { "surface" };
    let name = format!("block {}x{}x{}, {kind}", n[0], n[1], n[2]);
    part(&name, mesh, supports, candidates)
}

fn part(name: &str, mesh: Mesh, supports: Supports, mut candidates: Vec<u32>) -> Part {
    candidates.retain(|&node| !supports.is_fixed_in_all(node));
    let mut rows = candidates.clone();
    let mut is_row = vec![false; mesh.n_nodes()];
    candidates.iter().for_each(|&n| is_row[n as usize] = true);
    rows.extend(
        mesh.surface_nodes()
            .into_iter()
            .filter(|&n| !is_row[n as usize]),
    );
    Part {
        name: name.to_owned(),
        mesh,
        supports,
        candidates,
        rows,
    }
}

fn linear_block(n: [usize; 3]) -> Mesh {
    /// Axes along which a tetrahedron's edges go from the cell's corner to the opposite one.
    const PATHS: [[usize; 3]; 6] = [
        [0, 1, 2],
        [1, 2, 0],
        [2, 0, 1],
        [0, 2, 1],
        [2, 1, 0],
        [1, 0, 2],
    ];
    let index = |at: [usize; 3]| (at[0] + (n[0] + 1) * (at[1] + (n[1] + 1) * at[2])) as u32;
    let (mut nodes, mut elements) = (Vec::new(), Vec::new());
    for z in 0..=n[2] {
        for y in 0..=n[1] {
            nodes.extend((0..=n[0]).map(|x| [x, y, z].map(|i| 1e-3 * i as f64)));
        }
    }
    for cell in 0..n[0] * n[1] * n[2] {
        let corner = [cell % n[0], cell / n[0] % n[1], cell / (n[0] * n[1])];
        for (k, path) in PATHS.iter().enumerate() {
            let mut at = corner;
            let mut vertices = [index(at); 4];
            for (step, &axis) in path.iter().enumerate() {
                at[axis] += 1;
                vertices[step + 1] = index(at);
            }
            // Odd permutations of the axes turn the element inside out.
            if k >= 3 {
                vertices.swap(1, 2);
            }
            elements.extend(vertices);
        }
    }
    let (n_nodes, n_elements) = (nodes.len() as u64, elements.len() as u64 / 4);
    let tags = ((1..=n_nodes).collect(), (1..=n_elements).collect());
    Mesh::new(Order::Linear, nodes, tags.0, elements, tags.1, vec![])
}

fn measure(part: &Part) -> Measured {
    let material = Material::new(2.7e9, 0.35).unwrap();
    let of_element = vec![0; part.mesh.n_elements()];
    let (mut stages, mut plain) = (vec![], vec![]);
    let mut measured = None;
    for _ in 0..ROUNDS {
        let mut lap = Instant::now();
        let mut seconds = move || {
            std::mem::replace(&mut lap, Instant::now())
                .elapsed()
                .as_secs_f64()
        };
        let stiffness =
            fem::assemble_stiffness(&part.mesh, &[material], &of_element, Quadrature::Converged)
                .unwrap();
        let assembled = seconds();
        let ordered = OrderedStiffness::new(&stiffness, &part.supports, &Silent).unwrap();
        let order = seconds();
        let factor = ordered.factor(&Silent).unwrap();
        let factored = seconds();
        let c = Compliance::build(&factor, &part.candidates, &part.rows, &Silent).unwrap();
        let columns = seconds();
        c.check(&stiffness, &factor).unwrap();
        stages.push([assembled, order, factored, columns, seconds()]);
        let other = plain::solve(&stiffness, &part.supports, &part.candidates, &part.rows);
        plain.push(other.seconds);
        let largest = c.blocks.iter().fold(0.0f64, |a, x| a.max(x.abs()));
        let pairs = c.blocks.iter().zip(&other.blocks);
        measured = Some(Measured {
            name: part.name.clone(),
            nodes: part.mesh.n_nodes(),
            candidates: part.candidates.len(),
            rows: part.rows.len(),
            free: factor.n_free(),
            entries: factor.n_factor_entries(),
            plain_entries: other.entries,
            stages: [0.0; 5],
            plain: [0.0; 2],
            difference: pairs.fold(0.0f64, |a, (x, y)| a.max((x - y).abs())) / largest,
        });
    }
    Measured {
        stages: std::array::from_fn(|k| median(stages.iter().map(|s| s[k]))),
        plain: std::array::from_fn(|k| median(plain.iter().map(|s| s[k]))),
        ..measured.unwrap()
    }
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn table(rows: &[Measured]) -> String {
    let mut text = format!(
        "Measured on {}. Milliseconds, medians of {ROUNDS}.\n\n",
        Machine::read().summary()
    );
    text += "| part | nodes | can touch | surface | free unknowns | entries of L (plain) | assemble | order \
             | factor | columns | checks | **sum** | plain factor | plain columns | plain / ours | compliance | factor |\n";
    text += "| :-- ";
    text += &"| --: ".repeat(16);
    text += "|\n";
    for m in rows {
        let ms = |s: f64| format!("{:.0}", (1e3 * s).max(1.0));
        let stages: Vec<String> = m.stages.iter().map(|&s| ms(s)).collect();
        // What both do: order, factor and columns.
        let ratio = m.plain.iter().sum::<f64>() / m.stages[1..4].iter().sum::<f64>();
        writeln!(
            text,
            "| {} | {} | {} | {} | {} | {:.2} M ({:.2} M) | {} | **{}** | {} | {} | {ratio:.1} | {} | {} |",
            m.name,
            m.nodes,
            m.candidates,
            m.rows,
            m.free,
            1e-6 * m.entries as f64,
            1e-6 * m.plain_entries as f64,
            stages.join(" | "),
            ms(m.stages.iter().sum()),
            ms(m.plain[0]),
            ms(m.plain[1]),
            budget::bytes(72.0 * m.candidates as f64 * m.rows as f64),
            budget::bytes(8.0 * m.entries as f64),
        )
        .unwrap();
    }
    let worst = rows.iter().fold(0.0f64, |a, m| a.max(m.difference));
    writeln!(
        text,
        "\nLargest difference of the two answers, over the largest entry: {worst:.0e}."
    )
    .unwrap();
    text
}

fn main() {
    let parts = [
        clip("clip.msh"),
        clip("clip-medium.msh"),
        clip("clip-fine.msh"),
        block([4, 4, 4], true),
        block([7, 7, 6], true),
        block([4, 4, 4], false),
        block([7, 7, 7], false),
        block([10, 10, 10], false),
    ];
    let rows: Vec<Measured> = parts.iter().map(measure).collect();
    let text = table(&rows);
    println!("{text}");
    if std::env::var_os("SNAPIN_WRITE_DOCS").is_some() {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
        std::fs::write(docs.join("images/prepare-time.svg"), times::times(&rows)).unwrap();
        let page = docs.join("performance.md");
        let old = std::fs::read_to_string(&page).unwrap();
        let (begin, end) = ("<!-- prepare: begin -->\n", "<!-- prepare: end -->");
        let (before, rest) = old.split_once(begin).unwrap();
        let (_, after) = rest.split_once(end).unwrap();
        std::fs::write(page, format!("{before}{begin}{text}{end}{after}")).unwrap();
    }
}

//! Time of `engine::step` against the size of the part, the number of contacts and the tool's triangles.
//!
//! Measures: a rigid sphere pressed into an elastic half-space with a square grid of nodes 1 mm apart that can
//! all touch (displacements by Boussinesq and Cerruti, see Johnson, Contact Mechanics, 3.2 and 3.6), then slid over
//! it in steps of 20 um with a slow bob, its pose imposed. Only steps with contact count.
//! The size of the part is varied with the columns of the nodes that the sphere can meet alone, so that 100 000 nodes
//! fit; all nodes are candidates that the step must rule out.
//! `cargo bench -p snapin --bench scale` runs it on one core (two minutes, 4 GB) and prints the tables;
//! with `SNAPIN_WRITE_DOCS=1` it writes them into `docs/performance.md` and plots them.
//! `-- size`, `-- contacts` or `-- triangles` prints that table alone.

#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a benchmark prints, and ends where it cannot go on"
)]

#[path = "../shared/half_space.rs"]
mod half_space;
#[path = "../shared/plot.rs"]
mod plot;
mod stages;

use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use contact::tool::{DistanceField, Mesh, Sphere, Tool};
use glam::DVec3;
use glamx::DPose3;
use half_space::{CELL, half_space, half_space_near};
use snapin::engine::{ContactIterations, ContactPart, Engine, EngineSettings, Plan, Stage};
use snapin::machine::Machine;

/// m, motion of the tool in one step of 1 ms.
const STRIDE: f64 = 2e-5;

const STEPS: u32 = 1500;

/// m, half of the way that the tool slides.
const HALF_WAY: f64 = 5e-3;

struct Measured {
    contacts: f64,
    near: f64,
    passes: f64,
    stages: Vec<f64>,
    total: [f64; 3],
}

/// Presses the sphere in until about `contacts` nodes carry force, then slides it.
fn measure(part: &Arc<ContactPart>, tool: Tool, radius: f64, contacts: f64) -> Measured {
    // Hertz: a² = radius · depth, π a² = contacts cells.
    let depth = contacts * CELL * CELL / (std::f64::consts::PI * radius);
    let settings = EngineSettings {
        contact_iterations: ContactIterations::Converged,
        displacement_tolerance: 1e-9,
        near_distance: 0.0004 * 2.0 * radius,
        max_contacts: 1024,
        merge_tolerance: 0.0,
        lcp: contact::lcp::Settings::default(),
        max_stride: 0.02 * 2.0 * radius,
    };
    let mut engine = Engine::new(Plan::new(Arc::clone(part), tool, None, settings)).unwrap();
    let mut stages = vec![Vec::new(); Stage::ALL.len()];
    let (mut totals, mut n_contacts, mut near, mut passes) = (vec![], 0, 0, 0);
    for step in 0..STEPS {
        let t = f64::from(step);
        let pressed = (t / 300.0).min(1.0) * (1.0 + 0.02 * (0.05 * t).sin());
        let slid = STRIDE * (t - 300.0).max(0.0) - HALF_WAY;
        let at = DVec3::new(slid.min(HALF_WAY), 0.3 * slid, radius - pressed * depth);
        let begun = Instant::now();
        let report = engine.step(&DPose3::from_translation(at));
        let total = 1e-3 * begun.elapsed().as_nanos() as f64;
        if step < 300 || report.contacts == 0 {
            continue;
        }
        assert!(report.lcp_solved && report.converged && report.dropped == 0);
        assert_eq!(
            report.without_column, 0,
            "the sphere meets nodes without a column"
        );
        totals.push(total);
        n_contacts += report.contacts;
        near += report.near;
        passes += report.passes;
        for (times, ns) in stages.iter_mut().zip(report.stage_ns) {
            times.push(1e-3 * ns as f64);
        }
    }
    let n = totals.len() as f64;
    Measured {
        contacts: f64::from(n_contacts) / n,
        near: f64::from(near) / n,
        passes: f64::from(passes) / n,
        stages: stages
            .into_iter()
            .map(|mut times| quantile(&mut times, 0.5))
            .collect(),
        total: [0.5, 0.99, 0.999].map(|share| quantile(&mut totals.clone(), share)),
    }
}

/// A sphere of `rings` rings of triangles and as many segments, poles along x.
fn sphere_mesh(radius: f64, rings: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let at = |ring: u32, segment: u32| {
        let polar = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        let around = std::f64::consts::TAU * f64::from(segment) / f64::from(rings);
        radius
            * DVec3::new(
                polar.cos(),
                polar.sin() * around.cos(),
                polar.sin() * around.sin(),
            )
    };
    let mut vertices = vec![at(0, 0)];
    for ring in 1..rings {
        vertices.extend((0..rings).map(|segment| at(ring, segment)));
    }
    let last = vertices.len() as u32;
    vertices.push(at(rings, 0));
    let index = |ring: u32, segment: u32| 1 + (ring - 1) * rings + segment % rings;
    let mut triangles = Vec::new();
    for k in 0..rings {
        triangles.push([0, index(1, k), index(1, k + 1)]);
        for ring in 1..rings - 1 {
            let (a, b) = (index(ring, k), index(ring, k + 1));
            let (c, d) = (index(ring + 1, k), index(ring + 1, k + 1));
            triangles.extend([[a, c, d], [a, d, b]]);
        }
        triangles.push([last, index(rings - 1, k + 1), index(rings - 1, k)]);
    }
    (vertices, triangles)
}

fn quantile(times: &mut [f64], share: f64) -> f64 {
    times.sort_by(f64::total_cmp);
    times[((times.len() - 1) as f64 * share).round() as usize]
}

fn main() {
    let sphere = |radius: f64| Tool::Sphere(Sphere::new(radius).unwrap());
    let mut text = format!(
        "Measured on {}, one core used. Microseconds.\n",
        Machine::read().summary()
    );
    let header = |first: &str| {
        let stages: Vec<&str> = Stage::ALL[..5].iter().map(|stage| stage.name()).collect();
        let line = "| --: ".repeat(6 + stages.len());
        format!(
            "| {first} | contacts | near | passes | {} | **step, median** | p99 |\n{line}|\n",
            stages.join(" | ")
        )
    };
    let row = |first: String, m: &Measured| {
        let stages: Vec<String> = m.stages[..5].iter().map(|t| format!("{t:.1}")).collect();
        format!(
            "| {first} | {:.1} | {:.1} | {:.1} | {} | **{:.1}** | {:.1} |\n",
            m.contacts,
            m.near,
            m.passes,
            stages.join(" | "),
            m.total[0],
            m.total[1],
        )
    };
    writeln!(
        text,
        "\nSize of the part at 62 contacts, sphere of 30 mm:\n"
    )
    .unwrap();
    text += &header("nodes that can touch");
    let asked: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    let is_asked = |table: &str| asked.is_empty() || asked.iter().any(|a| a == table);
    let mut of_size = Vec::new();
    let sides = [15, 26, 55, 100, 178, 316];
    for side in sides.into_iter().filter(|_| is_asked("size")) {
        let part = half_space_near(side, HALF_WAY + 8e-3);
        let m = measure(&part, sphere(0.03), 0.03, 62.0);
        text += &row((side * side).to_string(), &m);
        of_size.push(((side * side) as f64, m));
    }
    let part = half_space(55);
    writeln!(
        text,
        "\nContacts, on 3025 nodes, sphere of 30 mm (100 mm from 250 on):\n"
    )
    .unwrap();
    text += &header("aim");
    let mut of_contacts = Vec::new();
    let aims = [5.0, 15.0, 30.0, 62.0, 120.0, 250.0, 500.0];
    for contacts in aims.into_iter().filter(|_| is_asked("contacts")) {
        let radius = if contacts < 200.0 { 0.03 } else { 0.1 };
        let m = measure(&part, sphere(radius), radius, contacts);
        text += &row(format!("{contacts}"), &m);
        of_contacts.push((m.contacts, m));
    }
    writeln!(
        text,
        "\nTriangles of the tool, the sphere of 30 mm as a mesh, on 3025 nodes at 62 contacts:\n"
    )
    .unwrap();
    text += &header("triangles");
    let mut of_triangles = Vec::new();
    let rings = [4, 8, 24, 72, 224];
    for rings in rings.into_iter().filter(|_| is_asked("triangles")) {
        let (vertices, triangles) = sphere_mesh(0.03, rings);
        let n = triangles.len();
        let tool = Tool::Mesh(Mesh::new(&vertices, &triangles).unwrap().into());
        let m = measure(&part, tool.clone(), 0.03, 62.0);
        text += &row(n.to_string(), &m);
        of_triangles.push((n as f64, m));
        if rings == 224 {
            // As a scene's tool.field_error = 5 um: below 1 um, what its facets deviate from the ball, every facet counts.
            let field = DistanceField::new(tool, 5e-6, 6e-4, 1 << 30).unwrap();
            let m = measure(&part, Tool::Field(field.into()), 0.03, 62.0);
            text += &row(format!("{n}, field to 5 µm"), &m);
        }
    }
    println!("{text}");
    if std::env::var_os("SNAPIN_WRITE_DOCS").is_some() && asked.is_empty() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/performance.md");
        let old = std::fs::read_to_string(&page).unwrap();
        let (begin, end) = ("<!-- step: begin -->\n", "<!-- step: end -->");
        let (before, rest) = old.split_once(begin).unwrap();
        let (_, after) = rest.split_once(end).unwrap();
        std::fs::write(&page, format!("{before}{begin}{text}{end}{after}")).unwrap();
        for (file, axis, measured) in [
            ("step-over-size.svg", "nodes that can touch", &of_size),
            ("step-over-contacts.svg", "contacts", &of_contacts),
            (
                "step-over-triangles.svg",
                "triangles of the tool",
                &of_triangles,
            ),
        ] {
            let image = page.with_file_name("images").join(file);
            std::fs::write(image, stages::stages(axis, measured)).unwrap();
        }
    }
}

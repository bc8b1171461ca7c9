//! A small made-up run for the tests of the writers.

use glam::DVec3;
use glamx::DPose3;

use super::data::*;
use super::origin::{InputFile, Origin};
use super::part_curve::{Doubts, Limits, StrainUse};
use super::strain::{PeakKind, StrainFacts, StrainPeak};

/// Force of the sample over its travel, N: up to 40 N at 2 mm, down to -10 N at 3 mm, 0 at 4 mm.
pub(super) fn force(travel_m: f64) -> f64 {
    let t = travel_m * 1e3;
    if t < 2.0 {
        20.0 * t
    } else if t < 3.0 {
        40.0 - 50.0 * (t - 2.0)
    } else {
        -10.0 + 10.0 * (t - 3.0)
    }
}

/// 4 mm in, a rest, and 4 mm out, with 15 N of pull.
pub(super) fn rows() -> Vec<StepRow> {
    let mut rows = Vec::new();
    for step in 0..900u64 {
        let (phase, travel_m, force_n) = match step {
            0..=400 => {
                let travel = step as f64 * 1e-5;
                (Phase::Approach, travel, force(travel))
            }
            401..=499 => (Phase::Hold, 4e-3, 0.0),
            _ => {
                let back = (step - 500) as f64 * 1e-5;
                (
                    Phase::Retract,
                    4e-3 - back,
                    -15.0 * (back / 4e-3 * std::f64::consts::PI).sin(),
                )
            }
        };
        let jitter = (step * 7919 % 101) * 13;
        let stage_ns = [
            900 + jitter,
            2_100 + 2 * jitter,
            800 + jitter,
            1_500 + 5 * jitter,
            400 + jitter,
        ];
        rows.push(StepRow {
            step,
            time_s: step as f64 * 1e-3,
            phase,
            travel_m,
            force_n,
            force_on_handle: DVec3::new(0.1, -force_n, 0.0),
            torque_on_handle: DVec3::new(0.0, 0.0, 1e-3 * force_n),
            contacts: (force_n.abs() / 2.0) as u32,
            pivots: 3,
            certificate: 1e-16 * (step % 7) as f64,
            wrench_mismatch_rel: 1e-12,
            handle_pose: DPose3::from_translation(DVec3::new(0.0, -travel_m, 0.0)),
            tool_pose: DPose3::from_translation(DVec3::new(0.0, -travel_m + force_n / 1e5, 0.0)),
            total_ns: stage_ns.iter().sum::<u64>() + 120,
            stage_ns,
            multiply_ns: step.is_multiple_of(16).then_some(40_000 + 20 * jitter),
        });
    }
    rows
}

/// The part's own curve of the sample: 42 N at 2 mm, -12 N at 3 mm, a seat of 60 N at 4 mm; 18 N to pull out.
pub(super) fn drive_rows() -> Vec<DriveRow> {
    let row = |phase, travel_m: f64, force_n: f64| DriveRow {
        phase,
        travel_m,
        force_n,
        sideways_m: 0.0,
        turn_rad: 0.0,
        contacts: (force_n.abs() / 2.0).ceil() as u32,
        sticking: 0,
        dissipated_j: 0.0,
        stored_j: 0.0,
        is_converged: true,
        certificate: 0.0,
    };
    let force = |t: f64| match t {
        t if t < 2.0 => 21.0 * t,
        t if t < 3.0 => 42.0 - 54.0 * (t - 2.0),
        t if t < 3.8 => -12.0 + 15.0 * (t - 3.0),
        t => 300.0 * (t - 3.8),
    };
    let mut rows: Vec<DriveRow> = (0..=200)
        .map(|i| 0.02 * f64::from(i))
        .map(|t| row(Phase::Approach, 1e-3 * t, force(t)))
        .collect();
    rows.push(row(Phase::Hold, 4e-3, force(4.0)));
    rows.extend((0..=200).map(|i| {
        let back = f64::from(i) / 200.0;
        let pull = 18.0 * (back * std::f64::consts::PI).sin();
        row(Phase::Retract, 4e-3 * (1.0 - back), -pull)
    }));
    rows
}

/// The driven curve of the sample, with all limits asked for, and no doubt.
pub(super) fn driven(strain: &StrainFacts) -> Driven {
    let asked = Limits {
        insertion_below: Some(50.0),
        removal_above: Some(20.0),
        strain_below: Some(0.04),
        strain_use: StrainUse::Once,
    };
    Driven::of(drive_rows(), &Doubts::default(), &asked, strain)
}

/// A clip's arm: a curved strip of `n_x` by `n_y` by `n_z` hexahedra, each cut into six tet4.
pub(super) fn part(n_x: u32, n_y: u32, n_z: u32) -> PartDrawing {
    let node = |x: u32, y: u32, z: u32| (z * (n_y + 1) + y) * (n_x + 1) + x;
    let mut part = PartDrawing {
        cell_kind: CellKind::Tet4,
        ..PartDrawing::default()
    };
    for z in 0..=n_z {
        for y in 0..=n_y {
            for x in 0..=n_x {
                // Three quarters of a ring, as a clip for a pipe has.
                let angle = (f64::from(x) / f64::from(n_x) - 0.5) * 4.4 - 1.571;
                let radius = 8e-3 + 2e-3 * f64::from(y) / f64::from(n_y);
                let depth = 12e-3 * (f64::from(z) / f64::from(n_z) - 0.5);
                part.nodes.push(DVec3::new(
                    radius * angle.cos(),
                    radius * angle.sin(),
                    depth,
                ));
            }
        }
    }
    let sizes = [n_x, n_y, n_z];
    for z in 0..n_z {
        for y in 0..n_y {
            for x in 0..n_x {
                let corner = |i: u32| node(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2 & 1));
                for path in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                    part.cells
                        .extend([corner(0), corner(path[0]), corner(path[1]), corner(7)]);
                }
            }
        }
    }
    // Each of the six sides as quadrilaterals of two triangles and their outline.
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        for end in [0, sizes[axis]] {
            for j in 0..sizes[b] {
                for i in 0..sizes[a] {
                    let at = |di: u32, dj: u32| {
                        let mut c = [0; 3];
                        (c[axis], c[a], c[b]) = (end, i + di, j + dj);
                        node(c[0], c[1], c[2])
                    };
                    let mut quad = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
                    // Local axes (x along the arc, y outwards, z) are left-handed here.
                    if end != 0 {
                        quad.reverse();
                    }
                    part.triangles
                        .extend([[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]);
                    part.edges.push(vec![at(0, 0), at(1, 0), at(1, 1)]);
                    part.edges.push(vec![at(0, 0), at(0, 1)]);
                }
            }
        }
    }
    part
}

/// The part opened by a pin that comes from above.
pub(super) fn frame(part: &PartDrawing, label: &str, open: f64) -> Frame {
    let mut frame = Frame {
        label: label.into(),
        step: 100,
        travel_m: 1e-3,
        force_n: 20.0 * open,
        ..Frame::default()
    };
    for &p in &part.nodes {
        let angle = p.x.atan2(-p.y);
        let bend = open * 1.6e-3 * (angle / 2.2) * (angle / 2.2).abs();
        frame
            .displacement
            .push(DVec3::new(bend, 0.4 * bend.abs() * (p.y * 100.0), 0.0));
        let radial = ((p.truncate().length() - 9e-3) / 1e-3).abs();
        frame
            .von_mises
            .push(45e6 * open * radial * (1.0 - (angle / 2.2).abs()).max(0.0).sqrt());
    }
    let centre = DVec3::new(0.0, 10.5e-3 - 2e-3 * open, 0.0);
    let (radius, half_length, n) = (7.8e-3, 9e-3, 48);
    let rim = |i: usize, z: f64| {
        let a = i as f64 / n as f64 * std::f64::consts::TAU;
        centre + DVec3::new(radius * a.cos(), radius * a.sin(), z)
    };
    for i in 0..n {
        let (a, b) = (rim(i, -half_length), rim(i + 1, -half_length));
        let (c, d) = (rim(i + 1, half_length), rim(i, half_length));
        frame.tool.extend([[a, b, c], [a, c, d]]);
        let end = |z: f64| centre + DVec3::new(0.0, 0.0, z);
        frame
            .tool
            .extend([[end(half_length), d, c], [end(-half_length), b, a]]);
    }
    for (node, &p) in part.nodes.iter().enumerate() {
        let at = p + frame.displacement[node];
        if (at.y > 3e-3) && p.truncate().length() < 8.01e-3 && p.z.abs() < 5e-3 {
            let force = (at - centre).reject_from(DVec3::Z).normalize() * 3.0 * open;
            let node = node as u32;
            frame.contacts.push(ContactForce {
                node,
                point: at,
                force,
                sticks: false,
            });
        }
    }
    frame
}

/// A whole run, two frames, every block filled.
pub(super) fn run() -> Run {
    let part = part(16, 2, 4);
    let frames = vec![
        frame(&part, "first contact", 0.2),
        frame(&part, "Peak!", 1.0),
    ];
    let strain = StrainFacts {
        peaks: vec![StrainPeak {
            value: 0.021,
            error: 0.003,
            place: [0.0, -9e-3, 0.0],
            node_tag: 12,
            travel_m: 1e-3,
            force_n: 20.0,
            kind: PeakKind::Free,
        }],
        permissible: Some(0.04),
        at_seat: None,
        n_moments: 40,
    };
    Run {
        title: "Pipe clip <C-20> & co".into(),
        scene_path: "examples/clip.toml".into(),
        machine: "test machine, 1 core".into(),
        origin: Origin {
            made: "2026-11-27T08:15:30Z".into(),
            inputs: vec![
                InputFile {
                    kind: "scene",
                    name: "clip.toml".into(),
                    hash: [0xab; 32],
                },
                InputFile {
                    kind: "mesh",
                    name: "clip.msh".into(),
                    hash: [0xcd; 32],
                },
            ],
        },
        settings: vec![("coupling".into(), "10 N/mm".into())],
        checks: vec![("symmetry of the compliance".into(), "3.1e-16".into())],
        notes: vec!["made up for a test".into()],
        warnings: vec![
            "friction would change the force by \"30 %\""
                .to_owned()
                .into(),
        ],
        facts: Facts {
            nodes: part.nodes.len(),
            elements: part.cells.len() / 4,
            order: 1,
            surface_nodes: 300,
            candidates: 120,
            coupling_stiffness: Some(1e4),
            prepare_s: 1.25,
            from_cache: false,
            missed_deadlines: None,
            max_principal_strain: 0.021,
            max_rotation_deg: 7.5,
            rates: RateFacts {
                why: "asked for".into(),
                two: Some(TwoRateFacts {
                    every: Some(5),
                    hand_overs: 180,
                    difference_median_n: 2e-3,
                    difference_max_n: 0.05,
                    max_staleness: 9,
                    beyond_margin: 3,
                    faded: 0,
                    engine_us: None,
                }),
            },
            multiply: MultiplyFacts {
                runs_on: "the processor, 64 bits".into(),
                why: "asked",
                words: "the processor, 64 bits, as asked for".into(),
                ..MultiplyFacts::default()
            },
        },
        driven: Some(driven(&strain)),
        strain,
        rows: rows(),
        part,
        frames,
        handbook: Some(Handbook {
            name: "cantilever of constant section".into(),
            rows: vec![HandbookRow {
                label: "insertion force".into(),
                handbook: 42.0,
                computed: 40.0,
                unit: "N".into(),
            }],
            curve: vec![(0.0, 0.0), (2e-3, 42.0), (2.1e-3, 0.0)],
        }),
        paper: PaperStage::duriez_2004(4.2, 1.9, 55.0),
        effects: vec![
            Effect {
                name: "friction".into(),
                on: false,
                number: Some(0.3),
                threshold: 0.1,
                why: "the scene states a friction coefficient of 0.2".into(),
            },
            Effect {
                name: "gravity".into(),
                on: false,
                number: None,
                threshold: 0.1,
                why: "no density given".into(),
            },
        ],
        viewing: Viewing::default(),
        outputs: Outputs::default(),
    }
}

use glam::{DMat3, DQuat};

use super::*;
use crate::delassus::delassus_block_into;
use crate::face::Face;
use crate::surface::FaceData;

/// A curved quadratic face; node 5 is held, so candidates are 0 to 4.
fn places() -> [DVec3; 6] {
    [
        DVec3::new(0.0, 0.0, 0.1),
        DVec3::new(1.0, 0.1, 0.0),
        DVec3::new(0.1, 0.9, 0.0),
        DVec3::new(0.5, 0.0, 0.12),
        DVec3::new(0.6, 0.5, 0.05),
        DVec3::new(0.0, 0.45, 0.12),
    ]
}

fn surface(n_held: usize) -> Surface {
    let places = places();
    let (rest, held) = places.split_at(6 - n_held);
    let data = FaceData {
        nodes: (0..6).collect(),
        height: 1.0,
    };
    Surface::new(rest, held.to_vec(), &[data]).unwrap()
}

fn row_at(surface: &Surface, places: &[DVec3; 6], p: DVec3) -> FaceRow {
    let nearest = Face::new(surface.order(), places).nearest(p);
    FaceRow::new(surface, 0, 7, p, &nearest)
}

#[test]
fn gap_follows_nodes_and_tool_as_the_row_says() {
    let surface = surface(0);
    let p = DVec3::new(0.35, 0.3, 0.2);
    let row = row_at(&surface, &places(), p);
    assert!(row.gap > 0.0 && row.normal.z < 0.0);
    let step = 1e-6;
    for axis in DVec3::AXES {
        for &(node, weight) in row.shares() {
            let gap = |sign: f64| {
                let mut moved = places();
                moved[node as usize] += sign * step * axis;
                row_at(&surface, &moved, p).gap
            };
            let rate = (gap(1.0) - gap(-1.0)) / (2.0 * step);
            assert!((rate - weight * row.normal.dot(axis)).abs() < 1e-8);
        }
    }
    let reference = DVec3::new(-0.4, 0.2, 1.0);
    let h = row.tool_row(reference);
    for k in 0..6 {
        let gap = |sign: f64| {
            let mut twist = [0.0; 6];
            twist[k] = sign * step;
            let turn = DQuat::from_scaled_axis(DVec3::from_slice(&twist[3..]));
            let moved = reference + turn * (p - reference) + DVec3::from_slice(&twist[..3]);
            row_at(&surface, &places(), moved).gap
        };
        let rate = (gap(1.0) - gap(-1.0)) / (2.0 * step);
        assert!((rate + h[k]).abs() < 1e-8, "{k}: {rate} and {}", h[k]);
    }
}

#[test]
fn forces_on_the_nodes_are_the_force_at_the_point() {
    // A plane quadratic face: its map keeps moments.
    let flat = places().map(|x| DVec3::new(x.x, x.y, 0.3 * x.x - 0.2 * x.y));
    let surface = surface(0);
    let row = row_at(&surface, &flat, DVec3::new(0.3, 0.3, 0.2));
    let force = 3.0 * row.normal;
    let (mut sum, mut moment) = (DVec3::ZERO, DVec3::ZERO);
    for &(node, weight) in row.shares() {
        sum += weight * force;
        moment += flat[node as usize].cross(weight * force);
    }
    assert!((sum - force).length() < 1e-14);
    // Along the normal through the tool's point.
    assert!((moment - row.point.cross(force)).length() < 1e-14);
    let (on_tool, torque) = row.wrench_on_tool(3.0, DVec3::ZERO);
    assert!((on_tool + sum).length() < 1e-14 && (torque + moment).length() < 1e-14);
    assert!(row.shares().iter().any(|(_, weight)| *weight < 0.0));
}

struct Blocks(Vec<Vec<DMat3>>);
impl ComplianceBlocks for Blocks {
    fn block(&self, row: usize, col: usize) -> DMat3 {
        self.0[row][col]
    }
}

#[test]
fn operator_is_the_product_of_whole_matrices() {
    let mut state = 5_u64;
    let mut next = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let surface = surface(1);
    let n = 5;
    let random: Vec<DMat3> = (0..n * n)
        .map(|_| DMat3::from_cols_array(&std::array::from_fn(|_| next())))
        .collect();
    let block = |i: usize, j: usize| random[i * n + j] + random[j * n + i].transpose();
    let blocks = Blocks(
        (0..n)
            .map(|i| (0..n).map(|j| block(i, j)).collect())
            .collect(),
    );
    let half: [[f64; 6]; 6] = std::array::from_fn(|_| std::array::from_fn(|_| next()));
    let matrix: [[f64; 6]; 6] = std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..6).map(|k| half[i][k] * half[j][k]).sum())
    });
    let reference = DVec3::new(0.1, 0.2, 0.3);
    let coupling = Some(CouplingCompliance {
        matrix: &matrix,
        reference,
    });
    let planes =
        [(3, DVec3::X), (1, DVec3::new(0.0, 0.6, -0.8))].map(|(candidate, normal)| Plane {
            candidate,
            gap: 0.0,
            normal,
            point: places()[candidate as usize],
        });
    let rows = [(0.3, 0.3), (0.1, 0.5), (0.6, 0.2)]
        .map(|(x, y)| row_at(&surface, &places(), DVec3::new(x, y, 0.1)));
    // The held node has no share.
    assert!(
        rows.iter()
            .all(|row| row.shares().iter().all(|(node, _)| *node < 5))
    );
    let m = planes.len() + rows.len();
    let mut w = vec![f64::NAN; m * m];
    let mut scratch = vec![DVec3::ZERO; n];
    delassus_block_into(&blocks, &planes, coupling, m, &mut w).unwrap();
    face_rows_into(
        &blocks,
        &planes,
        &rows,
        coupling,
        &[0, 1, 2, 3, 4],
        &mut scratch,
        &mut w,
    )
    .unwrap();

    // H_d as a matrix of 3 n columns, and h, for every row.
    let mut h_part = vec![vec![0.0; 3 * n]; m];
    let mut h_tool = Vec::new();
    for (i, plane) in planes.iter().enumerate() {
        for c in 0..3 {
            h_part[i][3 * plane.candidate as usize + c] = plane.normal[c];
        }
        h_tool.push(plane.tool_row(reference));
    }
    for (i, row) in rows.iter().enumerate() {
        for &(node, weight) in row.shares() {
            for c in 0..3 {
                h_part[2 + i][3 * node as usize + c] = weight * row.normal[c];
            }
        }
        h_tool.push(row.tool_row(reference));
    }
    for i in 0..m {
        for j in 0..m {
            let mut expected = 0.0;
            for a in 0..3 * n {
                for b in 0..3 * n {
                    let entry = blocks.0[a / 3][b / 3].col(b % 3)[a % 3];
                    expected += h_part[i][a] * entry * h_part[j][b];
                }
            }
            for a in 0..6 {
                for b in 0..6 {
                    expected += h_tool[i][a] * matrix[a][b] * h_tool[j][b];
                }
            }
            assert!((w[j * m + i] - expected).abs() < 1e-12, "{i} {j}");
            assert_eq!(w[j * m + i].to_bits(), w[i * m + j].to_bits());
        }
    }
    let short = face_rows_into(
        &blocks,
        &planes,
        &rows,
        coupling,
        &[],
        &mut scratch,
        &mut w[1..],
    );
    assert!(short.is_err());
}

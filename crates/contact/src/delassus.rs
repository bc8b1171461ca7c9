//! Delassus operator: the compliance seen along the contact normals, and with friction along two tangents as well.

use glam::{DMat3, DVec3};

use crate::contacts::Contact;
use crate::error::Error;

/// Compliance of the part as 3 x 3 blocks; the caller owns the storage.
pub trait ComplianceBlocks {
    /// Displacement of `row` per unit force at `col` (nodes, or places of contacts), m/N, part's frame.
    fn block(&self, row: usize, col: usize) -> DMat3;
}

/// Compliance of the virtual coupling that holds the tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CouplingCompliance<'a> {
    /// K_c⁻¹, symmetric: twist (m, rad) of the tool per wrench (N, N m about `reference`), part's frame.
    pub matrix: &'a [[f64; 6]; 6],
    /// Point of the wrench and the twist, part's frame, m.
    pub reference: DVec3,
}

/// Writes the Delassus operator of the contacts, column-major m x m. `compliance`: between their places.
///
/// ```text
/// W = H_d C H_dᵀ + H_t K_c⁻¹ H_tᵀ      W_ij = n_iᵀ C_ij n_j + h_iᵀ K_c⁻¹ h_j,   h = [n, r × n]
/// ```
/// m/N. Both triangles, equal to the last bit. `coupling` None: the tool's pose is imposed.
/// Does not allocate. Cost: about 20 m² multiply-adds.
///
/// Source: Duriez et al. 2004, section 4.2, on unit normals, with the coupling of the tool added.
///
/// # Errors
/// [`Error::Length`] unless `w` has m² entries.
pub fn delassus_into(
    compliance: &impl ComplianceBlocks,
    contacts: &[Contact],
    coupling: Option<CouplingCompliance>,
    w: &mut [f64],
) -> Result<(), Error> {
    let m = contacts.len();
    check_size(w, m)?;
    for_each_entry(compliance, contacts, coupling, |i, j, entry| {
        w[j * m + i] = entry;
        w[i * m + j] = entry;
    });
    Ok(())
}

/// A contact's unit normal and two tangents, orthogonal, part's frame.
pub type Frame = [DVec3; 3];

/// Any frame of a unit normal.
pub fn frame(normal: DVec3) -> Frame {
    let (t1, t2) = normal.any_orthonormal_pair();
    [normal, t1, t2]
}

/// The frame of a unit normal whose first tangent is as near to `tangent` as it can be.
pub fn frame_along(normal: DVec3, tangent: DVec3) -> Frame {
    match (tangent - normal * normal.dot(tangent)).try_normalize() {
        Some(t1) => [normal, t1, normal.cross(t1)],
        None => frame(normal),
    }
}

/// As [`delassus_into`] along the normals and tangents of the contacts: column-major 3m x 3m, rows 3i normal, 3i + 1 and
/// 3i + 2 tangents; what [`crate::friction`] solves.
///
/// ```text
/// W_ij = F_iᵀ C_ij F_j + H_i K_c⁻¹ H_jᵀ,   F = [n t1 t2],   H = [d, r × d] for each d of F
/// ```
/// Does not allocate. Cost: about 100 m² multiply-adds.
///
/// # Errors
/// [`Error::Length`] unless there is a frame for each contact and `w` has 9 m² entries.
pub fn delassus_frames_into(
    compliance: &impl ComplianceBlocks,
    contacts: &[Contact],
    frames: &[Frame],
    coupling: Option<CouplingCompliance>,
    w: &mut [f64],
) -> Result<(), Error> {
    let n = 3 * contacts.len();
    check_frames(frames, contacts.len())?;
    check_size(w, n)?;
    for_each_block(compliance, contacts, frames, coupling, |i, j, block| {
        write_block(w, n, i, j, &block);
    });
    Ok(())
}

/// Writes block (i, j) of a symmetric matrix of n rows, and its transpose at (j, i).
#[inline]
pub(crate) fn write_block(w: &mut [f64], n: usize, i: usize, j: usize, block: &[[f64; 3]; 3]) {
    for (b, column) in block.iter().enumerate() {
        for (a, entry) in column.iter().enumerate() {
            // Of a block on the diagonal only one triangle counts.
            if i != j || a <= b {
                w[(3 * j + b) * n + 3 * i + a] = *entry;
                w[(3 * i + a) * n + 3 * j + b] = *entry;
            }
        }
    }
}

pub(crate) fn check_frames(frames: &[Frame], m: usize) -> Result<(), Error> {
    if frames.len() == m {
        return Ok(());
    }
    Err(Error::Length {
        what: "the frames of the contacts",
        expected: m,
        actual: frames.len(),
    })
}

/// Tells W_ij by columns, three along the frame of j seen along that of i, for all i <= j.
#[inline]
pub(crate) fn for_each_block(
    compliance: &impl ComplianceBlocks,
    contacts: &[Contact],
    frames: &[Frame],
    coupling: Option<CouplingCompliance>,
    mut tell: impl FnMut(usize, usize, [[f64; 3]; 3]),
) {
    for (j, (contact_j, frame_j)) in contacts.iter().zip(frames).enumerate() {
        let twists = coupling.map(|coupling| frame_j.map(|d| twist_along(&coupling, contact_j, d)));
        for (i, (contact_i, frame_i)) in contacts[..=j].iter().zip(frames).enumerate() {
            let block = compliance.block(contact_i.place as usize, contact_j.place as usize);
            let lever = coupling.map_or(DVec3::ZERO, |c| contact_i.point - c.reference);
            let columns = std::array::from_fn(|b| {
                let mut displacement = block * frame_j[b];
                if let Some(twists) = &twists {
                    let (translation, rotation) = twists[b];
                    displacement += translation + rotation.cross(lever);
                }
                frame_i.map(|d| d.dot(displacement))
            });
            tell(i, j, columns);
        }
    }
}

pub(crate) fn check_size(w: &[f64], m: usize) -> Result<(), Error> {
    if w.len() == m * m {
        return Ok(());
    }
    Err(Error::Length {
        what: "the Delassus operator",
        expected: m * m,
        actual: w.len(),
    })
}

/// Tells W_ij of the contacts for all i <= j.
#[inline]
pub(crate) fn for_each_entry(
    compliance: &impl ComplianceBlocks,
    contacts: &[Contact],
    coupling: Option<CouplingCompliance>,
    mut tell: impl FnMut(usize, usize, f64),
) {
    for (j, contact_j) in contacts.iter().enumerate() {
        let twist = coupling.map(|coupling| twist_per_force(&coupling, contact_j));
        for (i, contact_i) in contacts[..=j].iter().enumerate() {
            let block = compliance.block(contact_i.place as usize, contact_j.place as usize);
            let mut displacement = block * contact_j.normal;
            if let (Some(coupling), Some((translation, rotation))) = (&coupling, twist) {
                // (r × n) · θ = n · (θ × r): the point of the tool at i moves away.
                displacement += translation + rotation.cross(contact_i.point - coupling.reference);
            }
            tell(i, j, contact_i.normal.dot(displacement));
        }
    }
}

/// K_c⁻¹ h of one contact: how far the tool yields to a unit normal force.
fn twist_per_force(coupling: &CouplingCompliance, contact: &Contact) -> (DVec3, DVec3) {
    twist_along(coupling, contact, contact.normal)
}

/// How far it yields to a unit force along a direction.
fn twist_along(
    coupling: &CouplingCompliance,
    contact: &Contact,
    direction: DVec3,
) -> (DVec3, DVec3) {
    let row = contact.tool_row_along(direction, coupling.reference);
    let twist = coupling
        .matrix
        .map(|line| line.iter().zip(&row).map(|(c, h)| c * h).sum::<f64>());
    (
        DVec3::new(twist[0], twist[1], twist[2]),
        DVec3::new(twist[3], twist[4], twist[5]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Blocks(Vec<Vec<DMat3>>);
    impl ComplianceBlocks for Blocks {
        fn block(&self, row: usize, col: usize) -> DMat3 {
            self.0[row][col]
        }
    }

    /// Numbers between -1 and 1 that look random, from a linear congruence.
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    /// Symmetric compliance C_ij = C_jiᵀ, unsymmetric blocks off the diagonal.
    fn compliance(n: usize, next: &mut impl FnMut() -> f64) -> Blocks {
        let mut random_block = || DMat3::from_cols_array(&std::array::from_fn(|_| next()));
        let random: Vec<DMat3> = (0..n * n).map(|_| random_block()).collect();
        let block = |i: usize, j: usize| random[i * n + j] + random[j * n + i].transpose();
        let blocks = (0..n)
            .map(|i| (0..n).map(|j| block(i, j)).collect())
            .collect();
        Blocks(blocks)
    }

    fn contacts(places: &[u32], next: &mut impl FnMut() -> f64) -> Vec<Contact> {
        let mut vector = || DVec3::new(next(), next(), next());
        places
            .iter()
            .map(|&place| Contact {
                place,
                gap: 0.0,
                normal: vector().normalize(),
                point: vector(),
            })
            .collect()
    }

    #[test]
    fn delassus_is_the_product_of_whole_matrices() {
        let mut next = numbers(1);
        let (n, places) = (5, [4, 0, 2, 3]);
        let blocks = compliance(n, &mut next);
        let contacts = contacts(&places, &mut next);
        let coupling_matrix = couplings(&mut next);
        let coupling = CouplingCompliance {
            matrix: &coupling_matrix,
            reference: DVec3::new(0.1, 0.2, 0.3),
        };
        let m = contacts.len();
        let mut w = vec![f64::NAN; m * m];
        delassus_into(&blocks, &contacts, Some(coupling), &mut w).unwrap();
        for i in 0..m {
            for j in 0..m {
                // The part's own term by scalars, the tool's by its rows.
                let mut expected = 0.0;
                for a in 0..3 {
                    for b in 0..3 {
                        let block = blocks.0[places[i] as usize][places[j] as usize];
                        expected += contacts[i].normal[a] * block.col(b)[a] * contacts[j].normal[b];
                    }
                }
                let (hi, hj) = (
                    contacts[i].tool_row(coupling.reference),
                    contacts[j].tool_row(coupling.reference),
                );
                for a in 0..6 {
                    for b in 0..6 {
                        expected += hi[a] * coupling_matrix[a][b] * hj[b];
                    }
                }
                assert!((w[j * m + i] - expected).abs() < 1e-12);
                assert_eq!(w[j * m + i].to_bits(), w[i * m + j].to_bits());
            }
        }
    }

    fn couplings(next: &mut impl FnMut() -> f64) -> [[f64; 6]; 6] {
        let half: [[f64; 6]; 6] = std::array::from_fn(|_| std::array::from_fn(|_| next()));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| (0..6).map(|k| half[i][k] * half[j][k]).sum())
        })
    }

    /// Along its frame a contact is three contacts of one direction each.
    #[test]
    fn along_frames_it_is_that_of_three_times_as_many_normals() {
        let mut next = numbers(7);
        let (n, places) = (5, [4, 0, 2, 3]);
        let blocks = compliance(n, &mut next);
        let contacts = contacts(&places, &mut next);
        let frames: Vec<Frame> = contacts
            .iter()
            .map(|contact| {
                let (t1, t2) = contact.normal.any_orthonormal_pair();
                [contact.normal, t1, t2]
            })
            .collect();
        let matrix = couplings(&mut next);
        let coupling = CouplingCompliance {
            matrix: &matrix,
            reference: DVec3::new(0.1, 0.2, 0.3),
        };
        let single: Vec<Contact> = contacts
            .iter()
            .zip(&frames)
            .flat_map(|(contact, frame)| frame.map(|normal| Contact { normal, ..*contact }))
            .collect();
        let m = single.len();
        let (mut w, mut expected) = (vec![f64::NAN; m * m], vec![0.0; m * m]);
        delassus_frames_into(&blocks, &contacts, &frames, Some(coupling), &mut w).unwrap();
        delassus_into(&blocks, &single, Some(coupling), &mut expected).unwrap();
        for i in 0..m {
            for j in 0..m {
                assert!((w[j * m + i] - expected[j * m + i]).abs() < 1e-12);
                assert_eq!(w[j * m + i].to_bits(), w[i * m + j].to_bits());
            }
        }
        let too_few = delassus_frames_into(&blocks, &contacts, &frames[1..], None, &mut w);
        assert!(too_few.is_err());
    }

    #[test]
    fn soft_coupling_alone_gives_rank_one_per_direction() {
        // Part rigid, coupling 2 m/N along z only: two equal normals see the same compliance.
        let blocks = Blocks(vec![vec![DMat3::ZERO; 2]; 2]);
        let mut matrix = [[0.0; 6]; 6];
        matrix[2][2] = 2.0;
        let contact = |place, x| Contact {
            place,
            gap: 0.0,
            normal: DVec3::Z,
            point: DVec3::new(x, 0.0, 0.0),
        };
        let contacts = [contact(0, 0.0), contact(1, 5.0)];
        let coupling = CouplingCompliance {
            matrix: &matrix,
            reference: DVec3::ZERO,
        };
        let mut w = [0.0; 4];
        delassus_into(&blocks, &contacts, Some(coupling), &mut w).unwrap();
        assert_eq!(w, [2.0; 4]);
        delassus_into(&blocks, &contacts, None, &mut w).unwrap();
        assert_eq!(w, [0.0; 4]);
        assert!(delassus_into(&blocks, &contacts, None, &mut [0.0; 3]).is_err());
    }
}

use glam::DMat3;

use super::*;
use crate::delassus::delassus_into;

struct Blocks;
static NEAR: DMat3 = DMat3::from_cols_array(&[2.0, 0.1, 0.0, 0.1, 3.0, 0.2, 0.0, 0.2, 4.0]);
static FAR: DMat3 = DMat3::from_cols_array(&[0.5, 0.1, 0.0, 0.1, 0.4, 0.0, 0.0, 0.0, 0.3]);
impl ComplianceBlocks for Blocks {
    fn block(&self, row: usize, col: usize) -> DMat3 {
        if row == col { NEAR } else { FAR }
    }
}

/// Two heaps of nodes, far apart, and one node with the opposite normal amid the first.
fn contacts() -> Vec<Contact> {
    (0..41)
        .rev()
        .map(|k: u32| {
            let side = if k < 20 || k == 40 { 0.0 } else { 30.0 };
            let at = f64::from(k % 20);
            let normal = if k == 40 { -DVec3::Z } else { DVec3::Z };
            Contact {
                place: k,
                gap: 0.0,
                normal,
                point: DVec3::new(side + 0.1 * at, 0.02 * at * at, 0.0),
            }
        })
        .collect()
}

/// Neighbours side by side: the odd one in the middle of the first heap.
fn rank_of(place: u32) -> u32 {
    match place {
        40 => 10,
        0..10 => place,
        _ => place + 1,
    }
}

fn gathered(most: usize) -> (Patches, Vec<Contact>) {
    let mut contacts = contacts();
    let mut patches = Patches::new(contacts.len());
    let hint = |place: u32| f64::from(place % 3);
    patches.gather(&mut contacts, rank_of, 42, most, 10.0, hint, false);
    (patches, contacts)
}

#[test]
fn patches_keep_the_budget_and_split_what_differs_first() {
    for most in [1, 2, 3, 7, 20, 41, 100] {
        let (patches, contacts) = gathered(most);
        assert_eq!(patches.len(), most.min(41));
        assert_eq!(patches.range(patches.len() - 1).end, contacts.len());
        for patch in 0..patches.len() {
            assert!(!patches.range(patch).is_empty());
            let sum: f64 = patches.shares[patches.range(patch)].iter().sum();
            assert!((sum - 1.0).abs() < 1e-12);
        }
    }
    // Places apart by most of the length, then the opposite normal.
    let (patches, contacts) = gathered(8);
    let of_odd = contacts
        .iter()
        .position(|contact| contact.place == 40)
        .unwrap();
    let mixed = (0..8).filter(|patch| {
        let members = &contacts[patches.range(*patch)];
        members.iter().any(|p| p.point.x < 15.0) && members.iter().any(|p| p.point.x > 15.0)
    });
    assert_eq!(mixed.count(), 0);
    assert_eq!(patches.range(patches.patch_of[of_odd] as usize).len(), 1);
}

/// W_r = Pᵀ W P by the whole matrices, with forces and gaps to match.
#[test]
fn shared_rows_are_the_galerkin_product() {
    let (mut patches, contacts) = gathered(7);
    let (n, m) = (contacts.len(), patches.len());
    let identity: [[f64; 6]; 6] =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    let coupling = CouplingCompliance {
        matrix: &identity,
        reference: DVec3::new(1.0, -2.0, 0.5),
    };
    let (mut w, mut w_r) = (vec![0.0; n * n], vec![0.0; m * m]);
    delassus_into(&Blocks, &contacts, Some(coupling), &mut w).unwrap();
    patches
        .delassus_into(&Blocks, &contacts, Some(coupling), &mut w_r)
        .unwrap();
    for g in 0..m {
        for h in 0..m {
            let mut expected = 0.0;
            for i in patches.range(g) {
                for j in patches.range(h) {
                    expected += patches.shares[i] * w[j * n + i] * patches.shares[j];
                }
            }
            assert!((w_r[h * m + g] - expected).abs() < 1e-9 * expected.abs().max(1.0));
            assert_eq!(w_r[h * m + g].to_bits(), w_r[g * m + h].to_bits());
        }
    }
    let q: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
    let mut z: Vec<f64> = (0..n).map(|g| 1.0 + g as f64).collect();
    let mut q_r = vec![0.0; m];
    patches.reduce_into(&q, &mut q_r);
    let work: f64 = q_r.iter().zip(&z).map(|(q, y)| q * y).sum();
    patches.spread(&mut z);
    let expected: f64 = q.iter().zip(&z).map(|(q, z)| q * z).sum();
    assert!((work - expected).abs() < 1e-12);
    assert!(
        patches
            .delassus_into(&Blocks, &contacts, None, &mut w)
            .is_err()
    );
}

/// (e_i - p)ᵀ W (e_i - p) / (1 - p_i) by the whole matrix.
#[test]
fn a_shift_is_what_a_node_gives_way_against_its_patch() {
    let (mut patches, contacts) = gathered(7);
    let (n, m) = (contacts.len(), patches.len());
    let (mut w, mut w_r) = (vec![0.0; n * n], vec![0.0; m * m]);
    delassus_into(&Blocks, &contacts, None, &mut w).unwrap();
    patches
        .delassus_into(&Blocks, &contacts, None, &mut w_r)
        .unwrap();
    for g in 0..m {
        for i in patches.range(g) {
            let mut d = vec![0.0; n];
            for j in patches.range(g) {
                d[j] = -patches.shares[j];
            }
            d[i] += 1.0;
            let away = (0..n).map(|j| d[j] * (0..n).map(|k| w[k * n + j] * d[k]).sum::<f64>());
            let expected = away.sum::<f64>() / (1.0 - patches.shares[i]);
            match patches.shift(i) {
                Some(shift) => assert!((shift / expected - 1.0).abs() < 1e-9),
                None => assert!(patches.range(g).len() == 1 || patches.shares[i] == 1.0),
            }
        }
    }
}

/// Two springs of 1 N/m, pressed 1 m and 3 m, in equal shares: 4 N, gaps -1 m and 1 m.
#[test]
fn loss_bounds_the_energy_that_was_left() {
    let (q, z, gaps) = ([-1.0, -3.0], [2.0, 2.0], [1.0, -1.0]);
    let loss = loss(&z, &[1.0, 3.0], &q, &gaps);
    assert_eq!(loss.penetration, 1.0);
    // -½ (1 + 9) = -5 J in truth, -4 J so: 1 J lost, bounded by 3 of 4 J.
    assert_eq!(loss.force_rel, SAFETY * (3.0f64 / 4.0).sqrt());
}

//! The step against one that spares nothing: all nodes in every pass, no appointments, no kept displacement, the
//! operator assembled anew from its definition, the contact problem solved cold.

use std::sync::Arc;

use contact::delassus::ComplianceBlocks;
use contact::lcp;
use contact::tool::{Mesh, Tool};
use device::VirtualCoupling;
use glam::{DMat3, DQuat, DVec3};
use glamx::DPose3;
use snapin::engine::{ContactPart, Engine};
use snapin::prepare::{PrepareOptions, prepare};
use snapin::progress::Ui;
use snapin::scene::Scene;
use snapin::setup;
use snapin_tests::root;

/// What the slow way keeps between steps: forces on all candidates and the tool's deviation.
struct BruteForce<'a> {
    part: &'a ContactPart,
    tool: &'a Tool,
    coupling: &'a VirtualCoupling,
    near_distance: f64,
    forces: Vec<DVec3>,
    deviation: [f64; 6],
}

impl BruteForce<'_> {
    fn block(&self, i: usize, j: usize) -> DMat3 {
        ComplianceBlocks::block(self.part, i, j)
    }

    fn positions(&self) -> Vec<DVec3> {
        let loaded: Vec<usize> = (0..self.forces.len())
            .filter(|j| self.forces[*j] != DVec3::ZERO)
            .collect();
        let rest = self.part.rest_positions().iter().enumerate();
        rest.map(|(i, x)| {
            let moved = loaded.iter().map(|&j| self.block(i, j) * self.forces[j]);
            *x + moved.sum::<DVec3>()
        })
        .collect()
    }

    /// Wrench of the contacts on the tool about its origin, N and N m, after this many passes over the planes.
    fn step(&mut self, target: &DPose3, passes: u32) -> [f64; 6] {
        let compliance = self.coupling.compliance();
        let mut seen: Vec<bool> = self.forces.iter().map(|f| *f != DVec3::ZERO).collect();
        let mut wrench = [0.0; 6];
        for _ in 0..passes {
            let pose = VirtualCoupling::pose_from_deviation(target, &self.deviation);
            let before = self.positions();
            let mut rows = Vec::new();
            for (i, x) in before.iter().enumerate() {
                let at = self.tool.signed_distance(&pose, *x);
                seen[i] |= at.signed_distance < self.near_distance;
                if seen[i] {
                    let turned = (*x - pose.translation).cross(at.normal);
                    let (n, t) = (at.normal.to_array(), turned.to_array());
                    let h = [n[0], n[1], n[2], t[0], t[1], t[2]];
                    let u = *x - self.part.rest_positions()[i];
                    let along: f64 = h.iter().zip(&self.deviation).map(|(h, e)| h * e).sum();
                    let gap = at.signed_distance - at.normal.dot(u) + along;
                    rows.push((i, at.normal, h, gap));
                }
            }
            let m = rows.len();
            let yields =
                |h: &[f64; 6]| compliance.map(|c| c.iter().zip(h).map(|(c, h)| c * h).sum::<f64>());
            let mut w = vec![0.0; m * m];
            for (a, (i, n_i, h_i, _)) in rows.iter().enumerate() {
                for (b, (j, n_j, h_j, _)) in rows.iter().enumerate().take(a + 1) {
                    let tool: f64 = yields(h_j).iter().zip(h_i).map(|(y, h)| y * h).sum();
                    let entry = n_i.dot(self.block(*i, *j) * *n_j) + tool;
                    (w[a * m + b], w[b * m + a]) = (entry, entry);
                }
            }
            let q: Vec<f64> = rows.iter().map(|row| row.3).collect();
            let (mut z, mut gaps) = (vec![0.0; m], vec![0.0; m]);
            let solution = lcp::solve(
                &lcp::Problem::symmetric(&w, &q).unwrap(),
                &lcp::Settings::default(),
                &mut lcp::Scratch::new(m),
                lcp::Start::Cold,
                &mut z,
                &mut gaps,
            );
            assert_eq!(solution.unwrap().status, lcp::Status::Solved);
            self.forces.fill(DVec3::ZERO);
            wrench = [0.0; 6];
            for ((i, normal, h, _), z) in rows.iter().zip(&z) {
                self.forces[*i] = *z * *normal;
                for (sum, h) in wrench.iter_mut().zip(h) {
                    *sum -= z * h;
                }
            }
            self.deviation = yields(&wrench);
        }
        wrench
    }
}

/// Numbers between -1 and 1 that look random.
fn numbers() -> impl FnMut() -> f64 {
    let mut state = 7_u64;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Pushes the tool in and out at random along the scene's way, with some play to the sides and in turning.
fn compare(name: &str, as_mesh: bool, deepest: f64) {
    let scene = Scene::load(&root().join("scenes").join(name)).unwrap();
    let mut unseen = std::io::sink();
    let spec = setup::part_spec(&scene).unwrap();
    let ui = Ui::new(&mut unseen, false);
    let prepared = prepare(&spec, &PrepareOptions::default(), &ui).unwrap();
    let (mut tool, _) = setup::tool(&scene).unwrap();
    if as_mesh {
        let (vertices, triangles) = tool.tessellate(0.02);
        tool = Tool::Mesh(Mesh::new(&vertices, &triangles).unwrap().into());
    }
    let usual = setup::engine(&scene, &prepared, tool.clone()).unwrap();
    let settings = usual.settings().clone();
    let near_distance = settings.near_distance;
    let largest_motion = 0.2 * settings.max_stride;
    let coupling = *usual.coupling().unwrap();
    let part = prepared.contact_part();
    let mut fast = Engine::new(Arc::clone(&part), tool.clone(), Some(coupling), settings).unwrap();
    let mut slow = BruteForce {
        part: &part,
        tool: &tool,
        coupling: &coupling,
        near_distance,
        forces: vec![DVec3::ZERO; part.n_candidates()],
        deviation: [0.0; 6],
    };
    let mut next = numbers();
    let start = scene.tool.pose_part_tool;
    let (mut way, mut play, mut turn) = (0.0, DVec3::ZERO, DVec3::ZERO);
    let mut wanted = 0.5 * deepest;
    let (mut n_contact, mut largest_force) = (0, 0.0_f64);
    for _ in 0..600 {
        // Towards a random depth, a new one now and then.
        if next() > 0.97 {
            wanted = deepest * (0.75 + 0.25 * next());
        }
        way += (wanted - way).clamp(-largest_motion, largest_motion);
        let mut random = || DVec3::new(next(), next(), next());
        play = 0.98 * play + 0.1 * largest_motion * random();
        turn = 0.98 * turn + 1e-4 * random();
        let target = DPose3 {
            translation: start.translation + way * scene.hand.direction + play,
            rotation: DQuat::from_scaled_axis(turn) * start.rotation,
        };
        let report = fast.step(&target);
        assert_eq!((report.strides, report.dropped), (1, 0));
        let expected = slow.step(&target, report.passes);
        let force = DVec3::from_slice(&expected[..3]).length();
        let difference = |from: usize| {
            let ours = &report.contact_wrench_on_tool[from..from + 3];
            (DVec3::from_slice(ours) - DVec3::from_slice(&expected[from..])).length()
        };
        n_contact += u32::from(report.contacts > 0);
        largest_force = largest_force.max(force);
        let lever = tool.characteristic_size();
        // A force of less than 0.1 N is the difference of positions that are known to some 1e-17 m.
        let scale = force.max(0.1);
        assert!(
            difference(0) <= 1e-9 * scale && difference(3) <= 1e-9 * scale * lever,
            "{name}: {:?} and {expected:?}",
            report.contact_wrench_on_tool
        );
    }
    assert!(n_contact > 200, "{name}: contact in {n_contact} steps only");
    assert!(largest_force > 0.5, "{name}: {largest_force} N");
}

#[test]
fn the_clip_on_a_tube_as_by_brute_force() {
    compare("clip.toml", false, 0.0055);
}

#[test]
fn the_hook_as_by_brute_force() {
    compare("hook.toml", false, 0.0035);
}

#[test]
fn the_hook_under_a_faceted_rod_as_by_brute_force() {
    compare("hook.toml", true, 0.0035);
}

//! The step against one that spares nothing: all nodes, and all points of the tool's edges against all faces, in every
//! pass, nothing foreseen, no appointments, no kept displacement, the operator assembled anew from its definition, the
//! contact problem solved cold.

use std::sync::Arc;

use contact::delassus::ComplianceBlocks;
use contact::face::{Face, Nearest};
use contact::lcp;
use contact::surface::{NO_FACE, Surface};
use contact::tool::{Features, Mesh, Tool};
use device::VirtualCoupling;
use glam::{DMat3, DQuat, DVec3};
use glamx::DPose3;
use snapin::engine::{ContactPart, Engine, Plan};
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
    /// Nodes with force of a plane of their own.
    is_own: Vec<bool>,
    deviation: [f64; 6],
    edges: Option<SlowEdges>,
}

/// A row of the contact problem: nodes with their shares, normal, tool's row, gap at zero force.
struct Row {
    shares: Vec<(usize, f64)>,
    normal: DVec3,
    h: [f64; 6],
    gap: f64,
}

impl BruteForce<'_> {
    /// `gap` as it is now at `point` of tool or node.
    fn row(
        &self,
        shares: Vec<(usize, f64)>,
        (normal, gap): (DVec3, f64),
        point: DVec3,
        origin: DVec3,
        now: &[DVec3],
    ) -> Row {
        let (n, t) = (normal.to_array(), (point - origin).cross(normal).to_array());
        let h = [n[0], n[1], n[2], t[0], t[1], t[2]];
        let along: f64 = h.iter().zip(&self.deviation).map(|(h, e)| h * e).sum();
        let moved = shares
            .iter()
            .map(|(i, share)| *share * (now[*i] - self.part.rest_positions()[*i]));
        let gap = gap - normal.dot(moved.sum()) + along;
        Row {
            shares,
            normal,
            h,
            gap,
        }
    }

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

    /// Wrench of the contacts on the tool about its origin, N and N m, once the planes stand still.
    fn step(&mut self, target: &DPose3) -> [f64; 6] {
        /// m.
        const STANDSTILL: f64 = 1e-16;
        let compliance = self.coupling.compliance();
        let mut seen = self.is_own.clone();
        let mut wrench = [0.0; 6];
        if let Some(edges) = &mut self.edges {
            edges.begin_step();
        }
        for pass in 0.. {
            assert!(pass < 200, "planes do not stand still");
            let pose = VirtualCoupling::pose_from_deviation(target, &self.deviation);
            let before = self.positions();
            let origin = pose.translation;
            let mut rows = Vec::new();
            let mut own = Vec::new();
            for (i, x) in before.iter().enumerate() {
                let at = self.tool.signed_distance(&pose, *x);
                seen[i] |= at.signed_distance < self.near_distance;
                if seen[i] {
                    let seen_at = (at.normal, at.signed_distance);
                    rows.push(self.row(vec![(i, 1.0)], seen_at, *x, origin, &before));
                    own.push(i);
                }
            }
            let mut features = Vec::new();
            if let Some(mut edges) = self.edges.take() {
                for (feature, face, nearest) in edges.look(&pose, &before, self.near_distance) {
                    let point = pose.transform_point(edges.features.points()[feature]);
                    let nodes = edges.surface.nodes_of(face).iter().zip(nearest.weights);
                    let shares = nodes
                        .filter(|(node, _)| edges.surface.is_candidate(**node))
                        .map(|(node, weight)| (*node as usize, weight));
                    let seen_at = (-nearest.outward, nearest.height);
                    rows.push(self.row(shares.collect(), seen_at, point, origin, &before));
                    features.push((feature, face));
                }
                self.edges = Some(edges);
            }
            let m = rows.len();
            let yields =
                |h: &[f64; 6]| compliance.map(|c| c.iter().zip(h).map(|(c, h)| c * h).sum::<f64>());
            let mut w = vec![0.0; m * m];
            for (a, of) in rows.iter().enumerate() {
                for (b, by) in rows.iter().enumerate().take(a + 1) {
                    let tool: f64 = yields(&by.h).iter().zip(&of.h).map(|(y, h)| y * h).sum();
                    let mut entry = tool;
                    for (i, share_i) in &of.shares {
                        for (j, share_j) in &by.shares {
                            let moved = self.block(*i, *j) * by.normal;
                            entry += share_i * share_j * of.normal.dot(moved);
                        }
                    }
                    (w[a * m + b], w[b * m + a]) = (entry, entry);
                }
            }
            let q: Vec<f64> = rows.iter().map(|row| row.gap).collect();
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
            self.is_own.fill(false);
            wrench = [0.0; 6];
            for (row, z) in rows.iter().zip(&z) {
                for (i, share) in &row.shares {
                    self.forces[*i] += *share * *z * row.normal;
                }
                for (sum, h) in wrench.iter_mut().zip(row.h) {
                    *sum -= z * h;
                }
            }
            for (i, z) in own.iter().zip(&z) {
                self.is_own[*i] = *z > 0.0;
            }
            if let Some(edges) = &mut self.edges {
                let carried = features.iter().zip(&z[own.len()..]);
                edges.carried = carried
                    .filter(|(_, z)| **z > 0.0)
                    .map(|(f, _)| *f)
                    .collect();
            }
            self.deviation = yields(&wrench);
            let after = self.positions();
            let moved = before.iter().zip(&after).map(|(b, a)| (*b - *a).length());
            if moved.fold(0.0, f64::max) < STANDSTILL {
                break;
            }
        }
        wrench
    }
}

/// The rule of `contact::surface`, with every point asked at every face.
struct SlowEdges {
    surface: Arc<Surface>,
    features: Features,
    /// By feature: the face that it was at, and the step.
    memory: Vec<(u32, u64)>,
    step: u64,
    seen: Vec<usize>,
    /// Features and faces with a row in this step.
    pairs: Vec<(usize, usize)>,
    carried: Vec<(usize, usize)>,
}

impl SlowEdges {
    fn new((surface, features): (Arc<Surface>, Features)) -> Self {
        Self {
            memory: vec![(NO_FACE, 0); features.points().len()],
            surface,
            features,
            step: 2,
            seen: Vec::new(),
            pairs: Vec::new(),
            carried: Vec::new(),
        }
    }

    fn begin_step(&mut self) {
        self.step += 1;
        self.pairs = std::mem::take(&mut self.carried);
        self.seen = self.pairs.iter().map(|(feature, _)| *feature).collect();
        self.seen.sort_unstable();
        self.seen.dedup();
        for feature in &self.seen {
            self.memory[*feature].1 = self.step;
        }
    }

    fn before(&self, feature: usize) -> u32 {
        let (face, step) = self.memory[feature];
        if step + 1 >= self.step { face } else { NO_FACE }
    }

    fn places(&self, face: usize, now: &[DVec3]) -> Vec<DVec3> {
        let mut places = [DVec3::ZERO; 10];
        self.surface
            .positions_into(face, |c| now[c as usize], &mut places);
        places[..self.surface.order().n_nodes()].to_vec()
    }

    /// From the face that it was at to where it is now, over borders.
    fn follow(
        &self,
        feature: usize,
        point: DVec3,
        now: &[DVec3],
        hold: f64,
    ) -> Option<(usize, Nearest)> {
        let mut face = self.before(feature);
        for _ in 0..8 {
            if face == NO_FACE {
                return None;
            }
            let at = face as usize;
            let nearest = Face::new(self.surface.order(), &self.places(at, now)).nearest(point);
            if self.surface.is_at(at, &nearest, hold) {
                return Some((at, nearest));
            }
            let beyond = (0..3).filter(|k| nearest.is_beyond[*k]);
            let mut across = beyond.map(|k| self.surface.neighbour(at, k));
            face = across.find(|face| *face != NO_FACE).unwrap_or(NO_FACE);
        }
        None
    }

    /// Features, faces and nearest points that make rows.
    fn look(&mut self, pose: &DPose3, now: &[DVec3], near: f64) -> Vec<(usize, usize, Nearest)> {
        let points: Vec<DVec3> = self
            .features
            .points()
            .iter()
            .map(|p| pose.transform_point(*p))
            .collect();
        let mut rows = Vec::new();
        for face in 0..self.surface.n_faces() {
            let places = self.places(face, now);
            let centre = places.iter().sum::<DVec3>() / places.len() as f64;
            for (feature, point) in points.iter().enumerate() {
                // Neither the face nor the depth behind it reaches as far.
                if (*point - centre).length() > 4.0 * self.surface.size(face) {
                    continue;
                }
                let nearest = Face::new(self.surface.order(), &places).nearest(*point);
                let hold = if self.before(feature) == face as u32 {
                    near
                } else {
                    0.0
                };
                let depth = self.surface.depth(face);
                if nearest.height < near
                    && nearest.height >= -depth
                    && self.surface.is_at(face, &nearest, hold)
                {
                    rows.push((feature, face, nearest));
                }
            }
        }
        let is_deep = |height: f64| height < -0.01 * near;
        for (feature, point) in points.iter().enumerate() {
            let deepest_of = rows
                .iter()
                .filter(|r| r.0 == feature && is_deep(r.2.height));
            let Some(shallowest) = deepest_of.max_by(|a, b| a.2.height.total_cmp(&b.2.height))
            else {
                continue;
            };
            let (nearest_face, followed) = (shallowest.1, self.follow(feature, *point, now, near));
            if followed.is_some() && !self.seen.contains(&feature) {
                self.seen.push(feature);
            }
            let stays = followed.map_or(nearest_face, |(face, _)| face);
            rows.retain(|r| r.0 != feature || !is_deep(r.2.height) || r.1 == stays);
        }
        for feature in self.seen.clone() {
            let of = rows.iter().filter(|r| r.0 == feature);
            let gap = of.map(|r| r.2.height).fold(f64::INFINITY, f64::min);
            if gap == f64::INFINITY {
                if let Some((face, nearest)) = self.follow(feature, points[feature], now, near) {
                    rows.push((feature, face, nearest));
                }
                continue;
            }
            // In a hollow kink a point leans on both faces.
            for &(_, face) in self.pairs.iter().filter(|pair| pair.0 == feature) {
                let nearest = Face::new(self.surface.order(), &self.places(face, now))
                    .nearest(points[feature]);
                let is_smooth =
                    (0..3).all(|k| !nearest.is_beyond[k] || self.surface.is_smooth(face, k));
                if !rows.iter().any(|r| r.0 == feature && r.1 == face)
                    && is_smooth
                    && nearest.aside <= 0.25 * self.surface.size(face)
                    && nearest.height >= gap
                {
                    rows.push((feature, face, nearest));
                }
            }
        }
        for (feature, face, _) in &rows {
            if !self.pairs.contains(&(*feature, *face)) {
                self.pairs.push((*feature, *face));
            }
        }
        for feature in 0..points.len() {
            let of = rows.iter().filter(|r| r.0 == feature);
            if let Some(pressed) = of.min_by(|a, b| a.2.height.total_cmp(&b.2.height)) {
                self.memory[feature] = (pressed.1 as u32, self.step);
                if !self.seen.contains(&feature) {
                    self.seen.push(feature);
                }
            }
        }
        rows
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
    let prepared = snapin_tests::prepared(&scene);
    let (mut tool, _) = setup::tool(&scene).unwrap();
    if as_mesh {
        let (vertices, triangles) = tool.tessellate(0.02);
        tool = Tool::Mesh(Mesh::new(&vertices, &triangles).unwrap().into());
    }
    let usual = setup::engine(&scene, &prepared, tool.clone()).unwrap();
    let mut settings = usual.settings().clone();
    // Both go to their ends, which do not depend on where they start.
    settings.displacement_tolerance = 1e-16;
    let near_distance = settings.near_distance;
    let largest_motion = 0.2 * settings.max_stride;
    let coupling = *usual.coupling().unwrap();
    let part = prepared.contact_part();
    let mut plan = Plan::new(Arc::clone(&part), tool.clone(), Some(coupling), settings);
    if !as_mesh {
        plan = setup::with_contact(&scene, &prepared, plan).unwrap();
    }
    let edges = plan.features.clone().map(SlowEdges::new);
    let mut fast = Engine::new(plan).unwrap();
    let has_edges = edges.is_some();
    let mut slow = BruteForce {
        part: &part,
        tool: &tool,
        coupling: &coupling,
        near_distance,
        forces: vec![DVec3::ZERO; part.n_candidates()],
        is_own: vec![false; part.n_candidates()],
        deviation: [0.0; 6],
        edges,
    };
    let mut next = numbers();
    let start = scene.tool.pose_part_tool;
    let (mut way, mut play, mut turn) = (0.0, DVec3::ZERO, DVec3::ZERO);
    let mut wanted = 0.5 * deepest;
    let (mut n_contact, mut n_on_edges, mut largest_force) = (0, 0, 0.0_f64);
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
            translation: start.translation + way * scene.drive.direction + play,
            rotation: DQuat::from_scaled_axis(turn) * start.rotation,
        };
        let report = fast.step(&target);
        assert_eq!((report.strides, report.dropped), (1, 0));
        let expected = slow.step(&target);
        let force = DVec3::from_slice(&expected[..3]).length();
        let difference = |from: usize| {
            let ours = &report.contact_wrench_on_tool[from..from + 3];
            (DVec3::from_slice(ours) - DVec3::from_slice(&expected[from..])).length()
        };
        n_contact += u32::from(report.contacts > 0);
        n_on_edges += slow.edges.as_ref().map_or(0, |edges| edges.carried.len());
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
    assert!(
        !has_edges || n_on_edges > 200,
        "{name}: {n_on_edges} contacts on edges only"
    );
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

#[test]
fn the_hook_under_a_sharp_corner_as_by_brute_force() {
    compare("edge.toml", false, 0.0045);
}

//! Small parts made of bricks, as MSH text: what tests with random scenes push at.

use std::collections::BTreeMap;
use std::fmt::Write;

/// Which faces or elements a physical group takes, by their corners, m.
pub type Takes<'a> = (&'a str, &'a dyn Fn(&[[f64; 3]]) -> bool);

/// A body of bricks on a regular grid, each cut into six tetrahedra.
#[derive(Clone, Copy)]
pub struct Brick<'a> {
    /// Bricks along x, y, z.
    pub cells: [usize; 3],
    /// m, of the whole grid; its lowest corner is the origin.
    pub size: [f64; 3],
    /// Bricks that are left out, by their place in the grid.
    pub is_hole: &'a dyn Fn([usize; 3]) -> bool,
}

impl Brick<'_> {
    /// The body as a mesh of linear tetrahedra in MSH 4.1. `faces`: groups of boundary faces; `volumes`: of elements; a
    /// face or element may be in several. The whole body is the group `body`.
    pub fn msh(&self, faces: &[Takes<'_>], volumes: &[Takes<'_>]) -> String {
        let [nx, ny, nz] = self.cells;
        let number = |i: usize, j: usize, k: usize| i + (nx + 1) * (j + (ny + 1) * k);
        let mut places = Vec::new();
        for k in 0..=nz {
            for j in 0..=ny {
                for i in 0..=nx {
                    let at = [(i, 0), (j, 1), (k, 2)];
                    places.push(at.map(|(n, c)| self.size[c] * n as f64 / self.cells[c] as f64));
                }
            }
        }
        let mut tets = Vec::new();
        for k in 0..nz {
            for j in 0..ny {
                for i in 0..nx {
                    if (self.is_hole)([i, j, k]) {
                        continue;
                    }
                    tets.extend(
                        six_of_a_brick()
                            .map(|tet| tet.map(|[a, b, c]| number(i + a, j + b, k + c))),
                    );
                }
            }
        }
        write_msh(&places, &tets, faces, volumes)
    }
}

/// Corners of the six tetrahedra along the diagonal of a brick (Kuhn), each of positive volume.
fn six_of_a_brick() -> [[[usize; 3]; 4]; 6] {
    let ways = [
        [0, 1, 2],
        [1, 2, 0],
        [2, 0, 1],
        [0, 2, 1],
        [2, 1, 0],
        [1, 0, 2],
    ];
    std::array::from_fn(|k| {
        let mut corner = [0; 3];
        let mut tet = [[0; 3]; 4];
        for (step, axis) in ways[k].into_iter().enumerate() {
            corner[axis] = 1;
            tet[step + 1] = corner;
        }
        if k >= 3 {
            tet.swap(1, 2);
        }
        tet
    })
}

fn write_msh(
    places: &[[f64; 3]],
    tets: &[[usize; 4]],
    faces: &[Takes<'_>],
    volumes: &[Takes<'_>],
) -> String {
    let mut is_used = vec![false; places.len()];
    let mut sides: BTreeMap<[usize; 3], (usize, [usize; 3])> = BTreeMap::new();
    for tet in tets {
        tet.iter().for_each(|n| is_used[*n] = true);
        for [a, b, c] in [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]] {
            let face = [tet[a], tet[b], tet[c]];
            let mut key = face;
            key.sort_unstable();
            sides.entry(key).or_insert((0, face)).0 += 1;
        }
    }
    let boundary = sides
        .values()
        .filter(|(n, _)| *n == 1)
        .map(|(_, face)| *face);
    // Each combination of groups is one entity of the file.
    let mut by_groups: BTreeMap<(usize, u32), Vec<Vec<usize>>> = BTreeMap::new();
    let mut add = |dimension: usize, groups: &[Takes<'_>], nodes: Vec<usize>| {
        let corners: Vec<[f64; 3]> = nodes.iter().map(|n| places[*n]).collect();
        let mask = groups.iter().enumerate();
        let mask: u32 = mask.map(|(k, g)| u32::from((g.1)(&corners)) << k).sum();
        by_groups.entry((dimension, mask)).or_default().push(nodes);
    };
    boundary.for_each(|face| add(2, faces, face.to_vec()));
    let body: Takes<'_> = ("body", &|_| true);
    let volumes: Vec<Takes<'_>> = std::iter::once(body)
        .chain(volumes.iter().copied())
        .collect();
    tets.iter().for_each(|tet| add(3, &volumes, tet.to_vec()));
    // Faces of no group need not be there.
    by_groups.remove(&(2, 0));

    let mut text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n".to_owned();
    let mut line = |words: std::fmt::Arguments<'_>| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{words}");
    };
    line(format_args!("{}", faces.len() + volumes.len()));
    for (dimension, groups) in [(2, faces), (3, &volumes)] {
        for (k, (name, _)) in groups.iter().enumerate() {
            line(format_args!("{dimension} {} \"{name}\"", k + 1));
        }
    }
    line(format_args!("$EndPhysicalNames\n$Entities"));
    let count = |dimension| by_groups.keys().filter(|(d, _)| *d == dimension).count();
    line(format_args!("0 0 {} {}", count(2), count(3)));
    for (entity, (_, mask)) in by_groups.keys().enumerate() {
        let tags: Vec<String> = (0..32)
            .filter(|k| mask >> k & 1 == 1)
            .map(|k| (k + 1).to_string())
            .collect();
        line(format_args!(
            "{} 0 0 0 1 1 1 {} {} 0",
            entity + 1,
            tags.len(),
            tags.join(" ")
        ));
    }
    let used: Vec<usize> = (0..places.len()).filter(|n| is_used[*n]).collect();
    line(format_args!(
        "$EndEntities\n$Nodes\n1 {0} 1 {1}\n3 {2} 0 {0}",
        used.len(),
        places.len(),
        by_groups.len()
    ));
    used.iter().for_each(|n| line(format_args!("{}", n + 1)));
    for n in &used {
        let [x, y, z] = places[*n];
        line(format_args!("{x} {y} {z}"));
    }
    let n_elements: usize = by_groups.values().map(Vec::len).sum();
    line(format_args!(
        "$EndNodes\n$Elements\n{} {n_elements} 1 {n_elements}",
        by_groups.len()
    ));
    let mut tag = 0;
    for (entity, ((dimension, _), elements)) in by_groups.iter().enumerate() {
        let kind = 2 * (dimension - 1);
        line(format_args!(
            "{dimension} {} {kind} {}",
            entity + 1,
            elements.len()
        ));
        for nodes in elements {
            tag += 1;
            let nodes: Vec<String> = nodes.iter().map(|n| (n + 1).to_string()).collect();
            line(format_args!("{tag} {}", nodes.join(" ")));
        }
    }
    line(format_args!("$EndElements"));
    text
}

/// Reproducible numbers (SplitMix64).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// The same numbers for the same seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Between the two.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Between the two, each decade alike.
    pub fn decades(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    /// Below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    /// One of them.
    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    /// With this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// Of unit length, any direction alike.
    pub fn direction(&mut self) -> [f64; 3] {
        loop {
            let v: [f64; 3] = std::array::from_fn(|_| self.between(-1.0, 1.0));
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            if (0.1..=1.0).contains(&length) {
                return v.map(|x| x / length);
            }
        }
    }
}

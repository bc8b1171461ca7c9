//! Contact sets as elastic parts give them, and paths of a tool that presses and then slides over them.

/// Compliance of a set of contacts and where they stand.
pub(crate) struct Set {
    /// W, column-major, three rows per contact: normal, along x, along y; m/N.
    pub(crate) matrix: Vec<f64>,
    /// Places in the tangent plane, m.
    pub(crate) places: Vec<[f64; 2]>,
}

const POISSON_RATIO: f64 = 0.35;
const YOUNG: f64 = 2.6e9;

impl Set {
    /// `n` points of a square grid on an elastic half-space, those nearest to the middle.
    ///
    /// Between two points the compliance is that of Boussinesq (normal) and Cerruti (tangential), of a point with itself the
    /// mean over a disk of the grid cell's area. Source: Johnson, Contact Mechanics (1985), 3.2 and 3.6.
    pub(crate) fn half_space(n: usize) -> Self {
        let places = middle_of_grid(n);
        let (nu, per) = (
            POISSON_RATIO,
            (1.0 + POISSON_RATIO) / (std::f64::consts::PI * YOUNG),
        );
        let radius = SPACING / std::f64::consts::PI.sqrt();
        // Mean of 1/r over the disk's points, from a uniform load on the disk.
        let mean = 16.0 / (3.0 * std::f64::consts::PI * radius);
        let block = |i: usize, j: usize| -> [[f64; 3]; 3] {
            if i == j {
                let along = per * (1.0 - 0.5 * nu) * mean;
                return [
                    [per * (1.0 - nu) * mean, 0.0, 0.0],
                    [0.0, along, 0.0],
                    [0.0, 0.0, along],
                ];
            }
            let [x, y] = [0, 1].map(|k: usize| places[i][k] - places[j][k]);
            let r = x.hypot(y);
            let along = |a: f64, b: f64| per * nu * a * b / r.powi(3);
            let cross = |a: f64| per * (0.5 - nu) * a / (r * r);
            let direct = per * (1.0 - nu) / r;
            [
                [direct, cross(x), cross(y)],
                [-cross(x), direct + along(x, x), along(x, y)],
                [-cross(y), along(x, y), direct + along(y, y)],
            ]
        };
        Self {
            matrix: assembled(n, block),
            places,
        }
    }

    /// `n` points in two lines on the face of a cantilever that is 100 mm long, 10 mm wide and 4 mm thick; each also
    /// gives way by itself. Normal and tangential motion are coupled by the face's distance from the middle.
    pub(crate) fn beam(n: usize) -> Self {
        const LENGTH: f64 = 0.1;
        const THICKNESS: f64 = 4e-3;
        const WIDTH: f64 = 1e-2;
        let n_along = n.div_ceil(2);
        let places: Vec<[f64; 2]> = (0..n)
            .map(|i| {
                let share = (i / 2 + 1) as f64 / n_along as f64;
                let side = if i % 2 == 0 { -0.25 } else { 0.25 };
                [LENGTH * (0.4 + 0.6 * share), WIDTH * side]
            })
            .collect();
        let area = WIDTH * THICKNESS;
        let thin = WIDTH * THICKNESS.powi(3) / 12.0 * YOUNG;
        let wide = THICKNESS * WIDTH.powi(3) / 12.0 * YOUNG;
        let torsion = WIDTH * THICKNESS.powi(3) / 3.0 * YOUNG / (2.0 * (1.0 + POISSON_RATIO));
        // Clamped at x = 0: bending by a force at b and a moment at b, seen at a.
        let by_force = |a: f64, b: f64| {
            let (near, far) = (a.min(b), a.max(b));
            near * near * (3.0 * far - near) / 6.0
        };
        let slope = |a: f64, b: f64| {
            if a < b {
                a * b - 0.5 * a * a
            } else {
                0.5 * b * b
            }
        };
        let c = 0.5 * THICKNESS;
        let block = |i: usize, j: usize| -> [[f64; 3]; 3] {
            let ([a, y], [b, z]) = (places[i], places[j]);
            let near = a.min(b);
            let own = if i == j { 2e-7 } else { 0.0 };
            let normal = by_force(a, b) / thin + y * z * near / torsion;
            let along = near / (area * YOUNG) + c * c * near / thin + y * z * near / wide;
            let across = by_force(a, b) / wide + c * c * near / torsion;
            [
                [
                    normal + own,
                    -c * slope(b, a) / thin,
                    y * c * near / torsion,
                ],
                [
                    -c * slope(a, b) / thin,
                    along + own,
                    -y * slope(a, b) / wide,
                ],
                [
                    z * c * near / torsion,
                    -z * slope(b, a) / wide,
                    across + own,
                ],
            ]
        };
        Self {
            matrix: assembled(n, block),
            places,
        }
    }

    pub(crate) fn n(&self) -> usize {
        self.places.len()
    }
}

/// Distance of neighbours in the grid, m.
const SPACING: f64 = 5e-4;

fn middle_of_grid(n: usize) -> Vec<[f64; 2]> {
    let side = (n as f64).sqrt() as i32 + 3;
    // Off the middle, so that no four points are equally far.
    let mut places: Vec<[f64; 2]> = (-side..=side)
        .flat_map(|i| (-side..=side).map(move |j| [f64::from(i) + 0.11, f64::from(j) + 0.23]))
        .collect();
    places.sort_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])));
    places.truncate(n);
    places.iter().map(|p| p.map(|x| SPACING * x)).collect()
}

/// Blocks (i, j) for j ≤ i, mirrored: symmetric to the last bit.
fn assembled(n: usize, block: impl Fn(usize, usize) -> [[f64; 3]; 3]) -> Vec<f64> {
    let rows = 3 * n;
    let mut matrix = vec![0.0; rows * rows];
    for i in 0..n {
        for j in 0..=i {
            for (a, line) in block(i, j).iter().enumerate() {
                for (b, entry) in line.iter().enumerate() {
                    let (row, column) = (3 * i + a, 3 * j + b);
                    if row >= column {
                        matrix[column * rows + row] = *entry;
                        matrix[row * rows + column] = *entry;
                    }
                }
            }
        }
    }
    matrix
}

/// A tool that presses in and then slides along x, turning a little.
pub(crate) struct Path {
    /// Gap of each contact when the tool just touches the first one, m.
    pub(crate) shape: Vec<f64>,
    /// How deep, m.
    pub(crate) depth: f64,
    /// Slide in one step, m.
    pub(crate) slide: f64,
    /// Turn in one step, rad.
    pub(crate) turn: f64,
}

impl Path {
    /// Steps that press in.
    pub(crate) const PRESS: usize = 5;

    /// Gaps and slips without force in step `step`, after the displacements `before` (3 n, m).
    pub(crate) fn q(&self, set: &Set, step: usize, before: &[f64]) -> Vec<f64> {
        let pressed = (step + 1).min(Self::PRESS) as f64 / Self::PRESS as f64;
        let slides = f64::from(step >= Self::PRESS);
        let mut q = vec![0.0; 3 * set.n()];
        for (contact, place) in set.places.iter().enumerate() {
            let first = 3 * contact;
            let motion = [
                slides * (self.slide - self.turn * place[1]),
                slides * self.turn * place[0],
            ];
            q[first] = self.shape[contact] - self.depth * pressed;
            q[first + 1] = -before[first + 1] - motion[0];
            q[first + 2] = -before[first + 2] - motion[1];
        }
        q
    }
}

//! Samples with depth: triangles, lines and arrows onto a layer, layers onto each other.

/// How much nearer a line counts than the surface it lies on, in samples: deep enough for a steep
/// surface, shallow enough not to show through a thin wall.
const LINE_BIAS: f32 = 3.0;

/// Distance of the lines of a hatching along a row, samples.
const HATCH: usize = 28;

/// Background at the top and at the bottom of the picture.
const SKY: [[f32; 3]; 2] = [[1.0, 1.0, 1.0], [0.905, 0.925, 0.945]];

/// Colour, cover and depth of every sample.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    width: usize,
    height: usize,
    colour: Vec<[f32; 3]>,
    cover: Vec<f32>,
    depth: Vec<f32>,
}

/// The solid part and the glass tool in front of it.
#[derive(Clone, Debug)]
pub(super) struct Canvas {
    pub(super) solid: Layer,
    pub(super) glass: Layer,
}

impl Layer {
    pub(super) fn new(width: usize, height: usize) -> Self {
        let n = width * height;
        Self {
            width,
            height,
            colour: vec![[0.0; 3]; n],
            cover: vec![0.0; n],
            depth: vec![f32::INFINITY; n],
        }
    }

    /// Fills the samples of a triangle that are nearer than what is there. `shade` gets the
    /// weights of the corners and gives colour and cover, or nothing where the triangle is cut away.
    pub(super) fn triangle(
        &mut self,
        corners: [[f64; 3]; 3],
        shade: impl Fn([f32; 3]) -> Option<([f32; 3], f32)>,
    ) {
        if !corners.iter().flatten().all(|v| v.is_finite()) {
            return;
        }
        let [a, b, c] = corners;
        let cross = |p: [f64; 3], q: [f64; 3], x: f64, y: f64| {
            (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0])
        };
        let area = cross(a, b, c[0], c[1]);
        if area.abs() < 1e-9 {
            return;
        }
        let (columns, rows) = (
            span(corners.map(|p| p[0]), 0.0, self.width),
            span(corners.map(|p| p[1]), 0.0, self.height),
        );
        for row in rows {
            let y = row as f64 + 0.5;
            for column in columns.clone() {
                let x = column as f64 + 0.5;
                let weights = [cross(b, c, x, y) / area, cross(c, a, x, y) / area];
                let third = 1.0 - weights[0] - weights[1];
                // A hair outside counts as inside, so that no seam shows.
                if weights[0] < -1e-9 || weights[1] < -1e-9 || third < -1e-9 {
                    continue;
                }
                let depth = (weights[0] * a[2] + weights[1] * b[2] + third * c[2]) as f32;
                let at = row * self.width + column;
                if depth < self.depth[at] {
                    let weights = [weights[0] as f32, weights[1] as f32, third as f32];
                    if let Some(shaded) = shade(weights) {
                        self.depth[at] = depth;
                        (self.colour[at], self.cover[at]) = shaded;
                    }
                }
            }
        }
    }

    /// Fills what closed lines in a plane enclose (holes stay empty), hatched as cut faces are in drawings. `depth` gives that of the plane
    /// at a sample.
    pub(super) fn hatched(
        &mut self,
        lines: &[[[f64; 3]; 2]],
        depth: impl Fn(f64, f64) -> f64,
        colours: [[f32; 3]; 2],
        cover: f32,
    ) {
        let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); self.height];
        let finite = lines
            .iter()
            .filter(|l| l.iter().flatten().all(|v| v.is_finite()));
        for [a, b] in finite {
            let (low, high) = if a[1] < b[1] { (a, b) } else { (b, a) };
            for row in span([low[1], high[1], low[1]], 0.0, self.height) {
                let y = row as f64 + 0.5;
                if low[1] <= y && y < high[1] {
                    let share = (y - low[1]) / (high[1] - low[1]);
                    crossings[row].push(low[0] + share * (high[0] - low[0]));
                }
            }
        }
        for (row, crossings) in crossings.iter_mut().enumerate() {
            // A line that does not close is none.
            if crossings.len() % 2 == 1 {
                continue;
            }
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                let first = (pair[0] - 0.5).ceil().max(0.0) as usize;
                let last = ((pair[1] - 0.5).ceil().max(0.0) as usize).min(self.width);
                for column in first..last {
                    let at = row * self.width + column;
                    let here = depth(column as f64 + 0.5, row as f64 + 0.5) as f32;
                    if here < self.depth[at] {
                        let is_line = (row + column) % HATCH < HATCH / 7;
                        self.depth[at] = here;
                        self.colour[at] = colours[usize::from(is_line)];
                        self.cover[at] = cover;
                    }
                }
            }
        }
    }

    /// Depth of the nearest thing at a place, infinite where nothing is or off the layer.
    pub(super) fn depth_at(&self, x: f64, y: f64) -> f64 {
        let is_on = (0.0..self.width as f64).contains(&x) && (0.0..self.height as f64).contains(&y);
        if is_on {
            f64::from(self.depth[y as usize * self.width + x as usize])
        } else {
            f64::INFINITY
        }
    }

    /// A line on the surface, `width` samples wide, hidden where the surface in front of it is.
    pub(super) fn line(
        &mut self,
        ends: [[f64; 3]; 2],
        width: f64,
        colour: [f32; 3],
        strength: f32,
    ) {
        if !ends.iter().flatten().all(|v| v.is_finite()) {
            return;
        }
        let [a, b] = ends;
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length_squared = dx * dx + dy * dy;
        let reach = 0.5 * width + 0.5;
        let columns = span([a[0], b[0], a[0]], reach, self.width);
        for row in span([a[1], b[1], a[1]], reach, self.height) {
            for column in columns.clone() {
                let (x, y) = (column as f64 + 0.5 - a[0], row as f64 + 0.5 - a[1]);
                let along = if length_squared > 0.0 {
                    ((x * dx + y * dy) / length_squared).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let distance = (x - along * dx).hypot(y - along * dy);
                let cover = (reach - distance).clamp(0.0, 1.0) as f32;
                let depth = (a[2] + along * (b[2] - a[2])) as f32 - LINE_BIAS;
                let at = row * self.width + column;
                // Beyond the outline there is nothing that the line could lie on.
                if cover > 0.0 && depth <= self.depth[at] && self.depth[at].is_finite() {
                    self.blend(at, colour, cover * strength);
                }
            }
        }
    }

    /// An arrow over everything, with a light rim: from the first point to the second.
    pub(super) fn arrow(&mut self, ends: [[f64; 3]; 2], colour: [f32; 3]) {
        let [tail, tip] = ends;
        let (dx, dy) = (tip[0] - tail[0], tip[1] - tail[1]);
        let length = dx.hypot(dy);
        if length < 4.0 {
            return;
        }
        let along = [dx / length, dy / length];
        let head = (0.45 * length).min(30.0);
        let shaft = (0.12 * head).max(1.2);
        for (rim, colour, strength) in [(2.2, [1.0; 3], 0.85), (0.0, colour, 1.0)] {
            let columns = span([tail[0], tip[0], tail[0]], 0.5 * head + 4.0, self.width);
            for row in span([tail[1], tip[1], tail[1]], 0.5 * head + 4.0, self.height) {
                for column in columns.clone() {
                    let (x, y) = (column as f64 + 0.5 - tail[0], row as f64 + 0.5 - tail[1]);
                    let forward = x * along[0] + y * along[1];
                    let aside = (y * along[0] - x * along[1]).abs();
                    let back = length - forward;
                    let in_shaft = forward >= -rim && back >= 0.9 * head && aside <= shaft + rim;
                    let in_head = back >= -rim
                        && back <= head + rim
                        && aside <= 0.36 * back.max(0.0) + 1.1 * rim;
                    if in_shaft || in_head {
                        self.blend(row * self.width + column, colour, strength);
                    }
                }
            }
        }
    }

    fn blend(&mut self, at: usize, colour: [f32; 3], strength: f32) {
        for (below, above) in self.colour[at].iter_mut().zip(colour) {
            *below += strength * (above - *below);
        }
        self.cover[at] += strength * (1.0 - self.cover[at]);
    }
}

impl Canvas {
    pub(super) fn new(width: usize, height: usize) -> Self {
        let mut solid = Layer::new(width, height);
        for (row, line) in solid.colour.chunks_exact_mut(width).enumerate() {
            let share = row as f32 / height as f32;
            line.fill([0, 1, 2].map(|c| SKY[0][c] + share * (SKY[1][c] - SKY[0][c])));
        }
        Self {
            solid,
            glass: Layer::new(width, height),
        }
    }

    /// Lays the glass over the solid wherever it is in front.
    pub(super) fn lay_glass_over_solid(&mut self) {
        for at in 0..self.glass.colour.len() {
            if self.glass.depth[at] < self.solid.depth[at] {
                let (colour, cover) = (self.glass.colour[at], self.glass.cover[at]);
                self.solid.blend(at, colour, cover);
            }
        }
    }

    /// The samples, three bytes each.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let colours = self.solid.colour.iter().flatten();
        colours
            .map(|c| (c * 255.0).round().clamp(0.0, 255.0) as u8)
            .collect()
    }
}

/// Whole samples that three coordinates, widened by `reach`, touch within `0..end`.
fn span(values: [f64; 3], reach: f64, end: usize) -> std::ops::Range<usize> {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min) - reach;
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max) + reach;
    // Negative numbers and numbers beyond the range saturate.
    (low.floor() as usize).min(end)..(high.ceil() as usize).min(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RED: [f32; 3] = [1.0, 0.0, 0.0];
    const BLUE: [f32; 3] = [0.0, 0.0, 1.0];

    fn quad(layer: &mut Layer, depth: f64, colour: [f32; 3], cover: f32) {
        let [a, b, c, d] =
            [[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]].map(|[x, y]| [x, y, depth]);
        layer.triangle([a, b, c], |_| Some((colour, cover)));
        layer.triangle([a, c, d], |_| Some((colour, cover)));
    }

    #[test]
    fn the_nearer_triangle_is_seen_whatever_the_order() {
        for first_is_near in [true, false] {
            let mut canvas = Canvas::new(8, 8);
            let (near, far) = ((1.0, RED), (2.0, BLUE));
            let order = if first_is_near {
                [near, far]
            } else {
                [far, near]
            };
            for (depth, colour) in order {
                quad(&mut canvas.solid, depth, colour, 1.0);
            }
            assert!(canvas.solid.colour.iter().all(|&c| c == RED));
        }
    }

    #[test]
    fn glass_tints_only_what_is_behind_it() {
        for (depth, expected) in [(1.0, [128, 0, 128]), (3.0, [255, 0, 0])] {
            let mut canvas = Canvas::new(8, 8);
            quad(&mut canvas.solid, 2.0, RED, 1.0);
            quad(&mut canvas.glass, depth, BLUE, 0.5);
            canvas.lay_glass_over_solid();
            let pixels = canvas.bytes();
            assert_eq!(pixels.len(), 8 * 8 * 3);
            assert_eq!(pixels[..3], expected);
        }
    }

    #[test]
    fn a_line_behind_the_surface_is_hidden() {
        for (depth, is_seen) in [(2.0, true), (20.0, false)] {
            let mut canvas = Canvas::new(8, 8);
            quad(&mut canvas.solid, 2.0, RED, 1.0);
            canvas
                .solid
                .line([[0.0, 4.0, depth], [8.0, 4.0, depth]], 2.0, [0.0; 3], 1.0);
            assert_eq!(canvas.solid.colour[4 * 8 + 4] == [0.0; 3], is_seen);
        }
    }

    #[test]
    fn what_is_off_the_picture_or_not_a_number_does_no_harm() {
        let mut canvas = Canvas::new(8, 8);
        for far in [1e30, -1e30, f64::NAN, f64::INFINITY] {
            canvas
                .solid
                .triangle([[0.0; 3], [far, 0.0, 0.0], [0.0, far, 0.0]], |_| {
                    Some((RED, 1.0))
                });
            canvas
                .solid
                .line([[0.0; 3], [far, 1.0, 0.0]], 2.0, RED, 1.0);
        }
        canvas
            .solid
            .arrow([[-100.0, -100.0, 0.0], [-50.0, 300.0, 0.0]], RED);
    }

    /// A square with a square hole, behind and in front of what is there.
    #[test]
    fn a_hatched_face_keeps_its_holes_and_its_depth() {
        let square = |low: f64, high: f64| {
            let corners = [
                [low, low],
                [high, low],
                [high, high],
                [low, high],
                [low, low],
            ];
            let corners = corners.map(|[x, y]| [x, y, 0.0]);
            [0, 1, 2, 3].map(|i| [corners[i], corners[i + 1]])
        };
        let lines = [square(1.0, 7.0), square(3.0, 5.0)].concat();
        let mut layer = Layer::new(8, 8);
        layer.hatched(&lines, |x, _| x, [RED; 2], 1.0);
        let filled = layer.cover.iter().filter(|c| **c == 1.0).count();
        assert_eq!(filled, 36 - 4);
        assert_eq!(layer.depth_at(2.5, 2.5), 2.5);
        assert_eq!(layer.depth_at(4.5, 4.5), f64::INFINITY);
        assert_eq!(layer.depth_at(-1.0, 4.0), f64::INFINITY);
        layer.hatched(&lines, |_, _| 9.0, [BLUE; 2], 1.0);
        assert_eq!(layer.depth_at(2.5, 2.5), 2.5);
        // Lines that do not close fill nothing, and do no harm.
        layer.hatched(&lines[..3], |_, _| 0.0, [BLUE; 2], 1.0);
        assert!(layer.colour.iter().all(|c| *c != BLUE));
    }
}

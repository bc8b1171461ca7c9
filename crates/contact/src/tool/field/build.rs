//! From a tool to its field: which blocks, how fine, and the proof of every cell.

use std::cell::OnceCell;

use glam::DVec3;
use glamx::DPose3;

use super::{Block, Cell, DistanceField, NO_BLOCK};
use crate::error::{Error, check_positive};
use crate::tool::Tool;

/// Of the size of everything asked: set aside from the error for f64 round-off (1e-16 per operation, a hundred
/// operations) and for that of the tool's own answers.
pub(super) const ROUND_OFF: f64 = 1e-12;

/// rad; largest angle between the gradient and the exact normal in the lattice nodes of a cell that interpolates.
/// Smooth surfaces stay well below: the angle is half a cell's side over the radius of curvature. Beyond it
/// there is an edge that is flat enough for the distance but whose two sides are not to be mixed.
pub(super) const NORMAL_TOLERANCE: f64 = 0.1;

/// Cells along a side of the lattices that a block is first tried with, powers of 2: they ask the tool less.
const COARSE_LATTICES: [usize; 2] = [2, 4];
/// And of the last one.
const FINEST_LATTICE: usize = 8;

/// Blocks made between two looks at the memory.
const BATCH: usize = 1024;

pub(super) fn field(
    tool: Tool,
    error: f64,
    band: f64,
    max_bytes: usize,
) -> Result<DistanceField, Error> {
    check_positive("error of the distance field", error)?;
    check_positive("band of the distance field", band)?;
    if error > band {
        return Err(Error::FieldErrorAboveBand { error, band });
    }
    // The error of a field inside would be added to ours.
    let tool = match tool {
        Tool::Field(field) => field.tool.clone(),
        tool => tool,
    };
    let (min, max) = tool
        .aabb(&DPose3::IDENTITY)
        .filter(|(min, max)| min.is_finite() && max.is_finite())
        .ok_or(Error::FieldUnbounded)?;

    let recipe = Recipe::new(&tool, error, band, min, max);
    let origin = min - DVec3::splat(band);
    let along = ((max - min + DVec3::splat(2.0 * band)) / recipe.block_side).ceil();
    // A place in the table has 32 bits.
    let max_bytes = max_bytes.min(size_of::<u32>().saturating_mul(NO_BLOCK as usize));
    let refuse_above = |bytes: f64| {
        if bytes > max_bytes as f64 {
            Err(Error::FieldMemory {
                bytes: bytes as usize,
                max_bytes,
            })
        } else {
            Ok(())
        }
    };
    let table_bytes = along.element_product() * size_of::<u32>() as f64;
    refuse_above(table_bytes)?;
    let n_blocks = along.to_array().map(|n| n as usize);

    let mut wanted = Vec::new();
    let corner =
        |at: [usize; 3]| origin + recipe.block_side * DVec3::from_array(at.map(|x| x as f64));
    recipe.collect(&corner, [0; 3], n_blocks, &mut wanted);

    let [nx, ny, nz] = n_blocks;
    let mut field = DistanceField {
        error,
        band,
        origin,
        per_metre: recipe.block_side.recip(),
        n_blocks,
        table: vec![NO_BLOCK; nx * ny * nz],
        blocks: Vec::new(),
        samples: Vec::new(),
        asks: Vec::new(),
        n_cells: 0,
        n_exact: 0,
        tool: tool.clone(),
    };
    let mut n_done = 0;
    for batch in wanted.chunks(BATCH) {
        for (at, made) in batch.iter().zip(recipe.make(batch, &corner)) {
            field.add(*at, made);
        }
        n_done += batch.len();
        let made_bytes = field.bytes() as f64 - table_bytes;
        if field.bytes() > max_bytes {
            // The blocks still to come are taken to be as large as those made.
            refuse_above(table_bytes + made_bytes * (wanted.len() as f64 / n_done as f64))?;
        }
    }
    field.blocks.shrink_to_fit();
    field.samples.shrink_to_fit();
    field.asks.shrink_to_fit();
    Ok(field)
}

impl DistanceField {
    fn add(&mut self, [x, y, z]: [usize; 3], made: Made) {
        self.n_cells += made.n_cells;
        self.n_exact += made.n_exact;
        if made.n_exact == made.n_cells {
            return;
        }
        let [nx, ny, _] = self.n_blocks;
        self.table[x + nx * (y + ny * z)] = self.blocks.len() as u32;
        self.blocks.push(Block {
            first_sample: self.samples.len(),
            first_word: self.asks.len(),
            n_side: made.n_side,
        });
        self.samples.extend(made.samples);
        self.asks.extend(made.asks);
    }
}

/// One block, or nothing but its counts if all its cells ask.
#[derive(Debug, Clone, Default)]
struct Made {
    n_side: usize,
    samples: Vec<f32>,
    asks: Vec<u64>,
    n_cells: usize,
    n_exact: usize,
}

/// What every block is made by.
struct Recipe<'a> {
    tool: &'a Tool,
    error: f64,
    band: f64,
    /// m.
    block_side: f64,
    /// The error less what round-off may take, m.
    provable: f64,
}

/// What the tool says in a node of a block's lattice.
struct Node {
    position: DVec3,
    distance: f64,
    normal: DVec3,
    /// Far out and far in, found when a cell is to be proven.
    anchors: OnceCell<[Anchor; 2]>,
}

/// A place whose distance bounds that of the places round a node.
#[derive(Clone, Copy)]
struct Anchor {
    position: DVec3,
    distance: f64,
}

/// Where a cell stands.
#[derive(Clone, Copy, PartialEq)]
enum Verdict {
    Interpolates,
    Asks,
    /// No point of it is in the band: it asks and is not counted.
    Beyond,
}

impl<'a> Recipe<'a> {
    fn new(tool: &'a Tool, error: f64, band: f64, min: DVec3, max: DVec3) -> Self {
        // On a ball of radius r, cells of side h interpolate within h² / 4r and are proven within h² / 2r, or 3h² / 4r
        // where the normal is a diagonal: h = sqrt(r error) and below. So 4 cells a side do for the size of the whole
        // tool, and 8 for its details.
        let block_side = 4.0 * (error * tool.characteristic_size()).sqrt();
        let reach = 2.0 * (block_side / COARSE_LATTICES[0] as f64).powi(2) / error;
        let size = min.abs().max(max.abs()).length() + 2.0 * band + block_side + reach;
        Self {
            tool,
            error,
            band,
            block_side,
            provable: error - ROUND_OFF * size,
        }
    }

    /// Blocks of the grid from `from` to below `to` that may reach into the band.
    fn collect(
        &self,
        corner: &impl Fn([usize; 3]) -> DVec3,
        from: [usize; 3],
        to: [usize; 3],
        found: &mut Vec<[usize; 3]>,
    ) {
        let (low, high) = (corner(from), corner(to));
        // Slightly more than half the diagonal, for round-off.
        let radius = 0.501 * (high - low).length();
        let center = self.tool.signed_distance_local(0.5 * (low + high));
        if center.signed_distance.abs() > self.band + radius {
            return;
        }
        let longest = (0..3).max_by_key(|&k| to[k] - from[k]).unwrap_or(0);
        if to[longest] - from[longest] == 1 {
            found.push(from);
            return;
        }
        let middle = from[longest].midpoint(to[longest]);
        let (mut first_to, mut second_from) = (to, from);
        (first_to[longest], second_from[longest]) = (middle, middle);
        self.collect(corner, from, first_to, found);
        self.collect(corner, second_from, to, found);
    }

    /// In the order of `batch`.
    fn make(
        &self,
        batch: &[[usize; 3]],
        corner: &(impl Fn([usize; 3]) -> DVec3 + Sync),
    ) -> Vec<Made> {
        let n_threads = std::thread::available_parallelism().map_or(1, usize::from);
        let share = batch.len().div_ceil(n_threads);
        let mut made = vec![Made::default(); batch.len()];
        std::thread::scope(|scope| {
            for (places, made) in batch.chunks(share).zip(made.chunks_mut(share)) {
                scope.spawn(move || {
                    for (place, made) in places.iter().zip(made) {
                        *made = self.block(corner(*place));
                    }
                });
            }
        });
        made
    }

    /// The fewest cells that all interpolate; if the finest lattice proves none such, its cells, some of which ask.
    fn block(&self, corner: DVec3) -> Made {
        let coarse = COARSE_LATTICES.into_iter().find_map(|n_side| {
            let lattice = Lattice::new(self, corner, n_side);
            lattice.fewest_cells(self)
        });
        coarse.unwrap_or_else(|| {
            let finest = Lattice::new(self, corner, FINEST_LATTICE);
            let fewest = finest.fewest_cells(self);
            fewest.unwrap_or_else(|| finest.all_cells(self))
        })
    }
}

impl Made {
    fn new(n_side: usize, samples: Vec<f32>, verdicts: &[Verdict]) -> Self {
        let count = |wanted| verdicts.iter().filter(|&&v| v == wanted).count();
        let mut asks = vec![0; verdicts.len().div_ceil(64)];
        for (cell, verdict) in verdicts.iter().enumerate() {
            asks[cell / 64] |= u64::from(*verdict != Verdict::Interpolates) << (cell % 64);
        }
        let n_exact = count(Verdict::Asks);
        Self {
            n_side,
            samples,
            asks,
            n_cells: n_exact + count(Verdict::Interpolates),
            n_exact,
        }
    }
}

/// Nodes of one block, x fastest.
struct Lattice {
    n_side: usize,
    /// Between two nodes, m.
    spacing: f64,
    nodes: Vec<Node>,
}

impl Lattice {
    fn new(recipe: &Recipe<'_>, corner: DVec3, n_side: usize) -> Self {
        let spacing = recipe.block_side / n_side as f64;
        let nodes = places(n_side + 1)
            .map(|at| Node::new(recipe.tool, corner + spacing * to_vector(at)))
            .collect();
        Self {
            n_side,
            spacing,
            nodes,
        }
    }

    /// The block with as few cells as all interpolate, None if even those of the lattice do not.
    fn fewest_cells(&self, recipe: &Recipe<'_>) -> Option<Made> {
        let powers = std::iter::successors(Some(1), |n| Some(2 * n));
        let mut sizes = powers.take_while(|&n| n <= self.n_side);
        sizes.find_map(|n_side| {
            let samples = self.samples(n_side);
            let verdicts: Option<Vec<Verdict>> = places(n_side)
                .map(|at| Some(self.verdict(recipe, &samples, n_side, at)))
                .map(|verdict| verdict.filter(|&verdict| verdict != Verdict::Asks))
                .collect();
            verdicts.map(|verdicts| Made::new(n_side, samples, &verdicts))
        })
    }

    /// The block with the cells of the lattice, some of which ask.
    fn all_cells(&self, recipe: &Recipe<'_>) -> Made {
        let samples = self.samples(self.n_side);
        let verdicts: Vec<Verdict> = places(self.n_side)
            .map(|at| self.verdict(recipe, &samples, self.n_side, at))
            .collect();
        Made::new(self.n_side, samples, &verdicts)
    }

    /// For `n_side` cells along the block's side.
    fn samples(&self, n_side: usize) -> Vec<f32> {
        let stride = self.n_side / n_side;
        places(n_side + 1)
            .map(|at| self.node(at.map(|x| stride * x)).distance as f32)
            .collect()
    }

    /// Of the cell at `at` of `n_side` along the block's side.
    fn verdict(
        &self,
        recipe: &Recipe<'_>,
        samples: &[f32],
        n_side: usize,
        at: [usize; 3],
    ) -> Verdict {
        let cell = Cell::new(samples, n_side + 1, at);
        let stride = self.n_side / n_side;
        let nodes = || {
            places(stride + 1).map(|in_cell| {
                let in_block = [0, 1, 2].map(|k| stride * at[k] + in_cell[k]);
                (in_cell, self.node(in_block))
            })
        };
        // Every point is within half a diagonal of a node; slightly more for round-off.
        let half_diagonal = 0.501 * 3.0_f64.sqrt() * self.spacing;
        if nodes().all(|(_, node)| node.distance.abs() > recipe.band + half_diagonal) {
            return Verdict::Beyond;
        }
        // The normals first: they are there already.
        let share = (stride as f64).recip();
        let has_its_normal = |at: [usize; 3], node: &Node| {
            let (_, gradient) = cell.value_and_slope(share * to_vector(at));
            gradient.dot(node.normal) > NORMAL_TOLERANCE.cos() * gradient.length()
        };
        // In all octants round the node that are in the cell. Their corners: half a lattice cell back, here, and half
        // a cell ahead along each axis.
        let is_proven = |at: [usize; 3], node: &Node| {
            let [outer, inner] = node.anchors(recipe, self.spacing);
            places(3)
                .map(|step| to_vector(at) + 0.5 * (to_vector(step) - DVec3::ONE))
                .filter(|place| place.min_element() >= 0.0 && place.max_element() <= stride as f64)
                .all(|place| {
                    let position = node.position + self.spacing * (place - to_vector(at));
                    let (distance, _) = cell.value_and_slope(share * place);
                    distance - outer.least(position) <= recipe.provable
                        && inner.most(position) - distance <= recipe.provable
                })
        };
        if nodes().all(|(at, node)| has_its_normal(at, node))
            && nodes().all(|(at, node)| is_proven(at, node))
        {
            Verdict::Interpolates
        } else {
            Verdict::Asks
        }
    }

    fn node(&self, [x, y, z]: [usize; 3]) -> &Node {
        let n = self.n_side + 1;
        &self.nodes[x + n * (y + n * z)]
    }
}

impl Node {
    fn new(tool: &Tool, position: DVec3) -> Self {
        let contact = tool.signed_distance_local(position);
        Self {
            position,
            distance: contact.signed_distance,
            normal: contact.normal,
            anchors: OnceCell::new(),
        }
    }

    fn anchors(&self, recipe: &Recipe<'_>, spacing: f64) -> &[Anchor; 2] {
        self.anchors
            .get_or_init(|| [1.0, -1.0].map(|side| self.anchor(recipe, spacing, side)))
    }

    /// The anchor on the way along the normal, out of the tool (`side` 1) or into it (-1), that bounds best round here.
    fn anchor(&self, recipe: &Recipe<'_>, spacing: f64, side: f64) -> Anchor {
        // What an anchor at `reach` loses half a lattice cell aside (s² = spacing² / 2), beside its loss straight below.
        let bluntness = |reach: f64| spacing * spacing / (4.0 * reach);
        let mut best = Anchor {
            position: self.position,
            distance: self.distance,
        };
        // Start where that is an eighth of the error, come nearer while the medial axis is in the way, and give up
        // where hardly any cell could be proven.
        let mut least_loss = 2.0 * recipe.error;
        let mut reach = 2.0 * spacing * spacing / recipe.error;
        while bluntness(reach) < least_loss {
            let position = self.position + side * reach * self.normal;
            let distance = recipe.tool.signed_distance_local(position).signed_distance;
            let loss = reach - side * (distance - self.distance) + bluntness(reach);
            if loss < least_loss {
                least_loss = loss;
                best = Anchor { position, distance };
            }
            reach *= 0.5;
        }
        best
    }
}

impl Anchor {
    /// Below the exact distance at `place`.
    fn least(&self, place: DVec3) -> f64 {
        self.distance - place.distance(self.position)
    }

    /// Above the exact distance at `place`.
    fn most(&self, place: DVec3) -> f64 {
        self.distance + place.distance(self.position)
    }
}

/// All places of a cube of `n` along each side, x fastest.
fn places(n: usize) -> impl Iterator<Item = [usize; 3]> {
    (0..n).flat_map(move |z| (0..n).flat_map(move |y| (0..n).map(move |x| [x, y, z])))
}

fn to_vector(at: [usize; 3]) -> DVec3 {
    DVec3::from_array(at.map(|x| x as f64))
}

//! Precomputed signed distance of a rigid tool that answers slowly, with a bound on its error that holds.
//!
//! The band round the surface is covered by blocks, each cut into 1, 2³, 4³ or 8³ cells with a distance at every
//! corner. Inside a cell the distance is interpolated (trilinear) and the normal is the direction of the interpolant's
//! gradient. Cells where the bound is not proven, as along sharp edges, ask the tool, and so do points outside of the
//! band.
//!
//! # Why the bound holds
//! A signed distance changes by no more than the point moves. So the exact distance d, asked at any one place a,
//! bounds d at every other place y from both sides:
//!
//! ```text
//! d(a) − |y − a|  ≤  d(y)  ≤  d(a) + |y − a|
//! ```
//! The bounds are blunt for an a nearby, but sharp for an a that is far out, respectively far in, along the normal:
//! over a flat or round piece of surface they lose s² / 2R, s the way of y aside of the normal, R the way to a. The build
//! asks the tool at two such anchors for every node of a lattice, and uses them in the octants of lattice cells
//! round that node. In an octant the interpolant p is affine along each axis and |y − a| is convex, so that
//!
//! ```text
//! p(y) − (d(a) − |y − a|)    and    (d(a) + |y − a|) − p(y)
//! ```
//! are convex along each axis and greatest in one of the octant's eight corners. Both are computed there from the
//! stored, rounded samples; the cell interpolates if none exceeds the wanted error. No smoothness of the surface is
//! assumed and nothing is estimated: where the surface bends too much the anchors lose too much, and the cell asks.
//! What is left is f64 round-off, for which [`build::ROUND_OFF`] of the size is set aside.
//!
//! Normals have no such bound (a ripple lower than the error may face anywhere). In a cell that interpolates,
//! the gradient in each lattice node is within [`build::NORMAL_TOLERANCE`] of the exact normal.

mod build;

use glam::DVec3;

use super::{ContactPoint, Tool};
use crate::error::Error;

/// Signed distance of a bounded tool, interpolated near its surface. Build once, outside of the loop; the tool's frame.
pub struct DistanceField {
    tool: Tool,
    error: f64,
    band: f64,
    /// Least corner of the first block, m.
    origin: DVec3,
    /// Blocks per metre.
    per_metre: f64,
    n_blocks: [usize; 3],
    /// Position in `blocks` for every block of the grid, x fastest; [`NO_BLOCK`] where the tool is asked.
    table: Vec<u32>,
    blocks: Vec<Block>,
    /// Distances at the corners of the cells, m, x fastest, block after block.
    samples: Vec<f32>,
    /// One bit per cell, x fastest, block after block: whether it asks the tool.
    asks: Vec<u64>,
    n_cells: usize,
    n_exact: usize,
}

/// Beyond every list of blocks.
const NO_BLOCK: u32 = u32::MAX;

#[derive(Debug, Clone, Copy)]
struct Block {
    first_sample: usize,
    first_word: usize,
    /// Cells along a side.
    n_side: usize,
}

impl std::fmt::Debug for DistanceField {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("DistanceField")
            .field("tool", &self.tool)
            .field("error", &self.error)
            .field("band", &self.band)
            .field("n_cells", &self.n_cells)
            .finish_non_exhaustive()
    }
}

impl DistanceField {
    /// Asks `tool` for distances within `band` (m) of its surface, until interpolation errs by `error` (m) at most or
    /// asking the tool is left as the better way. Of a field the tool inside is taken.
    ///
    /// `max_bytes`: of the finished field, 17 GB at most. The build is parallel, its result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`Error::NotPositive`], [`Error::FieldErrorAboveBand`], [`Error::FieldUnbounded`], [`Error::FieldMemory`].
    pub fn new(tool: Tool, error: f64, band: f64, max_bytes: usize) -> Result<Self, Error> {
        build::field(tool, error, band, max_bytes)
    }

    /// The tool inside.
    pub fn tool(&self) -> &Tool {
        &self.tool
    }

    /// No answer differs from the tool's signed distance by more, m.
    pub fn error_bound(&self) -> f64 {
        self.error
    }

    /// Points farther from the surface ask the tool, m.
    pub fn band(&self) -> f64 {
        self.band
    }

    /// Cells that reach into the band.
    pub fn n_cells(&self) -> usize {
        self.n_cells
    }

    /// Share of [`DistanceField::n_cells`] that ask the tool, 0 to 1. Cells differ in size, they are smallest where the
    /// surface bends most.
    pub fn exact_share(&self) -> f64 {
        self.n_exact as f64 / self.n_cells.max(1) as f64
    }

    /// Memory of the field without the tool.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.table)
            + size_of_val(&*self.blocks)
            + size_of_val(&*self.samples)
            + size_of_val(&*self.asks)
    }

    pub(super) fn signed_distance_local(&self, point: DVec3) -> ContactPoint {
        self.interpolated(point)
            .unwrap_or_else(|| self.tool.signed_distance_local(point))
    }

    /// None where the tool is to be asked.
    fn interpolated(&self, point: DVec3) -> Option<ContactPoint> {
        /// Exact distances have a gradient of length 1. A shorter one than this has no direction to speak of.
        const SHORTEST_GRADIENT: f64 = 0.5;

        // Which block. A point that is not a number is in none.
        let in_grid = (point - self.origin) * self.per_metre;
        let [nx, ny, nz] = self.n_blocks;
        let end = DVec3::new(nx as f64, ny as f64, nz as f64);
        if !(in_grid.cmpge(DVec3::ZERO).all() && in_grid.cmplt(end).all()) {
            return None;
        }
        let (whole, in_grid) = split(in_grid);
        let [x, y, z] = whole.map(|x| x as usize);
        let place = self.table[x + nx * (y + ny * z)];
        let block = self.blocks.get(place as usize)?;

        // Which cell of it.
        let n = block.n_side;
        let (whole, in_cell) = split(in_grid * n as f64);
        let [x, y, z] = whole.map(|x| x as usize);
        let cell = x + n * (y + n * z);
        if self.asks[block.first_word + cell / 64] >> (cell % 64) & 1 == 1 {
            return None;
        }
        let samples = &self.samples[block.first_sample..];
        let cell = Cell::new(samples, n + 1, [x, y, z]);
        let (distance, gradient) = cell.value_and_slope(in_cell);

        if distance.abs() > self.band {
            return None;
        }
        let gradient = gradient * (self.per_metre * n as f64);
        let length = gradient.length();
        (length > SHORTEST_GRADIENT).then(|| ContactPoint {
            signed_distance: distance,
            normal: gradient / length,
        })
    }
}

/// Whole part and fraction of what is not below 0. (Twice as fast as `floor`, which older processors lack.)
fn split(v: DVec3) -> ([u32; 3], DVec3) {
    let whole = v.to_array().map(|x| x as u32);
    (whole, v - DVec3::from_array(whole.map(f64::from)))
}

/// Distances at the corners of a cell, m; corner k is at the least or largest x, y, z by the bits of k, x first.
struct Cell([f64; 8]);

impl Cell {
    /// Out of a lattice of `n` samples along a side, x fastest.
    fn new(samples: &[f32], n: usize, [x, y, z]: [usize; 3]) -> Self {
        let row = |y: usize, z: usize| {
            let start = x + n * (y + n * z);
            [f64::from(samples[start]), f64::from(samples[start + 1])]
        };
        let [c0, c1] = row(y, z);
        let [c2, c3] = row(y + 1, z);
        let [c4, c5] = row(y, z + 1);
        let [c6, c7] = row(y + 1, z + 1);
        Self([c0, c1, c2, c3, c4, c5, c6, c7])
    }

    /// At `t`, 0 to 1 along each axis: value, m, and change of the value over the whole cell along each axis, m.
    fn value_and_slope(&self, t: DVec3) -> (f64, DVec3) {
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let c = &self.0;
        let along_x = [0, 2, 4, 6].map(|k| mix(c[k], c[k + 1], t.x));
        let along_xy = [0, 2].map(|k| mix(along_x[k], along_x[k + 1], t.y));
        let slope_x = [0, 2, 4, 6].map(|k| c[k + 1] - c[k]);
        let slope_x = [0, 2].map(|k| mix(slope_x[k], slope_x[k + 1], t.y));
        let slope_y = [0, 2].map(|k| along_x[k + 1] - along_x[k]);
        (
            mix(along_xy[0], along_xy[1], t.z),
            DVec3::new(
                mix(slope_x[0], slope_x[1], t.z),
                mix(slope_y[0], slope_y[1], t.z),
                along_xy[1] - along_xy[0],
            ),
        )
    }
}

#[cfg(test)]
mod tests;

//! The p-method's "select": exact at principal and free nodes, interpolated at the others.

use std::time::Instant;

use bytemuck::{cast_slice, cast_slice_mut};
use fem::{Hierarchy, Rule as Following};
use glam::DVec3;
use gpu::{ComplianceMultiply, Layout};

use super::free_nodes::{FreeNodes, Rule};
use crate::Error;
use crate::choice::{Choice, Multiplier};
use crate::prepare::PreparedPart;
use crate::scene;
use crate::stored::StoredCompliance;

/// Updates in which a node that is freed or constrained moves from one place to the other: 80 ms at
/// 60 Hz, too slow to be seen as a jump.
const BLEND_UPDATES: f64 = 5.0;

/// Updates in which every node is looked at once.
const SWEEP: usize = 8;

/// Contacts that a time budget is reckoned with.
const TYPICAL_CONTACTS: usize = 16;

/// Rows with principal nodes first, so that they are multiplied as one stretch.
pub(super) struct Select {
    multiply: Multiplier,
    free: FreeNodes,
    n_principal: usize,
    /// Row of the surface, by row of the multiply.
    row_of: Vec<u32>,
    /// Masters of the interface rows: those of the k-th at `starts[k]..starts[k + 1]`.
    masters: Vec<(u32, f64)>,
    starts: Vec<u32>,
    /// By interface row: 0 where interpolated, 1 where exact, between while it moves.
    exact: Vec<f64>,
    /// Whether some are between, or have just arrived.
    is_moving: bool,
    /// Rows that are multiplied beside the principal ones.
    listed: Vec<u32>,
    contacts: Vec<DVec3>,
    u: Vec<f64>,
}

impl Select {
    /// `multiply`: makes the multiply of a compliance.
    pub(super) fn new(
        prepared: &PreparedPart,
        whole: &StoredCompliance,
        free: scene::FreeNodes,
        multiply: impl FnOnce(Layout, &[&[f64]]) -> Result<(Multiplier, Choice), Error>,
    ) -> Result<(Self, Choice), Error> {
        let loaded = &prepared.loaded;
        let (n_rows, n_candidates) = (loaded.rows.len(), loaded.candidates.len());
        let hierarchy = Hierarchy::of(&loaded.mesh);
        let is_principal = |row: &u32| hierarchy.is_principal(loaded.rows[*row as usize]);
        let mut row_of: Vec<u32> = (0..n_rows as u32).filter(is_principal).collect();
        let n_principal = row_of.len();
        // Neighbours in space are neighbours in memory: free nodes are then multiplied in stretches.
        let place = |row: &u32| loaded.mesh.nodes[loaded.rows[*row as usize] as usize];
        let mut interface_rows: Vec<u32> = (0..n_rows as u32)
            .filter(|row| !is_principal(row))
            .collect();
        let places: Vec<[f64; 3]> = interface_rows.iter().map(place).collect();
        let along_curve = morton_numbers(&places);
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by_key(|k| along_curve[*k]);
        interface_rows = order.into_iter().map(|k| interface_rows[k]).collect();
        row_of.extend(interface_rows);

        let mut place_of_node = vec![u32::MAX; loaded.mesh.n_nodes()];
        for (place, row) in (0..).zip(&row_of) {
            place_of_node[loaded.rows[*row as usize] as usize] = place;
        }
        // The exact rule for curved edges asks for vertices inside the part, which have no row; the
        // straight rule serves to draw.
        let interface: Vec<u32> = row_of[n_principal..]
            .iter()
            .map(|row| loaded.rows[*row as usize])
            .collect();
        let constraints = hierarchy.constrain(&interface, &loaded.supports, Following::Plain);
        let (mut masters, mut starts) = (Vec::new(), vec![0]);
        for node in &interface {
            let constraint = constraints.of_node(*node);
            let weights = constraint.map_or(&[][..], |constraint| constraint.weights);
            let of_place =
                |(master, weight): &(u32, f64)| (place_of_node[*master as usize], *weight);
            masters.extend(weights.iter().map(of_place));
            starts.push(masters.len() as u32);
        }
        let positions = interface
            .iter()
            .map(|node| DVec3::from_array(loaded.mesh.nodes[*node as usize]))
            .collect();

        let layout = Layout::new(n_rows, n_candidates)?;
        let mut permuted = Vec::with_capacity(layout.n_scalars());
        for candidate in 0..n_candidates {
            for row in &row_of {
                permuted.extend_from_slice(whole.block(*row as usize, candidate));
            }
        }
        let (mut multiply, choice) = multiply(layout, &[&permuted])?;
        let n_interface = n_rows - n_principal;
        let (rule, max_free) = match free {
            scene::FreeNodes::Radius(radius) => (Rule::Radius(radius), n_interface),
            scene::FreeNodes::Indicator(limit) => (Rule::Indicator(limit), n_interface),
            scene::FreeNodes::BudgetUs(budget) => {
                let rows = affordable_rows(multiply.get(), n_principal, budget)?;
                (Rule::Nearest, rows)
            }
        };
        let select = Self {
            multiply,
            free: FreeNodes::new(rule, max_free, positions, SWEEP),
            n_principal,
            row_of,
            masters,
            starts,
            exact: vec![0.0; n_interface],
            is_moving: true,
            listed: Vec::with_capacity(n_interface),
            contacts: Vec::with_capacity(n_candidates),
            u: vec![0.0; 3 * n_rows],
        };
        Ok((select, choice))
    }

    pub(super) fn multiplier(&self) -> &Multiplier {
        &self.multiply
    }

    pub(super) fn multiplier_mut(&mut self) -> &mut Multiplier {
        &mut self.multiply
    }

    pub(super) fn n_free(&self) -> usize {
        self.free.n_free()
    }

    /// `rest`: rest positions of the candidates, m. `waits`: whether a driver may be waited for; else the displacement is
    /// that of an earlier update.
    pub(super) fn update(
        &mut self,
        rest: &[DVec3],
        (columns, forces): (&[u32], &[f64]),
        waits: bool,
        displacement: &mut [f64],
    ) -> Result<(), Error> {
        if self.is_moving || self.free.looks_at_bend() {
            self.list_rows();
        }
        let may_wait = waits || !self.multiply.is_on_gpu();
        let multiply = self.multiply.get();
        if may_wait {
            let (n_first, listed) = (self.n_principal, &self.listed);
            multiply.multiply_rows_into(columns, forces, n_first, listed, &mut self.u)?;
        } else {
            // The form that does not wait gives all rows.
            multiply.newest_into(&mut self.u)?;
            multiply.begin(columns, forces)?;
        }

        self.contacts.clear();
        self.contacts
            .extend(columns.iter().map(|c| rest[*c as usize]));
        let (principal, interface) = cast_slice::<f64, DVec3>(&self.u).split_at(self.n_principal);
        let (masters, starts) = (&self.masters, &self.starts);
        let interpolated = |k: usize| -> DVec3 {
            let mut u = DVec3::ZERO;
            for &(master, weight) in &masters[starts[k] as usize..starts[k + 1] as usize] {
                u += weight * principal[master as usize];
            }
            u
        };
        let largest = if self.free.looks_at_bend() {
            super::largest(&self.u[..3 * self.n_principal])
        } else {
            0.0
        };
        let has_changed = self.free.sweep(
            &self.contacts,
            |k| (interface[k] - interpolated(k)).length(),
            largest,
        );

        let drawn = cast_slice_mut::<f64, DVec3>(displacement);
        let (rows, interface_rows) = self.row_of.split_at(self.n_principal);
        for (row, u) in rows.iter().zip(principal) {
            drawn[*row as usize] = *u;
        }
        for (k, (row, share)) in interface_rows.iter().zip(&self.exact).enumerate() {
            drawn[*row as usize] = if *share == 0.0 {
                interpolated(k)
            } else if *share == 1.0 {
                interface[k]
            } else {
                interpolated(k).lerp(interface[k], *share)
            };
        }
        if has_changed || self.is_moving {
            self.is_moving = has_changed;
            for (share, is_free) in self.exact.iter_mut().zip(self.free.is_free()) {
                let towards = if *is_free { 1.0 } else { 0.0 };
                let step = 1.0 / BLEND_UPDATES;
                self.is_moving |= *share != towards;
                *share += (towards - *share).clamp(-step, step);
            }
        }
        Ok(())
    }

    /// Interface rows whose exact displacement is wanted.
    fn list_rows(&mut self) {
        let Self {
            listed,
            free,
            exact,
            n_principal,
            ..
        } = self;
        let looked_at = if free.looks_at_bend() {
            free.next_slice()
        } else {
            0..0
        };
        listed.clear();
        for (k, (is_free, exact)) in free.is_free().iter().zip(exact).enumerate() {
            if *is_free || *exact > 0.0 || looked_at.contains(&k) {
                listed.push((*n_principal + k) as u32);
            }
        }
    }
}

/// Numbers along a space-filling curve (Morton's): near numbers are near places.
fn morton_numbers(places: &[[f64; 3]]) -> Vec<u32> {
    const BITS: u32 = 10;
    let low: [f64; 3] =
        std::array::from_fn(|c| places.iter().map(|x| x[c]).fold(f64::INFINITY, f64::min));
    let size = places
        .iter()
        .flat_map(|x| (0..3).map(|c| x[c] - low[c]))
        .fold(f64::MIN_POSITIVE, f64::max);
    let number = |x: &[f64; 3]| {
        let cell = |c: usize| ((x[c] - low[c]) / size * f64::from((1 << BITS) - 1)) as u32;
        let cells = [cell(0), cell(1), cell(2)];
        (0..BITS).fold(0, |number, bit| {
            (0..3).fold(number, |n, c| {
                n | (cells[c] >> bit & 1) << (3 * bit + c as u32)
            })
        })
    };
    places.iter().map(number).collect()
}

/// How many listed rows can be multiplied within `budget_us`, measured here and now, so that the
/// choice does not depend on the clock later.
fn affordable_rows(
    multiply: &mut dyn ComplianceMultiply,
    n_principal: usize,
    budget_us: f64,
) -> Result<usize, Error> {
    let layout = multiply.layout();
    let n_interface = layout.n_rows() - n_principal;
    if n_interface == 0 || layout.n_candidates() == 0 {
        return Ok(n_interface);
    }
    let columns: Vec<u32> = (0..TYPICAL_CONTACTS)
        .map(|k| (k * layout.n_candidates() / TYPICAL_CONTACTS) as u32)
        .collect();
    let forces = vec![1.0; 3 * columns.len()];
    let mut u = vec![0.0; layout.displacement_len()];
    let rows: Vec<u32> = (n_principal..layout.n_rows())
        .map(|row| row as u32)
        .collect();
    let mut median_us = |rows: &[u32]| -> Result<f64, Error> {
        let mut times = [0.0; 31];
        for time in &mut times {
            let begun = Instant::now();
            multiply.multiply_rows_into(&columns, &forces, n_principal, rows, &mut u)?;
            *time = 1e6 * begun.elapsed().as_secs_f64();
        }
        times.sort_by(f64::total_cmp);
        Ok(times[15])
    };
    let first = median_us(&[])?;
    let each = ((median_us(&rows)? - first) / n_interface as f64).max(1e-6);
    let affordable = ((budget_us - first) / each).max(0.0) as usize;
    Ok(affordable.min(n_interface))
}

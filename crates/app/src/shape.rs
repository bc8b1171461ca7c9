//! The drawn shape: displacement of the whole surface under the contact forces of a step.
//!
//! At display rate, not in the step. It is the dense multiply `u = C f` over the surface's rows.

use gpu::{Layout, Multiply};

use crate::Error;
use crate::engine::ActiveContact;
use crate::prepare::PreparedPart;
use crate::scene::{self, Accuracy};

/// Displacement of all surface nodes, with its buffers.
pub struct Shape {
    multiply: Box<dyn Multiply>,
    columns: Vec<u32>,
    forces: Vec<f64>,
    displacement: Vec<f64>,
}

impl Shape {
    /// Uploads the compliance in the number type that `accuracy` asks for.
    ///
    /// # Errors
    /// A compliance that the multiply refuses.
    pub fn new(prepared: &PreparedPart, accuracy: &Accuracy) -> Result<Self, Error> {
        let n_candidates = prepared.loaded.candidates.len();
        let n_rows = prepared.loaded.rows.len();
        let layout = Layout::new(n_rows, n_candidates)?;
        let scalar = match accuracy.scalar {
            scene::Scalar::F64 => gpu::Scalar::F64,
            scene::Scalar::F32 => gpu::Scalar::F32,
        };
        Ok(Self {
            multiply: gpu::on_cpu(layout, &prepared.compliance.blocks, scalar)?,
            columns: Vec::with_capacity(n_candidates),
            forces: Vec::with_capacity(3 * n_candidates),
            displacement: vec![0.0; 3 * n_rows],
        })
    }

    /// Displacement under these contact forces, 3 components for each of the part's rows, m.
    /// Does not allocate.
    ///
    /// # Errors
    /// Forces that are not finite.
    pub fn update(&mut self, contacts: &[ActiveContact]) -> Result<&[f64], Error> {
        self.columns.clear();
        self.forces.clear();
        for c in contacts {
            self.columns.push(c.candidate);
            self.forces.extend(c.force_on_part.to_array());
        }
        self.multiply
            .multiply_into(&self.columns, &self.forces, &mut self.displacement)?;
        Ok(&self.displacement)
    }
}

/// Largest length among displacements of 3 components each.
pub fn largest(displacement: &[f64]) -> f64 {
    displacement
        .chunks_exact(3)
        .map(|u| u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
        .fold(0.0, f64::max)
        .sqrt()
}

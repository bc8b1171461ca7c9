//! Displacement, strain and stress of the whole part under recorded contact forces.

use fem::FactoredStiffness;
use fem::stress::Extremes;

use crate::Error;
use crate::engine::ActiveContact;
use crate::prepare::{LoadedPart, assemble};

/// Solves for the whole part, not only its surface. Made once, for the pictures after a run.
#[derive(Debug)]
pub struct FieldSolver<'a> {
    loaded: &'a LoadedPart,
    factor: FactoredStiffness,
    of_element: Vec<u32>,
}

impl<'a> FieldSolver<'a> {
    /// Assembles and factors the stiffness.
    ///
    /// # Errors
    /// As `fem` reports them; Ctrl-C.
    pub fn new(loaded: &'a LoadedPart, progress: &dyn fem::Progress) -> Result<Self, Error> {
        let stiffness = assemble(loaded)?;
        let factor = FactoredStiffness::new(&stiffness, &loaded.supports, progress)
            .map_err(|e| Error::part(&loaded.spec.mesh_path, e))?;
        Ok(Self {
            loaded,
            factor,
            of_element: vec![0; loaded.mesh.n_elements()],
        })
    }

    /// Displacement of all nodes (3 node + component) under contact forces, m.
    pub fn displacement(&self, contacts: &[ActiveContact]) -> Vec<f64> {
        let mut force = vec![0.0; 3 * self.loaded.mesh.n_nodes()];
        for c in contacts {
            let at = 3 * self.loaded.candidates[c.candidate as usize] as usize;
            force[at..at + 3].copy_from_slice(&c.force_on_part.to_array());
        }
        self.factor.solve(&force)
    }

    /// Von Mises stress at all nodes, Pa.
    pub fn von_mises(&self, u: &[f64]) -> Vec<f64> {
        fem::stress::nodal_von_mises(
            &self.loaded.mesh,
            std::slice::from_ref(&self.loaded.spec.material),
            &self.of_element,
            u,
        )
    }

    /// Largest strain, stress and rotation.
    pub fn extremes(&self, u: &[f64]) -> Extremes {
        Extremes::of(
            &self.loaded.mesh,
            std::slice::from_ref(&self.loaded.spec.material),
            &self.of_element,
            u,
        )
    }
}

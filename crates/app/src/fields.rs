//! Displacement, strain and stress of the whole part under recorded contact forces.

use std::sync::OnceLock;

use fem::FactoredStiffness;
use fem::stress::Extremes;

use crate::Error;
use crate::evaluate::strain::{Moment, StrainPeaks, StrainReader};
use crate::prepare::{LoadedPart, PreparedPart, assemble};
use crate::session::{Record, Recording};

/// Displacement of all nodes (3 node + component), m.
#[derive(Debug)]
pub struct Field {
    at_nodes: Vec<f64>,
    /// Of the mesh that is solved on, where that is another.
    solved: Option<Vec<f64>>,
}

impl Field {
    /// Of the part's nodes.
    pub fn at_nodes(&self) -> &[f64] {
        &self.at_nodes
    }

    /// Of the nodes of the mesh that is solved on.
    pub fn solved(&self) -> &[f64] {
        self.solved.as_deref().unwrap_or(&self.at_nodes)
    }
}

/// Solves for the whole part, not only its surface. Made once, for the pictures after a run.
#[derive(Debug)]
pub struct FieldSolver<'a> {
    loaded: &'a LoadedPart,
    factor: Box<FactoredStiffness>,
    of_element: Vec<u32>,
    /// Made when strain is first asked for.
    strain: OnceLock<StrainReader<'a>>,
}

impl<'a> FieldSolver<'a> {
    /// Assembles and factors the stiffness.
    ///
    /// # Errors
    /// As `fem` reports them; Ctrl-C.
    pub fn new(prepared: &'a PreparedPart, progress: &dyn fem::Progress) -> Result<Self, Error> {
        let loaded = &prepared.loaded;
        let stiffness = assemble(loaded)?;
        let in_part = |e| Error::part(&loaded.spec.mesh_path, e);
        let factor = FactoredStiffness::new(&stiffness, loaded.solved_supports(), progress)
            .map_err(in_part)?;
        Ok(Self {
            loaded,
            factor: Box::new(factor),
            of_element: vec![0; loaded.mesh.n_elements()],
            strain: OnceLock::new(),
        })
    }

    /// Displacement in a recorded step.
    pub fn displacement(&self, recording: &Recording, record: &Record) -> Field {
        let n_dofs = 3 * self.loaded.mesh.n_nodes();
        let mut force = vec![0.0; n_dofs];
        for c in recording.contacts(record) {
            let at = 3 * self.loaded.contact_node(c.candidate) as usize;
            force[at..at + 3].copy_from_slice(&c.force_on_part.to_array());
        }
        if let Some(interior) = &self.loaded.interior {
            let solved = self.factor.solve(&interior.forces(&force));
            return Field {
                at_nodes: interior.at_surface::<3>(&solved, 0.0),
                solved: Some(solved),
            };
        }
        Field {
            at_nodes: self.factor.solve(&force),
            solved: None,
        }
    }

    /// Von Mises stress at all nodes, Pa.
    pub fn von_mises(&self, u: &Field) -> Vec<f64> {
        let here = fem::stress::nodal_von_mises(
            self.loaded.solved_mesh(),
            std::slice::from_ref(&self.loaded.spec.material),
            &self.of_element,
            u.solved(),
        );
        self.at_nodes(here, 0.0)
    }

    /// Numbers of the solved mesh's nodes at the part's.
    fn at_nodes(&self, here: Vec<f64>, missing: f64) -> Vec<f64> {
        match &self.loaded.interior {
            None => here,
            Some(interior) => interior.at_surface::<1>(&here, missing),
        }
    }

    /// Largest strain at the skin by kind of place, with error, node and moment.
    pub(crate) fn strain_peaks(&self, u: &Field, moment: &Moment<'_>) -> StrainPeaks {
        self.strain_reader().peaks(u.solved(), moment)
    }

    /// Largest principal strain by size at every node of the skin; not a number inside.
    pub(crate) fn principal_strain(&self, u: &Field) -> Vec<f64> {
        let here = self.strain_reader().principal(u.solved());
        self.at_nodes(here, f64::NAN)
    }

    fn strain_reader(&self) -> &StrainReader<'a> {
        self.strain.get_or_init(|| StrainReader::new(self.loaded))
    }

    /// Largest strain, stress and rotation at the integration points.
    pub fn extremes(&self, u: &Field) -> Extremes {
        Extremes::of(
            self.loaded.solved_mesh(),
            std::slice::from_ref(&self.loaded.spec.material),
            &self.of_element,
            u.solved(),
        )
    }
}

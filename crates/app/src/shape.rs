//! The drawn shape: displacement of the whole surface under the contact forces of a step.
//!
//! At display rate, not in the step. With all interface nodes free it is the dense multiply
//! `u = C f` over the surface's rows. With the p-method's "select" only principal and free interface
//! nodes are multiplied, the others interpolated (Duriez et al. 2004, section 3.2: U_ic = G U_p); the
//! forces do not depend on it. With "constrain" it is the shape of the constrained part that the
//! engine solves for.

mod select;

use std::sync::Arc;

use gpu::{ComplianceMultiply, Layout};

use crate::Error;
use crate::engine::Engine;
use crate::follow::Follower;
use crate::prepare::{Demand, PreparedCompliance, PreparedPart};
use crate::scene::{Accuracy, Adaptive, PMethod};
use crate::setup;
use select::Select;

/// Displacement of all surface nodes, with its buffers.
pub struct Shape {
    kind: Kind,
    columns: Vec<u32>,
    forces: Vec<f64>,
    displacement: Vec<f64>,
    follower: Option<Follower>,
}

enum Kind {
    Full(Box<dyn ComplianceMultiply>),
    /// From the columns that were fetched.
    Fetched(Arc<Demand>),
    Select(Box<Select>),
    Constrained {
        coarse: Box<dyn ComplianceMultiply>,
        coupling: Box<dyn ComplianceMultiply>,
        of_bubbles: Vec<f64>,
    },
}

impl Shape {
    /// Uploads the compliance in the number type that `accuracy` asks for.
    ///
    /// # Errors
    /// A compliance that the multiply refuses.
    pub fn new(prepared: &PreparedPart, accuracy: &Accuracy) -> Result<Self, Error> {
        let n_candidates = prepared.loaded.candidates.len();
        let n_rows = prepared.loaded.rows.len();
        let scalar = setup::scalar(accuracy.scalar);
        let upload = |n_columns: usize, blocks: &[&[f64]]| {
            gpu::on_cpu(Layout::new(n_rows, n_columns)?, blocks, scalar)
        };
        let mut n_columns = n_candidates;
        let whole = match &prepared.compliance {
            PreparedCompliance::All(stored) => stored,
            PreparedCompliance::Near(demand) => {
                return Ok(Self {
                    kind: Kind::Fetched(Arc::clone(demand)),
                    columns: Vec::new(),
                    forces: Vec::new(),
                    displacement: vec![0.0; 3 * n_rows],
                    follower: None,
                });
            }
        };
        let kind = match (accuracy.adaptive, &prepared.bubbles) {
            (
                Adaptive::On {
                    method: PMethod::Constrain,
                    ..
                },
                Some(bubbles),
            ) => {
                n_columns = n_columns.max(bubbles.bubbles.len());
                Kind::Constrained {
                    coarse: upload(n_candidates, &[&bubbles.coarse])?,
                    coupling: upload(bubbles.bubbles.len(), &[&bubbles.coupling])?,
                    of_bubbles: vec![0.0; 3 * n_rows],
                }
            }
            (Adaptive::On { free, .. }, _) => {
                Kind::Select(Box::new(Select::new(prepared, whole, free, scalar)?))
            }
            (Adaptive::Off, _) => Kind::Full(upload(n_candidates, &whole.stretches())?),
        };
        Ok(Self {
            kind,
            columns: Vec::with_capacity(n_columns),
            forces: Vec::with_capacity(3 * n_columns),
            displacement: vec![0.0; 3 * n_rows],
            follower: None,
        })
    }

    /// Where columns are fetched: [`Self::look_ahead`] does so from now on. `beside`: in a thread of its own, so that
    /// nobody waits; otherwise runs are alike.
    pub fn follow(&mut self, beside: bool) {
        if let Kind::Fetched(demand) = &self.kind {
            self.follower = Some(Follower::new(demand, beside));
        }
    }

    /// Fetches columns where the tool goes, by the shape of the last [`Self::update`].
    pub fn look_ahead(&mut self, engine: &Engine) {
        if let (Some(follower), Some(tool_pose)) = (&mut self.follower, engine.tool_pose()) {
            follower.look(engine, tool_pose, &self.displacement);
        }
    }

    /// Interface nodes of the surface that are drawn where they are, if some are interpolated.
    pub fn n_free(&self) -> Option<usize> {
        match &self.kind {
            Kind::Select(select) => Some(select.n_free()),
            Kind::Full(_) | Kind::Fetched(_) | Kind::Constrained { .. } => None,
        }
    }

    /// Displacement in the engine's state, 3 components for each of the part's rows, m. Does not
    /// allocate.
    ///
    /// # Errors
    /// Those of the multiply, which an engine's state does not give.
    pub fn update(&mut self, engine: &mut Engine) -> Result<&[f64], Error> {
        let contacts = engine.active_contacts();
        self.columns.clear();
        self.forces.clear();
        if !matches!(self.kind, Kind::Fetched(_)) {
            for c in contacts {
                self.columns.push(c.candidate);
                self.forces.extend(c.force_on_part.to_array());
            }
        }
        match &mut self.kind {
            Kind::Fetched(demand) => demand.draw_into(contacts, &mut self.displacement),
            Kind::Full(multiply) => {
                multiply.multiply_into(&self.columns, &self.forces, &mut self.displacement)?;
            }
            Kind::Select(select) => {
                let rest = engine.part().rest_positions();
                select.update(rest, &self.columns, &self.forces, &mut self.displacement)?;
            }
            Kind::Constrained {
                coarse,
                coupling,
                of_bubbles,
            } => {
                coarse.multiply_into(&self.columns, &self.forces, &mut self.displacement)?;
                self.columns.clear();
                self.forces.clear();
                for (bubble, amplitude) in engine.bubble_amplitudes() {
                    self.columns.push(*bubble);
                    self.forces.extend(amplitude.to_array());
                }
                coupling.multiply_into(&self.columns, &self.forces, of_bubbles)?;
                for (u, more) in self.displacement.iter_mut().zip(of_bubbles) {
                    *u += *more;
                }
            }
        }
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

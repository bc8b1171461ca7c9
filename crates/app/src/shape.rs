//! The drawn shape: displacement of the whole surface under the contact forces of a step.
//!
//! At display rate, not in the step. With all interface nodes free it is the dense multiply
//! `u = C f` over the surface's rows. With the p-method's "select" only principal and free interface
//! nodes are multiplied, the others interpolated (Duriez et al. 2004, section 3.2: U_ic = G U_p); the
//! forces do not depend on it.

mod free_nodes;
mod select;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::sync::Arc;

use glamx::DPose3;
use gpu::{ComplianceMultiply, Layout};

use crate::Error;
use crate::choice::{self, Choice, Multiplier, choose};
use crate::engine::{ActiveContact, ContactPart, Engine};
use crate::follow::{Follower, Reach};
use crate::prepare::{Demand, PreparedCompliance, PreparedPart};
use crate::scene::{Accuracy, Adaptive, Multiply};
use select::Select;

/// Displacement of all surface nodes, with its buffers.
pub struct Shape {
    kind: Kind,
    part: Arc<ContactPart>,
    columns: Vec<u32>,
    forces: Vec<f64>,
    displacement: Vec<f64>,
    follower: Option<Follower>,
    choice: Choice,
    /// What a back-end said when it was given up.
    given_up: Option<String>,
    /// Whether [`Self::update`] may wait for a driver.
    waits: bool,
}

enum Kind {
    Full(Multiplier),
    /// From the columns that were fetched.
    Fetched(Arc<Demand>),
    Select(Box<Select>),
}

impl Shape {
    /// Uploads the compliance to where `accuracy` wants it multiplied. `folder`: where it is kept which of processor
    /// and GPU was faster; `None`: it is measured anew.
    ///
    /// # Errors
    /// A compliance that the multiply refuses; `"gpu"` where no adapter can multiply.
    pub fn new(
        prepared: &PreparedPart,
        accuracy: &Accuracy,
        folder: Option<&Path>,
    ) -> Result<Self, Error> {
        let n_candidates = prepared.loaded.candidates.len();
        let n_rows = prepared.loaded.rows.len();
        let (kind, choice) = match (&prepared.compliance, accuracy.adaptive) {
            (PreparedCompliance::Near(demand), _) => {
                refuse_gpu(
                    accuracy,
                    "its columns are fetched, because the compliance is larger than the memory or the scene says so",
                )?;
                let choice = choice::fetched(prepared.loaded.spec.contact_scalar);
                (Kind::Fetched(Arc::clone(demand)), choice)
            }
            (PreparedCompliance::All(whole), Adaptive::On(free)) => {
                let multiply = |layout, blocks: &[&[f64]]| choose(layout, blocks, accuracy, folder);
                let (select, choice) = Select::new(prepared, whole, free, multiply)?;
                (Kind::Select(Box::new(select)), choice)
            }
            (PreparedCompliance::All(whole), Adaptive::Off) => {
                let layout = Layout::new(n_rows, n_candidates)?;
                let (multiply, choice) = choose(layout, &whole.stretches(), accuracy, folder)?;
                (Kind::Full(multiply), choice)
            }
        };
        let n_columns = match &kind {
            Kind::Fetched(_) => 0,
            Kind::Full(_) | Kind::Select(_) => n_candidates,
        };
        Ok(Self {
            kind,
            part: prepared.contact_part(),
            columns: Vec::with_capacity(n_columns),
            forces: Vec::with_capacity(3 * n_columns),
            displacement: vec![0.0; 3 * n_rows],
            follower: None,
            choice,
            given_up: None,
            waits: true,
        })
    }

    /// Where the multiply runs, and why there.
    pub fn choice(&self) -> &Choice {
        &self.choice
    }

    /// What the adapter said when it was given up for the processor, if it was.
    pub fn given_up(&self) -> Option<&str> {
        self.given_up.as_deref()
    }

    /// How often the adapter was too late, so that the processor multiplied.
    pub fn n_late(&self) -> u32 {
        self.multiplier().map_or(0, Multiplier::n_late)
    }

    /// From now on [`Self::update`] does not wait for a GPU: it gives the newest displacement that is ready, and asks
    /// for that of these forces.
    pub fn never_wait(&mut self) {
        self.waits = false;
    }

    /// The back-end that may run on a GPU.
    fn multiplier(&self) -> Option<&Multiplier> {
        match &self.kind {
            Kind::Full(multiply) => Some(multiply),
            Kind::Select(select) => Some(select.multiplier()),
            Kind::Fetched(_) => None,
        }
    }

    /// Where columns are fetched: [`Self::look_ahead`] does so from now on. `beside`: in a thread of its own, so that
    /// nobody waits; otherwise runs are alike.
    pub fn follow(&mut self, engine: &Engine, beside: bool) {
        if let Kind::Fetched(demand) = &self.kind {
            self.follower = Some(Follower::new(demand, Reach::of(engine), beside));
        }
    }

    /// Fetches columns where the tool goes, by the shape of the last [`Self::update`].
    pub fn look_ahead(&mut self, tool_pose: DPose3) {
        if let Some(follower) = &mut self.follower {
            follower.look(tool_pose, &self.displacement);
        }
    }

    /// Interface nodes of the surface that are drawn where they are, if some are interpolated.
    pub fn n_free(&self) -> Option<usize> {
        match &self.kind {
            Kind::Select(select) => Some(select.n_free()),
            Kind::Full(_) | Kind::Fetched(_) => None,
        }
    }

    /// Displacement under the contact forces of a step, 3 components for each of the part's rows, m; after [`Self::never_wait`] on a
    /// GPU that of an earlier update. Does not allocate, but where a GPU is given up.
    ///
    /// # Errors
    /// Those of the multiply, which an engine's state does not give.
    pub fn update(&mut self, contacts: &[ActiveContact]) -> Result<&[f64], Error> {
        self.columns.clear();
        self.forces.clear();
        if !matches!(self.kind, Kind::Fetched(_)) {
            // Forces on held nodes move nothing.
            let part = &self.part;
            for c in contacts.iter().filter(|c| !part.is_held(c.candidate)) {
                self.columns.push(c.candidate);
                self.forces.extend(c.force_on_part.to_array());
            }
        }
        match &mut self.kind {
            Kind::Fetched(demand) => demand.draw_into(contacts, &mut self.displacement),
            Kind::Full(multiply) => {
                let may_wait = self.waits || !multiply.is_on_gpu();
                let multiply = multiply.get();
                if may_wait {
                    multiply.multiply_into(&self.columns, &self.forces, &mut self.displacement)?;
                } else {
                    multiply.newest_into(&mut self.displacement)?;
                    multiply.begin(&self.columns, &self.forces)?;
                }
                note_given_up(multiply, &mut self.given_up);
            }
            Kind::Select(select) => {
                let rest = self.part.rest_positions();
                let given = (self.columns.as_slice(), self.forces.as_slice());
                select.update(rest, given, self.waits, &mut self.displacement)?;
                note_given_up(select.multiplier_mut().get(), &mut self.given_up);
            }
        }
        Ok(&self.displacement)
    }
}

/// `"gpu"` asks for the whole compliance, and for one matrix.
fn refuse_gpu(accuracy: &Accuracy, why_not: &str) -> Result<(), Error> {
    if accuracy.multiply != Multiply::Gpu {
        return Ok(());
    }
    Err(Error::Input(format!(
        "accuracy.multiply is \"gpu\", which asks for the whole compliance of the part, but {why_not}; write multiply = \
         \"auto\" or \"cpu\""
    )))
}

fn note_given_up(multiply: &mut dyn ComplianceMultiply, given_up: &mut Option<String>) {
    if let Some(remark) = multiply.take_remark() {
        *given_up = Some(remark);
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

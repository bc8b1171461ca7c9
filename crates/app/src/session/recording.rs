//! What a scripted session leaves behind: every period, in memory that is reserved before it begins.

use std::ops::Range;

use device::{Phase, Realtime, ServoReport, SimulatedEvents, Wrench};
use glam::DVec3;
use glamx::DPose3;

use super::Held;
use super::rates::{ChosenRates, TwoRates};
use crate::engine::{ActiveContact, StepReport};

/// One recorded period.
#[derive(Clone, Debug)]
pub struct Record {
    /// Number of the period.
    pub step: u64,
    /// s, of the loop's clock.
    pub time_s: f64,
    /// What the hand is doing.
    pub phase: Phase,
    /// Handle in the world.
    pub handle_pose: DPose3,
    /// m, of the held body in the simulation, along the approach direction.
    pub travel: f64,
    /// m, of its grip across that direction.
    pub sideways: f64,
    /// rad, of the held body from how it stood at the start.
    pub turn: f64,
    /// On the handle, about the handle point, world; what the engine gives, before the device's
    /// limits and resolution.
    pub wrench_on_handle: Wrench,
    /// The step.
    pub report: StepReport,
    /// ns, the whole step.
    pub step_ns: u64,
    /// ns, the surface multiply, in periods that had one.
    pub multiply_ns: Option<u64>,
    contacts: Range<usize>,
}

/// Everything a session leaves behind.
#[derive(Debug)]
pub struct Recording {
    /// By period.
    pub records: Vec<Record>,
    /// Unit vector, world.
    pub direction: DVec3,
    /// Periods, misses and times of the loop.
    pub servo: ServoReport,
    /// What the system granted a loop in real time.
    pub granted: Option<Realtime>,
    /// What the simulated hardware limited.
    pub device: SimulatedEvents,
    /// Largest displacement of a surface node, m, seen at display rate.
    pub max_surface_displacement: f64,
    /// Whether whole steps were solved in the loop, and why.
    pub rates: ChosenRates,
    /// What two rates tell, if there were two.
    pub two_rates: Option<TwoRates>,
    contacts: Vec<ActiveContact>,
}

/// What a record is made of, besides the step itself.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    /// s, of the loop's clock; 0 without one.
    pub(crate) time_s: f64,
    pub(crate) phase: Phase,
    pub(crate) handle_pose: DPose3,
    pub(crate) wrench_on_handle: Wrench,
    pub(crate) step_ns: u64,
}

impl Recording {
    /// An empty one with memory for so many records, and contacts in each. `direction`: of any length but zero.
    pub(crate) fn with_room(
        direction: DVec3,
        (n_records, n_contacts): (usize, usize),
        rates: ChosenRates,
    ) -> Self {
        /// Contacts in all: the system gives memory as it is written to, and no scene comes near.
        const MOST: usize = 1 << 20;
        Self {
            records: Vec::with_capacity(n_records),
            direction: direction.normalize(),
            servo: ServoReport::default(),
            granted: None,
            device: SimulatedEvents::default(),
            max_surface_displacement: 0.0,
            rates,
            two_rates: None,
            contacts: Vec::with_capacity(MOST.min(n_contacts.saturating_mul(n_records))),
        }
    }

    /// Adds a record. Does not allocate within the memory that was asked for.
    pub(crate) fn push(
        &mut self,
        entry: &Entry,
        held: &Held,
        report: &StepReport,
        contacts: &[ActiveContact],
    ) {
        let gone = held.gone(&report.tool_pose, self.direction);
        let contacts_from = self.contacts.len();
        self.contacts.extend_from_slice(contacts);
        self.records.push(Record {
            step: self.records.len() as u64,
            time_s: entry.time_s,
            phase: entry.phase,
            handle_pose: entry.handle_pose,
            travel: gone.travel,
            sideways: gone.sideways,
            turn: gone.turn,
            wrench_on_handle: entry.wrench_on_handle,
            report: *report,
            step_ns: entry.step_ns,
            multiply_ns: None,
            contacts: contacts_from..self.contacts.len(),
        });
    }

    /// The whole surface was drawn: its largest displacement, m.
    pub(super) fn see(&mut self, largest: f64) {
        self.max_surface_displacement = self.max_surface_displacement.max(largest);
    }

    /// The surface multiply of a period took so long.
    pub(super) fn note_multiply(&mut self, period: u64, multiply_ns: u64) {
        if let Some(record) = self.records.get_mut(period as usize) {
            record.multiply_ns = Some(multiply_ns);
        }
    }

    /// Contacts that carried force in a record.
    pub fn contacts(&self, record: &Record) -> &[ActiveContact] {
        &self.contacts[record.contacts.clone()]
    }

    /// N, along the approach direction, positive when it resists.
    pub fn resistance(&self, record: &Record) -> f64 {
        -record.wrench_on_handle.force.dot(self.direction)
    }
}

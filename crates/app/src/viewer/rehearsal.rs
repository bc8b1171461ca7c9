//! The scene's way gone once before anyone holds anything: what the window takes its scales, its first view and the curve
//! behind the felt one from.

use contact::tool::Tool;
use glam::DVec3;
use glamx::DPose3;

use crate::drive::{self, DriveSpec};
use crate::engine::{ActiveContact, StepReport};
use crate::prepare::PreparedPart;
use crate::scene::Scene;
use crate::session::{Held, Record, refuse_overlap};
use crate::shape::{self, Shape};
use crate::{Error, setup};

/// Rows of a contact problem at least, as for the part's own curve: there is no period to keep.
const ROWS: usize = 1500;

/// Places whose surface is looked at for the scales.
const LOOKS: usize = 24;

/// A place of the way.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    /// m, of the held body.
    pub(super) travel: f64,
    /// N, that it resists.
    pub(super) resistance: f64,
    pub(super) report: StepReport,
    pub(super) contacts: Vec<ActiveContact>,
}

/// The way.
#[derive(Debug)]
pub(crate) struct Rehearsal {
    pub(super) held: Held,
    /// Unit vector, world.
    pub(super) direction: DVec3,
    /// m and N, on the way in.
    pub(super) curve: Vec<[f64; 2]>,
    /// Largest displacement of a surface node on the way, m.
    pub(super) largest_displacement: f64,
    /// Largest force of a contact on the way, N.
    pub(super) largest_force: f64,
    /// Where the contacts press most.
    pub(super) strongest: Place,
    /// The end of the way.
    pub(super) last: Place,
}

impl Rehearsal {
    /// `travel`: m, another than the scene's. `scene`: with friction decided.
    ///
    /// # Errors
    /// A tool that overlaps the part at the start; settings that are refused; Ctrl-C.
    pub(crate) fn of(
        scene: &Scene,
        prepared: &PreparedPart,
        tool: Tool,
        shape: &mut Shape,
        travel: Option<f64>,
        progress: &dyn fem::Progress,
    ) -> Result<Self, Error> {
        let held = setup::held(scene, prepared, &tool);
        let mesh = &prepared.loaded.mesh;
        refuse_overlap(&setup::clearance(scene), mesh, &tool, &held.tool_pose)?;
        let rows = scene.accuracy.max_contacts.max(ROWS);
        let mut engine = setup::drive_engine(scene, prepared, tool, rows)?;
        let way = setup::drive(scene, held);
        let spec = DriveSpec {
            travel: travel.unwrap_or(way.travel),
            retract: false,
            ..way
        };
        let driven = drive::run(&spec, prepared, &mut engine, progress)?;
        let recording = &driven.recording;
        let records = &recording.records;
        let pressed = |record: &Record| -> f64 {
            let contacts = recording.contacts(record).iter();
            contacts.map(|c| c.force_on_part.length()).sum()
        };
        let place = |record: &Record| Place {
            travel: record.travel,
            resistance: recording.resistance(record) + 0.0,
            report: record.report,
            contacts: recording.contacts(record).to_vec(),
        };
        let mut strongest = &records[0];
        let (mut largest_force, mut largest_displacement) = (0.0_f64, 0.0_f64);
        for record in records {
            if pressed(record) > pressed(strongest) {
                strongest = record;
            }
            let forces = recording.contacts(record).iter();
            largest_force = forces
                .map(|c| c.force_on_part.length())
                .fold(largest_force, f64::max);
        }
        let last = &records[records.len() - 1];
        let every = (records.len() / LOOKS).max(1);
        for record in records.iter().step_by(every).chain([strongest, last]) {
            let displacement = shape.update(recording.contacts(record))?;
            largest_displacement = largest_displacement.max(shape::largest(displacement));
        }
        Ok(Self {
            held,
            direction: spec.direction,
            curve: records
                .iter()
                .map(|r| [r.travel, recording.resistance(r)])
                .collect(),
            largest_displacement,
            largest_force,
            strongest: place(strongest),
            last: place(last),
        })
    }

    /// Part and tool in the world, for a pose of the tool in the part's frame.
    pub(super) fn poses(&self, tool_pose: &DPose3) -> [DPose3; 2] {
        match self.held.holds {
            crate::session::Holds::Tool => [DPose3::IDENTITY, *tool_pose],
            crate::session::Holds::Part => [
                self.held.tool_pose * tool_pose.inverse(),
                self.held.tool_pose,
            ],
        }
    }
}

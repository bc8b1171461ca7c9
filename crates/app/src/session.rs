//! A headless session: a scripted hand on a simulated device pushes the tool onto the part, and
//! every step is recorded.
//!
//! Frames: the scene's world is the part's rest frame at the start. If the handle holds the tool,
//! the part stays; if it holds the part, the tool stays, and contact is solved in the part's frame
//! all the same.

use std::ops::Range;
use std::time::Instant;

use device::{
    AsFastAsPossible, Clock, HandSettings, HandleState, Insertion, Phase, RealTime, Script, Servo,
    ServoReport, ServoSettings, Simulated, SimulatedEvents, SimulatedHand, SimulatedSettings,
    Wrench,
};
use fem::Mesh;
use glam::DVec3;
use glamx::DPose3;

use crate::engine::{ActiveContact, Engine, StepReport};
use crate::follow::Follower;
use crate::prepare::{PreparedCompliance, PreparedPart};
use crate::shape::{self, Shape};
use crate::{Error, interrupt};

/// Servo periods between two evaluations of the whole surface: 60 Hz at 1 kHz.
const DISPLAY_INTERVAL: u64 = 16;

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
    bubbles: Range<usize>,
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
    /// What the simulated hardware limited.
    pub device: SimulatedEvents,
    /// Largest displacement of a surface node, m, seen at display rate.
    pub max_surface_displacement: f64,
    contacts: Vec<ActiveContact>,
    bubbles: Vec<(u32, DVec3)>,
}

impl Recording {
    /// Contacts that carried force in a record.
    pub fn contacts(&self, record: &Record) -> &[ActiveContact] {
        &self.contacts[record.contacts.clone()]
    }

    /// Free interface nodes of a constrained part, by their number among its bubbles, and how far
    /// they are from where they would follow, m.
    pub fn bubbles(&self, record: &Record) -> &[(u32, DVec3)] {
        &self.bubbles[record.bubbles.clone()]
    }

    /// N, along the approach direction, positive when it resists.
    pub fn resistance(&self, record: &Record) -> f64 {
        -record.wrench_on_handle.force.dot(self.direction)
    }
}

/// Which body the device holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds {
    /// The tool; the part is fixed in the world.
    Tool,
    /// The part; the tool is fixed in the world.
    Part,
}

/// What a session needs beyond the engine.
#[derive(Clone, Debug)]
pub struct SessionSpec {
    /// Which body the device holds.
    pub holds: Holds,
    /// Tool in the world at the start, m.
    pub tool_pose: DPose3,
    /// Approach of the held body.
    pub direction: DVec3,
    /// m/s.
    pub speed: f64,
    /// m.
    pub travel: f64,
    /// s.
    pub hold_s: f64,
    /// Whether the hand pulls back afterwards.
    pub retract: bool,
    /// The hand.
    pub hand: HandSettings,
    /// s.
    pub period_s: f64,
    /// Whether to wait for the real clock; the results are the same.
    pub real_time: bool,
}

/// Runs the script to its end.
///
/// # Errors
/// A script that the device cannot follow; a tool that overlaps the part at the start; Ctrl-C.
pub fn run(
    spec: &SessionSpec,
    prepared: &PreparedPart,
    engine: &mut Engine,
    shape: &mut Shape,
    progress: &dyn fem::Progress,
) -> Result<Recording, Error> {
    refuse_overlap(spec, &prepared.loaded.mesh, engine)?;
    let start = match spec.holds {
        Holds::Tool => spec.tool_pose,
        Holds::Part => DPose3::IDENTITY,
    };
    let script = Script::new(&Insertion {
        start,
        direction: spec.direction,
        speed: spec.speed,
        travel: spec.travel,
        hold_s: spec.hold_s,
        retract: spec.retract,
    })?;
    let n_periods = script.periods(spec.period_s);
    let hand = SimulatedHand::new(spec.hand, script, spec.period_s)?;
    let device = Simulated::new(SimulatedSettings::default(), hand)?;
    let session = Session {
        spec,
        script,
        start,
        engine,
        recording: Recording {
            records: Vec::with_capacity(n_periods as usize),
            direction: spec.direction.normalize(),
            servo: ServoReport::default(),
            device: SimulatedEvents::default(),
            max_surface_displacement: 0.0,
            contacts: Vec::with_capacity(64 * n_periods as usize),
            bubbles: Vec::new(),
        },
        shape,
        follower: match &prepared.compliance {
            PreparedCompliance::All(_) => None,
            PreparedCompliance::Near(demand) => Some(Follower::new(demand, spec.real_time)),
        },
    };
    let settings = ServoSettings::for_limits(device::HapticDevice::limits(&device));
    if spec.real_time {
        let servo = Servo::new(RealTime::new(spec.period_s)?, settings)?;
        session.run(servo, device, n_periods, progress)
    } else {
        let servo = Servo::new(AsFastAsPossible::new(spec.period_s)?, settings)?;
        session.run(servo, device, n_periods, progress)
    }
}

struct Session<'a> {
    spec: &'a SessionSpec,
    script: Script,
    start: DPose3,
    engine: &'a mut Engine,
    recording: Recording,
    shape: &'a mut Shape,
    follower: Option<Follower>,
}

impl Session<'_> {
    fn run<C: Clock>(
        mut self,
        mut servo: Servo<C>,
        mut device: Simulated,
        n_periods: u64,
        progress: &dyn fem::Progress,
    ) -> Result<Recording, Error> {
        for period in 0..n_periods {
            if interrupt::is_requested() {
                servo.release(&mut device);
                return Err(Error::Interrupted);
            }
            servo.step(&mut device, |handle| self.simulate(handle))?;
            if period % DISPLAY_INTERVAL == 0 {
                self.display()?;
                progress.advance("insert", period as usize, n_periods as usize);
            }
        }
        servo.release(&mut device);
        self.recording.servo = servo.report();
        self.recording.device = device.events();
        Ok(self.recording)
    }

    /// One haptic step and its record. The record's memory was reserved before the loop.
    fn simulate(&mut self, handle: &HandleState) -> Wrench {
        let target = match self.spec.holds {
            Holds::Tool => handle.pose,
            Holds::Part => handle.pose.inverse() * self.spec.tool_pose,
        };
        let begun = Instant::now();
        let report = self.engine.step(&target);
        let step_ns = begun.elapsed().as_nanos() as u64;

        let (held, wrench_on_handle) = match self.spec.holds {
            // The handle feels the opposite of what the coupling exerts on the tool.
            Holds::Tool => {
                let on_tool = Wrench::from_array(&report.coupling_wrench_on_tool);
                let at_tool = -on_tool;
                (
                    report.tool_pose,
                    at_tool.about(report.tool_pose.translation, handle.pose.translation),
                )
            }
            // The part feels the opposite of the tool, at the tool, turned into the world.
            Holds::Part => {
                let part = self.spec.tool_pose * report.tool_pose.inverse();
                let on_tool = Wrench::from_array(&report.contact_wrench_on_tool);
                let on_part = Wrench::new(
                    part.rotation * -on_tool.force,
                    part.rotation * -on_tool.torque,
                );
                (
                    part,
                    on_part.about(self.spec.tool_pose.translation, handle.pose.translation),
                )
            }
        };
        let recording = &mut self.recording;
        let contacts_from = recording.contacts.len();
        recording
            .contacts
            .extend_from_slice(self.engine.active_contacts());
        let bubbles_from = recording.bubbles.len();
        recording
            .bubbles
            .extend_from_slice(self.engine.bubble_amplitudes());
        recording.records.push(Record {
            step: recording.records.len() as u64,
            time_s: handle.time_s,
            phase: self.script.phase(handle.time_s),
            handle_pose: handle.pose,
            travel: (held.translation - self.start.translation).dot(recording.direction),
            wrench_on_handle,
            report,
            step_ns,
            multiply_ns: None,
            contacts: contacts_from..recording.contacts.len(),
            bubbles: bubbles_from..recording.bubbles.len(),
        });
        wrench_on_handle
    }

    /// What the display would do between two steps: the whole surface.
    fn display(&mut self) -> Result<(), Error> {
        let begun = Instant::now();
        let drawn = self.shape.update(self.engine)?;
        let largest = shape::largest(drawn);
        let elapsed = begun.elapsed().as_nanos() as u64;
        if let (Some(follower), Some(last)) = (&mut self.follower, self.recording.records.last()) {
            follower.look(self.engine, last.report.tool_pose, drawn);
        }
        self.recording.max_surface_displacement =
            self.recording.max_surface_displacement.max(largest);
        if let Some(last) = self.recording.records.last_mut() {
            last.multiply_ns = Some(elapsed);
        }
        Ok(())
    }
}

/// A tool that starts inside the part has no path to where it is: refused with the depth.
fn refuse_overlap(spec: &SessionSpec, mesh: &Mesh, engine: &Engine) -> Result<(), Error> {
    let tool = engine.tool();
    let deepest = mesh
        .surface_nodes()
        .into_iter()
        .map(|node| {
            let x = DVec3::from_array(mesh.nodes[node as usize]);
            (
                tool.signed_distance(&spec.tool_pose, x).signed_distance,
                node,
            )
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((distance, node)) = deepest
        && distance < 0.0
    {
        return Err(Error::Input(format!(
            "the tool starts inside the part: node {} of the mesh is {:.3} mm inside it; move \
             tool.position back, against hand.direction",
            mesh.node_tags[node as usize],
            -1e3 * distance
        )));
    }
    // A tool smaller than an element can hide between the nodes.
    let inside = tool
        .tessellate(part_extent(mesh))
        .0
        .into_iter()
        .map(|p| spec.tool_pose * p)
        .find(|p| fem::stress::locate(mesh, p.to_array()).is_some());
    match inside {
        Some(p) => Err(Error::Input(format!(
            "the tool starts inside the part: its surface at {:.4} {:.4} {:.4} m is in an element; \
             move tool.position back, against hand.direction",
            p.x, p.y, p.z
        ))),
        None => Ok(()),
    }
}

/// m, diagonal of the part's bounding box.
pub fn part_extent(mesh: &Mesh) -> f64 {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for x in &mesh.nodes {
        for c in 0..3 {
            low[c] = low[c].min(x[c]);
            high[c] = high[c].max(x[c]);
        }
    }
    (0..3)
        .map(|c| (high[c] - low[c]).powi(2))
        .sum::<f64>()
        .sqrt()
}

//! Who is told of each period, on the loop's thread: nothing here allocates, locks or waits.

use device::{Arming, PeriodRecord, Phase, Wrench};
use glam::DVec3;
use glamx::DPose3;
use triple_buffer::{Input, Output, TripleBuffer};

use super::held::{Gone, Held};
use super::recording::{Entry, Recording};
use super::snap::SnapWatch;
use crate::engine::{ActiveContact, StepReport};

/// A period in full, of fixed size.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Number of the period.
    pub step: u64,
    /// s, of the loop's clock.
    pub time_s: f64,
    /// What the hand is doing.
    pub phase: Phase,
    /// Handle in the world, as it is mapped.
    pub handle_pose: DPose3,
    /// How far the held body has gone.
    pub gone: Gone,
    /// N, along the approach direction, positive when it resists.
    pub resistance: f64,
    /// On the handle, world, before the device's limits.
    pub wrench_on_handle: Wrench,
    /// The step.
    pub report: StepReport,
    /// ns, the whole step.
    pub step_ns: u64,
    /// The loop's side of the period: what went to the device, and when.
    pub servo: PeriodRecord,
}

/// The newest period for a viewer: of fixed size, made before the session.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The period; none before the first.
    pub sample: Option<Sample>,
    /// The felt curve so far.
    pub snap: SnapWatch,
    contacts: Box<[ActiveContact]>,
    n_contacts: usize,
}

impl Snapshot {
    /// Nodes that carry force, the first ones where there is no room for all.
    pub fn contacts(&self) -> &[ActiveContact] {
        &self.contacts[..self.n_contacts]
    }
}

/// A period as a plot needs it.
#[derive(Clone, Copy, Debug)]
pub struct TracePoint {
    /// m, of the held body along the approach direction.
    pub travel: f64,
    /// N, along the approach direction, positive when it resists.
    pub resistance: f64,
    /// s, scheduled time to the end of the write.
    pub response_s: f64,
    /// Whether the end was after the next scheduled time.
    pub is_late: bool,
}

/// The loop's end of the newest-value box for a viewer.
#[derive(Debug)]
pub struct SnapshotInput(Input<Snapshot>);

/// The viewer's end.
pub type SnapshotOutput = Output<Snapshot>;

/// A box with room for so many contacts in each snapshot.
pub fn snapshots(most_contacts: usize) -> (SnapshotInput, SnapshotOutput) {
    let nothing = ActiveContact {
        candidate: 0,
        normal_force: 0.0,
        force_on_part: DVec3::ZERO,
        sticks: false,
    };
    let empty = Snapshot {
        sample: None,
        snap: SnapWatch::default(),
        contacts: vec![nothing; most_contacts].into(),
        n_contacts: 0,
    };
    let (input, output) = TripleBuffer::new(&empty).split();
    (SnapshotInput(input), output)
}

/// A step that was solved.
pub(super) struct Solved<'a> {
    pub(super) time_s: f64,
    pub(super) phase: Phase,
    pub(super) handle_pose: DPose3,
    pub(super) gone: Gone,
    pub(super) report: StepReport,
    pub(super) wrench_on_handle: Wrench,
    pub(super) step_ns: u64,
    pub(super) contacts: &'a [ActiveContact],
}

/// Who is told.
#[derive(Default)]
pub(super) struct Ports<'a> {
    /// Unit vector, world.
    pub(super) direction: DVec3,
    /// All periods, in memory.
    pub(super) recording: Option<&'a mut Recording>,
    /// All periods, for a thread that writes them.
    pub(super) log: Option<rtrb::Producer<Sample>>,
    /// All periods for a plot; those that it has no room for are left out.
    pub(super) trace: Option<rtrb::Producer<TracePoint>>,
    /// Periods for which that thread was too slow.
    pub(super) n_unlogged: u64,
    /// The newest period.
    pub(super) viewer: Option<SnapshotInput>,
    pub(super) snap: SnapWatch,
    /// N, the most that went to the device.
    pub(super) largest_rendered: f64,
    /// Length of a period, s, where times are those of the clock: with what the loop skipped.
    pub(super) clock_period_s: Option<f64>,
    pub(super) n_skipped: u64,
    pub(super) force: ForceOn,
    pub(super) solved: Option<Pending>,
}

/// Whether the hand was given force at all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForceOn {
    /// s, when it was armed first.
    pub since_s: Option<f64>,
    /// Periods in contact in which it was not armed.
    pub n_unarmed_contacts: u64,
    /// What was waited for last.
    pub arming: Arming,
}

impl ForceOn {
    fn follow(&mut self, arming: &Arming, time_s: f64, touches: bool) {
        self.arming = *arming;
        match arming {
            Arming::NotAsked | Arming::Armed => {
                self.since_s.get_or_insert(time_s);
            }
            Arming::Waiting(_) | Arming::Rising => self.n_unarmed_contacts += u64::from(touches),
        }
    }
}

/// A step whose period is not over yet.
pub(super) struct Pending {
    time_s: f64,
    phase: Phase,
    handle_pose: DPose3,
    gone: Gone,
    resistance: f64,
    report: StepReport,
    wrench_on_handle: Wrench,
    step_ns: u64,
}

impl<'a> Ports<'a> {
    /// For a recording alone.
    pub(super) fn recording(recording: &'a mut Recording) -> Self {
        Self {
            direction: recording.direction,
            recording: Some(recording),
            ..Self::default()
        }
    }

    /// The step of a period was solved.
    pub(super) fn solved(&mut self, held: &Held, solved: &Solved<'_>) {
        let resistance = -solved.wrench_on_handle.force.dot(self.direction);
        self.snap
            .follow(solved.phase, solved.gone.travel, resistance);
        if let Some(recording) = &mut self.recording {
            let entry = Entry {
                time_s: solved.time_s,
                phase: solved.phase,
                handle_pose: solved.handle_pose,
                wrench_on_handle: solved.wrench_on_handle,
                step_ns: solved.step_ns,
            };
            recording.push(&entry, held, &solved.report, solved.contacts);
        }
        if let Some(SnapshotInput(viewer)) = &mut self.viewer {
            let snapshot = viewer.input_buffer_mut();
            let n = solved.contacts.len().min(snapshot.contacts.len());
            snapshot.contacts[..n].copy_from_slice(&solved.contacts[..n]);
            snapshot.n_contacts = n;
        }
        self.solved = Some(Pending {
            time_s: solved.time_s,
            phase: solved.phase,
            handle_pose: solved.handle_pose,
            gone: solved.gone,
            resistance,
            report: solved.report,
            wrench_on_handle: solved.wrench_on_handle,
            step_ns: solved.step_ns,
        });
    }

    /// The period is over. Nothing is told of one without a state of the handle.
    pub(super) fn over(&mut self, servo: &PeriodRecord) {
        let rendered = servo.wrench_on_handle.force.length();
        self.largest_rendered = self.largest_rendered.max(rendered);
        self.n_skipped += servo.skipped;
        let Some(solved) = self.solved.take() else {
            return;
        };
        let slot = (servo.index + self.n_skipped) as f64;
        let time_s = self
            .clock_period_s
            .map_or(solved.time_s, |period_s| slot * period_s);
        self.force
            .follow(&servo.arming, time_s, solved.report.contacts > 0);
        let sample = Sample {
            step: servo.index,
            time_s,
            phase: solved.phase,
            handle_pose: solved.handle_pose,
            gone: solved.gone,
            resistance: solved.resistance,
            wrench_on_handle: solved.wrench_on_handle,
            report: solved.report,
            step_ns: solved.step_ns,
            servo: *servo,
        };
        if let Some(trace) = &mut self.trace {
            let point = TracePoint {
                travel: sample.gone.travel,
                resistance: sample.resistance,
                response_s: servo.response_s,
                is_late: servo.is_late,
            };
            // A plot may have gaps.
            let _ = trace.push(point);
        }
        if let Some(log) = &mut self.log {
            self.n_unlogged += u64::from(log.push(sample).is_err());
        }
        if let Some(SnapshotInput(viewer)) = &mut self.viewer {
            let snapshot = viewer.input_buffer_mut();
            snapshot.sample = Some(sample);
            snapshot.snap = self.snap;
            viewer.publish();
        }
    }
}

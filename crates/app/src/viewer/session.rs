//! The window's end of a live session: the newest snapshot, the surface under it, and what is told.

use std::collections::VecDeque;
use std::sync::mpsc::Receiver;

use super::exhibit::Exhibit;
use super::scene3d::Moving;
use super::trail::Trail;
use crate::session::{Sample, SnapWatch, SnapshotOutput, TracePoint};
use crate::shape::{self, Shape};

/// Messages that stay to be read.
const MOST_MESSAGES: usize = 6;

/// What the window has of the loop.
pub(crate) struct Feed<'a> {
    /// The newest period.
    pub(crate) view: SnapshotOutput,
    /// The surface's motion.
    pub(crate) shape: &'a mut Shape,
    /// Every period, for the plot.
    pub(crate) trace: rtrb::Consumer<TracePoint>,
    /// What devices tell.
    pub(crate) messages: Vec<&'a Receiver<String>>,
    /// Whether the loop has ended.
    pub(crate) is_over: &'a dyn Fn() -> bool,
}

/// A session as it is seen.
pub(super) struct Seen<'a> {
    feed: Feed<'a>,
    /// The newest period; none before the first.
    pub(super) sample: Option<Sample>,
    pub(super) snap: SnapWatch,
    pub(super) trail: Trail,
    /// As it is drawn.
    pub(super) moving: Moving,
    /// m, largest displacement of a surface node now.
    pub(super) largest: f64,
    /// What was told, newest last.
    pub(super) told: VecDeque<String>,
}

impl<'a> Seen<'a> {
    pub(super) fn new(feed: Feed<'a>, exhibit: &Exhibit) -> Self {
        let mut moving = Moving::default();
        let start = exhibit
            .rehearsal
            .held
            .target(&exhibit.rehearsal.held.start());
        exhibit.moment_into(&start, &[], &[], &mut moving);
        Self {
            feed,
            sample: None,
            snap: SnapWatch::default(),
            trail: Trail::new(exhibit.plot_scale()),
            moving,
            largest: 0.0,
            told: VecDeque::new(),
        }
    }

    /// Whether the loop has ended.
    pub(super) fn is_over(&self) -> bool {
        (self.feed.is_over)()
    }

    /// Where the surface is multiplied.
    pub(super) fn multiply(&self) -> String {
        let choice = self.feed.shape.choice();
        choice.runs_on.clone()
    }

    /// Takes what is new; never waits.
    pub(super) fn look(&mut self, exhibit: &Exhibit) {
        while let Ok(point) = self.feed.trace.pop() {
            self.trail.push(&point);
        }
        let messages = self.feed.messages.iter().flat_map(|m| m.try_iter());
        self.told.extend(messages);
        while self.told.len() > MOST_MESSAGES {
            self.told.pop_front();
        }
        if !self.feed.view.update() {
            return;
        }
        let snapshot = self.feed.view.output_buffer();
        self.snap = snapshot.snap;
        self.sample = snapshot.sample;
        let Some(sample) = &snapshot.sample else {
            return;
        };
        match self.feed.shape.update(snapshot.contacts()) {
            Ok(displacement) => {
                self.largest = shape::largest(displacement);
                let pose = &sample.report.tool_pose;
                exhibit.moment_into(pose, snapshot.contacts(), displacement, &mut self.moving);
            }
            Err(e) => {
                let told = format!("the surface cannot be drawn: {e}");
                if self.told.back() != Some(&told) {
                    self.told.push_back(told);
                }
            }
        }
        self.feed.shape.look_ahead(sample.report.tool_pose);
    }
}

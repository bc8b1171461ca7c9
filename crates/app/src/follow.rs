//! Fetches columns ahead of the tool: at display rate, between steps or beside them.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use contact::tool::Tool;
use glam::DVec3;

use crate::engine::Engine;
use crate::prepare::Demand;

/// Nodes nearer than this are wanted, in strides of the tool: a tenth of its size.
const LOOK_AHEAD: f64 = 5.0;

/// And that far for what the tool moved since the last look.
const MOTIONS_AHEAD: f64 = 4.0;

/// The tool, and how far around it nodes may be touched.
#[derive(Clone, Debug)]
pub(crate) struct Reach {
    tool: Tool,
    /// m.
    within: f64,
}

impl Reach {
    /// That of an engine.
    pub(crate) fn of(engine: &Engine) -> Self {
        Self {
            tool: engine.tool().clone(),
            within: LOOK_AHEAD * engine.settings().max_stride + engine.reach_between_nodes(),
        }
    }
}

/// Asks for columns where the tool goes.
pub(crate) struct Follower {
    demand: Arc<Demand>,
    reach: Reach,
    worker: Option<Worker>,
    seen_at: Option<DVec3>,
}

/// A thread that fetches while steps go on.
struct Worker {
    requests: Option<SyncSender<Vec<u32>>>,
    thread: Option<JoinHandle<()>>,
}

impl Follower {
    /// `beside`: fetch in a thread beside the steps, which do not wait; otherwise between them, so that two runs are
    /// alike.
    pub(crate) fn new(demand: &Arc<Demand>, reach: Reach, beside: bool) -> Self {
        let worker = beside.then(|| {
            // One request at a time: a newer look knows better.
            let (requests, wanted) = sync_channel(1);
            let demand = Arc::clone(demand);
            let thread = std::thread::spawn(move || fetch_all(&demand, &wanted));
            Worker {
                requests: Some(requests),
                thread: Some(thread),
            }
        });
        Self {
            demand: Arc::clone(demand),
            reach,
            worker,
            seen_at: None,
        }
    }

    /// Looks where tool and surface are. `tool_at`: of the last step, part's frame, m. `drawn`: displacement of every
    /// row, m.
    pub(crate) fn look(&mut self, tool_at: glamx::DPose3, drawn: &[f64]) {
        let moved = self
            .seen_at
            .map_or(0.0, |then| (tool_at.translation - then).length());
        self.seen_at = Some(tool_at.translation);
        let within = self.reach.within + MOTIONS_AHEAD * moved;
        let tool = &self.reach.tool;
        let wanted = self.demand.wanted(tool, &tool_at, drawn, within);
        if wanted.is_empty() {
            return;
        }
        match &self.worker {
            None => self.demand.fetch(&wanted),
            // Full: it has something to do, and what is wanted now is asked for at the next look.
            Some(worker) => drop(worker.requests.as_ref().map(|to| to.try_send(wanted))),
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        drop(self.requests.take());
        if let Some(thread) = self.thread.take() {
            // It ends after the batch it is at.
            let _ = thread.join();
        }
    }
}

fn fetch_all(demand: &Demand, wanted: &Receiver<Vec<u32>>) {
    while let Ok(candidates) = wanted.recv() {
        demand.fetch(&candidates);
    }
}

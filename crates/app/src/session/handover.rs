//! Between the loop and the engine beside it: targets one way, frozen problems the other, without a lock.
//!
//! ```text
//!            targets ──────────────>
//!   loop     <────────── problems      engine
//!            empty ones ───────────>
//! ```
//! Three rings with one writer and one reader each. Problems are boxes that were made before the start and go round:
//! nothing is copied, nothing allocated. Neither side waits for the other: the loop takes the newest problem there
//! is, or none; the engine takes the newest target, and has nothing to do where there is none.

use glamx::DPose3;
use rtrb::{Consumer, Producer, PushError, RingBuffer};

use crate::engine::FrozenProblem;

/// A frozen problem and the period whose target it was solved for.
#[derive(Debug)]
pub struct Handed {
    /// Number of the period.
    pub tick: u64,
    /// The problem.
    pub problem: FrozenProblem,
}

/// A target and its period.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// Number of the period.
    pub tick: u64,
    /// Pose of the tool that the handle asks for, part's frame.
    pub target: DPose3,
}

/// The loop's end. Nothing here allocates, locks or waits.
#[derive(Debug)]
pub struct LoopEnd {
    targets: Producer<Asked>,
    problems: Consumer<Box<Handed>>,
    empty: Producer<Box<Handed>>,
}

/// The engine's end.
#[derive(Debug)]
pub struct EngineEnd {
    targets: Consumer<Asked>,
    problems: Producer<Box<Handed>>,
    empty: Consumer<Box<Handed>>,
}

/// Problems that go round, beside the one in use: one being made, two on their way or spent.
pub const N_BOXES: usize = 3;

/// Both ends, with `boxes` to go round and room for `n_targets` targets that are not taken yet.
pub fn link(boxes: [Box<Handed>; N_BOXES], n_targets: usize) -> (LoopEnd, EngineEnd) {
    // Also the one in use: a push never finds its ring full.
    let n_boxes = N_BOXES + 1;
    let (to_engine, targets) = RingBuffer::new(n_targets.max(1));
    let (to_loop, problems) = RingBuffer::new(n_boxes);
    let (mut back, empty) = RingBuffer::new(n_boxes);
    for handed in boxes {
        let pushed = back.push(handed);
        debug_assert!(pushed.is_ok(), "the ring has room for all boxes");
    }
    let loop_end = LoopEnd {
        targets: to_engine,
        problems,
        empty: back,
    };
    let engine_end = EngineEnd {
        targets,
        problems: to_loop,
        empty,
    };
    (loop_end, engine_end)
}

impl LoopEnd {
    /// Asks for a target. False if the engine has not taken any for so long that there is no room: by then its last
    /// problem is stale, and the wrench has faded.
    pub fn ask(&mut self, asked: Asked) -> bool {
        self.targets.push(asked).is_ok()
    }

    /// The newest problem, if one has come since the last call.
    pub fn newest(&mut self) -> Option<Box<Handed>> {
        let mut newest = self.problems.pop().ok()?;
        while let Ok(newer) = self.problems.pop() {
            self.give_back(std::mem::replace(&mut newest, newer));
        }
        Some(newest)
    }

    /// Gives a problem back that is not needed any more.
    pub fn give_back(&mut self, spent: Box<Handed>) {
        let pushed = self.empty.push(spent);
        debug_assert!(pushed.is_ok(), "the ring has room for all boxes");
    }
}

impl EngineEnd {
    /// Memory for a problem, unless the loop has not taken the last ones yet.
    pub fn take_empty(&mut self) -> Option<Box<Handed>> {
        self.empty.pop().ok()
    }

    /// The newest target that has been asked for since the last call.
    pub fn newest_target(&mut self) -> Option<Asked> {
        let mut newest = None;
        while let Ok(asked) = self.targets.pop() {
            newest = Some(asked);
        }
        newest
    }

    /// Hands a problem over.
    pub fn hand_over(&mut self, handed: Box<Handed>) {
        let pushed = self.problems.push(handed);
        debug_assert!(
            !matches!(pushed, Err(PushError::Full(_))),
            "the ring has room for all boxes"
        );
    }
}

//! The wire to the motors: what is written arrives later, and not always equally late.

use crate::wrench::Wrench;

/// A wrench on its way.
#[derive(Debug, Clone, Copy)]
struct Sent {
    due: u64,
    wrench: Wrench,
}

/// A line of wrenches, each due some steps after it was sent. A later one that arrives first makes the earlier void.
#[derive(Debug)]
pub(super) struct DelayLine {
    delay: u64,
    jitter: u64,
    /// Oldest first; all memory is taken at the start.
    on_the_way: Vec<Sent>,
    arrived: Wrench,
    step: u64,
    random: u64,
}

impl DelayLine {
    /// Delay and largest jitter in steps.
    pub(super) fn new(delay: u64, jitter: u64) -> Self {
        Self {
            delay,
            jitter,
            on_the_way: Vec::with_capacity((delay + jitter) as usize + 2),
            arrived: Wrench::ZERO,
            step: 0,
            random: 0x9e37_79b9_7f4a_7c15,
        }
    }

    /// Sends a wrench. Several within a step overwrite each other.
    pub(super) fn push(&mut self, wrench: Wrench) {
        let due = self.step + 1 + self.delay + self.late();
        let is_full = self.on_the_way.len() == self.on_the_way.capacity();
        match self.on_the_way.last_mut() {
            Some(last) if is_full => *last = Sent { due, wrench },
            _ => self.on_the_way.push(Sent { due, wrench }),
        }
    }

    /// A step further: what the motors render in it.
    pub(super) fn step(&mut self) -> Wrench {
        self.step += 1;
        if let Some(newest) = self.on_the_way.iter().rposition(|s| s.due <= self.step) {
            self.arrived = self.on_the_way[newest].wrench;
            self.on_the_way.drain(..=newest);
        }
        self.arrived
    }

    /// Nothing is on its way, and nothing is rendered.
    pub(super) fn clear(&mut self) {
        self.on_the_way.clear();
        self.arrived = Wrench::ZERO;
    }

    /// From 0 to the jitter, the same at each run (xorshift).
    fn late(&mut self) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random % (self.jitter + 1)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn force(x: f64) -> Wrench {
        Wrench::new(DVec3::X * x, DVec3::ZERO)
    }

    /// What arrives in the step after each of the numbered writes.
    fn arrivals(line: &mut DelayLine, n: u32) -> Vec<f64> {
        (1..=n)
            .map(|k| {
                line.push(force(f64::from(k)));
                line.step().force.x
            })
            .collect()
    }

    #[test]
    fn without_delay_a_write_is_felt_in_the_next_step() {
        assert_eq!(arrivals(&mut DelayLine::new(0, 0), 3), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn delay_shifts_what_arrives_and_the_last_write_is_held() {
        let mut line = DelayLine::new(2, 0);
        assert_eq!(arrivals(&mut line, 4), [0.0, 0.0, 1.0, 2.0]);
        let held: Vec<f64> = (0..4).map(|_| line.step().force.x).collect();
        assert_eq!(held, [3.0, 4.0, 4.0, 4.0]);
        line.push(force(9.0));
        line.clear();
        assert_eq!(line.step(), Wrench::ZERO);
    }

    #[test]
    fn jitter_keeps_the_order_and_stays_within_its_bounds() {
        let mut line = DelayLine::new(3, 4);
        let seen = arrivals(&mut line, 2000);
        let lags: Vec<f64> = seen
            .iter()
            .enumerate()
            .skip(10)
            .map(|(k, x)| k as f64 + 1.0 - x)
            .collect();
        assert!(seen.windows(2).all(|w| w[1] >= w[0]));
        assert!(lags.iter().all(|lag| (3.0..=7.0).contains(lag)));
        assert!(lags.contains(&3.0) && lags.iter().any(|lag| *lag > 3.0));
    }

    #[test]
    fn more_writes_than_steps_take_no_more_memory() {
        let mut line = DelayLine::new(1, 0);
        let room = line.on_the_way.capacity();
        for k in 0..100 {
            line.push(force(f64::from(k)));
        }
        assert_eq!(line.on_the_way.capacity(), room);
        line.step();
        assert_eq!(line.step(), force(99.0));
    }
}

//! The loop: once a period read, judge, simulate, judge, write; and the times all this took.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::clock::Clock;
use crate::error::DeviceError;
use crate::haptic_device::{Command, HandleState, HapticDevice, Limits};
use crate::histogram::{TimeHistogram, TimeSummary};
use crate::safety::{Arming, ObservedEnergy, Safety, SafetyEvents, SafetySettings};
use crate::wrench::Wrench;

mod answer;

pub use answer::Answer;

/// What the loop is allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoSettings {
    /// The guard between simulation and hand.
    pub safety: SafetySettings,
    /// Failures of the device in a row after which it is given up, in periods. Default 100: a tenth of
    /// a second at 1 kHz, within which the wrench has gone to zero. `None`: never; the loop goes on with
    /// zero force, and the force is armed again when the device is back.
    pub failures_max: Option<u32>,
}

impl ServoSettings {
    /// The settings for a scripted session on a simulated device with these limits.
    #[must_use]
    pub fn for_limits(limits: &Limits) -> Self {
        Self {
            safety: SafetySettings::for_limits(limits),
            failures_max: Some(100),
        }
    }

    /// The settings for a live session on a device with these limits: every guard is on, and a device that
    /// is lost is waited for.
    ///
    /// # Errors
    /// Where the limits are none that a device can have ([`Limits::check`]), by name.
    pub fn live(limits: &Limits) -> Result<Self, DeviceError> {
        Ok(Self {
            safety: SafetySettings::live(limits)?,
            failures_max: None,
        })
    }
}

/// One period of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeriodRecord {
    /// Number of the period, from 0.
    pub index: u64,
    /// The loop's time, s.
    pub time_s: f64,
    /// The state the simulation was given; none before the first good sample.
    pub handle: Option<HandleState>,
    /// The wrench on the handle that went to the device, about the handle point.
    pub wrench_on_handle: Wrench,
    /// Scheduled time to waking, s.
    pub wake_delay_s: f64,
    /// Waking to the end of the write, s.
    pub compute_s: f64,
    /// Scheduled time to the end of the write, s.
    pub response_s: f64,
    /// Was the end after the next scheduled time?
    pub is_late: bool,
    /// Scheduled times that had gone by unused before this period.
    pub skipped: u64,
    /// How far arming is; what the user should do is in its text.
    pub arming: Arming,
    /// Energy observed at the handle.
    pub energy: ObservedEnergy,
    /// How often the guard has stepped in so far.
    pub safety: SafetyEvents,
}

/// What came of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ServoReport {
    /// Periods done.
    pub periods: u64,
    /// Periods that ended after the next scheduled time. On a clock without waiting: that would have.
    pub missed_deadlines: u64,
    /// Most of them in a row.
    pub longest_miss_run: u64,
    /// Scheduled times that went by unused.
    pub skipped: u64,
    /// Scheduled time to waking.
    pub wake_delay: TimeSummary,
    /// Waking to the end of the write.
    pub compute: TimeSummary,
    /// Scheduled time to the end of the write.
    pub response: TimeSummary,
    /// Reads that failed.
    pub read_failures: u64,
    /// Writes that failed.
    pub write_failures: u64,
    /// How often the guard stepped in.
    pub safety: SafetyEvents,
    /// How far arming is.
    pub arming: Arming,
    /// The lowest energies observed at the handle, J, 0 or below: the most that came out beyond what had
    /// gone in.
    pub lowest_energy: ObservedEnergy,
}

/// The loop between a device and a simulation, on a clock.
///
/// The simulation is a closure from the state of the handle to the wrench *on the handle* about the
/// handle point, or to an [`Answer`] that also says how the force goes on and how old it is. It is called
/// once a period as soon as there has been a good sample. In real time a
/// period that ends late is counted and its successor waits for the next scheduled time; nothing is
/// made up for.
#[derive(Debug, Clone)]
pub struct Servo<C> {
    clock: C,
    safety: Safety,
    failures_max: Option<u32>,
    failures: u32,
    periods: u64,
    missed_deadlines: u64,
    miss_run: u64,
    longest_miss_run: u64,
    skipped: u64,
    read_failures: u64,
    write_failures: u64,
    wake_delay: TimeHistogram,
    compute: TimeHistogram,
    response: TimeHistogram,
}

impl<C: Clock> Servo<C> {
    /// A loop that has not begun; all its memory is taken here.
    ///
    /// # Errors
    /// Where a setting is outside its range.
    pub fn new(clock: C, settings: ServoSettings) -> Result<Self, DeviceError> {
        Ok(Self {
            clock,
            safety: Safety::new(settings.safety)?,
            failures_max: settings.failures_max,
            failures: 0,
            periods: 0,
            missed_deadlines: 0,
            miss_run: 0,
            longest_miss_run: 0,
            skipped: 0,
            read_failures: 0,
            write_failures: 0,
            wake_delay: TimeHistogram::new(),
            compute: TimeHistogram::new(),
            response: TimeHistogram::new(),
        })
    }

    /// Runs until `stop` is set, then lets the wrench go to zero and stops the device.
    ///
    /// The device is stopped also when the simulation panics.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] when the device fails too often in a row.
    pub fn run<A: Into<Answer>>(
        &mut self,
        device: &mut dyn HapticDevice,
        stop: &AtomicBool,
        simulate: impl FnMut(&HandleState) -> A,
    ) -> Result<ServoReport, DeviceError> {
        self.run_while(device, |_| !stop.load(Ordering::Relaxed), simulate)
    }

    /// Runs for a number of periods, then lets the wrench go to zero and stops the device.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] when the device fails too often in a row.
    pub fn run_periods<A: Into<Answer>>(
        &mut self,
        device: &mut dyn HapticDevice,
        periods: u64,
        simulate: impl FnMut(&HandleState) -> A,
    ) -> Result<ServoReport, DeviceError> {
        let end = self.periods.saturating_add(periods);
        self.run_while(device, |done| done < end, simulate)
    }

    /// One period: waits for its scheduled time and does its work.
    ///
    /// For callers with a loop of their own; they end with [`release`](Self::release).
    /// Real-time: no allocation unless the device fails.
    ///
    /// # Errors
    /// [`DeviceError::Lost`] when the device has failed too often in a row.
    pub fn step<A: Into<Answer>>(
        &mut self,
        device: &mut dyn HapticDevice,
        simulate: impl FnOnce(&HandleState) -> A,
    ) -> Result<PeriodRecord, DeviceError> {
        let release = self.clock.wait();
        let period_s = self.clock.period_s();
        let elapsed_s = (release.skipped as f64 + 1.0) * period_s;
        if release.skipped > 0 {
            self.safety.after_gap(elapsed_s);
        }

        let read = device.read(release.time_s);
        let handle = self
            .safety
            .accept_sample(read.as_ref().ok(), release.time_s, elapsed_s);
        let command = match &handle {
            Some(handle) => {
                let answer = simulate(handle).into();
                // One period also after a gap: to the hand the new wrench is one step either way.
                self.safety.accept(&answer, period_s)
            }
            None => Command::ZERO,
        };
        let written = device.write(&command);

        let response_s = self.clock.since_release_s();
        let record = PeriodRecord {
            index: release.index,
            time_s: release.time_s,
            handle,
            wrench_on_handle: command.wrench,
            wake_delay_s: release.wake_delay_s,
            compute_s: response_s - release.wake_delay_s,
            response_s,
            is_late: response_s > period_s,
            skipped: release.skipped,
            arming: self.safety.arming(),
            energy: self.safety.energy(),
            safety: self.safety.events(),
        };
        self.count(&record);
        self.count_failures(read.err(), written.err())?;
        Ok(record)
    }

    /// Lets the wrench go to zero within the guard's decay time, period by period, then stops the device.
    pub fn release(&mut self, device: &mut dyn HapticDevice) {
        while self.safety.last_wrench() != Wrench::ZERO {
            let release = self.clock.wait();
            let wrench = self.safety.decay(self.clock.period_s());
            // The handle keeps moving; what it reports no longer matters.
            let is_alive =
                device.read(release.time_s).is_ok() && device.write(&wrench.into()).is_ok();
            if !is_alive {
                break;
            }
        }
        device.stop();
    }

    /// Counts and times of the periods so far.
    #[must_use]
    pub fn report(&self) -> ServoReport {
        ServoReport {
            periods: self.periods,
            missed_deadlines: self.missed_deadlines,
            longest_miss_run: self.longest_miss_run,
            skipped: self.skipped,
            wake_delay: self.wake_delay.summary(),
            compute: self.compute.summary(),
            response: self.response.summary(),
            read_failures: self.read_failures,
            write_failures: self.write_failures,
            safety: self.safety.events(),
            arming: self.safety.arming(),
            lowest_energy: self.safety.lowest_energy(),
        }
    }

    /// The full distribution of the response times so far.
    #[must_use]
    pub fn response_histogram(&self) -> &TimeHistogram {
        &self.response
    }

    fn run_while<A: Into<Answer>>(
        &mut self,
        device: &mut dyn HapticDevice,
        mut goes_on: impl FnMut(u64) -> bool,
        mut simulate: impl FnMut(&HandleState) -> A,
    ) -> Result<ServoReport, DeviceError> {
        let device = StopOnDrop(device);
        while goes_on(self.periods) {
            self.step(device.0, &mut simulate)?;
        }
        self.release(device.0);
        Ok(self.report())
    }

    fn count(&mut self, record: &PeriodRecord) {
        self.periods += 1;
        self.skipped += record.skipped;
        if record.is_late {
            self.missed_deadlines += 1;
            self.miss_run += 1;
            self.longest_miss_run = self.longest_miss_run.max(self.miss_run);
        } else {
            self.miss_run = 0;
        }
        self.wake_delay.record(record.wake_delay_s);
        self.compute.record(record.compute_s);
        self.response.record(record.response_s);
    }

    fn count_failures(
        &mut self,
        read: Option<DeviceError>,
        write: Option<DeviceError>,
    ) -> Result<(), DeviceError> {
        self.read_failures += u64::from(read.is_some());
        self.write_failures += u64::from(write.is_some());
        let Some(last) = write.or(read) else {
            self.failures = 0;
            return Ok(());
        };
        self.failures = self.failures.saturating_add(1);
        if self.failures_max.is_some_and(|max| self.failures >= max) {
            return Err(DeviceError::Lost {
                failures: self.failures,
                last: Box::new(last),
            });
        }
        Ok(())
    }
}

/// Stops the device however the loop is left.
struct StopOnDrop<'a>(&'a mut dyn HapticDevice);

impl Drop for StopOnDrop<'_> {
    fn drop(&mut self) {
        self.0.stop();
    }
}

#[cfg(test)]
mod tests;

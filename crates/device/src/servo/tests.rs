//! The loop on a device of the test's own and on the simulated one. Nothing here asserts a duration.

use glam::DVec3;
use glamx::DPose3;

use super::*;
use crate::clock::{AsFastAsPossible, Driven, RealTime};
use crate::driver::simulated::{Simulated, SimulatedSettings};
use crate::hand::{HandSettings, SimulatedHand};
use crate::haptic_device::Command;
use crate::safety::WaitsFor;
use crate::script::{Insertion, Script};

const T: f64 = 1e-3;

/// A device that reports what the test put in and remembers what was written.
struct Bench {
    limits: Limits,
    reads: Vec<Result<HandleState, DeviceError>>,
    is_writable: bool,
    written: Vec<Wrench>,
    stops: u32,
}

impl Bench {
    /// Reports the origin at each time.
    fn at_origin() -> Self {
        Self {
            limits: Limits::virtuose_6d(),
            reads: Vec::new(),
            is_writable: true,
            written: Vec::new(),
            stops: 0,
        }
    }

    fn no_answer() -> DeviceError {
        DeviceError::NoAnswer {
            device: "bench".to_owned(),
            reason: "unplugged".to_owned(),
        }
    }
}

impl HapticDevice for Bench {
    fn name(&self) -> &str {
        "bench"
    }

    fn limits(&self) -> &Limits {
        &self.limits
    }

    fn read(&mut self, time_s: f64) -> Result<HandleState, DeviceError> {
        if self.reads.is_empty() {
            return Ok(HandleState {
                time_s,
                ..HandleState::at_rest(DPose3::IDENTITY)
            });
        }
        self.reads.remove(0)
    }

    fn write(&mut self, command: &Command) -> Result<(), DeviceError> {
        if !self.is_writable {
            return Err(Self::no_answer());
        }
        self.written.push(command.wrench);
        Ok(())
    }

    fn stop(&mut self) {
        self.stops += 1;
    }
}

fn servo<C: Clock>(clock: C) -> Servo<C> {
    Servo::new(clock, ServoSettings::for_limits(&Limits::virtuose_6d())).unwrap()
}

fn push(x: f64) -> Wrench {
    Wrench::new(DVec3::new(x, 0.0, 0.0), DVec3::ZERO)
}

/// The states and wrenches of 60 periods against a wall, on a clock.
fn run_on(clock: impl Clock) -> Vec<(HandleState, Wrench)> {
    let script = Script::new(&Insertion {
        start: DPose3::new(DVec3::ZERO, DVec3::new(0.1, 0.2, 0.3)),
        direction: DVec3::NEG_Z,
        speed: 0.5,
        travel: 0.01,
        hold_s: 0.5,
        retract: false,
    })
    .unwrap();
    let hand = SimulatedHand::new(HandSettings::default(), script, T).unwrap();
    let mut device = Simulated::new(SimulatedSettings::default(), hand).unwrap();
    let mut servo = servo(clock);
    let mut seen = Vec::new();
    for _ in 0..60 {
        let record = servo
            .step(&mut device, |handle| {
                let depth = (-handle.pose.translation.z - 0.002).max(0.0);
                let up = DVec3::new(0.0, 0.0, 500.0 * depth);
                Wrench::new(up, DVec3::new(0.05, 0.0, 0.0) * depth / 0.01)
            })
            .unwrap();
        seen.push((record.handle.unwrap(), record.wrench_on_handle));
    }
    servo.release(&mut device);
    assert_eq!(device.rendered(), Wrench::ZERO);
    seen
}

#[test]
fn real_time_and_virtual_time_give_the_same_states_and_wrenches() {
    let fast = run_on(AsFastAsPossible::new(T).unwrap());
    // Less than 10 N is felt, so that even a stall of the machine meets no rate limit.
    assert!(fast.iter().any(|(_, w)| w.force.z > 1.0));
    assert!(fast.iter().all(|(_, w)| w.force.z < 10.0));
    assert_eq!(run_on(RealTime::new(T).unwrap()), fast);
    assert_eq!(run_on(Driven::new(T).unwrap()), fast);
}

#[test]
fn late_periods_are_counted_and_not_made_up_for() {
    let mut clock = Driven::new(T).unwrap();
    for response in [0.2e-3, 1.5e-3, 3.5e-3, 0.9e-3, 1.2e-3] {
        clock.push(0.1e-3, response);
    }
    let mut servo = servo(clock);
    let mut device = Bench::at_origin();
    let mut times = Vec::new();
    let report = servo
        .run_periods(&mut device, 8, |handle| {
            times.push(handle.time_s);
            Wrench::ZERO
        })
        .unwrap();
    assert_eq!(report.periods, 8);
    assert_eq!(report.missed_deadlines, 3);
    assert_eq!(report.longest_miss_run, 2);
    // 1.5 ms loses one scheduled time, 3.5 ms three, 1.2 ms one.
    assert_eq!(report.skipped, 5);
    assert_eq!(times, (0..8).map(|k| f64::from(k) * T).collect::<Vec<_>>());
    assert_eq!(report.response.max_s, 3.5e-3);
    assert_eq!(report.wake_delay.max_s, 0.1e-3);
    assert!((report.compute.max_s - 3.4e-3).abs() < 1e-15);
    assert_eq!(report.response.count, 8);
    assert_eq!(servo.response_histogram().count(), 8);
}

#[test]
fn stall_makes_the_wrench_rise_again_at_the_rate() {
    let mut clock = Driven::new(T).unwrap();
    for response in [0.0, 0.0, 0.0, 0.5] {
        clock.push(0.0, response);
    }
    let mut settings = ServoSettings::for_limits(&Limits::virtuose_6d());
    // 1 N per period; after a stall of 500 periods the limit on the rate must not open wide.
    settings.safety.force_rate_max = 1000.0;
    let mut servo = Servo::new(clock, settings).unwrap();
    let mut device = Bench::at_origin();
    for _ in 0..4 {
        servo.step(&mut device, |_| push(4.0)).unwrap();
    }
    servo.step(&mut device, |_| push(4.0)).unwrap();
    let report = servo.report();
    assert_eq!(report.safety.stalls, 1);
    let forces: Vec<f64> = device.written.iter().map(|w| w.force.x).collect();
    assert_eq!(forces, [1.0, 2.0, 3.0, 4.0, 1.0]);
}

#[test]
fn end_of_a_run_lets_the_wrench_go_and_stops_the_device() {
    let mut servo = servo(Driven::new(T).unwrap());
    let mut device = Bench::at_origin();
    let stop = AtomicBool::new(false);
    let mut calls = 0;
    let report = servo
        .run(&mut device, &stop, |_| {
            calls += 1;
            stop.store(calls == 10, Ordering::Relaxed);
            push(20.0)
        })
        .unwrap();
    assert_eq!((calls, report.periods), (10, 10));
    let after = &device.written[9..];
    assert_eq!(after[0].force.x, 20.0);
    for pair in after.windows(2) {
        // 35 N within 50 ms is 0.7 N a period.
        let fall = pair[0].force.x - pair[1].force.x;
        assert!((0.0..=0.7 + 1e-12).contains(&fall));
    }
    assert_eq!(after.last().copied(), Some(Wrench::ZERO));
    assert!(device.stops >= 1);
}

#[test]
fn simulation_that_gives_nan_never_reaches_the_device() {
    let mut servo = servo(Driven::new(T).unwrap());
    let mut device = Bench::at_origin();
    let mut k = 0;
    let report = servo
        .run_periods(&mut device, 200, |_| {
            k += 1;
            push(if k > 20 { f64::NAN } else { 30.0 })
        })
        .unwrap();
    assert!(device.written.iter().all(Wrench::is_finite));
    assert_eq!(device.written[120], Wrench::ZERO);
    assert_eq!(report.safety.wrenches_non_finite, 180);
}

#[test]
fn failed_read_is_survived_with_the_last_pose() {
    let mut servo = servo(Driven::new(T).unwrap());
    let mut device = Bench::at_origin();
    let moved = HandleState::at_rest(DPose3::from_translation(DVec3::splat(1e-3)));
    device.reads = vec![Err(Bench::no_answer()), Ok(moved), Err(Bench::no_answer())];
    let mut seen = Vec::new();
    let report = servo
        .run_periods(&mut device, 3, |handle| {
            seen.push(handle.pose.translation.x);
            push(1.0)
        })
        .unwrap();
    // Before the first good sample the simulation is not asked and nothing is rendered.
    assert_eq!(seen, [1e-3, 1e-3]);
    assert_eq!(device.written[0], Wrench::ZERO);
    assert_eq!(device.written[1].force.x, 1.0);
    assert!(device.written[2].force.x < 1.0);
    assert_eq!(report.read_failures, 2);
    assert_eq!(report.safety.samples_missing, 2);
}

#[test]
fn device_that_stays_away_ends_the_loop_and_is_stopped() {
    let mut settings = ServoSettings::for_limits(&Limits::virtuose_6d());
    settings.failures_max = Some(5);
    let mut servo = Servo::new(Driven::new(T).unwrap(), settings).unwrap();
    let mut device = Bench::at_origin();
    device.is_writable = false;
    let error = servo
        .run_periods(&mut device, 100, |_| Wrench::ZERO)
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "the device failed 5 times in a row; the loop was ended with zero force \
         (last failure: bench does not answer: unplugged)"
    );
    assert_eq!(servo.report().write_failures, 5);
    assert_eq!(device.stops, 1);
}

#[test]
fn device_is_stopped_when_the_simulation_panics() {
    let mut servo = servo(Driven::new(T).unwrap());
    let mut device = Bench::at_origin();
    let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        servo.run_periods(&mut device, 3, |_| -> Wrench { panic!("provoked") })
    }));
    assert!(outcome.is_err());
    assert_eq!(device.stops, 1);
}

#[test]
fn device_that_fails_while_the_wrench_goes_is_stopped_at_once() {
    let mut servo = servo(Driven::new(T).unwrap());
    let mut device = Bench::at_origin();
    servo.step(&mut device, |_| push(10.0)).unwrap();
    device.is_writable = false;
    servo.release(&mut device);
    assert_eq!(device.stops, 1);
    assert_eq!(device.written.len(), 1);
}

fn live_servo(clock: Driven) -> Servo<Driven> {
    Servo::new(clock, ServoSettings::live(&Limits::virtuose_6d()).unwrap()).unwrap()
}

#[test]
fn live_session_outlives_a_lost_device_and_arms_again_when_it_is_back() {
    let mut servo = live_servo(Driven::new(T).unwrap());
    let mut device = Bench::at_origin();
    let mut step = |device: &mut Bench, x: f64| servo.step(device, |_| push(x)).unwrap();
    for _ in 0..400 {
        step(&mut device, 0.0);
    }
    for _ in 0..20 {
        step(&mut device, 20.0);
    }
    assert_eq!(device.written.last(), Some(&push(20.0)));
    // Away for five seconds: neither reads nor writes.
    device.is_writable = false;
    device.reads = (0..5000).map(|_| Err(Bench::no_answer())).collect();
    let record = (0..5000).map(|_| step(&mut device, 20.0)).last().unwrap();
    assert_eq!(record.wrench_on_handle, Wrench::ZERO);
    assert_eq!(record.arming, Arming::Waiting(WaitsFor::Samples));
    // Back, with the tool still in contact: no force until it was small.
    device.is_writable = true;
    let record = (0..500).map(|_| step(&mut device, 20.0)).last().unwrap();
    assert_eq!(record.arming, Arming::Waiting(WaitsFor::SmallForce));
    assert_eq!(record.wrench_on_handle, Wrench::ZERO);
    for _ in 0..400 {
        step(&mut device, 0.0);
    }
    let record = (0..20).map(|_| step(&mut device, 20.0)).last().unwrap();
    assert_eq!(
        (record.arming, record.wrench_on_handle),
        (Arming::Armed, push(20.0))
    );
    let report = servo.report();
    assert_eq!((report.read_failures, report.write_failures), (5000, 5000));
    assert_eq!(
        (report.safety.trips_samples_lost, report.safety.trips()),
        (1, 1)
    );
    assert_eq!(report.arming, Arming::Armed);
}

#[test]
fn simulation_may_answer_with_a_wrench_a_command_or_an_old_result() {
    let mut servo = servo(Driven::new(T).unwrap());
    let mut device = Bench::at_origin();
    let stiff = Command {
        wrench: push(2.0),
        stiffness: glam::DMat3::IDENTITY * -300.0,
    };
    let mut wrench = |servo: &mut Servo<Driven>| device_force(servo.step(&mut device, |_| stiff));
    assert_eq!(wrench(&mut servo), 2.0);
    let old = Answer {
        command: stiff,
        age_s: 0.03,
    };
    let old_wrench =
        |servo: &mut Servo<Driven>| device_force(servo.step(&mut Bench::at_origin(), |_| old));
    let faded = old_wrench(&mut servo);
    assert!((faded - 1.0).abs() < 1e-12, "{faded}");
    let gone = servo
        .step(&mut Bench::at_origin(), |_| Answer { age_s: 0.06, ..old })
        .unwrap();
    assert_eq!(gone.wrench_on_handle, Wrench::ZERO);
    assert_eq!(servo.report().safety.answers_stale, 2);
}

fn device_force(record: Result<PeriodRecord, DeviceError>) -> f64 {
    record.unwrap().wrench_on_handle.force.x
}

#[test]
fn loop_that_was_held_up_for_long_makes_up_for_nothing_and_arms_again() {
    let mut clock = Driven::new(T).unwrap();
    for _ in 0..420 {
        clock.push(0.0, 1e-4);
    }
    clock.push(0.0, 3.0);
    let mut servo = live_servo(clock);
    let mut device = Bench::at_origin();
    let mut calls = 0;
    for k in 0..500 {
        let force = if k < 400 { 0.0 } else { 10.0 };
        servo
            .step(&mut device, |_| {
                calls += 1;
                push(force)
            })
            .unwrap();
    }
    // One call and one write a period, whatever was missed.
    assert_eq!((calls, device.written.len()), (500, 500));
    let report = servo.report();
    assert_eq!((report.skipped, report.safety.trips_stalled), (2999, 1));
    assert_eq!(device.written[419], push(10.0));
    assert!(device.written[421..].iter().all(|w| *w == Wrench::ZERO));
}

#[test]
fn live_session_that_was_never_armed_ends_at_once() {
    let mut servo = live_servo(Driven::new(T).unwrap());
    let mut device = Bench::at_origin();
    servo.run_periods(&mut device, 100, |_| push(20.0)).unwrap();
    assert_eq!(device.written.len(), 100);
    assert!(device.written.iter().all(|w| *w == Wrench::ZERO));
    assert!(device.stops >= 1);
}

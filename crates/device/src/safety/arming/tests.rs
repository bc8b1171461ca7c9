//! The ways to armed and the ways back.

use glam::DVec3;

use super::*;

const T: f64 = 1e-3;

/// A gate, its events, and what it sees unless a test says otherwise.
struct Bench {
    gate: ArmingGate,
    events: SafetyEvents,
    seen: Seen,
}

impl Bench {
    fn new(hand: HandPresence) -> Self {
        Self {
            gate: ArmingGate::new(ArmingSettings::for_limits(&Limits::virtuose_6d())).unwrap(),
            events: SafetyEvents::default(),
            seen: Seen {
                hand,
                readiness: Readiness::Ready,
                silent_s: 0.0,
                speed: 0.0,
                angular_speed: 0.0,
                wrench: Wrench::ZERO,
            },
        }
    }

    fn step(&mut self) -> f64 {
        self.gate.pass(&self.seen, T, &mut self.events)
    }

    fn steps(&mut self, n: usize) -> f64 {
        (0..n).map(|_| self.step()).last().unwrap()
    }

    /// Periods until armed, with a rise that never jumps.
    fn arm(&mut self) -> usize {
        let mut last = 0.0;
        for k in 1..=1000 {
            let gain = self.step();
            assert!((0.0..=T / 0.3 + 1e-12).contains(&(gain - last)));
            last = gain;
            if self.gate.state() == Arming::Armed {
                assert_eq!(gain, 1.0);
                return k;
            }
        }
        panic!("never armed: {:?}", self.gate.state());
    }

    fn waits_for(&mut self) -> WaitsFor {
        self.step();
        match self.gate.state() {
            Arming::Waiting(what) => what,
            other => panic!("{other:?}"),
        }
    }

    fn push(&mut self, force: f64) {
        self.seen.wrench = Wrench::new(DVec3::X * force, DVec3::ZERO);
    }
}

#[test]
fn device_without_a_sensor_is_armed_by_a_small_force_and_rises_for_300_ms() {
    let mut bench = Bench::new(HandPresence::Unknown);
    // 50 periods calm, then 300 of rising, one shared.
    assert!((348..=352).contains(&bench.arm()));
    assert_eq!(bench.events.trips(), 0);
}

#[test]
fn force_that_is_large_from_the_start_is_never_armed() {
    let mut bench = Bench::new(HandPresence::Unknown);
    bench.push(1.8);
    assert_eq!(bench.steps(1000), 0.0);
    assert_eq!(bench.waits_for(), WaitsFor::SmallForce);
    bench.seen.wrench = Wrench::new(DVec3::ZERO, DVec3::Z * 0.2);
    assert_eq!(bench.steps(1000), 0.0);
    // Small for 40 ms is not long enough; the count begins anew.
    bench.push(1.7);
    bench.steps(40);
    bench.push(1.8);
    bench.step();
    bench.push(1.7);
    assert_eq!(bench.steps(45), 0.0);
    assert!(bench.steps(10) > 0.0);
}

#[test]
fn handle_held_from_the_start_must_be_let_go_of_first() {
    let mut bench = Bench::new(HandPresence::Present);
    assert_eq!(bench.steps(2000), 0.0);
    assert_eq!(bench.waits_for(), WaitsFor::Release);
    bench.seen.hand = HandPresence::Absent;
    assert_eq!(bench.waits_for(), WaitsFor::Hold);
    bench.seen.hand = HandPresence::Present;
    bench.arm();
    assert_eq!(bench.events.trips(), 0);
}

#[test]
fn hand_that_lets_go_takes_the_force_away_within_20_ms_and_must_hold_again() {
    let mut bench = Bench::new(HandPresence::Absent);
    bench.step();
    bench.seen.hand = HandPresence::Present;
    bench.arm();
    bench.seen.hand = HandPresence::Absent;
    let mut last = 1.0;
    for _ in 0..20 {
        let gain = bench.step();
        assert!(gain < last);
        last = gain;
    }
    assert!(last < 1e-12);
    assert_eq!(bench.events.trips_hand_absent, 1);
    bench.steps(100);
    assert_eq!(bench.events.trips(), 1);
    bench.seen.hand = HandPresence::Present;
    assert!(bench.arm() > 300);
}

#[test]
fn device_that_cuts_its_force_asks_for_the_whole_way_again() {
    let mut bench = Bench::new(HandPresence::Absent);
    bench.step();
    bench.seen.hand = HandPresence::Present;
    bench.arm();
    bench.seen.readiness = Readiness::Tripped("emergency stop");
    assert_eq!(bench.waits_for(), WaitsFor::Device);
    assert_eq!(bench.events.trips_not_ready, 1);
    assert_eq!(bench.steps(100), 0.0);
    // Ready again, but the handle was never let go of.
    bench.seen.readiness = Readiness::Ready;
    assert_eq!(bench.waits_for(), WaitsFor::Release);
    bench.seen.hand = HandPresence::Absent;
    bench.step();
    bench.seen.hand = HandPresence::Present;
    bench.arm();
}

#[test]
fn lost_samples_trip_after_20_ms_and_one_missing_does_not() {
    let mut bench = Bench::new(HandPresence::Unknown);
    bench.arm();
    bench.seen.silent_s = 0.019;
    assert_eq!(bench.step(), 1.0);
    bench.seen.silent_s = 0.021;
    assert_eq!(bench.waits_for(), WaitsFor::Samples);
    assert_eq!(bench.events.trips_samples_lost, 1);
    bench.seen.silent_s = 0.0;
    bench.steps(20);
    assert!(bench.arm() > 300);
}

#[test]
fn handle_that_is_pushed_away_trips_and_one_that_moves_freely_does_not() {
    for angular in [false, true] {
        let mut bench = Bench::new(HandPresence::Unknown);
        bench.arm();
        (bench.seen.speed, bench.seen.angular_speed) =
            if angular { (0.0, 41.0) } else { (2.1, 0.0) };
        assert_eq!(bench.steps(50), 1.0);
        bench.push(5.0);
        bench.step();
        assert_eq!(bench.events.trips_too_fast, 1);
        bench.push(0.0);
        assert_eq!(bench.waits_for(), WaitsFor::SlowHandle);
        bench.steps(50);
        (bench.seen.speed, bench.seen.angular_speed) = (1.9, 39.0);
        bench.arm();
    }
}

#[test]
fn loop_that_stood_still_takes_the_force_away_at_once() {
    let mut bench = Bench::new(HandPresence::Unknown);
    bench.arm();
    bench.gate.stalled(&mut bench.events);
    bench.gate.stalled(&mut bench.events);
    assert_eq!(bench.gate.gain(), 0.0);
    assert_eq!(bench.events.trips_stalled, 1);
    assert!(bench.arm() > 300);
}

#[test]
fn each_state_has_words_for_the_user() {
    let words = |what: WaitsFor| Arming::Waiting(what).to_string();
    assert_eq!(
        words(WaitsFor::Release),
        "no force: let go of the handle once"
    );
    assert_eq!(
        words(WaitsFor::SmallForce),
        "no force: move the tool out of contact"
    );
    assert_eq!(Arming::Armed.to_string(), "force on");
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let refused = |change: fn(&mut ArmingSettings)| {
        let mut settings = ArmingSettings::for_limits(&Limits::virtuose_6d());
        change(&mut settings);
        match ArmingGate::new(settings) {
            Err(DeviceError::InvalidSetting { name, .. }) => name,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(|s| s.ramp_s = 0.0), "ramp_s");
    assert_eq!(refused(|s| s.fall_s = f64::NAN), "fall_s");
    assert_eq!(refused(|s| s.calm_s = -1.0), "calm_s");
    assert_eq!(refused(|s| s.calm_force = f64::NAN), "calm_force");
    assert_eq!(refused(|s| s.calm_torque = -1.0), "calm_torque");
    assert_eq!(refused(|s| s.speed_trip = 0.0), "speed_trip");
    assert_eq!(
        refused(|s| s.angular_speed_trip = 0.0),
        "angular_speed_trip"
    );
    assert_eq!(refused(|s| s.samples_timeout_s = 0.0), "samples_timeout_s");
}

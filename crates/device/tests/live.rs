//! Live sessions: the whole way from a simulated device through every guard and back.
//!
//! What is asked of each run: force and torque within the device's limits, finite, and no more energy at the handle
//! than the stated bound: E >= -A - (d + 1) F_max dx, A the allowance (peak force over 2 mm, peak torque over 0.04 rad),
//! d the delay in periods, dx the longest way between two good samples.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use device::driver::simulated::{MODELS, Model};
use device::{
    Answer, Arming, AsFastAsPossible, ChosenCoupling, Command, CouplingWish, DeviceError, Driven,
    HandPresence, HandSettings, HandleState, HapticDevice, Insertion, Limits, PassivitySettings,
    PeriodRecord, Readiness, Script, Servo, ServoReport, ServoSettings, Simulated, SimulatedHand,
    WaitsFor, Wrench,
};
use glam::{DMat3, DQuat, DVec3};
use glamx::DPose3;

const T: f64 = 1e-3;

/// Force of a snap-fit against the way in, N: rises to a peak, falls steeply, pulls in, rests, and stands at a wall.
/// Scaled so that its peak is `peak`.
fn snap(depth: f64, peak: f64) -> f64 {
    let at = [
        (0.0, 0.0),
        (2.0e-3, 1.0),
        (2.5e-3, -0.4),
        (3.5e-3, 0.0),
        (5.0e-3, 0.0),
        (6.0e-3, 1.5),
    ];
    let depth = depth.clamp(0.0, 6.0e-3);
    let k = at.windows(2).position(|w| depth <= w[1].0).unwrap_or(4);
    let ((x0, f0), (x1, f1)) = (at[k], at[k + 1]);
    peak * (f0 + (f1 - f0) * (depth - x0) / (x1 - x0))
}

/// Most energy that may come out beyond what went in, J: of forces and of torques.
fn bound(limits: &Limits, period_s: f64, way: f64, turn: f64) -> (f64, f64) {
    let settings = PassivitySettings::for_limits(limits);
    let in_flight = 1.0 + (settings.delay_s / period_s).round();
    (
        settings.translation.allowance + in_flight * limits.peak_force * way,
        settings.rotation.allowance + in_flight * limits.peak_torque * turn,
    )
}

/// What a run saw at its ends.
struct Watch {
    limits: Limits,
    period_s: f64,
    way: f64,
    turn: f64,
    last: Option<DPose3>,
}

impl Watch {
    fn new(limits: &Limits, period_s: f64) -> Self {
        Self {
            limits: *limits,
            period_s,
            way: 0.0,
            turn: 0.0,
            last: None,
        }
    }

    fn see(&mut self, record: &PeriodRecord) {
        let wrench = record.wrench_on_handle;
        assert!(wrench.is_finite());
        assert!(wrench.force.length() <= self.limits.peak_force * (1.0 + 1e-12));
        assert!(wrench.torque.length() <= self.limits.peak_torque * (1.0 + 1e-12));
        if let Some(handle) = &record.handle {
            if let Some(last) = self.last {
                self.way = self
                    .way
                    .max((handle.pose.translation - last.translation).length());
                self.turn = self
                    .turn
                    .max(handle.pose.rotation.angle_between(last.rotation));
            }
            self.last = Some(handle.pose);
        }
    }

    fn judge(&self, report: &ServoReport) {
        let (force, torque) = bound(&self.limits, self.period_s, self.way, self.turn);
        let lowest = report.lowest_energy;
        assert!(
            lowest.translation >= -force * (1.0 + 1e-9),
            "{lowest:?} {force}"
        );
        assert!(
            lowest.rotation >= -torque * (1.0 + 1e-9),
            "{lowest:?} {torque}"
        );
    }
}

/// A scripted hand pushes a model's handle 12 mm in, onto a snap that begins 4 mm below, holds it and pulls it out.
fn insert(model: &Model, period_s: f64, speed: f64, peak: f64) -> (ServoReport, Vec<PeriodRecord>) {
    let script = Script::new(&Insertion {
        start: DPose3::IDENTITY,
        direction: DVec3::NEG_Z,
        speed,
        travel: 0.012,
        hold_s: 0.2,
        retract: true,
    })
    .unwrap();
    let hand = SimulatedHand::new(HandSettings::default(), script, 1e-4).unwrap();
    let mut device = Simulated::of_model(model, hand).unwrap();
    let settings = ServoSettings::live(device.limits()).unwrap();
    let mut servo = Servo::new(AsFastAsPossible::new(period_s).unwrap(), settings).unwrap();
    let mut watch = Watch::new(device.limits(), period_s);
    let records: Vec<PeriodRecord> = (0..script.periods(period_s))
        .map(|_| {
            let record = servo
                .step(&mut device, |handle| {
                    let depth = -handle.pose.translation.z - 0.004;
                    Wrench::new(DVec3::Z * snap(depth, peak), DVec3::ZERO)
                })
                .unwrap();
            watch.see(&record);
            record
        })
        .collect();
    servo.release(&mut device);
    let report = servo.report();
    watch.judge(&report);
    (report, records)
}

#[test]
fn insertion_into_a_snap_is_felt_whole_on_each_model_at_1_and_10_khz() {
    for model in MODELS {
        let peak = 0.6 * model.limits.continuous_force;
        for period_s in [1e-3, 1e-4] {
            // Slowly enough that arming is over before contact.
            let (report, records) = insert(model, period_s, 0.008, peak);
            let name = (model.key, period_s);
            assert_eq!(report.safety.trips(), 0, "{name:?}");
            assert_eq!(report.arming, Arming::Armed, "{name:?}");
            let forces = || records.iter().map(|r| r.wrench_on_handle.force.z);
            let (most, least) = (forces().fold(0.0, f64::max), forces().fold(0.0, f64::min));
            assert!(most > 0.95 * peak, "{name:?} {most} of {peak}");
            assert!(least < -0.3 * peak, "{name:?} {least} of {peak}");
            // Nothing of the force was taken by the guard of the energy.
            assert_eq!(report.safety.energy_limited, 0, "{name:?}");
        }
    }
}

#[test]
fn force_beyond_what_a_model_has_is_cut_and_its_energy_stays_bounded() {
    for model in MODELS {
        let (report, _) = insert(model, T, 0.02, 4.0 * model.limits.peak_force);
        let s = report.safety;
        assert!(s.wrenches_clamped + s.energy_limited > 0, "{}", model.key);
    }
}

/// A hand that trembles holds a wall of the stiffness that is chosen for the model: nothing of it fades, although
/// encoder, sampling and delay make a little energy all the time.
#[test]
fn contact_that_is_held_for_long_keeps_its_force() {
    for model in MODELS {
        let wish = CouplingWish::default();
        let chosen = ChosenCoupling::for_device(&model.limits, T, &wish).unwrap();
        let (stiffness, push) = (chosen.translational, 0.5 * model.limits.continuous_force);
        let grip = HandSettings::default();
        let (mut guide, hand) = SimulatedHand::guided(grip, DPose3::IDENTITY, 1e-4).unwrap();
        let mut device = Simulated::of_model(model, hand).unwrap();
        let settings = ServoSettings::live(device.limits()).unwrap();
        let mut servo = Servo::new(AsFastAsPossible::new(T).unwrap(), settings).unwrap();
        let into = push / stiffness + push / grip.grip_stiffness;
        for k in 0..15_000 {
            let t = f64::from(k) * T;
            let pressed = (t - 1.0).clamp(0.0, 1.0) * into;
            let z = -pressed + 2e-4 * (50.0 * t).sin();
            guide
                .set_target(DPose3::from_translation(DVec3::Z * z))
                .unwrap();
            let mut wanted = 0.0;
            let record = servo
                .step(&mut device, |handle| {
                    wanted = stiffness * (-handle.pose.translation.z).max(0.0);
                    Wrench::new(DVec3::Z * wanted, DVec3::ZERO)
                })
                .unwrap();
            if t > 3.0 {
                let felt = record.wrench_on_handle.force.z;
                assert!(
                    felt > 0.8 * wanted,
                    "{} at {t}: {felt} of {wanted}",
                    model.key
                );
            }
        }
        let report = servo.report();
        assert_eq!(report.safety.energy_limited, 0, "{}", model.key);
        assert_eq!(report.arming, Arming::Armed, "{}", model.key);
    }
}

/// A wall that is far too stiff for its delay shakes the handle; the guard keeps the shaking small.
#[test]
fn wall_beyond_the_edge_of_stability_is_kept_from_shaking_the_handle() {
    let shaken = |is_live: bool| {
        let model = Model::named("falcon").unwrap();
        // Within what was measured of human hands (van Beek et al. 2015: 0.55 kg, 6.5 N s/m, 135 N/m).
        let loose = HandSettings {
            apparent_mass: 0.2,
            grip_stiffness: 300.0,
            grip_damping: 5.0,
            ..HandSettings::default()
        };
        let (mut guide, hand) = SimulatedHand::guided(loose, DPose3::IDENTITY, 1e-4).unwrap();
        let mut device = Simulated::of_model(model, hand).unwrap();
        let settings = if is_live {
            ServoSettings::live(device.limits()).unwrap()
        } else {
            ServoSettings::for_limits(device.limits())
        };
        let mut servo = Servo::new(AsFastAsPossible::new(T).unwrap(), settings).unwrap();
        let mut watch = Watch::new(device.limits(), T);
        let mut swing = 0.0_f64;
        for k in 0..4000 {
            if k == 1000 {
                guide
                    .set_target(DPose3::from_translation(DVec3::NEG_Z * 0.004))
                    .unwrap();
            }
            let record = servo
                .step(&mut device, |handle| {
                    // Five times what device and hand bear with a delay of 1 ms, 7 N s/m over 1.5 ms.
                    let depth = (-handle.pose.translation.z - 0.002).max(0.0);
                    Wrench::new(DVec3::Z * (25_000.0 * depth), DVec3::ZERO)
                })
                .unwrap();
            watch.see(&record);
            if k > 3000 {
                swing = swing.max(device.hand().state().linear_velocity.length());
            }
        }
        if is_live {
            watch.judge(&servo.report());
        }
        swing
    };
    let (without, with) = (shaken(false), shaken(true));
    assert!(without > 0.02, "the wall does not shake at all: {without}");
    assert!(with < 0.5 * without, "{with} of {without}");
}

/// Random numbers with a seed (xorshift).
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// In [-1, 1].
    fn both(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.both(), self.both(), self.both())
    }

    fn happens(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }
}

/// A device that moves at random, and sometimes says what cannot be.
struct Wild {
    limits: Limits,
    random: Random,
    velocity: DVec3,
    spin: DVec3,
    pose: DPose3,
    state: HandleState,
}

impl Wild {
    fn new(limits: Limits, seed: u64) -> Self {
        Self {
            limits,
            random: Random(seed),
            velocity: DVec3::ZERO,
            spin: DVec3::ZERO,
            pose: DPose3::IDENTITY,
            state: HandleState::at_rest(DPose3::IDENTITY),
        }
    }
}

impl HapticDevice for Wild {
    fn name(&self) -> &str {
        "wild"
    }

    fn limits(&self) -> &Limits {
        &self.limits
    }

    fn read(&mut self, time_s: f64) -> Result<HandleState, DeviceError> {
        let r = &mut self.random;
        // Up to 1.2 m/s and 10 rad/s along each axis, changing within some 20 ms; then a step of noise.
        self.velocity = self.velocity * 0.95 + r.vector() * 0.06;
        self.spin = self.spin * 0.95 + r.vector() * 0.5;
        let noise = r.vector() * 2e-5;
        self.pose = DPose3::from_parts(
            self.pose.translation + self.velocity * T,
            (DQuat::from_scaled_axis(self.spin * T) * self.pose.rotation).normalize(),
        );
        self.state = HandleState {
            linear_velocity: self.velocity + r.vector() * 0.05,
            angular_velocity: self.spin,
            time_s,
            ..HandleState::at_rest(DPose3::from_parts(
                self.pose.translation + noise,
                self.pose.rotation,
            ))
        };
        let mut told = self.state;
        match (r.unit() * 2000.0) as u32 {
            0 => return Err(DeviceError::Silent { age_s: 1.0 }),
            1 => told.pose.translation.x = f64::NAN,
            2 => told.pose.rotation.w = 5.0,
            3 => told.linear_velocity.z = 1e9,
            4 => told.time_s = -1.0,
            5 if r.happens(0.05) => told.readiness = Readiness::Tripped("at random"),
            6 if r.happens(0.05) => told.hand = HandPresence::Absent,
            _ => {}
        }
        Ok(told)
    }

    fn write(&mut self, command: &Command) -> Result<(), DeviceError> {
        assert!(command.is_finite());
        Ok(())
    }

    fn stop(&mut self) {}
}

/// A simulation that wants anything: delayed springs and negative damping, noise, jumps, nonsense, old results.
struct Anything {
    random: Random,
    before: [DPose3; 8],
    k: usize,
    mood: u32,
}

impl Anything {
    fn answer(&mut self, handle: &HandleState, limits: &Limits) -> Answer {
        let r = &mut self.random;
        self.before[self.k % 8] = handle.pose;
        self.k += 1;
        if r.happens(1e-3) {
            self.mood = (r.unit() * 5.0) as u32;
        }
        let late = self.before[(self.k + 1) % 8].translation;
        let peak = limits.peak_force.max(1.0);
        let force = match self.mood {
            // Calm, so that the force is armed again after a trip.
            0 => r.vector() * 1e-3 * peak,
            // A spring to the grid, seven periods late.
            1 => ((late / 0.01).round() * 0.01 - late) * 1e4,
            // Pushes where the handle goes.
            2 => handle.linear_velocity * (20.0 * peak),
            3 => r.vector() * 3.0 * peak,
            _ => DVec3::X * (peak * f64::from(u8::from(r.happens(0.5)))),
        };
        let with_spin = f64::from(u8::from(self.mood > 0));
        let torque = force * 0.2 + handle.angular_velocity * (0.5 * with_spin);
        let mut answer = Answer::from(Command {
            wrench: Wrench::new(force, torque),
            stiffness: DMat3::IDENTITY * (1e4 * r.both()),
        });
        match (r.unit() * 1000.0) as u32 {
            0 => answer.command.wrench.force.y = f64::NAN,
            1 => answer.command.wrench.torque.x = f64::INFINITY,
            2 => answer.age_s = 0.2 * r.unit(),
            3 => answer.command.wrench.force = DVec3::splat(1e300),
            4 => answer.age_s = f64::NAN,
            _ => {}
        }
        answer
    }
}

/// A run of the wild device under any answers, on a clock that is sometimes late.
fn wild(limits: Limits, periods: u64, seed: u64) -> ServoReport {
    let mut clock = Driven::new(T).unwrap();
    let mut random = Random(seed ^ 0x5555);
    for _ in 0..periods.min(100_000) {
        let late = if random.happens(1e-3) { 0.03 } else { 1e-4 };
        clock.push(0.0, late * random.unit());
    }
    let mut device = Wild::new(limits, seed);
    let mut anything = Anything {
        random: Random(seed ^ 0xaaaa),
        before: [DPose3::IDENTITY; 8],
        k: 0,
        mood: 0,
    };
    let mut servo = Servo::new(clock, ServoSettings::live(&limits).unwrap()).unwrap();
    let mut watch = Watch::new(&limits, T);
    let mut armed = 0_u64;
    for _ in 0..periods {
        let record = servo
            .step(&mut device, |handle| anything.answer(handle, &limits))
            .unwrap();
        watch.see(&record);
        armed += u64::from(record.arming == Arming::Armed);
    }
    let report = servo.report();
    watch.judge(&report);
    // The force was on for a good part of it, or nothing was tried.
    assert!(armed > periods / 10, "{armed} of {periods}");
    report
}

#[test]
fn a_million_periods_of_anything_stay_within_the_limits_and_the_bound_of_energy() {
    let report = wild(Limits::virtuose_6d(), 700_000, 1);
    let s = report.safety;
    for provoked in [
        s.samples_missing,
        s.samples_non_finite,
        s.samples_non_unit,
        s.samples_too_fast,
        s.samples_back_in_time,
        s.wrenches_non_finite,
        s.wrenches_clamped,
        s.wrenches_rate_limited,
        s.stalls,
        s.passivity_damped,
        s.energy_limited,
        s.answers_stale,
        s.stiffness_limited,
        s.trips_not_ready,
        s.trips_hand_absent,
    ] {
        assert!(provoked > 0, "{s:?}");
    }
    let touch = Model::named("touch").unwrap().limits;
    wild(touch, 200_000, 2);
    let mut none = Limits::virtuose_6d();
    (none.peak_force, none.continuous_force, none.peak_torque) = (0.0, 0.0, 0.0);
    let report = wild(none, 100_000, 3);
    assert_eq!(report.lowest_energy, device::ObservedEnergy::default());
}

/// The way of a user at a device with a sensor of the hand.
#[test]
fn user_lets_go_takes_the_handle_and_feels_force_after_300_ms() {
    let model = Model::named("virtuose-6d").unwrap();
    let (mut guide, hand) =
        SimulatedHand::guided(HandSettings::default(), DPose3::IDENTITY, T).unwrap();
    guide.set_hand(HandPresence::Present);
    let mut device = Simulated::of_model(model, hand).unwrap();
    let settings = ServoSettings::live(device.limits()).unwrap();
    let mut servo = Servo::new(Driven::new(T).unwrap(), settings).unwrap();
    let mut run = |periods: u32, force: f64| {
        (0..periods)
            .map(|_| {
                let up = Wrench::new(DVec3::Z * force, DVec3::ZERO);
                servo.step(&mut device, |_| up).unwrap()
            })
            .last()
            .unwrap()
    };
    let waits = |record: PeriodRecord| match record.arming {
        Arming::Waiting(what) => what,
        other => panic!("{other:?}"),
    };
    assert_eq!(waits(run(500, 0.0)), WaitsFor::Release);
    guide.set_hand(HandPresence::Absent);
    assert_eq!(waits(run(100, 0.0)), WaitsFor::Hold);
    guide.set_hand(HandPresence::Present);
    assert_eq!(waits(run(500, 3.0)), WaitsFor::SmallForce);
    assert_eq!(run(100, 0.5).arming, Arming::Rising);
    assert_eq!(run(300, 0.5).arming, Arming::Armed);
    // A force that gives way to nothing makes energy; a little of it is damped.
    assert!(run(10, 3.0).wrench_on_handle.force.z > 2.9);
    guide.set_hand(HandPresence::Absent);
    let record = run(25, 3.0);
    assert_eq!(record.wrench_on_handle, Wrench::ZERO);
    assert_eq!(waits(record), WaitsFor::Hold);
}

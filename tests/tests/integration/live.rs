//! Live sessions: a device of our own behind our own VRPN server, and one that is killed while it is felt.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use device::driver::vrpn::server::Server;
use device::{
    Command, DeviceError, HandSettings, HandleState, HapticDevice, Insertion, Limits, Mapping,
    MappingSettings, SafetySettings, Script, ServoSettings, Simulated, SimulatedHand,
    SimulatedSettings,
};
use glam::DVec3;
use glamx::DPose3;
use snapin::engine::Engine;
use snapin::prepare::PreparedPart;
use snapin::report::mcap_file::{self, StepMessage};
use snapin::session::live::{self, Hands, LivePorts, LiveReport, LiveSpec, SecondHand};
use snapin::session::log::Log;
use snapin::session::rates::Rates;
use snapin::session::{SnapshotOutput, snapshots};
use snapin::setup;
use snapin_tests::shipped;

/// A simulated device whose hand rests until it is told to go.
struct Waiting<'a> {
    inner: Simulated,
    goes: &'a AtomicBool,
    rested_s: f64,
}

impl HapticDevice for Waiting<'_> {
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn limits(&self) -> &Limits {
        self.inner.limits()
    }

    fn read(&mut self, time_s: f64) -> Result<HandleState, DeviceError> {
        if !self.goes.load(Ordering::Acquire) {
            self.rested_s = time_s;
        }
        let state = self.inner.read(time_s - self.rested_s)?;
        Ok(HandleState { time_s, ..state })
    }

    fn write(&mut self, command: &Command) -> Result<(), DeviceError> {
        self.inner.write(command)
    }

    fn stop(&mut self) {
        self.inner.stop();
    }
}

/// The clip without friction, with its engine and what a live session of it needs.
struct Clip {
    prepared: PreparedPart,
    engine: Engine,
    spec: LiveSpec,
}

impl Clip {
    fn new() -> Self {
        let (scene, prepared) = shipped("clip.toml");
        let scene = scene.with_friction(false);
        let (tool, _) = setup::tool(&scene).unwrap();
        let held = setup::held(&scene, &prepared, &tool);
        let mut session = setup::live_session(&scene, held, 1e-3);
        session.rates = Rates::One;
        let engine = setup::engine(&scene, &prepared, tool).unwrap();
        let limits = Limits::virtuose_6d();
        let spec = LiveSpec {
            mapping: None,
            clutch: 0,
            slips: false,
            rail: None,
            largest_force: 14.0,
            stiffness: 2e4,
            n_periods: None,
            seconds: None,
            lever: 0.05,
            servo: ServoSettings::live(&limits).unwrap(),
            session,
        };
        Self {
            prepared,
            engine,
            spec,
        }
    }

    fn hand<'a>(&self, goes: &'a AtomicBool) -> Waiting<'a> {
        let session = &self.spec.session;
        let script = Script::new(&Insertion {
            start: session.held.start(),
            direction: session.direction,
            speed: session.speed,
            travel: session.travel,
            hold_s: 10.0,
            retract: false,
        })
        .unwrap();
        let hand = SimulatedHand::new(session.hand, script, 1e-3).unwrap();
        Waiting {
            inner: Simulated::new(SimulatedSettings::default(), hand).unwrap(),
            goes,
            rested_s: 0.0,
        }
    }

    /// Feels a device until `is_over` says so, looking at the newest snapshot a hundred times a second.
    fn feel(
        &mut self,
        device: &mut dyn HapticDevice,
        file: &Path,
        is_over: impl FnMut(&mut SnapshotOutput) -> bool,
    ) -> (LiveReport, Vec<StepMessage>) {
        let hands = Hands {
            first: device,
            second: None,
        };
        self.feel_with(hands, file, is_over)
    }

    fn feel_with(
        &mut self,
        hands: Hands<'_>,
        file: &Path,
        mut is_over: impl FnMut(&mut SnapshotOutput) -> bool,
    ) -> (LiveReport, Vec<StepMessage>) {
        let rates = live::rates(&self.spec.session, &self.prepared, &mut self.engine).unwrap();
        let (log, samples) = Log::create(file, &BTreeMap::new()).unwrap();
        let (viewer, mut view) = snapshots(self.engine.settings().max_contacts);
        let ports = LivePorts {
            at_start: None,
            viewer,
            log: Some(samples),
            trace: None,
        };
        let (stop, is_written) = (AtomicBool::new(false), AtomicBool::new(false));
        let (spec, engine) = (&self.spec, &mut self.engine);
        let report = std::thread::scope(|scope| {
            let writer = scope.spawn(|| log.write(&is_written));
            let felt = scope.spawn(|| live::run(spec, &rates, hands, engine, ports, &stop));
            while !is_over(&mut view) {
                assert!(!felt.is_finished(), "a session that nobody ended goes on");
                std::thread::sleep(Duration::from_millis(10));
            }
            stop.store(true, Ordering::Release);
            let report = felt.join().unwrap().unwrap();
            is_written.store(true, Ordering::Release);
            writer.join().unwrap().unwrap();
            report
        });
        let read = mcap_file::read(&std::fs::read(file).unwrap()).unwrap();
        assert!(read.is_whole);
        (report, read.messages)
    }
}

/// Whether the hand has gone all its way.
fn has_arrived(view: &mut SnapshotOutput, travel: f64) -> bool {
    view.update();
    let sample = view.output_buffer().sample;
    sample.is_some_and(|s| s.gone.travel > 0.98 * travel)
}

fn is_armed(view: &mut SnapshotOutput) -> bool {
    view.update();
    let sample = view.output_buffer().sample;
    sample.is_some_and(|s| s.servo.arming == device::Arming::Armed)
}

/// N, force of a recording at a travel, by the first steps around it.
fn force_at(steps: &[StepMessage], travel: f64) -> f64 {
    let k = steps.iter().position(|s| s.travel_m >= travel).unwrap();
    let (a, b) = (&steps[k - 1], &steps[k]);
    let t = (travel - a.travel_m) / (b.travel_m - a.travel_m);
    let (fa, fb) = (a.force_n.unwrap(), b.force_n.unwrap());
    fa + t * (fb - fa)
}

/// The step is quasi-static, so a delay moves the hand otherwise in time, and the force over the tool's travel hardly:
/// by no more than the steps from node to node between two samples of one way and of the other.
#[test]
fn a_session_through_our_vrpn_server_gives_the_curve_of_the_built_in_device() {
    let folder = tempfile::tempdir().unwrap();
    let mut clip = Clip::new();
    let travel = clip.spec.session.travel;
    let begun = AtomicBool::new(true);
    let mut built_in = clip.hand(&begun);
    let file = folder.path().join("built-in.mcap");
    let (report, expected) = clip.feel(&mut built_in, &file, |view| has_arrived(view, travel));
    assert!(report.snap.n_snaps_in == 1, "{:?}", report.snap);

    let (goes, stop) = (AtomicBool::new(false), AtomicBool::new(false));
    let mut served = clip.hand(&goes);
    let mut server = Server::bind("127.0.0.1:0", "Hand0").unwrap();
    let address = server.local_addr();
    let (through, found) = std::thread::scope(|scope| {
        let serving = scope.spawn(|| server.run(&mut served, 1e-3, &stop));
        let name = format!("vrpn:Hand0@{address}?force=35&stiffness=2000");
        let mut opened = device::driver::open(&name).unwrap();
        let start = clip.spec.session.held.start();
        let mapping = Mapping::new(MappingSettings::default(), start).unwrap();
        clip.spec.mapping = Some(mapping);
        clip.spec.servo = ServoSettings::live(opened.device.limits()).unwrap();
        let file = folder.path().join("vrpn.mcap");
        let felt = clip.feel(&mut *opened.device, &file, |view| {
            if is_armed(view) {
                goes.store(true, Ordering::Release);
            }
            has_arrived(view, travel)
        });
        drop(opened);
        stop.store(true, Ordering::Release);
        let served = serving.join().unwrap().unwrap();
        assert!(served.fields > 100, "{served:?}");
        felt
    });
    assert_eq!(through.snap.n_snaps_in, 1, "{:?}", through.snap);
    let peak = report.snap.peak_force;
    assert!(
        (through.snap.peak_force / peak - 1.0).abs() < 0.01,
        "{} and {peak} N",
        through.snap.peak_force
    );
    for k in 1..=20 {
        let at = 0.05 * f64::from(k) * report.snap.travel_at_peak;
        let (a, b) = (force_at(&found, at), force_at(&expected, at));
        assert!((a - b).abs() < 0.03 * peak, "{a} and {b} N at {at} m");
    }
}

/// The server dies while the clip is pressed: zero force, the session goes on, its recording is whole, and when there is
/// a server again the device is back.
#[test]
fn a_server_that_dies_in_contact_leaves_no_force_and_a_session_that_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let mut clip = Clip::new();
    // The hand stops in contact, before the peak.
    clip.spec.session.travel = 3e-3;
    let goes = AtomicBool::new(false);
    let first_stop = AtomicBool::new(false);
    let mut served = clip.hand(&goes);
    let mut server = Server::bind("127.0.0.1:0", "Hand0").unwrap();
    let address = server.local_addr();
    let second_stop = AtomicBool::new(false);
    let restarted = AtomicU64::new(0);
    let report = std::thread::scope(|scope| {
        let serving = scope.spawn(|| {
            server.run(&mut served, 1e-3, &first_stop).unwrap();
            drop(server);
            // As long as nobody listens it is silent; then there is a server again.
            std::thread::sleep(Duration::from_millis(300));
            serve_again(address, &restarted, &second_stop);
        });
        let name = format!("vrpn:Hand0@{address}?force=35&stiffness=2000");
        let mut opened = device::driver::open(&name).unwrap();
        let start = clip.spec.session.held.start();
        let mapping = Mapping::new(MappingSettings::default(), start).unwrap();
        clip.spec.mapping = Some(mapping);
        clip.spec.servo = ServoSettings::live(opened.device.limits()).unwrap();
        let file = folder.path().join("killed.mcap");
        let (mut was_pressed, mut was_cut) = (false, false);
        let (report, steps) = clip.feel(&mut *opened.device, &file, |view| {
            if is_armed(view) && !was_pressed {
                goes.store(true, Ordering::Release);
            }
            let Some(sample) = view.output_buffer().sample else {
                return false;
            };
            let on_hand = sample.servo.wrench_on_handle.force.length();
            if !was_pressed && on_hand > 2.0 {
                was_pressed = true;
                first_stop.store(true, Ordering::Release);
            }
            was_cut |= was_pressed && on_hand == 0.0;
            let is_back = restarted.load(Ordering::Acquire) > 0
                && sample
                    .servo
                    .handle
                    .is_some_and(|h| h.pose == DPose3::IDENTITY);
            was_cut && is_back
        });
        let told: Vec<String> = opened.messages.try_iter().collect();
        drop(opened);
        second_stop.store(true, Ordering::Release);
        serving.join().unwrap();
        assert!(told.iter().any(|m| m.contains("is lost")), "{told:?}");
        assert!(told.iter().any(|m| m.contains("is back")), "{told:?}");
        assert!(!steps.is_empty());
        report
    });
    assert!(report.servo.read_failures > 0);
    assert!(report.servo.safety.trips_samples_lost > 0, "{report:?}");
}

/// A device at the origin behind the address of before.
fn serve_again(address: SocketAddr, restarted: &AtomicU64, stop: &AtomicBool) {
    let hand = SimulatedHand::resting(Default::default(), DPose3::IDENTITY, 1e-3).unwrap();
    let mut device = Simulated::new(SimulatedSettings::default(), hand).unwrap();
    // The port may be in the system's hands for a moment.
    for _ in 0..200 {
        if let Ok(mut server) = Server::bind(address, "Hand0") {
            restarted.fetch_add(1, Ordering::Release);
            server.run(&mut device, 1e-3, stop).unwrap();
            return;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    panic!("the port did not come back");
}

/// A handle that goes on at a speed whatever stands in its way, as that of a SpaceMouse does.
struct Pusher {
    limits: Limits,
    velocity: DVec3,
    way: f64,
}

impl HapticDevice for Pusher {
    fn name(&self) -> &str {
        "pusher"
    }

    fn limits(&self) -> &Limits {
        &self.limits
    }

    fn read(&mut self, time_s: f64) -> Result<HandleState, DeviceError> {
        let gone = (time_s * self.velocity).clamp_length_max(self.way);
        Ok(HandleState {
            time_s,
            ..HandleState::at_rest(DPose3::from_translation(gone))
        })
    }

    fn write(&mut self, command: &Command) -> Result<(), DeviceError> {
        assert_eq!(command.wrench.force, DVec3::ZERO, "it renders none");
        Ok(())
    }

    fn stop(&mut self) {}
}

/// Nothing holds such a handle back, so it slips: it is never further ahead than it may be, and the clip snaps on with
/// the force that it has.
#[test]
fn a_handle_that_nothing_holds_back_slips_and_the_clip_snaps_on() {
    // 1.5 times 14 N at 20 kN/m.
    const AHEAD: f64 = 1.05e-3;
    let folder = tempfile::tempdir().unwrap();
    let mut clip = Clip::new();
    let session = &clip.spec.session;
    let travel = session.travel;
    let limits = Limits {
        peak_force: 0.0,
        continuous_force: 0.0,
        peak_torque: 0.0,
        ..Limits::virtuose_6d()
    };
    let speed = 0.02;
    let mut device = Pusher {
        limits,
        velocity: speed * session.direction,
        way: travel + 5e-3,
    };
    let mapping = Mapping::new(MappingSettings::default(), session.held.start()).unwrap();
    let start = session.held.start().translation;
    let direction = session.direction;
    clip.spec.mapping = Some(mapping);
    clip.spec.servo = ServoSettings::live(&limits).unwrap();
    clip.spec.slips = true;
    let file = folder.path().join("pushed.mcap");
    let (report, steps) = clip.feel(&mut device, &file, |view| has_arrived(view, travel));
    assert_eq!(report.snap.n_snaps_in, 1, "{:?}", report.snap);
    assert_eq!(report.largest_rendered, 0.0);
    // The clip's own peak without friction (the part's curve: 8.44 N).
    let peak = report.snap.peak_force;
    assert!((peak / 8.44 - 1.0).abs() < 0.01, "{peak} N");
    let mut largest = 0.0_f64;
    for step in &steps {
        let handle = DVec3::from_array(step.handle_position_m.map(Option::unwrap));
        largest = largest.max((handle - start).dot(direction) - step.travel_m);
    }
    // And what it goes in the periods that a loaded machine skips.
    assert!(largest > 2e-4, "it was ahead of the tool: {largest} m");
    assert!(largest < AHEAD + 1e-3, "{largest} m");
}

/// Two hands: one brings the tool, the other holds the part and gives way; both feel the same.
#[test]
fn the_other_hand_holds_the_part_and_gives_way() {
    let folder = tempfile::tempdir().unwrap();
    let mut clip = Clip::new();
    let travel = clip.spec.session.travel;
    let begun = AtomicBool::new(true);
    let mut first = clip.hand(&begun);
    let (scene, _) = shipped("clip.toml");
    let (tool, _) = setup::tool(&scene).unwrap();
    let mesh = &clip.prepared.loaded.mesh;
    let held = clip.spec.session.held.other(&tool, mesh);
    // A grip of 2 kN/m, so that under 8 N it gives way by 4 mm.
    let hand = SimulatedHand::resting(Default::default(), held.start(), 1e-3).unwrap();
    let mut second = Simulated::new(SimulatedSettings::default(), hand).unwrap();
    let hands = Hands {
        first: &mut first,
        second: Some(SecondHand {
            device: &mut second,
            held,
            mapping: None,
            safety: SafetySettings::live(&Limits::virtuose_6d()).unwrap(),
        }),
    };
    let file = folder.path().join("two.mcap");
    let (report, steps) = clip.feel_with(hands, &file, |view| {
        view.update();
        let seen = view.output_buffer();
        let snapped = seen.snap.n_snaps_in > 0;
        snapped && seen.sample.is_some_and(|s| s.gone.travel > 0.9 * travel)
    });
    let guard = report.second.unwrap();
    assert_eq!(guard.failures, 0);
    let peak = report.snap.peak_force;
    assert!((peak / 8.44 - 1.0).abs() < 0.02, "{peak} N");
    // Where the force is largest the first handle is ahead of the tool's travel by coupling and the other hand.
    let start = clip.spec.session.held.start().translation;
    let direction = clip.spec.session.direction;
    let ahead = |step: &StepMessage| {
        let handle = DVec3::from_array(step.handle_position_m.map(Option::unwrap));
        (handle - start).dot(direction) - step.travel_m
    };
    let at_peak = (steps.iter()).max_by(|a, b| a.force_n.partial_cmp(&b.force_n).unwrap());
    let gave_way = ahead(at_peak.unwrap()) - peak / 2e4;
    let expected = peak / HandSettings::default().grip_stiffness;
    assert!(
        (gave_way / expected - 1.0).abs() < 0.1,
        "{gave_way} and {expected} m"
    );
}

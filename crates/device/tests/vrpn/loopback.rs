//! Our client against our server.

use std::time::Duration;

use device::driver::Opened;
use device::{
    HandSettings, Insertion, Readiness, Script, Simulated, SimulatedHand, SimulatedSettings,
};
use glam::DVec3;
use glamx::DPose3;

use crate::bench::{
    Serving, force, hand_at, open, push, push_until, read, tripped, wait_for_message, wait_until,
    with,
};

const WAYS: [&str; 3] = ["", "tcp://", "udp://"];

fn x_is(opened: &mut Opened, x: f64) -> bool {
    read(opened).is_some_and(|state| state.pose.translation.x == x)
}

#[test]
fn pose_and_buttons_arrive_and_the_device_knows_itself() {
    for way in WAYS {
        let hand = hand_at(0.01);
        with(&hand, |hand| hand.state.buttons = 0b101);
        let server = Serving::start(&hand);
        let mut opened = open(&server.name(way, ""));
        assert!(opened.device.name().starts_with("Hand0 (VRPN 07.38"));
        let limits = *opened.device.limits();
        // The workspace is the server's, the force is assumed and said so, torque there is none.
        assert_eq!(limits.workspace_half_extents, DVec3::splat(0.2));
        assert_eq!((limits.peak_force, limits.peak_torque), (3.3, 0.0));
        assert!(opened.notes.iter().any(|note| note.contains("no torque")));
        assert!(opened.notes.iter().any(|note| note.contains("?force=")));

        wait_until("pose", || x_is(&mut opened, 0.01));
        wait_until("buttons", || {
            read(&mut opened).is_some_and(|state| state.buttons == 0b101)
        });
        with(&hand, |hand| {
            hand.state.pose.translation.x = -0.02;
            hand.state.buttons = 0b10;
        });
        wait_until("next pose", || x_is(&mut opened, -0.02));
        wait_until("next buttons", || {
            read(&mut opened).is_some_and(|state| state.buttons == 0b10)
        });
        drop(opened);
        let report = server.end();
        assert_eq!((report.guests, report.refused, report.faults), (1, 0, 0));
    }
}

#[test]
fn force_field_arrives_and_is_evaluated_where_the_handle_is() {
    for (way, options) in [
        ("tcp://", "?force=10"),
        ("udp://", "?force=10"),
        ("tcp://", "?force=10&field=near"),
    ] {
        let hand = hand_at(0.05);
        let server = Serving::start(&hand);
        let mut opened = open(&server.name(way, options));
        assert_eq!(opened.device.limits().peak_force, 10.0);
        wait_until("pose", || x_is(&mut opened, 0.05));
        let command = push(DVec3::new(2.0, -1.0, 0.5), 200.0);
        let is_near = |wanted: DVec3| {
            let hand = &hand;
            move || (force(hand) - wanted).length() < 1e-3
        };
        push_until(
            &mut opened,
            &command,
            "force",
            is_near(command.wrench.force),
        );
        drop(opened);
        wait_until("no force", || force(&hand) == DVec3::ZERO);
        let report = server.end();
        assert!(report.fields > 0);
        assert_eq!(report.fields_refused, 0, "{way}{options}");
        // The client switched its force off before it left.
        assert_eq!(report.departures, 0);
        assert_eq!(with(&hand, |hand| hand.stops), 1);
    }
}

#[test]
fn stopped_loop_and_written_zero_let_the_force_go() {
    for way in WAYS {
        let hand = hand_at(0.0);
        let server = Serving::start(&hand);
        let mut opened = open(&server.name(way, ""));
        let command = push(DVec3::new(2.0, 0.0, 0.0), 0.0);
        push_until(&mut opened, &command, "force", || force(&hand).x > 1.9);
        opened.device.stop();
        wait_until("no force after the stop", || force(&hand) == DVec3::ZERO);
        push_until(&mut opened, &command, "force", || force(&hand).x > 1.9);
        // No write comes: the link fades it.
        wait_until("no force without writes", || force(&hand) == DVec3::ZERO);
        drop(opened);
        server.end();
    }
}

#[test]
fn server_killed_in_contact_is_silence_and_a_message_and_then_it_is_back() {
    let hand = hand_at(0.03);
    let server = Serving::start(&hand);
    let address = server.address;
    let mut opened = open(&server.name("", ""));
    let command = push(DVec3::new(1.0, 0.0, 0.0), 100.0);
    push_until(&mut opened, &command, "force", || force(&hand).x > 0.9);
    server.end();
    assert_eq!(force(&hand), DVec3::ZERO);
    wait_until("silence", || read(&mut opened).is_none());
    let message = wait_for_message(&opened, "is lost");
    assert!(message.contains("closed"), "{message}");

    let server = Serving::start_at(&hand, address);
    wait_for_message(&opened, "is back");
    wait_until("pose", || x_is(&mut opened, 0.03));
    push_until(&mut opened, &command, "force", || force(&hand).x > 0.9);
    drop(opened);
    server.end();
}

#[test]
fn device_that_trips_or_fails_at_the_server_does_so_at_the_client() {
    let hand = hand_at(0.03);
    let server = Serving::start(&hand);
    let mut opened = open(&server.name("", ""));
    wait_until("pose", || read(&mut opened).is_some());
    with(&hand, |hand| {
        hand.state.readiness = Readiness::Tripped("hand let go of the deadman");
    });
    wait_until("tripped", || tripped(&mut opened).is_some());
    wait_for_message(&opened, "hand let go of the deadman");
    with(&hand, |hand| hand.state.readiness = Readiness::Ready);
    wait_until("ready", || {
        read(&mut opened).is_some_and(|state| state.readiness == Readiness::Ready)
    });
    with(&hand, |hand| hand.is_failing = true);
    wait_until("silence", || read(&mut opened).is_none());
    wait_for_message(&opened, "unplugged");
    with(&hand, |hand| hand.is_failing = false);
    wait_until("pose again", || read(&mut opened).is_some());
    drop(opened);
    let report = server.end();
    assert!(report.read_failures > 0);
}

#[test]
fn second_client_sees_the_poses_and_is_told_that_the_device_is_held() {
    let hand = hand_at(0.03);
    let server = Serving::start(&hand);
    let mut first = open(&server.name("", ""));
    let mut second = open(&server.name("udp://", ""));
    let (right, left) = (
        push(DVec3::new(1.0, 0.0, 0.0), 0.0),
        push(DVec3::new(-2.0, 0.0, 0.0), 0.0),
    );
    push_until(&mut first, &right, "force", || force(&hand).x > 0.9);
    let mut told = String::new();
    wait_until("the second is told", || {
        first.device.write(&right).unwrap();
        second.device.write(&left).unwrap();
        assert!(read(&mut second).is_some());
        told.extend(second.messages.try_iter());
        told.contains("another client holds the device")
    });
    // The first leaves, the second may.
    drop(first);
    push_until(&mut second, &left, "force of the second", || {
        force(&hand).x < -1.9
    });
    drop(second);
    let report = server.end();
    assert_eq!(report.guests, 2);
    assert!(report.fields_refused > 0);
}

#[test]
fn client_that_only_looks_does_not_disturb_who_holds_the_device() {
    let hand = hand_at(0.03);
    let server = Serving::start(&hand);
    let mut opened = open(&server.name("", ""));
    let command = push(DVec3::new(1.0, 0.0, 0.0), 0.0);
    push_until(&mut opened, &command, "force", || force(&hand).x > 0.9);
    let wrong = format!("vrpn:NoSuch@{}", server.address);
    let looking = std::thread::spawn(move || device::driver::open(&wrong).unwrap_err());
    push_until(&mut opened, &command, "it has looked", || {
        looking.is_finished()
    });
    let looked = looking.join().unwrap().to_string();
    // What it looked for, and what there is.
    assert!(
        looked.contains("NoSuch") && looked.contains("Hand0"),
        "{looked}"
    );
    push_until(&mut opened, &command, "force", || force(&hand).x > 0.9);
    let told: Vec<String> = opened.messages.try_iter().collect();
    assert!(!told.iter().any(|m| m.contains("lost")), "{told:?}");
    drop(opened);
    let report = server.end();
    assert_eq!((report.guests, report.fields_refused), (2, 0));
    assert_eq!(report.departures, 0);
}

#[test]
fn simulated_device_is_served_as_it_moves() {
    let period_s = 1e-3;
    let script = Script::new(&Insertion {
        start: DPose3::IDENTITY,
        direction: DVec3::NEG_Z,
        speed: 0.05,
        travel: 0.02,
        hold_s: 30.0,
        retract: false,
    })
    .unwrap();
    let grip = SimulatedHand::new(HandSettings::default(), script, period_s).unwrap();
    let mut simulated = Simulated::new(SimulatedSettings::default(), grip).unwrap();
    let mut server = device::driver::vrpn::Server::bind("127.0.0.1:0", "Hand0").unwrap();
    let name = format!("vrpn:Hand0@{}?velocity=server", server.local_addr());
    let stop = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        let serving = scope.spawn(|| server.run(&mut simulated, period_s, &stop));
        let mut opened = open(&name);
        let mut fastest: f64 = 0.0;
        wait_until("the hand is where it goes", || {
            let Some(state) = read(&mut opened) else {
                return false;
            };
            fastest = fastest.max(-state.linear_velocity.z);
            (state.pose.translation.z + 0.02).abs() < 1e-4
        });
        // On a machine so loaded that not one sample was seen under way, 0; never more than the script's speed.
        assert!(fastest < 0.1, "{fastest}");
        // A wall holds the hand off: 2 kN/m of the grip against 2 N.
        let up = push(DVec3::new(0.0, 0.0, 2.0), 0.0);
        let mut z = f64::NAN;
        push_wall(&mut opened, &up, &mut z);
        assert!((z + 0.019).abs() < 2e-4, "{z}");
        drop(opened);
        stop.store(true, std::sync::atomic::Ordering::Relaxed);
        serving.join().unwrap().unwrap();
    });
}

fn push_wall(opened: &mut Opened, command: &device::Command, z: &mut f64) {
    wait_until("the hand gives way by a millimetre", || {
        opened.device.write(command).unwrap();
        if let Some(state) = read(opened) {
            *z = state.pose.translation.z;
        }
        std::thread::sleep(Duration::from_millis(1));
        (*z + 0.019).abs() < 1e-4
    });
}

//! What is made of each message, without a network.

use std::time::Duration;

use super::*;
use crate::driver::vrpn::message::Placement;

fn heard(place: &str) -> Heard {
    Heard::new(&Place::parse(place).unwrap())
}

fn from_hand(heard: &mut Heard, seconds: u32, message: Message) {
    let time = Timestamp { seconds, micros: 0 };
    let event = Event::Message {
        time,
        sender: "Hand0",
        message,
    };
    heard.note(event, Instant::now());
}

fn pose(x: f64) -> Message {
    Message::PosQuat(SensorPose {
        sensor: 0,
        at: Placement {
            position: [x, 0.0, 0.0],
            rotation: [0.0, 0.0, 0.0, 1.0],
        },
    })
}

fn x_of(state: &HandleState) -> f64 {
    state.pose.translation.x
}

fn text(text: &str) -> Message {
    Message::Text(Text {
        severity: 1,
        level: 0,
        text: text.to_owned(),
    })
}

#[test]
fn each_pose_is_handed_over_once_and_the_newest_only() {
    let mut heard = heard("Hand0@h");
    assert_eq!(heard.take_state(Instant::now()), None);
    from_hand(&mut heard, 1, pose(0.1));
    from_hand(&mut heard, 2, pose(0.2));
    let state = heard.take_state(Instant::now()).unwrap();
    assert_eq!(x_of(&state), 0.2);
    assert_eq!(heard.take_state(Instant::now()), None);
}

#[test]
fn datagram_that_comes_late_is_left_out_but_a_clock_may_be_set() {
    let mut heard = heard("Hand0@h");
    let at = |seconds, micros, x| Event::Message {
        time: Timestamp { seconds, micros },
        sender: "Hand0",
        message: pose(x),
    };
    heard.note(at(100, 2000, 0.2), Instant::now());
    heard.note(at(100, 1000, 0.1), Instant::now());
    assert_eq!(x_of(&heard.take_state(Instant::now()).unwrap()), 0.2);
    heard.note(at(7, 0, 0.3), Instant::now());
    assert_eq!(x_of(&heard.take_state(Instant::now()).unwrap()), 0.3);
}

#[test]
fn other_senders_and_sensors_are_not_listened_to() {
    let mut heard = heard("Hand0@h?sensor=1");
    from_hand(&mut heard, 1, pose(0.1));
    let other = Event::Message {
        time: Timestamp::default(),
        sender: "Tracker0",
        message: pose(0.1),
    };
    heard.note(other, Instant::now());
    assert_eq!(heard.take_state(Instant::now()), None);
}

#[test]
fn first_sender_of_poses_is_taken_where_none_is_named() {
    let mut heard = heard("");
    for name in [CONTROL, "Button0", "Hand0"] {
        heard.note(Event::Sender { id: 0, name }, Instant::now());
    }
    assert_eq!(heard.offered(), ["Button0", "Hand0"]);
    assert_eq!(heard.offered_name(), None);
    from_hand(&mut heard, 1, pose(0.1));
    assert_eq!(heard.offered_name(), Some("Hand0"));
}

#[test]
fn buttons_are_bits_and_numbers_beyond_are_left_out() {
    let mut heard = heard("Hand0@h");
    let change = |button, state| Message::ButtonChange { button, state };
    from_hand(&mut heard, 1, Message::ButtonStates(vec![1, 0, 7]));
    from_hand(&mut heard, 1, change(31, 1));
    from_hand(&mut heard, 1, change(0, 0));
    for button in [32, -1, i32::MIN, i32::MAX] {
        from_hand(&mut heard, 1, change(button, 1));
    }
    from_hand(&mut heard, 2, pose(0.0));
    let buttons = heard.take_state(Instant::now()).unwrap().buttons;
    assert_eq!(buttons, 1 << 31 | 0b100);
    from_hand(&mut heard, 1, Message::ButtonStates(vec![0; 256]));
    from_hand(&mut heard, 3, pose(0.0));
    assert_eq!(heard.take_state(Instant::now()).unwrap().buttons, 0);
}

#[test]
fn force_error_trips_for_a_while_or_until_all_is_well() {
    let mut heard = heard("Hand0@h");
    let readiness = |heard: &mut Heard, code: Option<i32>, later_s: f64| {
        if let Some(code) = code {
            from_hand(heard, 1, Message::ForceError(code));
        }
        from_hand(heard, 1, pose(0.0));
        let later = Instant::now() + Duration::from_secs_f64(later_s);
        heard.take_state(later).unwrap().readiness
    };
    assert_eq!(readiness(&mut heard, Some(0), 0.0), Readiness::Ready);
    for code in [1, 2, 3, 77, -5] {
        let tripped = readiness(&mut heard, Some(code), 0.0);
        assert!(matches!(tripped, Readiness::Tripped(_)), "{code}");
        assert_eq!(readiness(&mut heard, None, 1.1), Readiness::Ready);
    }
    assert_eq!(readiness(&mut heard, Some(4), 0.0), Readiness::Ready);
    let told: Vec<_> = std::iter::from_fn(|| heard.message()).collect();
    // Out of range, 1, 2, and one for all the others.
    assert_eq!(told.len(), 4, "{told:?}");
    assert!(told[1].contains("loop took too long"), "{told:?}");
}

#[test]
fn texts_are_told_once_each_and_not_for_ever() {
    let mut heard = heard("Hand0@h");
    for _ in 0..3 {
        from_hand(&mut heard, 1, text("motor temperature high"));
        from_hand(&mut heard, 1, text("  "));
    }
    let first = heard.message().unwrap();
    assert_eq!(first, "the server says: warning: motor temperature high");
    assert_eq!(heard.message(), None);
    for k in 0..10_000 {
        from_hand(&mut heard, 1, text(&k.to_string()));
    }
    assert_eq!(heard.told.len(), TEXTS_MAX);
    assert!(heard.to_tell.len() < TEXTS_MAX);
}

#[test]
fn velocity_of_the_server_counts_only_where_it_is_asked_for() {
    let motion = |rotation, interval_s| {
        Message::Velocity(Motion {
            sensor: 0,
            linear: [1.0, 2.0, 3.0],
            rotation,
            interval_s,
        })
    };
    // Half a radian about x within 0.1 s.
    let turn = [0.25_f64.sin(), 0.0, 0.0, 0.25_f64.cos()];
    let mut of_poses = heard("Hand0@h");
    from_hand(&mut of_poses, 1, motion(turn, 0.1));
    from_hand(&mut of_poses, 1, pose(0.0));
    let state = of_poses.take_state(Instant::now()).unwrap();
    assert_eq!(state.linear_velocity, DVec3::ZERO);

    let mut of_server = heard("Hand0@h?velocity=server");
    from_hand(&mut of_server, 1, motion(turn, 0.1));
    from_hand(&mut of_server, 1, pose(0.0));
    let state = of_server.take_state(Instant::now()).unwrap();
    assert_eq!(state.linear_velocity, DVec3::new(1.0, 2.0, 3.0));
    assert!((state.angular_velocity - DVec3::X * 5.0).length() < 1e-12);
    // What the Falcon's server sends is no turn; no interval is none either.
    for (rotation, interval_s) in [([0.0; 4], 1000.0), (turn, 0.0), (turn, f64::NAN)] {
        from_hand(&mut of_server, 2, motion(rotation, interval_s));
        from_hand(&mut of_server, 2, pose(0.0));
        let state = of_server.take_state(Instant::now()).unwrap();
        assert_eq!(state.angular_velocity, DVec3::ZERO);
    }
}

#[test]
fn numbers_that_are_no_pose_pass_and_the_guard_rejects_them() {
    use crate::safety::{Safety, SafetySettings};
    let mut heard = heard("Hand0@h");
    let limits = crate::haptic_device::Limits::virtuose_6d();
    let mut safety = Safety::new(SafetySettings::for_limits(&limits)).unwrap();
    let mut judge = |heard: &mut Heard, position, rotation| {
        let at = Placement { position, rotation };
        from_hand(heard, 1, Message::PosQuat(SensorPose { sensor: 0, at }));
        let state = heard.take_state(Instant::now()).unwrap();
        safety.accept_sample(Some(&state), 0.0, 1e-3);
        safety.events()
    };
    let unit = [0.0, 0.0, 0.0, 1.0];
    assert_eq!(judge(&mut heard, [0.0; 3], unit).samples_rejected(), 0);
    let events = judge(&mut heard, [f64::NAN, 0.0, 0.0], unit);
    assert_eq!(events.samples_non_finite, 1);
    let events = judge(&mut heard, [0.0; 3], [0.0; 4]);
    assert_eq!(events.samples_non_unit, 1);
    let events = judge(&mut heard, [0.0; 3], [0.0, 0.0, 0.0, 2.0]);
    assert_eq!(events.samples_non_unit, 2);
    let events = judge(&mut heard, [0.0; 3], unit);
    assert_eq!(
        events.samples_rejected(),
        3,
        "a good one goes through again"
    );
}

#[test]
fn workspace_of_the_server_is_taken_where_a_device_can_have_it() {
    let mut heard = heard("Hand0@h");
    let mut half = |min, max| {
        from_hand(&mut heard, 1, Message::Workspace(Workspace { min, max }));
        heard.workspace_half_extents()
    };
    assert_eq!(
        half([-0.1, 0.0, 0.0], [0.1, 0.2, 0.4]),
        Some(DVec3::new(0.1, 0.1, 0.2))
    );
    assert_eq!(half([0.0; 3], [0.0; 3]), None);
    assert_eq!(half([0.1; 3], [-0.1; 3]), None);
    assert_eq!(half([f64::NAN; 3], [0.1; 3]), None);
    assert_eq!(half([-1e30; 3], [1e30; 3]), None);
}

//! Each turn of the conversation, without a service.

use serde_json::{Value, json};

use super::*;
use crate::driver::haply::tests::recording::answer;
use crate::wrench::Wrench;

mod mutations;

const ID: &str = "049D";
const MS: Duration = Duration::from_millis(1);

/// A conversation that goes on, a millisecond an exchange.
struct Talk {
    talk: Conversation,
    now: Instant,
    answer: Value,
    /// The share of the force that the service renders, and in which form it takes it.
    renders: f64,
    takes: Form,
}

impl Talk {
    fn new() -> Self {
        Self {
            talk: Conversation::new(ID, 10.0, Form::Vector),
            now: Instant::now(),
            answer: answer(),
            renders: 1.0,
            takes: Form::Vector,
        }
    }

    /// One exchange: the force that was sent, N, and the state that came.
    fn exchange(&mut self, force: DVec3) -> (DVec3, Option<HandleState>) {
        self.now += MS;
        let command: Command = Wrench::new(force, DVec3::ZERO).into();
        let said: Value = serde_json::from_str(&self.talk.say(&command, self.now)).unwrap();
        let commands = &said["inverse3"][0]["commands"]["set_cursor_force"];
        let read = |form: Form| {
            let value = commands.get(form.member())?;
            Some(DVec3::from_array(
                ["x", "y", "z"].map(|axis| value[axis].as_f64().unwrap()),
            ))
        };
        let taken = read(self.takes).unwrap_or(DVec3::ZERO) * self.renders;
        self.answer["inverse3"][0]["state"]["current_cursor_force"] =
            json!({"x": taken.x, "y": taken.y, "z": taken.z});
        let state = self.talk.hear(&self.answer.to_string(), self.now).unwrap();
        let sent = read(Form::Vector).or(read(Form::Values)).unwrap();
        (sent, state)
    }

    /// Exchanges with 2 N up for a time; the last force sent and the last state.
    fn push_for(&mut self, ms: u32) -> (DVec3, HandleState) {
        let mut last = None;
        for _ in 0..ms {
            let (sent, state) = self.exchange(UP);
            last = Some((sent, state.unwrap()));
        }
        last.unwrap()
    }

    fn event(&mut self, name: &str, level: &str, data: Value) -> Result<(), DeviceError> {
        let event = json!({"name": name, "category": "device", "level": level, "data": data, "message": "own words"});
        self.talk.hear_event(&event.to_string(), self.now)
    }

    fn safety(&mut self, kind: &str, level: &str) {
        let data = json!({"device_family": "inverse", "device_id": ID, "safety_type": kind});
        self.event("device-safety-triggered", level, data).unwrap();
    }

    fn messages(&mut self) -> Vec<String> {
        std::iter::from_fn(|| self.talk.message()).collect()
    }

    fn status(&mut self, name: &str, value: Value) {
        self.answer["inverse3"][0]["status"][name] = value;
    }

    fn grip(&mut self) -> &mut Value {
        &mut self.answer["wireless_verse_grip"][0]
    }
}

const UP: DVec3 = DVec3::new(0.0, 0.0, 2.0);

#[test]
fn state_is_that_of_the_answer() {
    let mut talk = Talk::new();
    let (_, state) = talk.exchange(DVec3::ZERO);
    let state = state.unwrap();
    let read = Frame::decode(&talk.answer.to_string()).unwrap();
    assert_eq!(Some(state.pose.translation), read.devices[0].position);
    assert_eq!(Some(state.linear_velocity), read.devices[0].velocity);
    assert_eq!(Some(state.pose.rotation), read.grips[0].orientation);
    assert_eq!(state.angular_velocity, DVec3::ZERO);
    assert_eq!(state.hand, HandPresence::Unknown);
    assert_eq!(state.readiness, Readiness::Ready);
    assert_eq!(
        talk.messages(),
        ["orientation and buttons come from grip 1102"]
    );
}

#[test]
fn force_goes_out_as_it_is_wanted_once_the_device_has_spoken() {
    let mut talk = Talk::new();
    assert_eq!(
        talk.exchange(UP).0,
        DVec3::ZERO,
        "nothing is known of the device yet"
    );
    assert_eq!(talk.exchange(UP).0, UP);
    // Beyond what the device can, in the same direction; and what is no number not at all.
    assert!((talk.exchange(UP * 100.0).0 - DVec3::new(0.0, 0.0, 10.0)).length() < 1e-12);
    assert_eq!(talk.exchange(DVec3::new(f64::NAN, 0.0, 1.0)).0, DVec3::ZERO);
    assert_eq!(talk.exchange(UP).0, UP);
}

#[test]
fn force_is_withheld_until_the_device_has_all_it_needs() {
    for (name, value, why) in [
        ("calibrated", json!(false), "not calibrated"),
        ("calibrated", Value::Null, "not calibrated"),
        ("ready", json!(false), "ready"),
        ("ready", json!("of another version"), "ready"),
        ("power_supply", json!(false), "power"),
    ] {
        let mut talk = Talk::new();
        talk.status(name, value);
        let (sent, state) = talk.push_for(5);
        assert_eq!(sent, DVec3::ZERO);
        let Readiness::Waiting(said) = state.readiness else {
            panic!("{name}: {:?}", state.readiness);
        };
        assert!(said.contains(why), "{said}");
        // It comes, and the force a moment later, when the loop must have seen that it was away.
        talk.status(name, json!(true));
        assert_eq!(talk.push_for(50).0, DVec3::ZERO);
        let (sent, state) = talk.push_for(60);
        assert_eq!((sent, state.readiness), (UP, Readiness::Ready), "{name}");
    }
}

#[test]
fn status_that_is_left_out_is_as_it_was() {
    let mut talk = Talk::new();
    talk.push_for(2);
    talk.answer["inverse3"][0]
        .as_object_mut()
        .unwrap()
        .remove("status");
    assert_eq!(talk.push_for(10).1.readiness, Readiness::Ready);
}

#[test]
fn device_that_another_program_drives_is_waited_for() {
    let mut talk = Talk::new();
    talk.status("in_use", json!(false));
    // Our forces are rendered: whatever `in_use` means, the device is ours.
    assert_eq!(talk.push_for(5).1.readiness, Readiness::Ready);
    talk.answer["inverse3"][0]["state"]["control_mode"] = json!("position");
    let (sent, state) = talk.push_for(5);
    assert_eq!(sent, DVec3::ZERO);
    assert!(matches!(state.readiness, Readiness::Waiting(why) if why.contains("in_use")));
}

#[test]
fn each_safety_event_trips_zeroes_and_is_told_in_the_services_words() {
    for (kind, ends) in [
        ("ebrake_triggered", Some(("ebrake_released", "notice"))),
        ("fod_stage_changed", Some(("fod_stage_changed", "info"))),
        ("stall_detected", None),
        ("stability_ceiling", None),
    ] {
        let mut talk = Talk::new();
        assert_eq!(talk.push_for(3).0, UP);
        talk.messages();
        talk.safety(kind, "warning");
        let (sent, state) = talk.push_for(1);
        assert_eq!(sent, DVec3::ZERO, "{kind}");
        assert!(matches!(state.readiness, Readiness::Tripped(_)), "{kind}");
        talk.safety(kind, "warning");
        let told = talk.messages();
        assert!(
            told[0].contains(kind) && told[0].contains("own words"),
            "{told:?}"
        );
        assert_eq!(told.len(), 1, "once: {told:?}");
        // Those with an end wait for it; the others pass.
        let (sent, _) = talk.push_for(1500);
        match ends {
            None => assert_eq!(sent, UP, "{kind}"),
            Some((end, level)) => {
                assert_eq!(sent, DVec3::ZERO, "{kind}");
                talk.safety(end, level);
                assert_eq!(talk.push_for(200).0, UP, "{end}");
            }
        }
    }
}

#[test]
fn brake_is_told_each_time() {
    let mut talk = Talk::new();
    for _ in 0..3 {
        talk.now += Duration::from_secs(2);
        talk.safety("ebrake_triggered", "error");
        talk.safety("ebrake_released", "notice");
    }
    assert_eq!(talk.messages().len(), 6);
}

#[test]
fn disconnection_of_the_device_ends_the_link_and_of_another_does_not() {
    let mut talk = Talk::new();
    talk.push_for(2);
    talk.messages();
    let other = json!({"device_id": "OTHER"});
    talk.event("device-disconnected", "warning", other).unwrap();
    assert_eq!(talk.messages(), [""; 0]);
    talk.event(
        "device-disconnected",
        "warning",
        json!({"device_id": "1102"}),
    )
    .unwrap();
    assert_eq!(talk.messages().len(), 1, "the grip is told");
    let gone = talk.event(
        "device-disconnected",
        "warning",
        json!({"device_id": "049d"}),
    );
    assert!(matches!(gone, Err(DeviceError::Gone { .. })), "{gone:?}");
}

#[test]
fn busy_device_waits_and_other_warnings_are_told_once() {
    let mut talk = Talk::new();
    talk.push_for(2);
    talk.messages();
    talk.event("device-busy", "warning", json!({"device_id": ID}))
        .unwrap();
    let (sent, state) = talk.push_for(1);
    assert_eq!(sent, DVec3::ZERO);
    assert!(matches!(state.readiness, Readiness::Waiting(_)));
    for _ in 0..5 {
        for (name, level, data) in [
            (
                "device-battery-low",
                "warning",
                json!({"device_id": "1102"}),
            ),
            (
                "device-battery-critical",
                "error",
                json!({"device_id": "1102"}),
            ),
            ("device-sleep", "info", json!({"device_id": "1102"})),
            ("session-control-rate-low", "warning", json!({})),
            ("session-opened", "info", json!({})),
            (
                "device-battery-low",
                "warning",
                json!({"device_id": "of another"}),
            ),
        ] {
            talk.event(name, level, data).unwrap();
        }
    }
    let told = talk.messages();
    let names = [
        "busy",
        "battery-low",
        "battery-critical",
        "sleep",
        "rate-low",
    ];
    assert_eq!(told.len(), names.len(), "{told:?}");
    for name in names {
        assert!(told.iter().any(|text| text.contains(name)), "{name}");
    }
    assert_eq!(
        talk.push_for(1200).0,
        UP,
        "none of these but the first holds the force"
    );
}

#[test]
fn critical_event_of_the_service_trips() {
    let mut talk = Talk::new();
    talk.push_for(2);
    talk.event("system-failure", "panic", json!({})).unwrap();
    assert!(matches!(
        talk.push_for(1).1.readiness,
        Readiness::Tripped(_)
    ));
}

#[test]
fn lost_events_are_told_and_end_the_link_only_under_an_alarm() {
    let mut talk = Talk::new();
    talk.talk.lose_events("reset", talk.now).unwrap();
    assert!(talk.messages()[0].contains("reset"));
    talk.safety("ebrake_triggered", "error");
    assert!(talk.talk.lose_events("reset", talk.now).is_err());
}

#[test]
fn weakened_force_is_told_with_both_numbers() {
    let mut talk = Talk::new();
    talk.push_for(2);
    talk.messages();
    talk.renders = 0.3;
    talk.push_for(2500);
    let told = talk.messages();
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(
        told[0].contains("of 2.0 N sent only 0.6 N are felt"),
        "{told:?}"
    );
}

#[test]
fn force_that_is_not_taken_is_given_in_the_other_form_after_a_new_arming() {
    let mut talk = Talk::new();
    talk.takes = Form::Values;
    talk.push_for(2);
    talk.messages();
    let mut was_tripped = false;
    for _ in 0..1000 {
        let (sent, state) = talk.exchange(UP);
        let tripped = matches!(state.unwrap().readiness, Readiness::Tripped(_));
        if was_tripped && tripped {
            assert_eq!(sent, DVec3::ZERO);
        }
        was_tripped |= tripped;
    }
    assert!(was_tripped);
    let told = talk.messages();
    assert!(
        told[0].contains("\"vector\"") && told[0].contains("\"values\""),
        "{told:?}"
    );
    assert_eq!(talk.push_for(1000).0, UP);
    assert_eq!(talk.talk.form, Form::Values);
    // A service that takes neither is told once, and not asked to and fro.
    talk.renders = 0.0;
    talk.push_for(3000);
    assert_eq!(talk.talk.form, Form::Values);
    assert_eq!(talk.messages().len(), 1);
}

#[test]
fn form_that_has_worked_is_not_changed_later() {
    let mut talk = Talk::new();
    talk.push_for(500);
    talk.messages();
    talk.renders = 0.0;
    talk.push_for(2000);
    assert_eq!(talk.talk.form, Form::Vector);
    let told = talk.messages();
    assert_eq!(
        told,
        ["the service renders nothing of the force that is sent"]
    );
}

#[test]
fn late_answer_takes_the_force_away_until_it_is_armed_anew() {
    let mut talk = Talk::new();
    assert_eq!(talk.push_for(2).0, UP);
    talk.now += STALL;
    let zero: Value = serde_json::from_str(&talk.talk.be_late(talk.now)).unwrap();
    assert_eq!(
        zero["inverse3"][0]["commands"]["set_cursor_force"]["vector"]["z"],
        0.0
    );
    let (sent, state) = talk.push_for(1);
    assert_eq!(sent, DVec3::ZERO);
    assert!(matches!(state.readiness, Readiness::Tripped(_)));
    assert_eq!(talk.push_for(1200).0, UP);
}

#[test]
fn device_that_tells_nothing_gets_no_force_and_at_last_the_link_ends() {
    for useless in [
        json!({"inverse3": []}),
        json!({"inverse3": [{"device_id": ID, "state": {}}]}),
        json!("of another version"),
    ] {
        let mut talk = Talk::new();
        assert_eq!(talk.push_for(2).0, UP);
        talk.messages();
        let text = useless.to_string();
        let command: Command = Wrench::new(UP, DVec3::ZERO).into();
        let mut n = 0;
        let gone = loop {
            talk.now += MS;
            n += 1;
            let said = talk.talk.say(&command, talk.now);
            if n > 51 {
                assert!(said.contains(r#""z":0.0"#), "{said}");
            }
            match talk.talk.hear(&text, talk.now) {
                Ok(state) => assert_eq!(state, None),
                Err(gone) => break gone,
            }
        };
        assert_eq!(n, USELESS_MAX);
        assert!(gone.to_string().contains(ID));
        assert_eq!(talk.messages().len(), 1);
    }
}

#[test]
fn device_that_was_not_told_of_for_a_while_must_be_armed_anew() {
    let mut talk = Talk::new();
    assert_eq!(talk.push_for(2).0, UP);
    let position = talk.answer["inverse3"][0]["state"]["cursor_position"].take();
    for _ in 0..60 {
        assert_eq!(talk.exchange(UP).1, None);
    }
    talk.answer["inverse3"][0]["state"]["cursor_position"] = position;
    let (sent, state) = talk.push_for(1);
    assert_eq!(sent, DVec3::ZERO);
    assert!(matches!(state.readiness, Readiness::Tripped(_)));
    assert_eq!(talk.push_for(1200).0, UP);
}

#[test]
fn grip_gives_orientation_and_buttons_and_may_sleep() {
    let mut talk = Talk::new();
    talk.answer["wireless_verse_grip"] = json!([]);
    let body = talk.push_for(3).1;
    let read = Frame::decode(&talk.answer.to_string()).unwrap();
    assert!(
        body.pose
            .rotation
            .angle_between(read.devices[0].body.unwrap())
            < 1e-9
    );
    assert_eq!(body.buttons, 0);

    talk.answer["wireless_verse_grip"] = answer()["wireless_verse_grip"].clone();
    talk.grip()["state"]["buttons"]["b"] = json!(true);
    let state = talk.push_for(400).1;
    let read = Frame::decode(&talk.answer.to_string()).unwrap();
    let told = read.grips[0].orientation.unwrap();
    assert!(state.pose.rotation.angle_between(told) < 1e-3);
    assert_eq!(state.buttons & 0b10, 0b10);

    talk.messages();
    talk.grip()["status"]["awake"] = json!(false);
    talk.grip()["state"]["orientation"] = json!({"w": 1, "x": 0, "y": 0, "z": 0});
    let asleep = talk.push_for(100).1;
    assert!(asleep.pose.rotation.angle_between(told) < 1e-3, "it stays");
    assert_eq!(asleep.buttons, 0);
    assert_eq!(asleep.readiness, Readiness::Ready);
    assert!(talk.messages()[0].contains("asleep"));

    talk.grip()["status"]["awake"] = json!(true);
    talk.grip()["state"]["battery_level"] = json!(0.08);
    talk.push_for(10);
    assert_eq!(talk.messages(), ["grip 1102 has 8 % of its charge left"]);
}

#[test]
fn velocity_that_is_not_told_is_zero_and_said() {
    let mut talk = Talk::new();
    talk.answer["inverse3"][0]["state"]
        .as_object_mut()
        .unwrap()
        .remove("cursor_velocity");
    assert_eq!(talk.push_for(3).1.linear_velocity, DVec3::ZERO);
    assert!(
        talk.messages()
            .iter()
            .any(|text| text.contains("no velocity"))
    );
}

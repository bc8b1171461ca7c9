//! Which field is sent, and when, against an end of the test's own.

use super::*;
use crate::driver::vrpn::endpoint::tests::{messages, pair};
use crate::wrench::Wrench;

fn link(place: &str) -> (VrpnLink, Endpoint) {
    let (ours, others) = pair();
    let mut endpoint = Endpoint::new(ours, false).unwrap();
    endpoint.describe("Hand0", SENT);
    let mut link = VrpnLink::new(endpoint, &Place::parse(place).unwrap());
    let mut server = Endpoint::new(others, false).unwrap();
    server.describe("Hand0", Kind::ALL);
    server.send(Service::Reliable, &Message::Force([0.0; 3]));
    server.flush().unwrap();
    while link.heard.force().is_none() {
        link.listen(WAIT).unwrap();
    }
    (link, server)
}

fn push(x: f64) -> Command {
    Wrench::new(DVec3::new(x, 0.0, 0.0), DVec3::ZERO).into()
}

fn fields(link: &mut VrpnLink, server: &mut Endpoint, wanted: usize) -> Vec<ForceField> {
    link.endpoint.flush().unwrap();
    let messages = messages(server, wanted);
    let field = |message| match message {
        Message::ForceField(field) => field,
        other => panic!("{other:?}"),
    };
    messages.into_iter().map(field).collect()
}

#[test]
fn command_belongs_to_the_pose_that_the_loop_has_had_time_to_read() {
    let (mut link, mut server) = link("Hand0@h?field=near");
    let now = Instant::now();
    // No pose, no position, no field.
    link.send_field(&push(1.0), now);
    assert_eq!(link.sent, ForceField::OFF);

    link.given_before = Some(DVec3::new(0.1, 0.0, 0.0));
    link.given = Some((DVec3::new(0.2, 0.0, 0.0), now));
    link.send_field(&push(1.0), now);
    link.send_field(&push(1.0), now + Duration::from_millis(1));
    let origins: Vec<f32> = fields(&mut link, &mut server, 2)
        .iter()
        .map(|field| field.origin[0])
        .collect();
    assert_eq!(origins, [0.1, 0.2]);
}

#[test]
fn no_force_is_said_at_once_repeated_for_a_while_and_then_now_and_then() {
    let (mut link, mut server) = link("Hand0@h");
    let now = Instant::now();
    let later = |ms| now + Duration::from_millis(ms);
    link.given = Some((DVec3::ZERO, now));
    link.send_field(&push(1.0), now);
    // On the connection twice: as what must arrive, and as the newest.
    link.send_field(&push(0.0), later(1));
    link.send_field(&push(0.0), later(2));
    // Said 98 ms ago: not again yet; 148 ms ago: again.
    link.send_field(&push(0.0), later(100));
    link.send_field(&push(0.0), later(150));
    link.send_field(&push(0.0), later(210));
    link.send_field(&push(2.0), later(211));
    let sent: Vec<f32> = fields(&mut link, &mut server, 7)
        .iter()
        .map(|field| field.force[0])
        .collect();
    assert_eq!(sent, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0]);
}

#[test]
fn server_that_knows_no_forces_is_sent_none() {
    let (ours, _others) = pair();
    let endpoint = Endpoint::new(ours, false).unwrap();
    let mut link = VrpnLink::new(endpoint, &Place::parse("Tracker0@h").unwrap());
    link.given = Some((DVec3::ZERO, Instant::now()));
    link.send_field(&push(1.0), Instant::now());
    assert_eq!(link.sent, ForceField::OFF);
}

#[test]
fn pose_that_stays_away_is_told_while_the_server_answers() {
    let (mut link, mut server) = link("Hand0@h");
    server.send(
        Service::Reliable,
        &Message::PosQuat(crate::driver::vrpn::message::SensorPose {
            sensor: 0,
            at: crate::driver::vrpn::message::Placement {
                position: [0.0; 3],
                rotation: [0.0, 0.0, 0.0, 1.0],
            },
        }),
    );
    server.flush().unwrap();
    while !link.heard.has_pose() {
        link.listen(WAIT).unwrap();
    }
    link.keep_alive(Instant::now()).unwrap();
    assert_eq!(link.message(), None);
    let later = |s| Instant::now() + Duration::from_secs_f64(s);
    link.keep_alive(later(1.5)).unwrap();
    let told = link.message().unwrap();
    assert!(told.contains("no pose"), "{told}");
    link.endpoint.flush().unwrap();
    assert_eq!(messages(&mut server, 1), [Message::Ping]);
    let lost = link.keep_alive(later(3.5)).unwrap_err();
    assert!(matches!(lost, DeviceError::Gone { .. }));
}

//! Listing, with and without a server.

use std::net::TcpListener;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use glamx::DPose3;

use super::*;
use crate::hand::{HandSettings, SimulatedHand};
use crate::script::{Insertion, Script};
use crate::{Simulated, SimulatedSettings};

fn at(server: std::net::SocketAddr) -> Place {
    Place::parse(&format!("any@{server}")).unwrap()
}

fn simulated() -> Simulated {
    let script = Script::new(&Insertion {
        start: DPose3::IDENTITY,
        direction: DVec3::NEG_Z,
        speed: 0.05,
        travel: 0.01,
        hold_s: 1.0,
        retract: false,
    })
    .unwrap();
    let hand = SimulatedHand::new(HandSettings::default(), script, 1e-3).unwrap();
    Simulated::new(SimulatedSettings::default(), hand).unwrap()
}

#[test]
fn devices_of_a_server_are_listed_by_the_names_that_open_them() {
    let mut server = Server::bind("127.0.0.1:0", "Hand0").unwrap();
    let address = server.local_addr();
    let stop = AtomicBool::new(false);
    let listings = std::thread::scope(|scope| {
        let serving = scope.spawn(|| server.run(&mut simulated(), 1e-3, &stop));
        let listings = list_at(&at(address));
        stop.store(true, Ordering::Relaxed);
        serving.join().unwrap().unwrap();
        listings
    });
    assert_eq!(listings.len(), 1);
    assert_eq!(listings[0].name, format!("vrpn:Hand0@{address}"));
    assert_eq!(listings[0].status, Ok("VRPN 07.38 server".to_owned()));
}

#[test]
fn no_server_and_what_is_none_are_listed_with_what_to_give() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    // Takes the connection and says nothing.
    let [silent] = &list_at(&at(address))[..] else {
        panic!("one entry");
    };
    assert!(
        silent
            .status
            .as_ref()
            .unwrap_err()
            .to_string()
            .contains("says nothing")
    );
    drop(listener);
    let [nobody] = &list_at(&at(address))[..] else {
        panic!("one entry");
    };
    assert_eq!(nobody.name, "vrpn");
    let why = nobody.status.as_ref().unwrap_err().to_string();
    assert!(why.contains("vrpn:NAME@HOST[:PORT]"), "{why}");
}

#[test]
fn family_is_found_by_its_key_and_always_listed() {
    assert!(!Vrpn.list().is_empty());
    assert_eq!(Vrpn.key(), "vrpn");
    let error = crate::driver::open("vrpn:@").unwrap_err();
    assert!(matches!(error, Unavailable::UnknownName { .. }), "{error}");
}

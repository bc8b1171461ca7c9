//! Integration, its ends, and what may stand after a question mark.

use super::*;
use crate::wrench::rotation_vector;

fn push(linear: DVec3, angular: DVec3) -> Input {
    Input {
        linear,
        angular,
        buttons: 0,
    }
}

#[test]
fn full_deflection_for_a_second_is_the_speed_and_the_turn() {
    let settings = RateSettings {
        speed: 0.05,
        turn: 0.8,
    };
    let mut handle = RateHandle::new(settings);
    let input = push(DVec3::new(1.0, 0.0, -0.5), DVec3::new(0.0, 0.0, 1.0));
    let mut state = handle.advance(&input, 0.0);
    for _ in 0..1000 {
        state = handle.advance(&input, 1e-3);
    }
    let expected = DVec3::new(0.05, 0.0, -0.025);
    assert!((state.pose.translation - expected).length() < 1e-12);
    assert!((state.linear_velocity - expected).length() < 1e-15);
    let turn = rotation_vector(state.pose.rotation);
    assert!((turn - DVec3::new(0.0, 0.0, 0.8)).length() < 1e-12);
    assert_eq!(state.angular_velocity, DVec3::new(0.0, 0.0, 0.8));
    // Let go: it stands at once.
    let rest = handle.advance(&Input::default(), 1e-3);
    assert_eq!(rest.pose, state.pose);
    assert_eq!(rest.linear_velocity, DVec3::ZERO);
}

/// Turns add up in the axes of the device, not of the handle: a quarter about x, then one about z.
#[test]
fn turns_are_about_the_axes_of_the_device() {
    let quarter = RateSettings {
        speed: 0.05,
        turn: std::f64::consts::FRAC_PI_2,
    };
    let mut handle = RateHandle::new(quarter);
    for axis in [DVec3::X, DVec3::Z] {
        for _ in 0..1000 {
            handle.advance(&push(DVec3::ZERO, axis), 1e-3);
        }
    }
    let up = handle.pose.rotation * DVec3::Z;
    assert!((up - DVec3::X).length() < 1e-9, "{up}");
}

#[test]
fn handle_stands_at_the_end_of_its_reach_and_comes_back_at_once() {
    let mut handle = RateHandle::new(RateSettings {
        speed: 1.0,
        turn: 0.8,
    });
    let out = push(DVec3::new(1.0, 0.5, 0.0), DVec3::ZERO);
    let mut state = handle.advance(&out, 0.0);
    for _ in 0..600 {
        state = handle.advance(&out, 1e-3);
    }
    assert_eq!(state.pose.translation.x, REACH);
    assert_eq!(state.linear_velocity, DVec3::new(0.0, 0.5, 0.0));
    let back = handle.advance(&push(DVec3::NEG_X, DVec3::ZERO), 1e-3);
    assert_eq!(back.linear_velocity.x, -1.0);
    assert!(back.pose.translation.x < REACH);
}

#[test]
fn stall_moves_the_handle_no_further_than_a_sample_may_be_old() {
    let mut handle = RateHandle::new(RateSettings::default());
    let input = push(DVec3::X, DVec3::ZERO);
    let state = handle.advance(&input, 30.0);
    assert!((state.pose.translation.x - 0.05 * STALE_S).abs() < 1e-15);
    let same = handle.advance(&input, -1.0);
    assert_eq!(same.pose, state.pose);
}

#[test]
fn share_is_zero_in_the_dead_zone_and_has_no_step_at_its_end() {
    assert_eq!(share(5.0, 350.0, 5.0), 0.0);
    assert_eq!(share(-4.0, 350.0, 5.0), 0.0);
    assert!(share(5.1, 350.0, 5.0) < 1e-3);
    assert_eq!(share(350.0, 350.0, 5.0), 1.0);
    assert_eq!(share(-32768.0, 350.0, 5.0), -1.0);
    assert!((share(-177.5, 350.0, 5.0) + 0.5).abs() < 1e-12);
    // A range that makes no sense deflects nothing.
    assert_eq!(share(3.0, 0.0, 0.0), 0.0);
    assert_eq!(share(0.0, 1.0, 2.0), 0.0);
    assert_eq!(share(f64::NAN, 1.0, 0.1), 0.0);
    assert_eq!(share(1.0, f64::NAN, 0.1), 0.0);
}

#[test]
fn options_after_the_question_mark_are_read_or_refused_with_the_mend() {
    let (path, settings) = split_place("spnav", "/run/spnav.sock?speed=0.1&turn=2").unwrap();
    assert_eq!(path, "/run/spnav.sock");
    assert_eq!((settings.speed, settings.turn), (0.1, 2.0));
    assert_eq!(
        split_place("spnav", "").unwrap(),
        ("", RateSettings::default())
    );
    assert_eq!(split_place("spnav", "?turn=1").unwrap().1.turn, 1.0);
    for wrong in [
        "?speed=0",
        "?speed=-1",
        "?speed=nan",
        "?speed=inf",
        "?speed=2",
        "?speed",
        "?speed=",
        "?turn=1e9",
        "?sped=1",
        "?speed=0.1;turn=1",
    ] {
        let refused = split_place("spnav", wrong).unwrap_err().to_string();
        assert!(refused.contains("spnav:?"), "{refused}");
        assert!(refused.contains("speed=M_PER_S"), "{refused}");
    }
}

struct Fixed(Input);

impl RateSource for Fixed {
    fn poll(&mut self, _now_s: f64) -> Result<Input, DeviceError> {
        Ok(self.0)
    }

    fn close(&mut self) {}
}

/// A device that was lost and opened again goes on from where the handle was: no jump for the tool.
#[test]
fn handle_outlives_its_link() {
    let handle = Arc::new(Mutex::new(RateHandle::new(RateSettings::default())));
    let identity = Identity {
        name: "fixed".to_owned(),
        limits: limits(0.0),
        notes: Vec::new(),
    };
    let moving = push(DVec3::X, DVec3::ZERO);
    let (_, mut first) = connected(identity.clone(), Fixed(moving), &handle);
    std::thread::sleep(std::time::Duration::from_millis(2));
    let left = first.exchange(&Command::ZERO).unwrap().unwrap();
    assert!(left.pose.translation.x > 0.0);
    first.close();
    let (_, mut second) = connected(identity, Fixed(Input::default()), &handle);
    let found = second.exchange(&Command::ZERO).unwrap().unwrap();
    assert_eq!(found.pose, left.pose);
}

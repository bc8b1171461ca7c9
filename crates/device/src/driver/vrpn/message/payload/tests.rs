//! Sizes, counts and texts.

use super::*;

/// Sizes of the payloads as VRPN's library sends them, bytes.
const SIZES: &[(Kind, usize)] = &[
    (Kind::Ping, 0),
    (Kind::Pong, 0),
    (Kind::Text, 1032),
    (Kind::PosQuat, 64),
    (Kind::Velocity, 72),
    (Kind::Acceleration, 72),
    (Kind::ToRoom, 56),
    (Kind::UnitToSensor, 64),
    (Kind::Workspace, 48),
    (Kind::RequestToRoom, 0),
    (Kind::RequestUnitToSensor, 0),
    (Kind::RequestWorkspace, 0),
    (Kind::SetUpdateRate, 8),
    (Kind::ResetOrigin, 0),
    (Kind::ButtonChange, 8),
    (Kind::ButtonStates, 4),
    (Kind::Analog, 8),
    (Kind::Dial, 12),
    (Kind::Force, 24),
    (Kind::SurfaceContact, 56),
    (Kind::ForceError, 4),
    (Kind::ForceField, 64),
    (Kind::Plane, 40),
    (Kind::PlaneEffects, 24),
    (Kind::CustomEffect, 8),
];

#[test]
fn each_kind_has_one_size_and_its_name_leads_back() {
    assert_eq!(SIZES.len(), Kind::ALL.len());
    for (kind, size) in SIZES {
        assert_eq!(Kind::from_name(kind.name()), Some(*kind));
        let message = Message::decode(*kind, &vec![0; *size]).unwrap();
        assert_eq!(message.kind(), *kind);
        let mut payload = Vec::new();
        message.encode_into(&mut payload);
        assert_eq!(payload.len(), *size, "{kind:?}");
        assert!(Message::decode(*kind, &vec![0; *size + 1]).is_err() || *kind == Kind::Text);
        if *size > 0 && *kind != Kind::Text {
            let error = Message::decode(*kind, &vec![0; *size - 1]).unwrap_err();
            assert!(error.to_string().contains(kind.name()), "{error}");
        }
    }
}

#[test]
fn counts_that_the_payload_does_not_bear_out_are_refused() {
    let with_count = |count: &[u8], kind, rest: usize| {
        let mut payload = count.to_vec();
        payload.resize(count.len() + rest, 0);
        Message::decode(kind, &payload)
    };
    for count in [-1_i32, 3, 257, i32::MAX] {
        assert!(with_count(&count.to_be_bytes(), Kind::ButtonStates, 8).is_err());
    }
    assert!(with_count(&2_i32.to_be_bytes(), Kind::ButtonStates, 8).is_ok());
    for count in [-1.0, 0.5, 3.0, 129.0, 1e300, f64::NAN, f64::INFINITY] {
        assert!(with_count(&f64::to_be_bytes(count), Kind::Analog, 16).is_err());
    }
    assert!(with_count(&2_f64.to_be_bytes(), Kind::Analog, 16).is_ok());
    let effect = [0, 0, 0, 1, 255, 255, 255, 255];
    assert!(with_count(&effect, Kind::CustomEffect, 8).is_err());
}

#[test]
fn text_ends_at_the_nul_and_carries_no_control_characters() {
    let mut payload = vec![0, 0, 0, 1, 0, 0, 0, 2];
    payload.extend(b"motor \x1b[31mhot\xff\0garbage\xfe\xfd");
    let Message::Text(text) = Message::decode(Kind::Text, &payload).unwrap() else {
        unreachable!();
    };
    assert_eq!((text.severity, text.level), (1, 2));
    assert_eq!(text.text, "motor  [31mhot\u{fffd}");
    let long = Text {
        text: "x".repeat(3000),
        ..text
    };
    let mut payload = Vec::new();
    Message::Text(long).encode_into(&mut payload);
    let Message::Text(text) = Message::decode(Kind::Text, &payload).unwrap() else {
        unreachable!();
    };
    assert_eq!(text.text.len(), TEXT_LEN - 1);
}

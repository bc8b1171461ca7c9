//! Frames and greetings, good and bad.

use super::*;

fn frames(decoder: &mut Decoder, bytes: &[u8]) -> Result<Vec<(i32, Vec<u8>)>, ProtocolError> {
    let mut found = Vec::new();
    decoder.push(bytes, |frame| {
        found.push((frame.kind, frame.payload.to_vec()));
        Ok(())
    })?;
    Ok(found)
}

fn frame(kind: i32, payload: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    let time = Timestamp::default();
    let sender = 1;
    Frame {
        time,
        sender,
        kind,
        payload,
    }
    .append_to(&mut out, 0);
    out
}

#[test]
fn length_counts_the_payload_without_what_fills_it_up() {
    let bytes = frame(3, b"Hand0\0");
    assert_eq!(bytes.len(), 32);
    assert_eq!(bytes[..4], 30_u32.to_be_bytes());
    assert_eq!(frame(3, b"").len(), 24);
    assert_eq!(frame(3, &[0; 8]).len(), 32);
}

#[test]
fn stream_in_any_pieces_gives_the_same_frames() {
    let mut stream = COOKIE.to_vec();
    stream.extend(frame(1, b""));
    stream.extend(frame(2, b"abc"));
    stream.extend(frame(3, &[7; 16]));
    let expected = vec![(1, vec![]), (2, b"abc".to_vec()), (3, vec![7; 16])];
    for size in 1..=stream.len() {
        let mut decoder = Decoder::new();
        let mut found = Vec::new();
        for piece in stream.chunks(size) {
            found.extend(frames(&mut decoder, piece).unwrap());
        }
        assert_eq!(found, expected, "pieces of {size}");
        assert_eq!(decoder.version(), Some("07.38"));
    }
}

#[test]
fn cookie_of_each_07_is_taken_and_of_no_other() {
    let greet = |text: &[u8]| {
        let mut cookie = [0; HEAD_LEN];
        cookie[..text.len()].copy_from_slice(text);
        frames(&mut Decoder::new(), &cookie)
    };
    for good in [b"vrpn: ver. 07.35  0", b"vrpn: ver. 07.99  3"] {
        assert_eq!(greet(good), Ok(vec![]));
    }
    for bad in [
        b"vrpn: ver. 06.99  0".as_slice(),
        b"vrpn: ver. 07.38  9",
        b"HTTP/1.1 400 Bad",
        b"",
    ] {
        assert!(matches!(greet(bad), Err(ProtocolError::Cookie { .. })));
    }
    let error = greet(b"vrpn: ver. 06.99  0").unwrap_err();
    assert!(error.to_string().contains("06.99"), "{error}");
}

#[test]
fn frame_too_short_or_too_long_ends_the_decoder_for_good() {
    for (length, error) in [
        (23_u32, ProtocolError::TooShort { length: 23 }),
        (0, ProtocolError::TooShort { length: 0 }),
        (64_025, ProtocolError::TooLong { length: 64_025 }),
        (u32::MAX, ProtocolError::TooLong { length: u32::MAX }),
    ] {
        let mut bytes = frame(1, b"");
        bytes[..4].copy_from_slice(&length.to_be_bytes());
        let mut decoder = Decoder::after_cookie();
        assert_eq!(frames(&mut decoder, &bytes), Err(error.clone()));
        assert_eq!(frames(&mut decoder, &frame(1, b"")), Err(error));
    }
    let longest = frame(1, &[1; PAYLOAD_MAX]);
    let found = frames(&mut Decoder::after_cookie(), &longest).unwrap();
    assert_eq!(found[0].1.len(), PAYLOAD_MAX);
}

#[test]
fn datagram_gives_its_frames_and_a_cut_one_an_error() {
    let mut bytes = frame(1, &[5; 8]);
    bytes.extend(frame(2, b"abc"));
    let kinds = |bytes: &[u8]| {
        let mut kinds = Vec::new();
        let result = read_datagram(bytes, |frame| {
            kinds.push(frame.kind);
            Ok(())
        });
        (kinds, result.is_ok())
    };
    assert_eq!(kinds(&bytes), (vec![1, 2], true));
    let without_filler = bytes.len() - 5;
    assert_eq!(kinds(&bytes[..without_filler]), (vec![1, 2], true));
    assert_eq!(kinds(&bytes[..without_filler - 1]), (vec![1], false));
    assert_eq!(kinds(&bytes[..40]), (vec![1], false));
    assert_eq!(kinds(&[]), (vec![], true));
}

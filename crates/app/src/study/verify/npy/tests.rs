use std::time::{Duration, Instant};

use super::*;

/// A file as NumPy writes it, of any version, with the header as given.
fn file(version: u8, header: &str, payload: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x93NUMPY".to_vec();
    bytes.extend([version, 0]);
    match version {
        1 => bytes.extend((header.len() as u16).to_le_bytes()),
        _ => bytes.extend((header.len() as u32).to_le_bytes()),
    }
    bytes.extend(header.as_bytes());
    bytes.extend(payload);
    bytes
}

fn numbers(n: usize) -> Vec<u8> {
    (0..n).flat_map(|k| (k as f64).to_le_bytes()).collect()
}

const LIST: &str = "{'descr': '<f8', 'fortran_order': False, 'shape': (3,), }\n";

#[test]
fn versions_orders_and_both_ends_first_are_read() {
    for version in 1..=3 {
        let array = parse::<f64>(&file(version, LIST, &numbers(3))).unwrap();
        assert_eq!(array.entries, [0.0, 1.0, 2.0]);
        assert_eq!(array.shape, [3]);
        assert!(!array.is_fortran);
    }
    let header = "{\"shape\":(2L, 2), 'fortran_order':True,'descr':'>f8'}";
    let payload: Vec<u8> = [1.0f64, 2.0, 3.0, 4.0]
        .iter()
        .flat_map(|x| x.to_be_bytes())
        .collect();
    let array = parse::<f64>(&file(1, header, &payload)).unwrap();
    assert_eq!(array.entries, [1.0, 2.0, 3.0, 4.0]);
    assert!(array.is_fortran);
    let header = "{'descr': '<i8', 'fortran_order': False, 'shape': (1,), }";
    let array = parse::<i64>(&file(1, header, &(-7i64).to_le_bytes())).unwrap();
    assert_eq!(array.entries, [-7]);
}

/// What is wrong with each, and the words that must be in the refusal.
#[test]
fn what_is_not_read_is_refused_with_place_and_mend() {
    let with = |from: &str, to: &str| file(1, &LIST.replace(from, to), &numbers(3));
    let mut nan = numbers(3);
    nan[8..16].copy_from_slice(&f64::NAN.to_le_bytes());
    let mut long = file(2, LIST, &numbers(3));
    long[8..12].copy_from_slice(&u32::MAX.to_le_bytes());
    let mut beyond = file(1, LIST, &numbers(3));
    beyond[8..10].copy_from_slice(&5000u16.to_le_bytes());
    let cases: Vec<(Vec<u8>, &str)> = vec![
        (Vec::new(), "byte 0: does not begin"),
        (b"\x93NUMPY".to_vec(), "cut off in its first bytes"),
        (
            b"\x93NUMPY\x01\x00\x76".to_vec(),
            "cut off in its first bytes",
        ),
        (file(4, LIST, &numbers(3)), "version 4.0"),
        (long, "a header of 4294967295 bytes; at most 10000"),
        (beyond, "a header of 5000 bytes in a file of"),
        (with("'<f8'", "'<f4'"), "entries of type \"<f4\""),
        (with("'<f8'", "[('a', '<f8')]"), "has '[' where the type"),
        (with("'<f8'", "'|O'"), "entries of type \"|O\""),
        (with("(3,)", "(3)"), "written (3,)"),
        (with("(3,)", "3"), "where a shape"),
        (with("(3,)", "(-3,)"), "has '-' where a number of entries"),
        (with("(3,)", "(2,)"), "goes on after the array"),
        (with("(3,)", "(4,)"), "was cut off"),
        (
            with("(3,)", "(99999999999,)"),
            "more than the 25000000 entries",
        ),
        (
            with("(3,)", "(4294967296, 4294967296, 4294967296)"),
            "more than the 25000000",
        ),
        (with("(3,)", "(0, 99999999999999999999)"), "64 bits"),
        (with("(3,)", "(3 1)"), "where `,` or `)`"),
        (
            with("(3,)", &format!("({})", "1,".repeat(40))),
            "more than 32 axes",
        ),
        (with("False", "0"), "True or False"),
        (with("fortran_order", "fortran"), "key \"fortran\""),
        (
            with("'fortran_order': False, ", ""),
            "no key 'fortran_order'",
        ),
        (with("'shape'", "'descr'"), "where the type"),
        (with("(3,), ", "(3,), 'shape': (3,), "), "comes twice"),
        (with("}\n", "} 1"), "the end of the header"),
        (with("}\n", ""), "nothing more"),
        (with("'<f8'", "'<fé'"), "not ASCII"),
        (file(1, LIST, &nan), "entry 1 "),
    ];
    for (bytes, words) in cases {
        let message = parse::<f64>(&bytes).unwrap_err();
        assert!(message.contains(words), "{words}: {message}");
        let has_mend = message.contains("numpy.save") || message.contains("must be numbers");
        assert!(has_mend, "{message}");
    }
}

/// The header took a time that doubled with each bracket.
#[test]
fn nested_brackets_are_refused_at_once() {
    let start = Instant::now();
    for bracket in ["[", "(", "{", "{'descr': [", "'"] {
        for key in ["'descr'", "'shape'", "'fortran_order'", "'other'"] {
            let header = format!("{{{key}: {}", bracket.repeat(900));
            assert!(parse::<f64>(&file(1, &header, &[])).is_err());
        }
        assert!(parse::<f64>(&file(1, &bracket.repeat(900), &[])).is_err());
    }
    assert!(start.elapsed() < Duration::from_secs(5));
}

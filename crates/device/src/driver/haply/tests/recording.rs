//! The recorded frames.

use serde_json::Value;

/// Which way a frame went.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::driver::haply) enum Direction {
    ToService,
    ToClient,
}

const FRAMES: &str = include_str!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/tests/data/haply/frames.jsonl"
));
const DECODED: &str = include_str!(concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/tests/data/haply/client_decoded.jsonl"
));

/// All frames in order; the first is the service's inventory.
pub(in crate::driver::haply) fn recorded() -> Vec<(Direction, String)> {
    FRAMES
        .lines()
        .map(|line| {
            let line: Value = serde_json::from_str(line).unwrap();
            let direction = match line["direction"].as_str().unwrap() {
                "client_to_service" => Direction::ToService,
                _ => Direction::ToClient,
            };
            (direction, line["text"].as_str().unwrap().to_owned())
        })
        .collect()
}

/// What the maker's client read, in order.
pub(in crate::driver::haply) fn decoded() -> Vec<Value> {
    DECODED
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// The inventory, to be changed by a test.
pub(in crate::driver::haply) fn inventory() -> Value {
    serde_json::from_str(&recorded()[0].1).unwrap()
}

/// An answer, to be changed by a test.
pub(in crate::driver::haply) fn answer() -> Value {
    serde_json::from_str(&recorded()[2].1).unwrap()
}

//! What each stub has: a log of the calls, and knobs that a test turns.

use std::collections::BTreeMap;
use std::ffi::{CStr, c_char};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

static LOG: Mutex<Vec<String>> = Mutex::new(Vec::new());
static KNOBS: Mutex<BTreeMap<String, f64>> = Mutex::new(BTreeMap::new());

pub fn log(line: String) {
    LOG.lock()
        .unwrap_or_else(PoisonError::into_inner)
        .push(line);
}

/// The value a test has set, or `otherwise`.
pub fn knob(name: &str, otherwise: f64) -> f64 {
    let knobs = KNOBS.lock().unwrap_or_else(PoisonError::into_inner);
    knobs.get(name).copied().unwrap_or(otherwise)
}

pub fn set_knob(name: &str, value: f64) {
    let mut knobs = KNOBS.lock().unwrap_or_else(PoisonError::into_inner);
    knobs.insert(name.to_owned(), value);
}

/// To be called by each function of the stub: blocks and fails as often as the test wants. Does it fail?
pub fn fails(call: &str) -> bool {
    let block_ms = knob(&format!("block:{call}"), 0.0);
    if block_ms > 0.0 {
        set_knob(&format!("block:{call}"), 0.0);
        std::thread::sleep(Duration::from_millis(block_ms as u64));
    }
    while knob(&format!("hold:{call}"), 0.0) > 0.0 {
        std::thread::sleep(Duration::from_millis(2));
    }
    let times = knob(&format!("fail:{call}"), 0.0);
    if times > 0.0 {
        set_knob(&format!("fail:{call}"), times - 1.0);
    }
    times > 0.0 || knob("dead", 0.0) == 1.0
}

/// Turns a knob.
///
/// # Safety
/// A text that ends with a zero.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn stub_set(name: *const c_char, value: f64) {
    let name = unsafe { CStr::from_ptr(name) };
    set_knob(&name.to_string_lossy(), value);
}

/// Copies the log from line `from` on, line by line, as far as there is room; returns the bytes it takes.
///
/// # Safety
/// `buffer` has the room that is stated.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn stub_log(from: usize, buffer: *mut u8, room: usize) -> usize {
    let log = LOG.lock().unwrap_or_else(PoisonError::into_inner);
    let text = log[from.min(log.len())..].join("\n");
    if text.len() <= room {
        unsafe { std::ptr::copy_nonoverlapping(text.as_ptr(), buffer, text.len()) };
    }
    text.len()
}

/// How many lines the log has.
#[unsafe(no_mangle)]
pub extern "C" fn stub_lines() -> usize {
    LOG.lock().unwrap_or_else(PoisonError::into_inner).len()
}

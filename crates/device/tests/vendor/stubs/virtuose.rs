//! A stand-in for libvirtuose: logs what it is told, answers what the test wants.

use std::ffi::{CStr, c_char, c_int, c_uint, c_void};

mod common;
use common::{fails, knob, log, set_knob};

/// What a connection points to.
static CONTROLLER: u8 = 0;

type Context = *mut c_void;

fn answer(call: &str, context: Context) -> c_int {
    if context.is_null() {
        log(format!("{call} without a connection"));
        return -1;
    }
    if fails(call) { -1 } else { 0 }
}

unsafe fn numbers<const N: usize>(start: *const f32) -> String {
    let all: Vec<String> = (0..N)
        .map(|i| unsafe { *start.add(i) }.to_string())
        .collect();
    all.join(" ")
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn virtAPIVersion(major: *mut c_int, minor: *mut c_int) -> c_int {
    unsafe { (*major, *minor) = (knob("major", 3.0) as c_int, 98) };
    0
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn virtOpen(address: *const c_char) -> Context {
    log(format!(
        "virtOpen {}",
        unsafe { CStr::from_ptr(address) }.to_string_lossy()
    ));
    if fails("virtOpen") {
        return std::ptr::null_mut();
    }
    (&raw const CONTROLLER).cast_mut().cast()
}

#[unsafe(no_mangle)]
pub extern "C" fn virtClose(context: Context) -> c_int {
    log("virtClose".to_owned());
    answer("virtClose", context)
}

#[unsafe(no_mangle)]
pub extern "C" fn virtGetErrorCode(_: Context) -> c_int {
    knob("error", 2.0) as c_int
}

#[unsafe(no_mangle)]
pub extern "C" fn virtGetErrorMessage(_: c_int) -> *const c_char {
    c"stub says no".as_ptr()
}

macro_rules! setters {
    ($($name:ident: $type:ty,)*) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(context: Context, value: $type) -> c_int {
            log(format!("{} {value}", stringify!($name)));
            answer(stringify!($name), context)
        }
    )*};
}
setters! {
    virtSetIndexingMode: c_int,
    virtSetForceFactor: f32,
    virtSetSpeedFactor: f32,
    virtSetTimeStep: f32,
    virtSetCommandType: c_int,
    virtEnableForceFeedback: c_int,
}

#[unsafe(no_mangle)]
pub extern "C" fn virtSetPowerOn(context: Context, is_on: c_int) -> c_int {
    log(format!("virtSetPowerOn {is_on}"));
    set_knob("power", is_on.into());
    answer("virtSetPowerOn", context)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn virtSetBaseFrame(context: Context, pose: *const f32) -> c_int {
    log(format!("virtSetBaseFrame {}", unsafe {
        numbers::<7>(pose)
    }));
    answer("virtSetBaseFrame", context)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn virtSetObservationFrame(context: Context, pose: *const f32) -> c_int {
    log(format!("virtSetObservationFrame {}", unsafe {
        numbers::<7>(pose)
    }));
    answer("virtSetObservationFrame", context)
}

#[cfg(not(without_set_force))]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn virtSetForce(context: Context, wrench: *const f32) -> c_int {
    log(format!("virtSetForce {}", unsafe { numbers::<6>(wrench) }));
    answer("virtSetForce", context)
}

#[unsafe(no_mangle)]
pub extern "C" fn virtSaturateTorque(context: Context, force: f32, torque: f32) -> c_int {
    log(format!("virtSaturateTorque {force} {torque}"));
    answer("virtSaturateTorque", context)
}

#[unsafe(no_mangle)]
pub extern "C" fn virtDetachVO(context: Context) -> c_int {
    log("virtDetachVO".to_owned());
    answer("virtDetachVO", context)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn virtGetPosition(context: Context, pose: *mut f32) -> c_int {
    // A quarter turn about z, and a scale that spoils it where the test wants that.
    let half = 0.5_f32.sqrt() * knob("scale", 1.0) as f32;
    let numbers = [0.1, -0.2, 0.3, 0.0, 0.0, half, half];
    unsafe { std::ptr::copy_nonoverlapping(numbers.as_ptr(), pose, 7) };
    answer("virtGetPosition", context)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn virtGetSpeed(context: Context, twist: *mut f32) -> c_int {
    let numbers = [0.01, 0.02, 0.03, 0.4, 0.5, 0.6];
    unsafe { std::ptr::copy_nonoverlapping(numbers.as_ptr(), twist, 6) };
    answer("virtGetSpeed", context)
}

macro_rules! getters {
    ($($name:ident: $type:ty = $knob:literal, $otherwise:literal;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(context: Context, value: *mut $type) -> c_int {
            unsafe { *value = knob($knob, $otherwise) as $type };
            answer(stringify!($name), context)
        }
    )*};
}
getters! {
    virtGetDeadMan: c_int = "dead man", 1.0;
    virtGetEmergencyStop: c_int = "chain", 1.0;
    virtGetPowerOn: c_int = "power", 0.0;
    virtIsInShiftPosition: c_int = "shift", 0.0;
    virtGetAlarm: c_uint = "alarm", 0.0;
    virtGetFailure: c_uint = "failure", 0.0;
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn virtGetButton(_: Context, number: c_int, state: *mut c_int) -> c_int {
    unsafe { *state = (knob("buttons", 0.0) as c_int >> number) & 1 };
    0
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn virtGetDeviceID(
    context: Context,
    model: *mut c_int,
    serial: *mut c_int,
) -> c_int {
    unsafe { (*model, *serial) = (knob("model", 3.0) as c_int, 17) };
    answer("virtGetDeviceID", context)
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn virtGetControlerVersion(
    context: Context,
    major: *mut c_int,
    minor: *mut c_int,
) -> c_int {
    unsafe { (*major, *minor) = (2, 5) };
    answer("virtGetControlerVersion", context)
}

//! A stand-in for libdhd: logs what it is told, answers what the test wants.

use std::ffi::{c_char, c_double, c_int, c_uchar, c_uint, c_ushort};

mod common;
use common::{fails, knob, log, set_knob};

/// As a call that says how it went: negative, 0, or a number that is no failure.
fn answer(call: &str) -> c_int {
    if fails(call) {
        -1
    } else {
        knob("returned", 0.0) as c_int
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetSDKVersion(
    major: *mut c_int,
    minor: *mut c_int,
    release: *mut c_int,
    revision: *mut c_int,
) {
    unsafe { (*major, *minor, *release, *revision) = (knob("major", 3.0) as c_int, 17, 6, 1) };
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdErrorGetLast() -> c_int {
    knob("error", 2.0) as c_int
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdErrorGetLastStr() -> *const c_char {
    c"stub says no".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetDeviceCount() -> c_int {
    knob("count", 1.0) as c_int
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdOpen() -> c_int {
    log("dhdOpen".to_owned());
    if fails("dhdOpen") { -1 } else { 5 }
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdOpenID(id: i8) -> c_int {
    log(format!("dhdOpenID {id}"));
    let is_taken = f64::from(id) == knob("taken", -1.0);
    if fails("dhdOpenID") || fails(&format!("dhdOpenID {id}")) || is_taken {
        -1
    } else {
        0
    }
}

macro_rules! by_id {
    ($($name:ident($($value:ident: $type:ty),*);)*) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $name($($value: $type,)* id: i8) -> c_int {
            let words = [stringify!($name).to_owned(), $($value.to_string(),)* format!("@{id}")];
            log(words.join(" "));
            answer(stringify!($name))
        }
    )*};
}
by_id! {
    dhdClose();
    dhdStop();
    dhdSetWatchdog(units: c_uchar);
    dhdSetGravityCompensation(is_on: c_int);
    dhdSetBrakes(is_on: c_int);
    dhdSetForce(x: c_double, y: c_double, z: c_double);
    dhdSetForceAndTorque(x: c_double, y: c_double, z: c_double, tx: c_double, ty: c_double, tz: c_double);
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdEnableForce(is_on: c_uchar, id: i8) -> c_int {
    log(format!("dhdEnableForce {is_on} @{id}"));
    set_knob("force", is_on.into());
    set_knob("cause", 0.0);
    answer("dhdEnableForce")
}

#[cfg(not(without_expert_mode))]
#[unsafe(no_mangle)]
pub extern "C" fn dhdEnableExpertMode() -> c_int {
    log("dhdEnableExpertMode".to_owned());
    answer("dhdEnableExpertMode")
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdDisableExpertMode() -> c_int {
    log("dhdDisableExpertMode".to_owned());
    0
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetVelocityThreshold(threshold: *mut c_uint, _: i8) -> c_int {
    unsafe { *threshold = knob("threshold", 40.0) as c_uint };
    0
}

/// Velocity threshold: no driver may change it.
#[unsafe(no_mangle)]
pub extern "C" fn dhdSetVelocityThreshold(value: c_uint, id: i8) -> c_int {
    log(format!("dhdSetVelocityThreshold {value} @{id}"));
    0
}

/// Seventeen numbers, as later versions of the library write.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetStatus(status: *mut c_int, _: i8) -> c_int {
    let mut numbers = [1; 17];
    numbers[0] = knob("has power", 1.0) as c_int;
    numbers[3] = knob("calibrated", 1.0) as c_int;
    numbers[5] = knob("force", 0.0) as c_int;
    numbers[9] = knob("has error", 0.0) as c_int;
    numbers[14] = knob("cause", 0.0) as c_int;
    unsafe { std::ptr::copy_nonoverlapping(numbers.as_ptr(), status, 17) };
    answer("dhdGetStatus")
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetPositionAndOrientationFrame(
    x: *mut c_double,
    y: *mut c_double,
    z: *mut c_double,
    frame: *mut c_double,
    _: i8,
) -> c_int {
    // A quarter turn about z: x becomes y. Row by row.
    let rows = [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0].map(|n| n * knob("scale", 1.0));
    unsafe {
        (*x, *y, *z) = (0.01, -0.02, 0.03);
        std::ptr::copy_nonoverlapping(rows.as_ptr(), frame, 9);
    }
    answer("dhdGetPositionAndOrientationFrame")
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetLinearVelocity(
    x: *mut c_double,
    y: *mut c_double,
    z: *mut c_double,
    _: i8,
) -> c_int {
    unsafe { (*x, *y, *z) = (knob("speed", 0.01), 0.02, 0.03) };
    answer("dhdGetLinearVelocity")
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetAngularVelocityRad(
    x: *mut c_double,
    y: *mut c_double,
    z: *mut c_double,
    _: i8,
) -> c_int {
    unsafe { (*x, *y, *z) = (0.4, 0.5, 0.6) };
    answer("dhdGetAngularVelocityRad")
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetButtonMask(_: i8) -> c_uint {
    knob("buttons", 0.0) as c_uint
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdHasWrist(_: i8) -> bool {
    knob("wrist", 0.0) > 0.0
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdHasActiveWrist(_: i8) -> bool {
    knob("wrist", 0.0) > 1.0
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetSystemType(_: i8) -> c_int {
    knob("type", 33.0) as c_int
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetSystemName(_: i8) -> *const c_char {
    c"omega.3".as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetSerialNumber(number: *mut c_ushort, _: i8) -> c_int {
    unsafe { *number = 421 };
    0
}

//! A stand-in for libHD with a scheduler of its own: logs what it is told, answers what the test wants, and complains
//! in the log of what is done out of a frame that belongs into one.

use std::ffi::{CStr, c_char, c_double, c_int, c_uchar, c_uint, c_ulong, c_ushort, c_void};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

mod common;
use common::{fails, knob, log, set_knob};

type Callback = unsafe extern "C" fn(*mut c_void) -> c_uint;

#[repr(C)]
pub struct ErrorInfo {
    code: c_uint,
    internal: c_int,
    device: c_uint,
}

const DEVICE: c_uint = 7;

static SCHEDULED: Mutex<Option<(usize, usize)>> = Mutex::new(None);
static THREAD: Mutex<Option<JoinHandle<()>>> = Mutex::new(None);
static RUNS: AtomicBool = AtomicBool::new(false);
static IN_FRAME: AtomicBool = AtomicBool::new(false);
static AT_START: AtomicUsize = AtomicUsize::new(0);
static ERRORS: Mutex<Vec<c_uint>> = Mutex::new(Vec::new());

/// What the scheduler's thread calls once before its first frame.
#[unsafe(no_mangle)]
pub extern "C" fn stub_at_start(call: extern "C" fn()) {
    AT_START.store(call as usize, Ordering::SeqCst);
}

fn error(code: u32) {
    ERRORS
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .push(code);
}

fn only_in_frame(call: &str) {
    if RUNS.load(Ordering::SeqCst) && !IN_FRAME.load(Ordering::SeqCst) {
        log(format!("{call} out of a frame"));
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdInitDevice(name: *const c_char) -> c_uint {
    let name = if name.is_null() {
        "default".to_owned()
    } else {
        unsafe { CStr::from_ptr(name) }
            .to_string_lossy()
            .into_owned()
    };
    log(format!("hdInitDevice {name}"));
    if fails("hdInitDevice") {
        error(knob("init error", 768.0) as u32);
        return 0xFFFF_FFFF;
    }
    if knob("error at init", 0.0) == 1.0 {
        error(knob("init error", 768.0) as u32);
    }
    DEVICE
}

macro_rules! with_handle {
    ($($name:ident),*) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(handle: c_uint) {
            log(format!("{} {handle}", stringify!($name)));
        }
    )*};
}
with_handle!(hdDisableDevice, hdMakeCurrentDevice);

#[unsafe(no_mangle)]
pub extern "C" fn hdBeginFrame(handle: c_uint) {
    fails("hdBeginFrame");
    if IN_FRAME.swap(true, Ordering::SeqCst) || handle != DEVICE {
        log("hdBeginFrame in a frame".to_owned());
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdEndFrame(handle: c_uint) {
    if !IN_FRAME.swap(false, Ordering::SeqCst) || handle != DEVICE {
        log("hdEndFrame out of a frame".to_owned());
    }
    if fails("frame") {
        error(knob("frame error", 770.0) as u32);
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdGetDoublev(what: c_uint, numbers: *mut c_double) {
    let s = knob("scale", 1.0);
    // A quarter turn about z, column by column, mm.
    let transform = [
        0.0, s, 0.0, 0.0, -s, 0.0, 0.0, 0.0, 0.0, 0.0, s, 0.0, 10.0, -20.0, 30.0, 1.0,
    ];
    let all: &[f64] = match what {
        0x2051 => &[knob("speed", 10.0), 20.0, 30.0],
        0x2052 => &transform,
        0x2550 => &[-80.0, -60.0, -35.0, 80.0, 60.0, 35.0],
        0x2602 => &[0.5],
        0x2603 => &[knob("largest force", 3.3)],
        0x2604 => &[0.88],
        0x2609 => &[0.003],
        0x2622 => &[188.0],
        _ => {
            log(format!("hdGetDoublev {what:#x}"));
            error(0x0100);
            return;
        }
    };
    if matches!(what, 0x2051 | 0x2052) {
        only_in_frame("hdGetDoublev");
    }
    unsafe { std::ptr::copy_nonoverlapping(all.as_ptr(), numbers, all.len()) };
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdGetIntegerv(what: c_uint, numbers: *mut c_int) {
    let number = match what {
        0x2000 => knob("buttons", 0.0),
        0x2554 => knob("freedoms", 3.0),
        0x2555 => knob("style", 4.0),
        _ => return log(format!("hdGetIntegerv {what:#x}")),
    };
    unsafe { *numbers = number as c_int };
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdGetBooleanv(what: c_uint, value: *mut c_uchar) {
    if what != 0x2002 {
        log(format!("hdGetBooleanv {what:#x}"));
    }
    unsafe { *value = knob("out of the well", 1.0) as c_uchar };
}

#[unsafe(no_mangle)]
pub extern "C" fn hdGetString(what: c_uint) -> *const c_char {
    match what {
        0x2500 if knob("major", 3.0) == 3.0 => c"3.4.0".as_ptr(),
        0x2500 => c"2.0.1".as_ptr(),
        0x2501 => c"Touch".as_ptr(),
        0x2504 => c"0814".as_ptr(),
        _ => std::ptr::null(),
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdSetDoublev(what: c_uint, numbers: *const c_double) {
    only_in_frame("hdSetDoublev");
    let [x, y, z] = unsafe { *numbers.cast::<[f64; 3]>() };
    log(format!("hdSetDoublev {what:#x} {x} {y} {z}"));
    if what == 0x2701 && knob("no torque", 0.0) == 1.0 {
        error(0x0100);
    }
}

macro_rules! switches {
    ($($name:ident),*) => {$(
        #[unsafe(no_mangle)]
        pub extern "C" fn $name(what: c_uint) {
            log(format!("{} {what:#x}", stringify!($name)));
        }
    )*};
}
switches!(hdEnable, hdDisable);

#[unsafe(no_mangle)]
pub extern "C" fn hdGetError() -> ErrorInfo {
    let mut errors = ERRORS.lock().unwrap_or_else(PoisonError::into_inner);
    let code = if knob("endless errors", 0.0) == 1.0 && RUNS.load(Ordering::SeqCst) {
        0x0302
    } else {
        errors.pop().unwrap_or(0)
    };
    ErrorInfo {
        code,
        internal: -1,
        device: DEVICE,
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdGetErrorString(_: c_uint) -> *const c_char {
    c"stub says no".as_ptr()
}

#[unsafe(no_mangle)]
pub extern "C" fn hdScheduleAsynchronous(
    callback: Callback,
    data: *mut c_void,
    priority: c_ushort,
) -> c_ulong {
    log(format!("hdScheduleAsynchronous {priority}"));
    *SCHEDULED.lock().unwrap_or_else(PoisonError::into_inner) =
        Some((callback as usize, data as usize));
    99
}

#[cfg(not(without_unschedule))]
#[unsafe(no_mangle)]
pub extern "C" fn hdUnschedule(number: c_ulong) {
    log(format!("hdUnschedule {number}"));
    *SCHEDULED.lock().unwrap_or_else(PoisonError::into_inner) = None;
}

#[unsafe(no_mangle)]
pub extern "C" fn hdStartScheduler() {
    log("hdStartScheduler".to_owned());
    if fails("hdStartScheduler") {
        return error(0x0304);
    }
    RUNS.store(true, Ordering::SeqCst);
    let thread = std::thread::spawn(|| {
        let at_start = AT_START.load(Ordering::SeqCst);
        if at_start != 0 {
            let call: extern "C" fn() = unsafe { std::mem::transmute(at_start) };
            call();
        }
        while RUNS.load(Ordering::SeqCst) {
            // Held during the call: unscheduling waits for the end of the frame.
            let mut scheduled = SCHEDULED.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some((callback, data)) = *scheduled {
                let callback: Callback = unsafe { std::mem::transmute(callback) };
                if unsafe { callback(data as *mut c_void) } == 0 {
                    *scheduled = None;
                }
            }
            drop(scheduled);
            std::thread::sleep(Duration::from_millis(1));
        }
    });
    *THREAD.lock().unwrap_or_else(PoisonError::into_inner) = Some(thread);
}

#[unsafe(no_mangle)]
pub extern "C" fn hdStopScheduler() {
    log("hdStopScheduler".to_owned());
    RUNS.store(false, Ordering::SeqCst);
    let thread = THREAD.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some(thread) = thread {
        let _ended = thread.join();
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdCheckCalibration() -> c_uint {
    knob("calibration", 20480.0) as c_uint
}

#[unsafe(no_mangle)]
pub extern "C" fn hdUpdateCalibration(style: c_uint) {
    log(format!("hdUpdateCalibration {style}"));
    if knob("calibration", 20480.0) == 20481.0 && knob("can calibrate", 1.0) == 1.0 {
        set_knob("calibration", 20480.0);
    }
}

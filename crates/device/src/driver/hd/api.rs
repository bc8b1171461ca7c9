//! The functions of OpenHaptics' `libHD` that are used, and one initialised device through them.
//!
//! mm, mm/s, N; torques in N mm. The functions say nothing of failures: those are fetched one by one, the
//! newest first.

#![allow(unsafe_code, reason = "the maker's library is C")]

use std::ffi::{CStr, c_char, c_double, c_int, c_uchar, c_uint, c_ulong, c_ushort, c_void};

use crate::driver::library::{Library, functions, text};

/// What the scheduler calls once a frame; 1 to be called again.
pub(super) type Callback = unsafe extern "C" fn(*mut c_void) -> c_uint;

type Handle = c_uint;

/// An error as the library returns it: by value, three fields.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
struct ErrorInfo {
    code: c_uint,
    internal: c_int,
    device: Handle,
}

functions! {
    /// The functions of the maker's library, version 3.
    Functions
    required {
        init: "hdInitDevice" = unsafe extern "C" fn(*const c_char) -> Handle,
        disable_device: "hdDisableDevice" = unsafe extern "C" fn(Handle),
        make_current: "hdMakeCurrentDevice" = unsafe extern "C" fn(Handle),
        begin_frame: "hdBeginFrame" = unsafe extern "C" fn(Handle),
        end_frame: "hdEndFrame" = unsafe extern "C" fn(Handle),
        get_doubles: "hdGetDoublev" = unsafe extern "C" fn(c_uint, *mut c_double),
        get_integers: "hdGetIntegerv" = unsafe extern "C" fn(c_uint, *mut c_int),
        get_booleans: "hdGetBooleanv" = unsafe extern "C" fn(c_uint, *mut c_uchar),
        get_string: "hdGetString" = unsafe extern "C" fn(c_uint) -> *const c_char,
        set_doubles: "hdSetDoublev" = unsafe extern "C" fn(c_uint, *const c_double),
        enable: "hdEnable" = unsafe extern "C" fn(c_uint),
        disable: "hdDisable" = unsafe extern "C" fn(c_uint),
        error: "hdGetError" = unsafe extern "C" fn() -> ErrorInfo,
        error_text: "hdGetErrorString" = unsafe extern "C" fn(c_uint) -> *const c_char,
        schedule: "hdScheduleAsynchronous" = unsafe extern "C" fn(Callback, *mut c_void, c_ushort) -> c_ulong,
        unschedule: "hdUnschedule" = unsafe extern "C" fn(c_ulong),
        start_scheduler: "hdStartScheduler" = unsafe extern "C" fn(),
        stop_scheduler: "hdStopScheduler" = unsafe extern "C" fn(),
        check_calibration: "hdCheckCalibration" = unsafe extern "C" fn() -> c_uint,
        update_calibration: "hdUpdateCalibration" = unsafe extern "C" fn(c_uint),
    }
    optional {}
}

/// Numbers of what can be asked, set or switched.
pub(super) mod number {
    pub(in crate::driver::hd) const BUTTONS: u32 = 0x2000;
    pub(in crate::driver::hd) const INKWELL_SWITCH: u32 = 0x2002;
    pub(in crate::driver::hd) const VELOCITY: u32 = 0x2051;
    pub(in crate::driver::hd) const TRANSFORM: u32 = 0x2052;
    pub(in crate::driver::hd) const VERSION: u32 = 0x2500;
    pub(in crate::driver::hd) const MODEL: u32 = 0x2501;
    pub(in crate::driver::hd) const SERIAL_NUMBER: u32 = 0x2504;
    pub(in crate::driver::hd) const WORKSPACE: u32 = 0x2550;
    pub(in crate::driver::hd) const OUTPUT_FREEDOMS: u32 = 0x2554;
    pub(in crate::driver::hd) const CALIBRATION_STYLE: u32 = 0x2555;
    pub(in crate::driver::hd) const MAX_STIFFNESS: u32 = 0x2602;
    pub(in crate::driver::hd) const MAX_FORCE: u32 = 0x2603;
    pub(in crate::driver::hd) const MAX_CONTINUOUS_FORCE: u32 = 0x2604;
    pub(in crate::driver::hd) const MAX_DAMPING: u32 = 0x2609;
    pub(in crate::driver::hd) const MAX_TORQUE: u32 = 0x2622;
    pub(in crate::driver::hd) const FORCE: u32 = 0x2700;
    pub(in crate::driver::hd) const TORQUE: u32 = 0x2701;
    pub(in crate::driver::hd) const FORCE_OUTPUT: u32 = 0x4000;
    pub(in crate::driver::hd) const FORCE_CLAMPING: u32 = 0x4001;
    pub(in crate::driver::hd) const FORCE_RAMPING: u32 = 0x4002;
    pub(in crate::driver::hd) const CALIBRATION_OK: u32 = 0x5000;
    pub(in crate::driver::hd) const CALIBRATION_NEEDS_UPDATE: u32 = 0x5001;
    /// Bit of the calibration style: by the inkwell.
    pub(in crate::driver::hd) const STYLE_INKWELL: u32 = 4;
}

/// No device.
const INVALID: Handle = 0xFFFF_FFFF;

/// Room for the numbers of any answer: the largest has 16.
const ROOM: usize = 32;

/// Errors that are fetched at a time; a library that never says "no more" must not hold the callback.
const ERRORS_MAX: usize = 8;

/// An error of the library.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Failure {
    /// The library's number.
    pub(super) code: u32,
    text: String,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} (error {:#06x})", self.text, self.code)
    }
}

/// An initialised device. Not disabled by itself: see [`Device::disable`]. Copied into the scheduler's callback.
#[derive(Debug, Clone, Copy)]
pub(super) struct Device {
    library: &'static Library<Functions>,
    handle: Handle,
}

impl Device {
    /// The device of this name in the maker's configuration, or the default one; it is made the current one.
    pub(super) fn init(
        library: &'static Library<Functions>,
        name: Option<&CStr>,
    ) -> Result<Self, Failure> {
        let functions = &library.functions;
        // Errors of an earlier try are no errors of this one.
        let nobody = Self {
            library,
            handle: INVALID,
        };
        let _old = nobody.errors();
        // SAFETY: a text that ends with a zero, or null for the default device.
        let handle = unsafe { (functions.init)(name.map_or(std::ptr::null(), CStr::as_ptr)) };
        let device = Self { library, handle };
        // What is too warm or was too fast before is no reason not to begin; the rest is.
        let errors: Vec<u32> = device.errors().collect();
        let fatal = errors.iter().find(|code| *code >> 8 >= 3);
        let reason = if handle == INVALID {
            fatal.or(errors.last())
        } else {
            fatal
        };
        match reason {
            None if handle == INVALID => Err(Failure {
                code: 0,
                text: "hdInitDevice gave no device and no reason".to_owned(),
            }),
            None => {
                device.make_current();
                Ok(device)
            }
            Some(code) => {
                if handle != INVALID {
                    device.disable();
                }
                Err(device.failure(*code))
            }
        }
    }

    pub(super) fn disable(&self) {
        // SAFETY: numbers only; the owner calls nothing after this.
        unsafe { (self.functions().disable_device)(self.handle) };
    }

    pub(super) fn make_current(&self) {
        // SAFETY: numbers only.
        unsafe { (self.functions().make_current)(self.handle) };
    }

    pub(super) fn begin_frame(&self) {
        // SAFETY: numbers only.
        unsafe { (self.functions().begin_frame)(self.handle) };
    }

    pub(super) fn end_frame(&self) {
        // SAFETY: numbers only.
        unsafe { (self.functions().end_frame)(self.handle) };
    }

    /// Not numbers where the library wrote none.
    pub(super) fn doubles<const N: usize>(&self, what: u32) -> [f64; N] {
        let mut room = [f64::NAN; ROOM];
        // SAFETY: more room than any answer fills.
        unsafe { (self.functions().get_doubles)(what, room.as_mut_ptr()) };
        std::array::from_fn(|i| room[i])
    }

    pub(super) fn integer(&self, what: u32) -> i32 {
        let mut room: [c_int; ROOM] = [0; ROOM];
        // SAFETY: more room than any answer fills.
        unsafe { (self.functions().get_integers)(what, room.as_mut_ptr()) };
        room[0]
    }

    pub(super) fn boolean(&self, what: u32) -> bool {
        let mut room: [c_uchar; ROOM] = [0; ROOM];
        // SAFETY: more room than any answer fills.
        unsafe { (self.functions().get_booleans)(what, room.as_mut_ptr()) };
        room[0] != 0
    }

    pub(super) fn string(&self, what: u32) -> String {
        // SAFETY: the library's texts last until its next call.
        unsafe { text((self.functions().get_string)(what)) }
    }

    pub(super) fn set(&self, what: u32, [x, y, z]: [f64; 3]) {
        let numbers = [x, y, z, 0.0, 0.0, 0.0];
        // SAFETY: more numbers than the function reads.
        unsafe { (self.functions().set_doubles)(what, numbers.as_ptr()) };
    }

    pub(super) fn switch_on(&self, what: u32) {
        // SAFETY: numbers only.
        unsafe { (self.functions().enable)(what) };
    }

    pub(super) fn switch_off(&self, what: u32) {
        // SAFETY: numbers only.
        unsafe { (self.functions().disable)(what) };
    }

    pub(super) fn check_calibration(&self) -> u32 {
        // SAFETY: takes nothing.
        unsafe { (self.functions().check_calibration)() }
    }

    pub(super) fn update_calibration(&self, style: u32) {
        // SAFETY: numbers only.
        unsafe { (self.functions().update_calibration)(style) };
    }

    /// Has `callback` called with `data` in each frame, as soon as the scheduler runs.
    ///
    /// # Safety
    /// `data` must be what the callback takes, and stay until the scheduler has stopped.
    pub(super) unsafe fn schedule(&self, callback: Callback, data: *mut c_void) -> c_ulong {
        // SAFETY: the caller promises what the data is.
        unsafe { (self.functions().schedule)(callback, data, c_ushort::MAX) }
    }

    pub(super) fn unschedule(&self, scheduled: c_ulong) {
        // SAFETY: a number that was given by `schedule`.
        unsafe { (self.functions().unschedule)(scheduled) };
    }

    pub(super) fn start_scheduler(&self) {
        // SAFETY: takes nothing.
        unsafe { (self.functions().start_scheduler)() };
    }

    pub(super) fn stop_scheduler(&self) {
        // SAFETY: takes nothing.
        unsafe { (self.functions().stop_scheduler)() };
    }

    /// The errors since the last call, the newest first; a few at a time. Does not allocate.
    pub(super) fn errors(&self) -> impl Iterator<Item = u32> + use<> {
        let function = self.functions().error;
        (0..ERRORS_MAX).map_while(move |_| {
            // SAFETY: takes nothing.
            let info = unsafe { function() };
            (info.code != 0).then_some(info.code)
        })
    }

    /// An error in the library's words.
    pub(super) fn failure(&self, code: u32) -> Failure {
        // SAFETY: the library's texts last for ever.
        let text = unsafe { text((self.functions().error_text)(code)) };
        Failure { code, text }
    }

    fn functions(&self) -> &'static Functions {
        &self.library.functions
    }
}

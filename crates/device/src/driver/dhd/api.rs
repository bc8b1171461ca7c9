//! The functions of `libdhd` that are used, and one open device through them.
//!
//! m, m/s, rad/s, N, N m. A call returns a negative number where it fails; 1 (called again too soon) and 2 (a motor
//! is saturated) are no failures. The last error is the calling thread's.

#![allow(unsafe_code, reason = "the maker's library is C")]

use std::ffi::{c_char, c_double, c_int, c_uchar, c_uint, c_ushort};

use crate::driver::library::{Library, functions, text};

/// C's `char` as the maker compiles it: signed, also where this machine's is not.
type Id = i8;
type ById = unsafe extern "system" fn(Id) -> c_int;
type Switch = unsafe extern "system" fn(c_int, Id) -> c_int;
type Byte = unsafe extern "system" fn(c_uchar, Id) -> c_int;
type Vector = unsafe extern "system" fn(*mut c_double, *mut c_double, *mut c_double, Id) -> c_int;
type Plain = unsafe extern "system" fn() -> c_int;
type Question = unsafe extern "system" fn(Id) -> u8;

functions! {
    /// The functions of the maker's library, version 3.
    Functions
    required {
        sdk_version: "dhdGetSDKVersion"
            = unsafe extern "system" fn(*mut c_int, *mut c_int, *mut c_int, *mut c_int),
        error: "dhdErrorGetLast" = Plain,
        error_text: "dhdErrorGetLastStr" = unsafe extern "system" fn() -> *const c_char,
        device_count: "dhdGetDeviceCount" = Plain,
        open: "dhdOpen" = Plain,
        open_id: "dhdOpenID" = ById,
        close: "dhdClose" = ById,
        stop: "dhdStop" = ById,
        status: "dhdGetStatus" = unsafe extern "system" fn(*mut c_int, Id) -> c_int,
        enable_force: "dhdEnableForce" = Byte,
        enable_expert_mode: "dhdEnableExpertMode" = Plain,
        set_watchdog: "dhdSetWatchdog" = Byte,
        pose: "dhdGetPositionAndOrientationFrame"
            = unsafe extern "system" fn(*mut c_double, *mut c_double, *mut c_double, *mut c_double, Id) -> c_int,
        linear_velocity: "dhdGetLinearVelocity" = Vector,
        buttons: "dhdGetButtonMask" = unsafe extern "system" fn(Id) -> c_uint,
        set_force: "dhdSetForce" = unsafe extern "system" fn(c_double, c_double, c_double, Id) -> c_int,
    }
    optional {
        disable_expert_mode: "dhdDisableExpertMode" = Plain,
        system_type: "dhdGetSystemType" = ById,
        system_name: "dhdGetSystemName" = unsafe extern "system" fn(Id) -> *const c_char,
        serial_number: "dhdGetSerialNumber" = unsafe extern "system" fn(*mut c_ushort, Id) -> c_int,
        set_gravity_compensation: "dhdSetGravityCompensation" = Switch,
        set_brakes: "dhdSetBrakes" = Switch,
        velocity_threshold: "dhdGetVelocityThreshold" = unsafe extern "system" fn(*mut c_uint, Id) -> c_int,
        has_wrist: "dhdHasWrist" = Question,
        has_active_wrist: "dhdHasActiveWrist" = Question,
        angular_velocity: "dhdGetAngularVelocityRad" = Vector,
        set_force_and_torque: "dhdSetForceAndTorque" = unsafe extern "system" fn(
            c_double, c_double, c_double, c_double, c_double, c_double, Id) -> c_int,
    }
}

/// Room for the status: 16 numbers in version 3.7 of the library, 17 in later ones, and some to spare.
const STATUS_ROOM: usize = 64;

/// A call that the library says has failed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Failure {
    call: &'static str,
    /// The library's error number.
    pub(super) code: i32,
    text: String,
}

impl Failure {
    /// The last error of this thread.
    fn of(library: &Library<Functions>, call: &'static str) -> Self {
        let functions = &library.functions;
        // SAFETY: the library's texts last for ever.
        let (code, text) = unsafe { ((functions.error)(), text((functions.error_text)())) };
        Self { call, code, text }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { call, code, text } = self;
        write!(f, "{call} failed: {text} (error {code})")
    }
}

/// What a device says of its state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Status {
    pub(super) has_power: bool,
    pub(super) is_calibrated: bool,
    pub(super) has_force: bool,
    pub(super) has_error: bool,
    /// Why the forces are off: 0 none, 1 button, 2 velocity, 3 watchdog, 4 software, 5 USB, 6 deadman.
    pub(super) force_off_cause: i32,
}

/// Version of the library: major, minor, release.
pub(super) fn sdk_version(library: &Library<Functions>) -> [i32; 3] {
    let [mut major, mut minor, mut release, mut revision] = [0; 4];
    // SAFETY: four integers to write to.
    unsafe {
        (library.functions.sdk_version)(
            &raw mut major,
            &raw mut minor,
            &raw mut release,
            &raw mut revision,
        );
    }
    [major, minor, release]
}

/// How many devices are attached, open ones among them.
pub(super) fn device_count(library: &Library<Functions>) -> Result<i8, Failure> {
    // SAFETY: takes nothing.
    let count = unsafe { (library.functions.device_count)() };
    if count < 0 {
        return Err(Failure::of(library, "dhdGetDeviceCount"));
    }
    // The number of a device is eight bits wide.
    Ok(i8::try_from(count).unwrap_or(i8::MAX))
}

/// An open device. Not closed by itself: see [`Device::close`].
#[derive(Debug)]
pub(super) struct Device {
    library: &'static Library<Functions>,
    id: Id,
}

impl Device {
    /// The device of this number, or the first that is free.
    pub(super) fn open(
        library: &'static Library<Functions>,
        id: Option<i8>,
    ) -> Result<Self, Failure> {
        let functions = &library.functions;
        // SAFETY: numbers only.
        let (opened, call) = match id {
            None => (unsafe { (functions.open)() }, "dhdOpen"),
            // SAFETY: numbers only.
            Some(id) => (unsafe { (functions.open_id)(id) }, "dhdOpenID"),
        };
        if opened < 0 {
            return Err(Failure::of(library, call));
        }
        // Where the library gives no number that fits, -1 means the device opened last.
        let id = id.unwrap_or_else(|| i8::try_from(opened).unwrap_or(-1));
        Ok(Self { library, id })
    }

    pub(super) fn close(&self) {
        // SAFETY: numbers only; the owner calls nothing after this.
        let _nothing_to_be_done = unsafe { (self.functions().close)(self.id) };
    }

    pub(super) fn stop(&self) {
        // SAFETY: numbers only.
        let _nothing_to_be_done = unsafe { (self.functions().stop)(self.id) };
    }

    pub(super) fn status(&self) -> Result<Status, Failure> {
        let mut room: [c_int; STATUS_ROOM] = [0; STATUS_ROOM];
        // SAFETY: more room than any version of the library fills.
        let returned = unsafe { (self.functions().status)(room.as_mut_ptr(), self.id) };
        self.check("dhdGetStatus", returned)?;
        Ok(Status {
            has_power: room[0] == 1,
            is_calibrated: room[3] == 1,
            has_force: room[5] == 1,
            has_error: room[9] == 1,
            force_off_cause: room[14],
        })
    }

    pub(super) fn enable_force(&self, is_on: bool) -> Result<(), Failure> {
        // SAFETY: numbers only.
        let returned = unsafe { (self.functions().enable_force)(is_on.into(), self.id) };
        self.check("dhdEnableForce", returned)
    }

    /// Forces go off by themselves where no new one comes for so many times 125 us; 0 never.
    pub(super) fn set_watchdog(&self, units: u8) -> Result<(), Failure> {
        let functions = self.functions();
        // SAFETY: takes nothing.
        let returned = unsafe { (functions.enable_expert_mode)() };
        self.check("dhdEnableExpertMode", returned)?;
        // SAFETY: numbers only.
        let returned = unsafe { (functions.set_watchdog)(units, self.id) };
        let answer = self.check("dhdSetWatchdog", returned);
        if let Some(function) = functions.disable_expert_mode {
            // SAFETY: takes nothing.
            let _stays_on = unsafe { function() };
        }
        answer
    }

    /// Position (m) and the frame of the handle, row by row; not numbers where the library wrote none.
    pub(super) fn pose(&self) -> Result<([f64; 3], [f64; 9]), Failure> {
        let [mut x, mut y, mut z] = [f64::NAN; 3];
        let mut frame = [f64::NAN; 9];
        // SAFETY: three numbers and nine in a row, as the function fills.
        let returned = unsafe {
            (self.functions().pose)(
                &raw mut x,
                &raw mut y,
                &raw mut z,
                frame.as_mut_ptr(),
                self.id,
            )
        };
        self.check("dhdGetPositionAndOrientationFrame", returned)?;
        Ok(([x, y, z], frame))
    }

    pub(super) fn linear_velocity(&self) -> Result<[f64; 3], Failure> {
        self.vector("dhdGetLinearVelocity", self.functions().linear_velocity)
    }

    pub(super) fn buttons(&self) -> u32 {
        // SAFETY: numbers only.
        unsafe { (self.functions().buttons)(self.id) }
    }

    pub(super) fn set_force(&self, [x, y, z]: [f64; 3]) -> Result<(), Failure> {
        // SAFETY: numbers only.
        let returned = unsafe { (self.functions().set_force)(x, y, z, self.id) };
        self.check("dhdSetForce", returned)
    }

    // From here on: `None` where the library does not have the function.

    pub(super) fn set_wrench(
        &self,
        [fx, fy, fz, tx, ty, tz]: [f64; 6],
    ) -> Option<Result<(), Failure>> {
        let function = self.functions().set_force_and_torque?;
        // SAFETY: numbers only.
        let returned = unsafe { function(fx, fy, fz, tx, ty, tz, self.id) };
        Some(self.check("dhdSetForceAndTorque", returned))
    }

    pub(super) fn angular_velocity(&self) -> Option<Result<[f64; 3], Failure>> {
        let function = self.functions().angular_velocity?;
        Some(self.vector("dhdGetAngularVelocityRad", function))
    }

    pub(super) fn system_type(&self) -> Option<i32> {
        let function = self.functions().system_type?;
        // SAFETY: numbers only.
        Some(unsafe { function(self.id) })
    }

    pub(super) fn system_name(&self) -> Option<String> {
        let function = self.functions().system_name?;
        // SAFETY: the library's texts last for ever.
        let name = unsafe { text(function(self.id)) };
        (!name.is_empty()).then_some(name)
    }

    pub(super) fn serial_number(&self) -> Option<u16> {
        let function = self.functions().serial_number?;
        let mut number = 0;
        // SAFETY: one number to write to.
        let returned = unsafe { function(&raw mut number, self.id) };
        (returned >= 0).then_some(number)
    }

    pub(super) fn compensate_gravity(&self) -> Option<Result<(), Failure>> {
        let function = self.functions().set_gravity_compensation?;
        // SAFETY: numbers only.
        let returned = unsafe { function(1, self.id) };
        Some(self.check("dhdSetGravityCompensation", returned))
    }

    pub(super) fn brake(&self) {
        if let Some(function) = self.functions().set_brakes {
            // SAFETY: numbers only.
            let _nothing_to_be_done = unsafe { function(1, self.id) };
        }
    }

    /// In the library's own unit; 0 where it is off.
    pub(super) fn velocity_threshold(&self) -> Option<u32> {
        let function = self.functions().velocity_threshold?;
        let mut threshold = 0;
        // SAFETY: one number to write to.
        let returned = unsafe { function(&raw mut threshold, self.id) };
        (returned >= 0).then_some(threshold)
    }

    pub(super) fn has_wrist(&self) -> bool {
        self.ask(self.functions().has_wrist)
    }

    /// With motors that can render a torque, and a function to give it to them.
    pub(super) fn has_active_wrist(&self) -> bool {
        self.functions().set_force_and_torque.is_some()
            && self.ask(self.functions().has_active_wrist)
    }

    fn functions(&self) -> &'static Functions {
        &self.library.functions
    }

    fn ask(&self, function: Option<Question>) -> bool {
        // SAFETY: numbers only. C's `bool` is one byte; read as a number, whatever stands in it.
        function.is_some_and(|function| unsafe { function(self.id) } != 0)
    }

    fn vector(&self, call: &'static str, function: Vector) -> Result<[f64; 3], Failure> {
        let [mut x, mut y, mut z] = [f64::NAN; 3];
        // SAFETY: three numbers to write to.
        let returned = unsafe { function(&raw mut x, &raw mut y, &raw mut z, self.id) };
        self.check(call, returned)?;
        Ok([x, y, z])
    }

    fn check(&self, call: &'static str, returned: c_int) -> Result<(), Failure> {
        if returned < 0 {
            Err(Failure::of(self.library, call))
        } else {
            Ok(())
        }
    }
}

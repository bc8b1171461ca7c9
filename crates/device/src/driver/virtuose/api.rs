//! The functions of `libvirtuose` that are used, and one open connection through them.
//!
//! All numbers are in single precision: poses x, y, z, qx, qy, qz, qw (m), twists and wrenches three linear and three
//! angular components (m/s, rad/s, N, N m). A call returns 0, or else its error is asked for.

#![allow(unsafe_code, reason = "the maker's library is C")]

use std::ffi::{CStr, c_char, c_int, c_uint, c_void};

use crate::driver::library::{Library, functions, text};

type Context = *mut c_void;
type Set<T> = unsafe extern "C" fn(Context, T) -> c_int;
type Get<T> = unsafe extern "C" fn(Context, *mut T) -> c_int;
/// Reads or writes an array; which of them, the name of the function says.
type Array = unsafe extern "C" fn(Context, *mut f32) -> c_int;
/// Writes two integers.
type Pair = unsafe extern "C" fn(Context, *mut c_int, *mut c_int) -> c_int;

functions! {
    /// The functions of the maker's library, version 3 or 4.
    Functions
    required {
        api_version: "virtAPIVersion" = unsafe extern "C" fn(*mut c_int, *mut c_int) -> c_int,
        open: "virtOpen" = unsafe extern "C" fn(*const c_char) -> Context,
        close: "virtClose" = unsafe extern "C" fn(Context) -> c_int,
        error_code: "virtGetErrorCode" = unsafe extern "C" fn(Context) -> c_int,
        error_message: "virtGetErrorMessage" = unsafe extern "C" fn(c_int) -> *const c_char,
        set_indexing_mode: "virtSetIndexingMode" = Set<c_int>,
        set_force_factor: "virtSetForceFactor" = Set<f32>,
        set_speed_factor: "virtSetSpeedFactor" = Set<f32>,
        set_time_step: "virtSetTimeStep" = Set<f32>,
        set_base_frame: "virtSetBaseFrame" = Array,
        set_observation_frame: "virtSetObservationFrame" = Array,
        set_command_type: "virtSetCommandType" = Set<c_int>,
        set_power_on: "virtSetPowerOn" = Set<c_int>,
        position: "virtGetPosition" = Array,
        speed: "virtGetSpeed" = Array,
        set_force: "virtSetForce" = Array,
        dead_man: "virtGetDeadMan" = Get<c_int>,
        emergency_stop: "virtGetEmergencyStop" = Get<c_int>,
    }
    optional {
        controller_version: "virtGetControlerVersion" = Pair,
        device_id: "virtGetDeviceID" = Pair,
        saturate_torque: "virtSaturateTorque" = unsafe extern "C" fn(Context, f32, f32) -> c_int,
        enable_force_feedback: "virtEnableForceFeedback" = Set<c_int>,
        power_on: "virtGetPowerOn" = Get<c_int>,
        button: "virtGetButton" = unsafe extern "C" fn(Context, c_int, *mut c_int) -> c_int,
        is_in_shift_position: "virtIsInShiftPosition" = Get<c_int>,
        alarm: "virtGetAlarm" = Get<c_uint>,
        failure: "virtGetFailure" = Get<c_uint>,
        detach: "virtDetachVO" = unsafe extern "C" fn(Context) -> c_int,
    }
}

/// Room for the numbers of any call, twice what the longest one writes.
const ROOM: usize = 16;

/// A call that the library says has failed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Failure {
    call: &'static str,
    /// The library's error number.
    pub(super) code: i32,
    text: String,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { call, code, text } = self;
        write!(f, "{call} failed: {text} (error {code})")
    }
}

/// Version of the library: major, minor.
pub(super) fn api_version(library: &Library<Functions>) -> (i32, i32) {
    let (mut major, mut minor) = (0, 0);
    // SAFETY: two integers to write to.
    let _as_it_left_them =
        unsafe { (library.functions.api_version)(&raw mut major, &raw mut minor) };
    (major, minor)
}

/// An open connection to a controller. Not closed by itself: see [`Connection::close`].
#[derive(Debug)]
pub(super) struct Connection {
    library: &'static Library<Functions>,
    context: Context,
}

impl Connection {
    pub(super) fn open(
        library: &'static Library<Functions>,
        address: &CStr,
    ) -> Result<Self, Failure> {
        // SAFETY: a text that ends with a zero.
        let context = unsafe { (library.functions.open)(address.as_ptr()) };
        let connection = Self { library, context };
        if context.is_null() {
            return Err(connection.failure("virtOpen"));
        }
        Ok(connection)
    }

    pub(super) fn close(&self) {
        // SAFETY: the connection is open; its owner calls nothing after this.
        let _nothing_to_be_done = unsafe { (self.functions().close)(self.context) };
    }

    pub(super) fn set_indexing_mode(&self, mode: i32) -> Result<(), Failure> {
        self.set(
            "virtSetIndexingMode",
            self.functions().set_indexing_mode,
            mode,
        )
    }

    pub(super) fn set_force_factor(&self, factor: f32) -> Result<(), Failure> {
        self.set(
            "virtSetForceFactor",
            self.functions().set_force_factor,
            factor,
        )
    }

    pub(super) fn set_speed_factor(&self, factor: f32) -> Result<(), Failure> {
        self.set(
            "virtSetSpeedFactor",
            self.functions().set_speed_factor,
            factor,
        )
    }

    pub(super) fn set_time_step(&self, step_s: f32) -> Result<(), Failure> {
        self.set("virtSetTimeStep", self.functions().set_time_step, step_s)
    }

    pub(super) fn set_base_frame(&self, pose: &[f32; 7]) -> Result<(), Failure> {
        self.put("virtSetBaseFrame", self.functions().set_base_frame, pose)
    }

    pub(super) fn set_observation_frame(&self, pose: &[f32; 7]) -> Result<(), Failure> {
        let function = self.functions().set_observation_frame;
        self.put("virtSetObservationFrame", function, pose)
    }

    pub(super) fn set_command_type(&self, command_type: i32) -> Result<(), Failure> {
        self.set(
            "virtSetCommandType",
            self.functions().set_command_type,
            command_type,
        )
    }

    pub(super) fn set_power_on(&self, is_on: bool) -> Result<(), Failure> {
        self.set(
            "virtSetPowerOn",
            self.functions().set_power_on,
            is_on.into(),
        )
    }

    pub(super) fn set_force(&self, wrench: &[f32; 6]) -> Result<(), Failure> {
        self.put("virtSetForce", self.functions().set_force, wrench)
    }

    /// x, y, z, qx, qy, qz, qw; not a number where the library wrote none.
    pub(super) fn position(&self) -> Result<[f64; 7], Failure> {
        self.numbers("virtGetPosition", self.functions().position)
    }

    pub(super) fn speed(&self) -> Result<[f64; 6], Failure> {
        self.numbers("virtGetSpeed", self.functions().speed)
    }

    pub(super) fn dead_man(&self) -> Result<bool, Failure> {
        self.get("virtGetDeadMan", self.functions().dead_man)
            .map(|on| on == 1)
    }

    /// Is the chain of the emergency stop closed?
    pub(super) fn emergency_stop(&self) -> Result<bool, Failure> {
        self.get("virtGetEmergencyStop", self.functions().emergency_stop)
            .map(|closed| closed == 1)
    }

    // From here on: `None` where the library does not have the function.

    pub(super) fn controller_version(&self) -> Option<(i32, i32)> {
        self.pair(self.functions().controller_version?)
    }

    /// Type and serial number.
    pub(super) fn device_id(&self) -> Option<(i32, i32)> {
        self.pair(self.functions().device_id?)
    }

    pub(super) fn saturate_torque(&self, force: f32, torque: f32) -> Option<Result<(), Failure>> {
        let function = self.functions().saturate_torque?;
        // SAFETY: the connection is open.
        let returned = unsafe { function(self.context, force, torque) };
        Some(self.check("virtSaturateTorque", returned))
    }

    pub(super) fn enable_force_feedback(&self) -> Option<Result<(), Failure>> {
        let function = self.functions().enable_force_feedback?;
        Some(self.set("virtEnableForceFeedback", function, 1))
    }

    pub(super) fn power_on(&self) -> Option<Result<bool, Failure>> {
        let function = self.functions().power_on?;
        Some(self.get("virtGetPowerOn", function).map(|on| on == 1))
    }

    /// `None` also where there is no such button.
    pub(super) fn button(&self, number: i32) -> Option<bool> {
        let function = self.functions().button?;
        let mut state = 0;
        // SAFETY: the connection is open, one integer to write to.
        let returned = unsafe { function(self.context, number, &raw mut state) };
        (returned == 0).then_some(state == 1)
    }

    pub(super) fn is_in_shift_position(&self) -> Option<Result<bool, Failure>> {
        let function = self.functions().is_in_shift_position?;
        Some(
            self.get("virtIsInShiftPosition", function)
                .map(|on| on == 1),
        )
    }

    pub(super) fn alarm(&self) -> Option<Result<u32, Failure>> {
        Some(self.get("virtGetAlarm", self.functions().alarm?))
    }

    pub(super) fn failure_bits(&self) -> Option<Result<u32, Failure>> {
        Some(self.get("virtGetFailure", self.functions().failure?))
    }

    pub(super) fn detach(&self) {
        if let Some(function) = self.functions().detach {
            // SAFETY: the connection is open.
            let _nothing_was_attached = unsafe { function(self.context) };
        }
    }

    fn functions(&self) -> &'static Functions {
        &self.library.functions
    }

    fn set<T>(&self, call: &'static str, function: Set<T>, value: T) -> Result<(), Failure> {
        // SAFETY: the connection is open, and the type of the value is the function's.
        self.check(call, unsafe { function(self.context, value) })
    }

    fn put<const N: usize>(
        &self,
        call: &'static str,
        function: Array,
        numbers: &[f32; N],
    ) -> Result<(), Failure> {
        let mut room = [0.0; ROOM];
        room[..N].copy_from_slice(numbers);
        // SAFETY: the connection is open, and there are more numbers than the function reads.
        self.check(call, unsafe { function(self.context, room.as_mut_ptr()) })
    }

    fn numbers<const N: usize>(
        &self,
        call: &'static str,
        function: Array,
    ) -> Result<[f64; N], Failure> {
        let mut room = [f32::NAN; ROOM];
        // SAFETY: the connection is open, and there is more room than the function fills.
        self.check(call, unsafe { function(self.context, room.as_mut_ptr()) })?;
        Ok(std::array::from_fn(|i| room[i].into()))
    }

    fn get<T: Copy + Default>(&self, call: &'static str, function: Get<T>) -> Result<T, Failure> {
        let mut value = T::default();
        // SAFETY: the connection is open, one value to write to.
        self.check(call, unsafe { function(self.context, &raw mut value) })?;
        Ok(value)
    }

    fn pair(&self, function: Pair) -> Option<(i32, i32)> {
        let (mut first, mut second) = (0, 0);
        // SAFETY: the connection is open, two integers to write to.
        let returned = unsafe { function(self.context, &raw mut first, &raw mut second) };
        (returned == 0).then_some((first, second))
    }

    fn check(&self, call: &'static str, returned: c_int) -> Result<(), Failure> {
        if returned == 0 {
            Ok(())
        } else {
            Err(self.failure(call))
        }
    }

    /// The last error; the connection may be one that was never opened.
    fn failure(&self, call: &'static str) -> Failure {
        // SAFETY: the library takes null for the last error without a connection; its texts last for ever.
        let (code, text) = unsafe {
            let code = (self.functions().error_code)(self.context);
            (code, text((self.functions().error_message)(code)))
        };
        Failure { call, code, text }
    }
}

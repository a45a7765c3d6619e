//! The functions of FMI 3.0 for co-simulation, from the standard's text (FMI 3.0.2, sections 2.2 and 4.2).

#![allow(
    unsafe_code,
    reason = "a foreign library is called through pointers; every call says why its arguments hold"
)]

use std::ffi::{CStr, c_char, c_int, c_void};

use libloading::Library;
use toml_input::Message;

use crate::instance::{Flags, Identity, Status};
use crate::log::Log;
use crate::two::symbol;

type Component = *mut c_void;
type Simple = unsafe extern "C" fn(Component) -> c_int;
type LogMessage = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);

#[derive(Debug, Clone, Copy)]
#[allow(clippy::type_complexity, reason = "the standard's signatures, each used once")]
pub(crate) struct Functions {
    instantiate: unsafe extern "C" fn(
        *const c_char,
        *const c_char,
        *const c_char,
        bool,
        bool,
        bool,
        bool,
        *const u32,
        usize,
        *mut c_void,
        LogMessage,
        *const c_void,
    ) -> Component,
    free_instance: unsafe extern "C" fn(Component),
    enter: unsafe extern "C" fn(Component, bool, f64, f64, bool, f64) -> c_int,
    exit: Simple,
    reset: Simple,
    terminate: Simple,
    get_float: unsafe extern "C" fn(Component, *const u32, usize, *mut f64, usize) -> c_int,
    set_float: unsafe extern "C" fn(Component, *const u32, usize, *const f64, usize) -> c_int,
    set_int: unsafe extern "C" fn(Component, *const u32, usize, *const i32, usize) -> c_int,
    set_boolean: unsafe extern "C" fn(Component, *const u32, usize, *const bool, usize) -> c_int,
    do_step: unsafe extern "C" fn(Component, f64, f64, bool, *mut u8, *mut u8, *mut u8, *mut f64) -> c_int,
}

impl Functions {
    pub fn of(library: &Library) -> Result<Self, Message> {
        let version: unsafe extern "C" fn() -> *const c_char = symbol(library, "fmi3GetVersion")?;
        // SAFETY: the function has no arguments, and its answer is a constant text of the library
        let said = unsafe { CStr::from_ptr(version()) }.to_string_lossy();
        if !said.starts_with("3.") {
            let message = Message::new("the binary of the FMU is of another version of FMI than its description");
            return Err(message
                .found(format!("fmi3GetVersion says \"{}\"", said.escape_debug()))
                .expected("3.0"));
        }
        Ok(Self {
            instantiate: symbol(library, "fmi3InstantiateCoSimulation")?,
            free_instance: symbol(library, "fmi3FreeInstance")?,
            enter: symbol(library, "fmi3EnterInitializationMode")?,
            exit: symbol(library, "fmi3ExitInitializationMode")?,
            reset: symbol(library, "fmi3Reset")?,
            terminate: symbol(library, "fmi3Terminate")?,
            get_float: symbol(library, "fmi3GetFloat64")?,
            set_float: symbol(library, "fmi3SetFloat64")?,
            set_int: symbol(library, "fmi3SetInt32")?,
            set_boolean: symbol(library, "fmi3SetBoolean")?,
            do_step: symbol(library, "fmi3DoStep")?,
        })
    }

    /// A new instance without event mode, early return and intermediate updates; null if the FMU refuses.
    pub fn instantiate(&self, identity: &Identity, log: &Log) -> Component {
        let (name, token, resources) = (&identity.name, &identity.token, &identity.resources);
        // SAFETY: texts end with NUL and live through the call; the log is boxed beside the instance and outlives it; no
        // intermediate variable is required, so their list may be null
        unsafe {
            (self.instantiate)(
                name.as_ptr(),
                token.as_ptr(),
                resources.as_ptr(),
                false,
                log.is_wanted(),
                false,
                false,
                std::ptr::null(),
                0,
                std::ptr::from_ref(log).cast_mut().cast(),
                message,
                std::ptr::null(),
            )
        }
    }

    pub fn initialise(&self, at: Component) -> (Status, &'static str) {
        // SAFETY: a live instance in the state "instantiated"; the tolerance and the end are said not to be defined
        let status = unsafe { (self.enter)(at, false, 0.0, 0.0, false, 0.0) };
        (Status::of(status), "fmi3EnterInitializationMode")
    }

    pub fn start(&self, at: Component) -> (Status, &'static str) {
        // SAFETY: a live instance in initialisation mode
        (Status::of(unsafe { (self.exit)(at) }), "fmi3ExitInitializationMode")
    }

    pub fn reset(&self, at: Component) -> Status {
        // SAFETY: a live instance
        Status::of(unsafe { (self.reset)(at) })
    }

    pub fn end(&self, at: Component, is_running: bool) {
        // SAFETY: a live instance, not used behind this; `fmi3Terminate` belongs to one that is running only
        unsafe {
            if is_running {
                (self.terminate)(at);
            }
            (self.free_instance)(at);
        }
    }

    pub fn get(&self, at: Component, reference: u32) -> (Status, f64) {
        let mut value = f64::NAN;
        // SAFETY: one reference of a scalar and room for one value
        let status = unsafe { (self.get_float)(at, &raw const reference, 1, &raw mut value, 1) };
        (Status::of(status), value)
    }

    pub fn set(&self, at: Component, reference: u32, value: f64) -> Status {
        // SAFETY: one reference of a scalar and one value
        Status::of(unsafe { (self.set_float)(at, &raw const reference, 1, &raw const value, 1) })
    }

    pub fn set_integer(&self, at: Component, reference: u32, value: i32) -> Status {
        // SAFETY: one reference of a scalar and one value
        Status::of(unsafe { (self.set_int)(at, &raw const reference, 1, &raw const value, 1) })
    }

    pub fn set_boolean(&self, at: Component, reference: u32, value: bool) -> Status {
        // SAFETY: one reference of a scalar and one value
        Status::of(unsafe { (self.set_boolean)(at, &raw const reference, 1, &raw const value, 1) })
    }

    pub fn do_step(&self, at: Component, time: f64, step: f64) -> (Status, Flags) {
        // as bytes: a foreign library may write another number than 0 and 1, which no `bool` of Rust may hold
        let (mut event, mut terminate, mut early, mut reached) = (0_u8, 0_u8, 0_u8, f64::NAN);
        // SAFETY: a live instance that is running, and room for each answer
        let status = unsafe {
            (self.do_step)(
                at,
                time,
                step,
                true,
                &raw mut event,
                &raw mut terminate,
                &raw mut early,
                &raw mut reached,
            )
        };
        let flags = Flags {
            wants_end: terminate != 0,
            is_early: early != 0,
            reached: reached.is_finite().then_some(reached),
        };
        (Status::of(status), flags)
    }
}

unsafe extern "C" fn message(environment: *mut c_void, status: c_int, _: *const c_char, text: *const c_char) {
    // SAFETY: the environment is the log that was given to the instance, or null from an FMU that forgot it
    let log = unsafe { environment.cast::<Log>().as_ref() };
    if let (Some(log), false) = (log, text.is_null()) {
        // SAFETY: the standard asks for a text that ends with NUL
        log.say(Status::of(status), &unsafe { CStr::from_ptr(text) }.to_string_lossy());
    }
}

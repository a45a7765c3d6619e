//! The functions of FMI 2.0 for co-simulation, from the standard's text (FMI 2.0.5, sections 2.1 and 4.2).

#![allow(
    unsafe_code,
    reason = "a foreign library is called through pointers; every call says why its arguments hold"
)]

use std::ffi::{CStr, c_char, c_int, c_uint, c_void};

use libloading::Library;
use toml_input::Message;

use crate::instance::{Flags, Identity, Status};
use crate::log::Log;

/// `fmi2CoSimulation`
const CO_SIMULATION: c_int = 1;
/// `fmi2LastSuccessfulTime`
const LAST_SUCCESSFUL_TIME: c_int = 2;

type Component = *mut c_void;
type Simple = unsafe extern "C" fn(Component) -> c_int;
// the standard's logger has more arguments behind these, as printf: a caller of a variadic function passes what is named in the
// same places as to a plain one on every ABI that is supported here, so those behind are simply not looked at
type Logger = unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char);

/// `fmi2CallbackFunctions`
#[repr(C)]
#[derive(Debug)]
pub(crate) struct Callbacks {
    logger: Logger,
    allocate: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    free: unsafe extern "C" fn(*mut c_void),
    finished: Option<unsafe extern "C" fn(*mut c_void, c_int)>,
    environment: *mut c_void,
}

// the C library's own: an FMU may ask for memory of any alignment that `malloc` gives
unsafe extern "C" {
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(memory: *mut c_void);
}

#[derive(Debug, Clone, Copy)]
#[allow(clippy::type_complexity, reason = "the standard's signatures, each used once")]
pub(crate) struct Functions {
    instantiate: unsafe extern "C" fn(
        *const c_char,
        c_int,
        *const c_char,
        *const c_char,
        *const Callbacks,
        c_int,
        c_int,
    ) -> Component,
    free_instance: unsafe extern "C" fn(Component),
    setup: unsafe extern "C" fn(Component, c_int, f64, f64, c_int, f64) -> c_int,
    enter: Simple,
    exit: Simple,
    reset: Simple,
    terminate: Simple,
    get_real: unsafe extern "C" fn(Component, *const c_uint, usize, *mut f64) -> c_int,
    set_real: unsafe extern "C" fn(Component, *const c_uint, usize, *const f64) -> c_int,
    set_integer: unsafe extern "C" fn(Component, *const c_uint, usize, *const c_int) -> c_int,
    set_boolean: unsafe extern "C" fn(Component, *const c_uint, usize, *const c_int) -> c_int,
    do_step: unsafe extern "C" fn(Component, f64, f64, c_int) -> c_int,
    real_status: unsafe extern "C" fn(Component, c_int, *mut f64) -> c_int,
}

impl Functions {
    pub fn of(library: &Library) -> Result<Self, Message> {
        let version: unsafe extern "C" fn() -> *const c_char = symbol(library, "fmi2GetVersion")?;
        // SAFETY: the function has no arguments, and its answer is a constant text of the library
        let said = unsafe { CStr::from_ptr(version()) }.to_string_lossy();
        if said != "2.0" {
            let message = Message::new("the binary of the FMU is of another version of FMI than its description");
            return Err(message
                .found(format!("fmi2GetVersion says \"{}\"", said.escape_debug()))
                .expected("2.0"));
        }
        Ok(Self {
            instantiate: symbol(library, "fmi2Instantiate")?,
            free_instance: symbol(library, "fmi2FreeInstance")?,
            setup: symbol(library, "fmi2SetupExperiment")?,
            enter: symbol(library, "fmi2EnterInitializationMode")?,
            exit: symbol(library, "fmi2ExitInitializationMode")?,
            reset: symbol(library, "fmi2Reset")?,
            terminate: symbol(library, "fmi2Terminate")?,
            get_real: symbol(library, "fmi2GetReal")?,
            set_real: symbol(library, "fmi2SetReal")?,
            set_integer: symbol(library, "fmi2SetInteger")?,
            set_boolean: symbol(library, "fmi2SetBoolean")?,
            do_step: symbol(library, "fmi2DoStep")?,
            real_status: symbol(library, "fmi2GetRealStatus")?,
        })
    }

    /// A new instance, null if the FMU refuses. The callbacks have to live as long as it does.
    pub fn instantiate(&self, identity: &Identity, log: &Log, callbacks: &mut Option<Box<Callbacks>>) -> Component {
        let own = callbacks.insert(Box::new(Callbacks {
            logger: message,
            allocate: calloc,
            free,
            finished: None,
            environment: std::ptr::from_ref(log).cast_mut().cast(),
        }));
        let (name, token, resources) = (&identity.name, &identity.token, &identity.resources);
        let logging = c_int::from(log.is_wanted());
        // SAFETY: texts end with NUL and live through the call; callbacks and log are boxed beside the instance and outlive it
        unsafe {
            (self.instantiate)(
                name.as_ptr(),
                CO_SIMULATION,
                token.as_ptr(),
                resources.as_ptr(),
                std::ptr::from_ref::<Callbacks>(own),
                0,
                logging,
            )
        }
    }

    pub fn initialise(&self, at: Component) -> (Status, &'static str) {
        // SAFETY: `at` is a live instance in the state "instantiated"; the tolerance and the end are said not to be defined
        let status = Status::of(unsafe { (self.setup)(at, 0, 0.0, 0.0, 0, 0.0) });
        if status.is_failure() {
            return (status, "fmi2SetupExperiment");
        }
        // SAFETY: a live instance
        (Status::of(unsafe { (self.enter)(at) }), "fmi2EnterInitializationMode")
    }

    pub fn start(&self, at: Component) -> (Status, &'static str) {
        // SAFETY: a live instance in initialisation mode
        (Status::of(unsafe { (self.exit)(at) }), "fmi2ExitInitializationMode")
    }

    pub fn reset(&self, at: Component) -> Status {
        // SAFETY: a live instance
        Status::of(unsafe { (self.reset)(at) })
    }

    pub fn end(&self, at: Component, is_running: bool) {
        // SAFETY: a live instance, not used behind this; `fmi2Terminate` belongs to one that is running only
        unsafe {
            if is_running {
                (self.terminate)(at);
            }
            (self.free_instance)(at);
        }
    }

    pub fn get(&self, at: Component, reference: u32) -> (Status, f64) {
        let mut value = f64::NAN;
        // SAFETY: one reference and room for one value
        let status = unsafe { (self.get_real)(at, &raw const reference, 1, &raw mut value) };
        (Status::of(status), value)
    }

    pub fn set(&self, at: Component, reference: u32, value: f64) -> Status {
        // SAFETY: one reference and one value
        Status::of(unsafe { (self.set_real)(at, &raw const reference, 1, &raw const value) })
    }

    pub fn set_integer(&self, at: Component, reference: u32, value: i32) -> Status {
        // SAFETY: one reference and one value
        Status::of(unsafe { (self.set_integer)(at, &raw const reference, 1, &raw const value) })
    }

    pub fn set_boolean(&self, at: Component, reference: u32, value: bool) -> Status {
        let value = c_int::from(value);
        // SAFETY: one reference and one value
        Status::of(unsafe { (self.set_boolean)(at, &raw const reference, 1, &raw const value) })
    }

    pub fn do_step(&self, at: Component, time: f64, step: f64) -> (Status, Flags) {
        // SAFETY: a live instance that is running; the state before is never asked for again
        let status = Status::of(unsafe { (self.do_step)(at, time, step, 1) });
        let mut reached = None;
        if status == Status::Discard {
            let mut last = f64::NAN;
            // SAFETY: room for one value
            let said = unsafe { (self.real_status)(at, LAST_SUCCESSFUL_TIME, &raw mut last) };
            reached = (said == 0 && last.is_finite()).then_some(last);
        }
        let flags = Flags {
            reached,
            ..Flags::default()
        };
        (status, flags)
    }
}

/// A function of the library, with the signature that the caller says it has.
pub(crate) fn symbol<T: Copy>(library: &Library, name: &str) -> Result<T, Message> {
    // SAFETY: the signature is the standard's for this name, and the library says that it follows the standard
    let found = unsafe { library.get::<T>(name.as_bytes()) };
    found.map(|symbol| *symbol).map_err(|_| {
        Message::new("the binary of the FMU lacks a function")
            .found(format!("no `{name}`"))
            .expected("all functions of FMI")
    })
}

unsafe extern "C" fn message(
    environment: *mut c_void,
    _: *const c_char,
    status: c_int,
    _: *const c_char,
    text: *const c_char,
) {
    // SAFETY: the environment is the log that was given to the instance, or null from an FMU that forgot it
    let log = unsafe { environment.cast::<Log>().as_ref() };
    if let (Some(log), false) = (log, text.is_null()) {
        // SAFETY: the standard asks for a text that ends with NUL
        log.say(Status::of(status), &unsafe { CStr::from_ptr(text) }.to_string_lossy());
    }
}

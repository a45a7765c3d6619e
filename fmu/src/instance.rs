//! The binary of an FMU, and an instance in it: states, calls and what went wrong in words.
//!
//! ```text
//!  instantiate ─► set start values ─► initialise ─► set inputs ─► start ─► (set inputs, step, read)* ─► reset or end
//! ```
//!
//! Invariant: an instance that said `fatal` is never called again, not even to free it; one that said `error` is freed.

#![allow(
    unsafe_code,
    reason = "a library is loaded, and a pointer to an instance goes to another thread"
)]

use std::ffi::{CString, c_int, c_void};
use std::mem::ManuallyDrop;
use std::path::Path;
use std::sync::Arc;

use tempfile::TempDir;
use toml_input::Message;

use crate::description::{Kind, Version};
use crate::log::{Log, Tell};
use crate::{three, two};

/// What a function of FMI answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Status {
    Ok,
    Warning,
    Discard,
    Error,
    Fatal,
    /// Pending, which nobody asked for, or a number that the standard does not know.
    Unknown,
}

impl Status {
    pub fn of(number: c_int) -> Self {
        match number {
            0 => Status::Ok,
            1 => Status::Warning,
            2 => Status::Discard,
            3 => Status::Error,
            4 => Status::Fatal,
            _ => Status::Unknown,
        }
    }

    pub fn is_failure(self) -> bool {
        !matches!(self, Status::Ok | Status::Warning)
    }

    pub fn word(self) -> &'static str {
        match self {
            Status::Ok => "ok",
            Status::Warning => "warning",
            Status::Discard => "discard",
            Status::Error => "error",
            Status::Fatal => "fatal",
            Status::Unknown => "a status that FMI does not know",
        }
    }
}

/// What a step says beside its status.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Flags {
    pub wants_end: bool,
    pub is_early: bool,
    /// s
    pub reached: Option<f64>,
}

/// With what an instance is made.
#[derive(Debug)]
pub(crate) struct Identity {
    pub name: CString,
    pub token: CString,
    pub resources: CString,
}

#[derive(Debug, Clone, Copy)]
enum Functions {
    Two(two::Functions),
    Three(three::Functions),
}

/// The same call in both versions.
macro_rules! both {
    ($functions:expr, $call:ident($($argument:expr),*)) => {
        match $functions {
            Functions::Two(functions) => functions.$call($($argument),*),
            Functions::Three(functions) => functions.$call($($argument),*),
        }
    };
}

/// A loaded binary, with what was unpacked beside it.
#[derive(Debug)]
pub(crate) struct Binary {
    functions: Functions,
    identity: Identity,
    shown: String,
    tell: Option<Tell>,
    // never unloaded: FMUs leave threads and exit handlers behind, and the process would run into nothing
    _library: ManuallyDrop<libloading::Library>,
    _folder: TempDir,
}

impl Binary {
    /// Loads `file` of the unpacked `folder`, which runs what the library does when it is loaded.
    ///
    /// # Errors
    /// If it cannot be loaded, or lacks a function of its version.
    pub fn load(
        folder: TempDir,
        file: &Path,
        version: Version,
        token: &str,
        shown: &str,
        tell: Option<Tell>,
    ) -> Result<Self, Message> {
        let path = folder.path().join(file);
        // SAFETY: none can be given: this runs foreign code, which the user has allowed by name
        let library = unsafe { libloading::Library::new(&path) }.map_err(|error| {
            let message = Message::new("the binary of the FMU cannot be loaded").found(error.to_string());
            message.hint("it may need a library that is not installed (`ldd` on the unpacked binary), or TMPDIR allows no programs")
        })?;
        let functions = match version {
            Version::Two => Functions::Two(two::Functions::of(&library)?),
            Version::Three => Functions::Three(three::Functions::of(&library)?),
        };
        let resources = folder.path().join("resources");
        std::fs::create_dir_all(&resources)
            .map_err(|error| Message::new("the FMU cannot be unpacked").found(error.to_string()))?;
        let resources = match version {
            Version::Two => address(&resources),
            // with a separator at the end, as the standard has it
            Version::Three => format!("{}{}", resources.display(), std::path::MAIN_SEPARATOR),
        };
        let text = |text: &str| CString::new(text).map_err(|_| Message::new("a text of the FMU has a NUL in it"));
        Ok(Self {
            functions,
            identity: Identity {
                name: text("converter")?,
                token: text(token)?,
                resources: text(&resources)?,
            },
            shown: shown.to_owned(),
            tell,
            _library: ManuallyDrop::new(library),
            _folder: folder,
        })
    }
}

/// A path as a URI.
fn address(path: &Path) -> String {
    use std::fmt::Write;
    let mut uri = String::from("file://");
    let path = path.display().to_string().replace('\\', "/");
    if !path.starts_with('/') {
        uri.push('/');
    }
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"/-_.~:".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            // writing to a String cannot fail
            let _ = write!(uri, "%{byte:02X}");
        }
    }
    uri
}

/// A variable that is read or written.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Port {
    pub name: String,
    pub reference: u32,
    pub kind: Kind,
}

/// One instance.
#[derive(Debug)]
pub(crate) struct Instance {
    component: *mut c_void,
    is_running: bool,
    /// Said `fatal`.
    is_lost: bool,
    binary: Arc<Binary>,
    // boxed: the FMU holds their addresses
    log: Box<Log>,
    callbacks: Option<Box<two::Callbacks>>,
}

// SAFETY: the standards let an instance be called from any thread, by one at a time; `&mut self` sees to that
unsafe impl Send for Instance {}
// SAFETY: nothing but `Debug`, which prints the address, takes a shared reference
unsafe impl Sync for Instance {}

impl Instance {
    /// A new instance.
    ///
    /// # Errors
    /// If the FMU refuses.
    pub fn new(binary: &Arc<Binary>) -> Result<Self, Message> {
        let log = Box::new(Log::new(&binary.shown, binary.tell));
        let mut callbacks = None;
        let component = match &binary.functions {
            Functions::Two(functions) => functions.instantiate(&binary.identity, &log, &mut callbacks),
            Functions::Three(functions) => functions.instantiate(&binary.identity, &log),
        };
        let own = Self {
            component,
            is_running: false,
            is_lost: component.is_null(),
            binary: Arc::clone(binary),
            log,
            callbacks,
        };
        if component.is_null() {
            let found = own.log.complaint().unwrap_or_else(|| "no instance".to_owned());
            let hint =
                "its token may be that of another build, or its licence is missing; --verbose shows what it says";
            return Err(Message::new("the FMU makes no instance of itself")
                .found(found)
                .hint(hint));
        }
        Ok(own)
    }

    /// Back to where it was when it was made. Of one that cannot, the caller makes a new one.
    pub fn reset(&mut self) -> bool {
        if self.is_lost || both!(&self.binary.functions, reset(self.component)).is_failure() {
            return false;
        }
        self.is_running = false;
        true
    }

    /// Before [`Instance::start`]; start values come before, inputs behind.
    pub fn initialise(&mut self) -> Result<(), Message> {
        let (status, what) = both!(&self.binary.functions, initialise(self.component));
        self.judge(status, || format!("{what} at the start"))
    }

    pub fn start(&mut self) -> Result<(), Message> {
        let (status, what) = both!(&self.binary.functions, start(self.component));
        self.is_running = !status.is_failure();
        self.judge(status, || format!("{what} at the start"))
    }

    /// Sets a variable, rounded if it is a whole number, true unless 0 if it is a truth value.
    pub fn set(&mut self, port: &Port, value: f64, time: f64) -> Result<(), Message> {
        let (functions, at) = (&self.binary.functions, self.component);
        let status = match port.kind {
            Kind::Number => both!(functions, set(at, port.reference, value)),
            Kind::Integer => both!(functions, set_integer(at, port.reference, value.round() as i32)),
            Kind::Boolean => both!(functions, set_boolean(at, port.reference, value != 0.0)),
        };
        self.judge(status, || format!("`{}` = {value} at {time:.6e} s", port.name))
    }

    /// A finite number.
    pub fn get(&mut self, port: &Port, time: f64) -> Result<f64, Message> {
        let (status, value) = both!(&self.binary.functions, get(self.component, port.reference));
        self.judge(status, || format!("reading `{}` at {time:.6e} s", port.name))?;
        if value.is_finite() {
            return Ok(value);
        }
        let message = Message::new(format!("the FMU gave no number for `{}`", port.name));
        Err(message
            .found(format!("{value} at {time:.6e} s"))
            .hint("its model has diverged, or its solver has failed"))
    }

    /// From `time` on for `step` seconds.
    pub fn step(&mut self, time: f64, step: f64) -> Result<(), Message> {
        let (status, flags) = both!(&self.binary.functions, do_step(self.component, time, step));
        let reached = |flags: &Flags| {
            flags
                .reached
                .map_or(String::new(), |at| format!(", reached {at:.6e} s"))
        };
        self.judge(status, || {
            format!("a step from {time:.6e} s of {step:e} s{}", reached(&flags))
        })?;
        if flags.wants_end || flags.is_early {
            let what = if flags.wants_end {
                "asked to end the simulation"
            } else {
                "returned early from a step"
            };
            let message = Message::new(format!("the FMU {what}"));
            return Err(message.found(format!("at {time:.6e} s{}", reached(&flags))));
        }
        Ok(())
    }

    fn judge(&mut self, status: Status, what: impl FnOnce() -> String) -> Result<(), Message> {
        if !status.is_failure() {
            return Ok(());
        }
        self.is_lost |= status == Status::Fatal;
        // in the state "error" an instance may be reset and freed, not terminated
        self.is_running &= status == Status::Discard;
        let problem = match status {
            Status::Discard => "the FMU discarded",
            Status::Fatal => "the FMU broke down (fatal) at",
            Status::Unknown => "the FMU answered with a status that FMI does not know to",
            Status::Ok | Status::Warning | Status::Error => "the FMU failed (error) at",
        };
        let message = Message::new(format!("{problem} {}", what()));
        Err(match self.log.complaint() {
            Some(text) => message.found(text),
            None => message.hint("--verbose shows what the FMU says"),
        })
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if self.is_lost {
            // no call is allowed any more; what it may still hold must stay
            if !self.component.is_null() {
                std::mem::forget(self.callbacks.take());
                Box::leak(std::mem::replace(&mut self.log, Box::new(Log::new("", None))));
            }
            return;
        }
        both!(&self.binary.functions, end(self.component, self.is_running));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_becomes_a_uri() {
        assert_eq!(address(Path::new("/tmp/a b/ö")), "file:///tmp/a%20b/%C3%B6");
    }
}

//! One input through one reader: whether it panicked, took too long, or took too much memory.

use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;
use std::time::Instant;

use crate::allocation;

/// What a reader said.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    /// Whether the bytes were taken.
    pub accepted: bool,
    /// The first fault, or what was read in a word or two: its kind decides whether the input is worth keeping.
    pub message: String,
}

impl Answer {
    /// The bytes were taken.
    #[must_use]
    pub fn accepted(what: impl Into<String>) -> Self {
        Answer {
            accepted: true,
            message: what.into(),
        }
    }

    /// The bytes were refused.
    #[must_use]
    pub fn refused(why: impl Into<String>) -> Self {
        Answer {
            accepted: false,
            message: why.into(),
        }
    }
}

/// What one input may cost.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Seconds for one input.
    pub seconds: f64,
    /// Bytes for any input.
    pub bytes: usize,
    /// Bytes beside them for each byte of the input.
    pub per_byte: usize,
}

impl Limits {
    /// The limits of a reader.
    pub const READER: Limits = Limits {
        // inputs are below 100 kB: a person who waits longer for so little takes it for a hang
        seconds: 1.0,
        // a table of 1024 by 1024 weights as text, numbers and products, ten times over
        bytes: 256 << 20,
        // a cell of two characters becomes a number with a place, and its message a line of text
        per_byte: 256,
    };

    fn most_bytes(&self, input: &[u8]) -> usize {
        self.bytes.saturating_add(self.per_byte.saturating_mul(input.len()))
    }
}

/// What must not happen.
#[derive(Debug, Clone, PartialEq)]
pub enum Fault {
    /// Where it panicked, and with which words.
    Panic {
        /// `file:line:column`
        place: String,
        /// The panic's message.
        message: String,
    },
    /// It took so many seconds, twice.
    Slow(f64),
    /// It took so many bytes.
    Memory(usize),
    /// It did not come back; seconds that were waited.
    Hang(u64),
    /// The process ended: stack, memory or abort; in the words of the system.
    Death(String),
}

impl Fault {
    /// Equal for faults that are the same to mend.
    #[must_use]
    pub fn kind(&self) -> String {
        match self {
            Fault::Panic { place, .. } => format!("panic at {place}"),
            Fault::Slow(_) => "slow".to_owned(),
            Fault::Memory(_) => "memory".to_owned(),
            Fault::Hang(_) => "hang".to_owned(),
            Fault::Death(how) => format!("death: {how}"),
        }
    }
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Fault::Panic { place, message } => write!(f, "panic at {place}: {message}"),
            Fault::Slow(seconds) => write!(f, "slow: {seconds:.1} s"),
            Fault::Memory(bytes) => write!(f, "memory: {} MiB", bytes >> 20),
            Fault::Hang(seconds) => write!(f, "hang: no answer within {seconds} s"),
            Fault::Death(how) => write!(f, "death of the process: {how}"),
        }
    }
}

/// A reader that is ready for bytes. It must give the same answer to the same bytes, whatever came before.
pub type Reader = dyn Fn(&[u8]) -> Answer;

thread_local! {
    static PROBING: Cell<bool> = const { Cell::new(false) };
    static PANIC: RefCell<Option<(String, String)>> = const { RefCell::new(None) };
}

/// While a reader is probed its panics are kept and not printed.
fn install_hook() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !PROBING.get() {
                return before(info);
            }
            let place = info
                .location()
                .map_or_else(|| "an unknown place".to_owned(), ToString::to_string);
            let payload = info.payload();
            let text = payload.downcast_ref::<&str>().copied();
            let text = text.or(payload.downcast_ref::<String>().map(String::as_str));
            let words = text.unwrap_or("no words").to_owned();
            PANIC.set(Some((place, words)));
        }));
    });
}

/// Runs `reader` on `input`.
///
/// # Errors
/// What must not happen.
pub fn probe(reader: &Reader, input: &[u8], limits: &Limits) -> Result<Answer, Fault> {
    let (answer, seconds) = once(reader, input, limits)?;
    if seconds > limits.seconds {
        // the machine may have been busy with something else: what counts is a reader that is slow again
        let (_, again) = once(reader, input, limits)?;
        if again > limits.seconds {
            return Err(Fault::Slow(seconds.min(again)));
        }
    }
    Ok(answer)
}

fn once(reader: &Reader, input: &[u8], limits: &Limits) -> Result<(Answer, f64), Fault> {
    install_hook();
    let before = allocation::begin();
    let started = Instant::now();
    PROBING.set(true);
    // a reader keeps nothing between inputs but tables that it fills before it answers
    let outcome = catch_unwind(AssertUnwindSafe(|| reader(input)));
    PROBING.set(false);
    let seconds = started.elapsed().as_secs_f64();
    let peak = allocation::peak_since(before);
    let Ok(answer) = outcome else {
        let (place, message) = PANIC.take().unwrap_or_default();
        return Err(Fault::Panic { place, message });
    };
    if peak > limits.most_bytes(input) {
        return Err(Fault::Memory(peak));
    }
    Ok((answer, seconds))
}

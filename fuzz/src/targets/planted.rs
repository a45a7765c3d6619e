//! Targets with a fault planted: the driver is seen to find what it is there for. They run by name alone.

use super::Target;
use crate::forms::Form;
use crate::guard::{Answer, Limits, Reader};

/// Short, so that the test of a loop without end takes seconds.
const IMPATIENT: Limits = Limits {
    seconds: 0.1,
    bytes: 1 << 20,
    per_byte: 16,
};

const fn planted(name: &'static str, about: &'static str, reader: fn() -> Result<Box<Reader>, String>) -> Target {
    Target {
        name,
        about,
        form: Form::Bytes,
        words: &["needle"],
        limits: IMPATIENT,
        seeds: || Ok(vec![b"a seed of some words and numbers 1 2 3".to_vec()]),
        reader,
    }
}

pub(super) static TARGETS: &[Target] = &[
    planted("planted-panic", "panics at a word", || {
        Ok(Box::new(|bytes| {
            assert!(!holds(bytes), "the planted panic");
            Answer::accepted("read")
        }))
    }),
    planted("planted-loop", "never comes back from a word", || {
        Ok(Box::new(|bytes| {
            while holds(bytes) {
                std::thread::yield_now();
            }
            Answer::accepted("read")
        }))
    }),
    planted("planted-slowness", "takes its time at a word", || {
        Ok(Box::new(|bytes| {
            if holds(bytes) {
                std::thread::sleep(std::time::Duration::from_millis(150));
            }
            Answer::accepted("read")
        }))
    }),
    planted("planted-allocation", "takes memory at a word", || {
        Ok(Box::new(|bytes| {
            let size = if holds(bytes) { 8 << 20 } else { 8 };
            let taken: Vec<u8> = Vec::with_capacity(size);
            Answer::accepted(if taken.capacity() > 8 { "much" } else { "little" })
        }))
    }),
    planted("planted-recursion", "overflows the stack at a word", || {
        Ok(Box::new(|bytes| {
            let depth = if holds(bytes) { u64::MAX } else { 1 };
            Answer::accepted(if deep(depth) > 0 { "read" } else { "" })
        }))
    }),
];

fn holds(bytes: &[u8]) -> bool {
    bytes.windows(6).any(|window| window == b"needle")
}

fn deep(left: u64) -> u64 {
    // the array keeps the compiler from making a loop of it
    let here = std::hint::black_box([left; 32]);
    match left {
        0 => here[0],
        _ => deep(left - 1).wrapping_add(here[1]),
    }
}

//! The texts of the usual faults of files, keys and values, side by side so that they speak with one voice.
//!
//! `label` is the key a value belongs to; `title` is the table as the user knows it (`[network]`), empty for the top
//! level of the file.

use std::io;
use std::path::Path;

use crate::fault::Message;
use crate::nearest::nearest;
use crate::source::Origin;

// --- files ---

pub(crate) fn unreadable(file: &str, origin: Origin, error: &io::Error) -> Message {
    match error.kind() {
        io::ErrorKind::NotFound => {
            // an absolute path is not relative to anything
            let relative = Path::new(file).is_relative().then(|| origin.relative_to().to_owned());
            Message::new(format!("cannot find the file `{file}`")).maybe_hint(relative)
        }
        io::ErrorKind::PermissionDenied => Message::new(format!("may not read the file `{file}`")),
        _ => Message::new(format!("cannot read the file `{file}`")).found(error.to_string()),
    }
}

pub(crate) fn is_folder(file: &str) -> Message {
    Message::new(format!("`{file}` is a folder")).expected("a file")
}

pub(crate) fn not_regular(file: &str) -> Message {
    Message::new(format!("`{file}` is not a regular file"))
}

pub(crate) fn file_too_large(file: &str, found: u64, limit: u64) -> Message {
    Message::new(format!("the file `{file}` is too large"))
        .found(format!("{found} bytes"))
        .expected(format!("at most {limit} bytes"))
}

pub(crate) fn not_text() -> Message {
    Message::new("the file is not text")
        .found("zero bytes, as programs, pictures and UTF-16 have them")
        .expected("text in UTF-8")
}

pub(crate) fn not_utf8(byte: u8) -> Message {
    Message::new("the file is not UTF-8 text")
        .found(format!("byte 0x{byte:02x}"))
        .hint("save it as UTF-8, or write ASCII only")
}

pub(crate) fn incomplete() -> Message {
    Message::new("the file is incomplete").hint("please report this: the missing part should have been named")
}

// --- names ---

/// A name that is none of the `known` ones of its kind (`target`, `output`); the hint is the nearest of them.
#[must_use]
pub fn unknown(kind: &str, found: &str, known: &[&str]) -> Message {
    Message::new(format!("unknown {kind} `{}`", found.escape_debug()))
        .expected(format!("one of {}", known.join(", ")))
        .did_you_mean(found, known.iter().copied())
}

// --- form ---

pub(crate) fn syntax(message: &str, decimal_comma: bool) -> Message {
    let text = Message::new("this is not valid TOML").found(message.to_lowercase());
    if decimal_comma {
        return text.expected("a decimal point").hint("write 1.5 instead of 1,5");
    }
    text
}

fn place(title: &str) -> String {
    if title.is_empty() {
        "at the top level".to_owned()
    } else {
        format!("in {title}")
    }
}

/// A key that the table does not have; the hint is the nearest of `known`.
#[must_use]
pub fn unknown_key(key: &str, title: &str, known: &[&str]) -> Message {
    Message::new(format!("unknown key `{}` {}", key.escape_debug(), place(title)))
        .expected(format!("one of {}", known.join(", ")))
        .did_you_mean(key, known.iter().copied())
}

/// A key that the table must have.
#[must_use]
pub fn missing_key(key: &str, title: &str, hint: &str) -> Message {
    Message::new(format!("`{key}` is missing {}", place(title))).hint(hint)
}

pub(crate) fn still_todo(label: &str, expected: &str) -> Message {
    Message::new(format!("`{label}` still says TODO: fill in {expected}")).gap()
}

pub(crate) fn wrong_type(label: &str, found: &str, expected: &str) -> Message {
    let hint = decimal_comma_in_text(found).then(|| "write a number with a point and without quotes: 1.5".to_owned());
    Message::new(format!("`{label}` is of the wrong kind"))
        .found(found)
        .expected(expected)
        .maybe_hint(hint)
}

fn decimal_comma_in_text(found: &str) -> bool {
    let text = found.trim_start_matches("the text \"").trim_end_matches('"');
    text.split_once(',')
        .is_some_and(|(a, b)| a.parse::<f64>().is_ok() && b.parse::<f64>().is_ok())
}

/// An array of `found` values where another number of them is needed.
#[must_use]
pub fn wrong_length(label: &str, found: usize, expected: &str) -> Message {
    // [0,4, 0,6] in place of two numbers is four whole ones
    let hint = (found == 4).then(|| "a decimal comma? write 0.4 instead of 0,4".to_owned());
    Message::new(format!("`{label}` has the wrong number of values"))
        .found(found.to_string())
        .expected(expected)
        .maybe_hint(hint)
}

/// A text that is none of the allowed ones; the hint is the nearest of them.
#[must_use]
pub fn not_one_of(label: &str, found: &str, allowed: &[&str]) -> Message {
    let hint = nearest(found, allowed.iter().copied()).map(|name| format!("did you mean \"{name}\"?"));
    Message::new(format!("`{label}` has no such value"))
        .found(format!("\"{}\"", found.escape_debug()))
        .expected(allowed.join(", "))
        .maybe_hint(hint)
}

/// `found` of the keys `keys` are given where it must be one.
#[must_use]
pub fn exactly_one_of(title: &str, keys: &str, found: usize) -> Message {
    Message::new(format!("{title} needs exactly one of {keys}"))
        .found(found.to_string())
        .expected("1")
}

/// Fewer than `low` or more than `high` of something.
#[must_use]
pub fn count(what: &str, found: usize, low: usize, high: usize) -> Message {
    let problem = if found < low {
        format!("too few {what}")
    } else {
        format!("too many {what}")
    };
    Message::new(problem)
        .found(found.to_string())
        .expected(format!("{low} to {high}"))
}

// --- values ---

/// Infinity, or not a number.
#[must_use]
pub fn not_finite(label: &str, value: f64) -> Message {
    Message::new(format!("`{label}` is not a finite number"))
        .found(value.to_string().to_lowercase())
        .expected("a finite number")
}

/// A value that is not what it may be.
#[must_use]
pub fn out_of_range(label: &str, found: &str, expected: &str) -> Message {
    Message::new(format!("`{label}` is out of range"))
        .found(found)
        .expected(expected)
}

/// A number that is 0 or less.
#[must_use]
pub fn not_positive(label: &str, found: f64) -> Message {
    Message::new(format!("`{label}` must be greater than 0"))
        .found(found.to_string())
        .expected("> 0")
}

/// An interval whose ends are the wrong way round.
#[must_use]
pub fn crossed(label: &str, low: f64, high: f64) -> Message {
    Message::new(format!("the limits of `{label}` are crossed"))
        .found(format!("low {low}, high {high}"))
        .expected("low <= high")
        .hint(format!("write [{high}, {low}]"))
}

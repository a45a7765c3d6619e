//! The texts of all faults of files, keys, values and names, side by side so that they speak with one voice.
//!
//! Faults of tensors and layer chains stand in [`crate::weights::catalogue`].

use std::io;

use crate::faults::Message;
use crate::names::nearest;

// --- files ---

pub(crate) fn unreadable(file: &str, error: &io::Error) -> Message {
    match error.kind() {
        io::ErrorKind::NotFound => Message::new(format!("cannot find the file `{file}`"))
            .hint("paths are relative to the folder of the file that names them"),
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

pub(crate) fn not_utf8(byte: u8) -> Message {
    Message::new("the file is not UTF-8 text")
        .found(format!("byte 0x{byte:02x}"))
        .hint("save it as UTF-8, or write ASCII only")
}

pub(crate) fn outside_root(file: &str) -> Message {
    Message::new(format!("`{file}` lies outside the crate"))
        .expected("a path inside the folder of Cargo.toml")
        .hint("copy the file into the crate, so that a build elsewhere finds the same one")
}

// --- form ---

pub(crate) fn syntax(message: &str, decimal_comma: bool) -> Message {
    let text = Message::new("this is not valid TOML").found(message.to_lowercase());
    if decimal_comma {
        return text.expected("a decimal point").hint("write 1.5 instead of 1,5");
    }
    text
}

pub(crate) fn unknown_key(key: &str, title: &str, known: &[&str]) -> Message {
    let place = if title.is_empty() {
        "at the top level".to_owned()
    } else {
        format!("in {title}")
    };
    let hint = nearest(key, known.iter().copied()).map(|name| format!("did you mean `{name}`?"));
    Message::new(format!("unknown key `{}` {place}", key.escape_debug()))
        .expected(format!("one of {}", known.join(", ")))
        .maybe_hint(hint)
}

pub(crate) fn missing_key(key: &str, title: &str, hint: &str) -> Message {
    let place = if title.is_empty() {
        "at the top level".to_owned()
    } else {
        format!("in {title}")
    };
    Message::new(format!("`{key}` is missing {place}")).hint(hint)
}

pub(crate) fn still_todo(label: &str, expected: &str) -> Message {
    Message::new(format!("`{label}` still says TODO: fill in {expected}"))
        .found("TODO")
        .expected(expected)
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

pub(crate) fn wrong_length(label: &str, found: usize, expected: &str) -> Message {
    let hint = (found == 4).then(|| "a decimal comma? write 0.4 instead of 0,4".to_owned());
    Message::new(format!("`{label}` has the wrong number of values"))
        .found(found.to_string())
        .expected(expected)
        .maybe_hint(hint)
}

pub(crate) fn not_one_of(label: &str, found: &str, allowed: &[&str]) -> Message {
    let hint = nearest(found, allowed.iter().copied()).map(|name| format!("did you mean \"{name}\"?"));
    Message::new(format!("`{label}` has no such value"))
        .found(format!("\"{}\"", found.escape_debug()))
        .expected(allowed.join(", "))
        .maybe_hint(hint)
}

pub(crate) fn not_supported_yet(label: &str, found: &str, supported: &[&str]) -> Message {
    Message::new(format!("`{label}` = \"{}\" is not supported yet", found.escape_debug()))
        .found(format!("\"{}\"", found.escape_debug()))
        .expected(format!("supported: {}", supported.join(", ")))
}

pub(crate) fn exactly_one_of(title: &str, keys: &str, found: usize) -> Message {
    Message::new(format!("{title} needs exactly one of {keys}"))
        .found(found.to_string())
        .expected("1")
}

pub(crate) fn count(what: &str, found: usize, low: usize, high: usize) -> Message {
    let problem = if found < low {
        format!("too few {what}")
    } else {
        format!("too many {what}")
    };
    Message::new(problem)
        .found(found.to_string())
        .expected(format!("{low} to {high}"))
}

pub(crate) fn incomplete() -> Message {
    Message::new("the contract is incomplete").hint("please report this: the missing part should have been named")
}

// --- values ---

pub(crate) fn not_finite(label: &str, value: f64) -> Message {
    Message::new(format!("`{label}` is not a finite number"))
        .found(value.to_string().to_lowercase())
        .expected("a finite number")
}

pub(crate) fn out_of_range(label: &str, found: &str, expected: &str) -> Message {
    Message::new(format!("`{label}` is out of range"))
        .found(found)
        .expected(expected)
}

pub(crate) fn duty_range(label: &str, found: f64) -> Message {
    let percent = found > 1.0 && found <= 100.0;
    let hint = percent.then(|| format!("looks like a percentage: write {}", tidy(found / 100.0)));
    Message::new(format!("`{label}` is not a duty ratio"))
        .found(found.to_string())
        .expected("0 to 1")
        .maybe_hint(hint)
}

/// A quotient by 100 without the binary noise (0.44 rather than 0.44000000000000006).
fn tidy(x: f64) -> f64 {
    (x * 1e12).round() / 1e12
}

pub(crate) fn crossed(label: &str, low: f64, high: f64) -> Message {
    Message::new(format!("the limits of `{label}` are crossed"))
        .found(format!("low {low}, high {high}"))
        .expected("low <= high")
        .hint(format!("write [{high}, {low}]"))
}

pub(crate) fn empty_range(label: &str, at: f64) -> Message {
    Message::new(format!("`{label}` is a single point"))
        .found(format!("low = high = {at}"))
        .expected("low < high")
}

pub(crate) fn empty_after_rounding(label: &str, low: f64, high: f64) -> Message {
    Message::new(format!("no f32 number lies inside `{label}`"))
        .found(format!("[{low}, {high}]"))
        .expected("an interval that holds an f32 number after rounding inwards")
        .hint("make it a little wider")
}

pub(crate) fn not_in_f32(label: &str, value: f64) -> Message {
    let what = if value.abs() > 1.0 {
        "too large for f32"
    } else {
        "rounds to 0 in f32"
    };
    Message::new(format!("`{label}` {what}"))
        .found(format!("{value:e}"))
        .expected("0, or a magnitude of 1.2e-38 to 8e37")
}

pub(crate) fn outside(label: &str, value: f64, name: &str, low: f64, high: f64) -> Message {
    Message::new(format!("`{label}` lies outside {name}"))
        .found(value.to_string())
        .expected(format!("{low} to {high}"))
}

pub(crate) fn adc_codes(name: &str, low: f64, high: f64) -> Message {
    Message::new(format!(
        "the plausible range of `{name}` is beyond what its ADC code can say"
    ))
    .found(format!("codes {low} to {high}"))
    .expected("codes within -16777216 to 16777216")
    .hint("gain is the physical unit per code: physical = gain * code + offset")
}

pub(crate) fn soft_start_too_slow(increment: f64) -> Message {
    Message::new("the soft start is too slow for f32")
        .found(format!("a step of {increment:e}"))
        .expected("(largest duty - from) / steps of at least 1.2e-7")
        .hint("take fewer steps, or start further below the largest duty")
}

pub(crate) fn not_increasing(i_out: f64, slope: f64) -> Message {
    Message::new("the mapping does not rise with d_sim")
        .found(format!("a + r i = {slope} at i_out = {i_out}"))
        .expected("a + r i > 0 over the valid range of i_out")
        .hint("a duty that falls while the policy asks for more turns the loop's sign: check the fit")
}

pub(crate) fn not_positive(label: &str, found: f64) -> Message {
    Message::new(format!("`{label}` must be greater than 0"))
        .found(found.to_string())
        .expected("> 0")
}

pub(crate) fn needs_other(label: &str, other: &str) -> Message {
    Message::new(format!("`{label}` is given without `{other}`"))
        .hint(format!("give `{other}` as well, or leave it out"))
}

pub(crate) fn time_constant(found: f64, longest: f64) -> Message {
    let hint = "f32 cannot follow a pole that slow: take a shorter time constant or a longer sample period";
    Message::new("the time constant is out of range")
        .found(format!("{found} s"))
        .expected(format!("more than 0, at most {longest} s (1e6 sample periods)"))
        .hint(hint)
}

pub(crate) fn may_overflow(what: &str, magnitude: f64) -> Message {
    Message::new(format!("{what} could leave the range of f32"))
        .found(format!("magnitudes up to {magnitude:e}"))
        .expected(format!("at most {:e}", crate::limits::MAX_MAGNITUDE))
        .hint("narrow the plausible ranges or the clips, or scale the features down")
}

// --- names ---

pub(crate) fn bad_name(kind: &str, name: &str, hint: &str) -> Message {
    Message::new(format!("`{}` cannot be the name of a {kind}", name.escape_debug()))
        .found(format!("\"{}\"", name.escape_debug()))
        .expected("a lower-case letter, then up to 30 of a-z, 0-9, _")
        .hint(hint)
}

pub(crate) fn duplicate_name(kind: &str, name: &str, other: &str) -> Message {
    Message::new(format!("the name `{}` is used twice", name.escape_debug()))
        .found(format!("a {kind} and a {other} of this name"))
        .expected("a name of its own")
}

pub(crate) fn unknown_name(kind: &str, name: &str, hint: Option<String>, expected: &str) -> Message {
    Message::new(format!("there is no {kind} `{}`", name.escape_debug()))
        .expected(expected)
        .maybe_hint(hint)
}

pub(crate) fn bad_unit(found: &str) -> Message {
    Message::new("this unit cannot be printed in a comment")
        .found(format!("\"{}\"", found.escape_debug()))
        .expected("at most 16 printable characters without quotes, backslash, */ or newline")
}

// --- expressions ---

pub(crate) fn expression(problem: &str) -> Message {
    Message::new(problem)
}

//! The sections of `policy.toml`, one file each: keys, values, and what must hold between them.

pub(crate) mod actions;
mod continuous;
pub(crate) mod features;
pub(crate) mod filters;
pub(crate) mod head;
pub(crate) mod mapping;
pub(crate) mod network;
pub(crate) mod observers;
pub(crate) mod outputs;
pub(crate) mod protection;
pub(crate) mod residual;
pub(crate) mod schedule;
pub(crate) mod signals;

use toml_input::{Sink, Value};

use crate::catalogue;
use crate::limits::MAX_MAGNITUDE;
use crate::model::Interval;
use crate::names::{self, Kind};
use crate::rounding::inward_f32;

/// Names given so far and what they are, so that clashes are found across sections.
pub(crate) type Taken = Vec<(String, Kind)>;

/// A name that is fit for `kind` and not used by anything it could be confused with.
pub(crate) fn name(value: &Value<'_>, kind: Kind, taken: &mut Taken, faults: &mut Sink) -> Option<String> {
    let text = value.text(faults)?;
    if let Some(hint) = names::objection(text, kind) {
        faults.push(value.fault(catalogue::bad_name(kind.word(), text, &hint)));
        return None;
    }
    taken_once(text, kind, taken)
        .map_err(|message| faults.push(value.fault(message)))
        .ok()
}

/// Enters `name`; a fault if it is taken. Signals and parameters share one space, features have their own.
pub(crate) fn taken_once(name: &str, kind: Kind, taken: &mut Taken) -> Result<String, toml_input::Message> {
    // no expression names a feature: it may be called as the signal that it passes on
    let clash = |other: Kind| (kind == Kind::Feature) == (other == Kind::Feature);
    if let Some((_, other)) = taken.iter().find(|(used, other)| used == name && clash(*other)) {
        return Err(catalogue::duplicate_name(kind.word(), name, other.word()));
    }
    taken.push((name.to_owned(), kind));
    Ok(name.to_owned())
}

/// A number that is 0 or keeps its sign and size in binary32.
pub(crate) fn number_f32(value: &Value<'_>, faults: &mut Sink) -> Option<f64> {
    let number = value.number(faults)?;
    if fits_f32(number) {
        return Some(number);
    }
    faults.push(value.fault(catalogue::not_in_f32(value.label(), number)));
    None
}

pub(crate) fn fits_f32(number: f64) -> bool {
    // a number that rounds to 0 would silently be another one
    number.abs() <= MAX_MAGNITUDE && (number == 0.0 || number as f32 != 0.0)
}

/// An interval whose ends fit binary32 and that still holds a binary32 number after rounding inwards.
pub(crate) fn interval_f32(value: &Value<'_>, faults: &mut Sink) -> Option<Interval> {
    let [low, high] = value.interval(faults)?;
    let interval = Interval { low, high };
    let widest = interval.low.abs().max(interval.high.abs());
    if widest > MAX_MAGNITUDE {
        faults.push(value.fault(catalogue::not_in_f32(value.label(), widest)));
        return None;
    }
    if inward_f32(interval).is_none() {
        faults.push(value.fault(catalogue::empty_after_rounding(
            value.label(),
            interval.low,
            interval.high,
        )));
        return None;
    }
    Some(interval)
}

/// An interval with `low < high`.
pub(crate) fn range_f32(value: &Value<'_>, faults: &mut Sink) -> Option<Interval> {
    let interval = interval_f32(value, faults)?;
    if interval.low < interval.high {
        return Some(interval);
    }
    faults.push(value.fault(catalogue::empty_range(value.label(), interval.low)));
    None
}

/// A duty ratio within 0..1.
pub(crate) fn duty(value: &Value<'_>, faults: &mut Sink) -> Option<f64> {
    let number = value.number(faults)?;
    if (0.0..=1.0).contains(&number) {
        return Some(number);
    }
    faults.push(value.fault(catalogue::duty_range(value.label(), number)));
    None
}

/// An interval of duty ratios within 0..1.
pub(crate) fn duty_interval(value: &Value<'_>, faults: &mut Sink) -> Option<Interval> {
    let interval = interval_f32(value, faults)?;
    match [interval.low, interval.high]
        .iter()
        .find(|end| !(0.0..=1.0).contains(*end))
    {
        None => Some(interval),
        Some(end) => {
            faults.push(value.fault(catalogue::duty_range(value.label(), *end)));
            None
        }
    }
}

//! `[limits]` and `[fallback]`.

use toml_input::{Sink, Table, Value};

use super::{duty, duty_interval};
use crate::catalogue;
use crate::limits::{MAX_HOLD, MAX_SOFT_START_STEPS, MIN_SOFT_START_INCREMENT};
use crate::model::{Fallback, Interval, Limits, SoftStart};

pub(crate) fn fallback(root: &mut Table<'_>, faults: &mut Sink) -> Option<Fallback> {
    let hint = "say what happens without a usable measurement: [fallback] with `duty` and `hold`";
    let mut section = root.required("fallback", hint, faults)?.table("[fallback]", faults)?;
    let hint = "the duty commanded when no measurement is usable: `duty = 0.0`";
    // any duty: 0 has to be possible where the limits begin at 0.05
    let duty = section.required("duty", hint, faults).and_then(|v| duty(&v, faults));
    let hint = "how many bad samples are bridged with the last good one: `hold = 3`";
    let hold = section
        .required("hold", hint, faults)
        .and_then(|v| v.integer(0..=MAX_HOLD, faults));
    section.finish(faults);
    Some(Fallback {
        duty: duty?,
        hold: hold?,
    })
}

/// The duty that one of several outputs falls back to.
pub(crate) fn own_fallback(section: &mut Table<'_>, faults: &mut Sink) -> Option<f64> {
    let hint = "each output says what it commands without a usable measurement: `fallback = { duty = 0.0 }`";
    let mut own = section
        .required("fallback", hint, faults)?
        .table("fallback of an output", faults)?;
    let duty = own.required("duty", hint, faults).and_then(|v| duty(&v, faults));
    own.finish_with(faults, |key| {
        (key == "hold").then(|| "samples are held for all outputs together: `hold` stands in [fallback]".to_owned())
    });
    duty
}

/// How many bad samples are bridged where each output has a fallback duty of its own.
pub(crate) fn hold(root: &mut Table<'_>, faults: &mut Sink) -> Option<u32> {
    let hint = "how many bad samples are bridged with the last good one: [fallback] with `hold = 3`";
    let mut section = root.required("fallback", hint, faults)?.table("[fallback]", faults)?;
    let hold = section
        .required("hold", hint, faults)
        .and_then(|v| v.integer(0..=MAX_HOLD, faults));
    section.finish_with(faults, |key| {
        (key == "duty").then(|| "each [[output]] has its own: `fallback = { duty = 0.0 }`".to_owned())
    });
    hold
}

/// The limits; `initial_duty` is the fallback duty where the contract does not give it.
pub(crate) fn limits(root: &mut Table<'_>, fallback: Option<Fallback>, faults: &mut Sink) -> Option<Limits> {
    let hint = "give [limits] with `duty = [low, high]`";
    let mut section = root.required("limits", hint, faults)?.table("[limits]", faults)?;
    let hint = "the smallest and largest duty the hardware may see: `duty = [0.05, 0.95]`";
    let range = section
        .required("duty", hint, faults)
        .and_then(|v| duty_interval(&v, faults));
    let slew = section
        .optional("slew")
        .map_or(Some(None), |v| slew(&v, faults).map(Some));
    let soft = section
        .optional("soft_start")
        .map_or(Some(None), |v| soft_start(&v, range, faults).map(Some));
    let initial = match section.optional("initial_duty") {
        Some(value) => duty(&value, faults),
        None => fallback.map(|fallback| fallback.duty),
    };
    section.finish(faults);
    Some(Limits {
        duty: range?,
        slew: slew?,
        soft_start: soft?,
        initial_duty: initial?,
    })
}

fn slew(value: &Value<'_>, faults: &mut Sink) -> Option<f64> {
    let number = value.number(faults)?;
    // the same bound as for the soft start: a much smaller step is lost in the rounding of a duty near 1
    if (MIN_SOFT_START_INCREMENT..=1.0).contains(&number) {
        return Some(number);
    }
    let expected = "1.2e-7 (below, f32 duties would not move) to 1: the largest change of duty per sample period";
    faults.push(value.fault(catalogue::out_of_range("slew", &number.to_string(), expected)));
    None
}

fn soft_start(value: &Value<'_>, range: Option<Interval>, faults: &mut Sink) -> Option<SoftStart> {
    let mut section = value.table("soft_start", faults)?;
    let hint = "a soft start is `{ from = 0.1, steps = 1000 }`";
    let start = section.required("from", hint, faults);
    let from = start.as_ref().and_then(|v| duty(v, faults));
    let steps = section.required("steps", hint, faults);
    let steps = steps.and_then(|v| v.integer(1..=MAX_SOFT_START_STEPS, faults));
    section.finish(faults);
    let (start, from, steps, range) = (start?, from?, steps?, range?);
    if from > range.high {
        faults.push(start.fault(catalogue::outside(
            "from",
            from,
            "0 to the largest duty",
            0.0,
            range.high,
        )));
        return None;
    }
    // in binary64, as section 10 combines it before the one rounding
    let increment = (range.high - from) / f64::from(steps);
    if increment < MIN_SOFT_START_INCREMENT {
        faults.push(value.fault(catalogue::soft_start_too_slow(increment)));
        return None;
    }
    Some(SoftStart { from, steps })
}

//! What a scenario and a training file share, read from TOML.

use std::ops::RangeInclusive;

use toml_input::{Message, Sink, Table, Value, messages};

use crate::load_step::LoadKind;
use crate::scenario::Task;

/// The load steps and how they are run; what is left out is as in [`Task::default`].
pub fn task(table: &mut Table<'_>, faults: &mut Sink) -> Task {
    let default = Task::default();
    let count = |v: &Value<'_>, faults: &mut Sink| v.integer(1..=1_000_000, faults);
    Task {
        load_steps: table.with_default("load_steps", default.load_steps, faults, |v, faults| {
            pairs(v, "powers in W: [[200, 500]]", LoadKind::Power.range(), faults)
        }),
        instants: table.with_default("instants", default.instants, faults, count),
        sampling_instants: table.with_default("sampling_instants", default.sampling_instants, faults, count),
        lead: table.with_default("lead", default.lead, faults, count),
        after: table.with_default("after", default.after, faults, count),
        tail: table.with_default("tail", default.tail, faults, count),
    }
}

/// Pairs of numbers within `range`; `of` says of what.
pub fn pairs(value: &Value<'_>, of: &str, range: RangeInclusive<f64>, faults: &mut Sink) -> Option<Vec<[f64; 2]>> {
    let one = |item: &Value<'_>, faults: &mut Sink| item.pair(range.clone(), faults);
    value.each(&format!("pairs of {of}"), faults, one)
}

/// Numbers of a plant that take the place of its file's: `[set]`.
pub fn plant_numbers(value: &Value<'_>, faults: &mut Sink) -> Option<Vec<(String, f64)>> {
    let mut list = Vec::new();
    for (key, value) in value.pairs(faults)? {
        known_parameter(&key.value, &value, faults);
        let Some(number) = value.number(faults) else { continue };
        let allowed = plant::parameter(&key.value).map(|parameter| parameter.allowed);
        // the plant checks it again; only here the line is known
        if let Some((low, high)) = allowed
            && !(low..=high).contains(&number)
        {
            let expected = format!("{low} to {high}");
            faults.push(value.fault(messages::out_of_range(value.label(), &number.to_string(), &expected)));
        }
        list.push((key.value.clone(), number));
    }
    Some(list)
}

/// A fault at `value` if the plant has no number `key`.
pub fn known_parameter(key: &str, value: &Value<'_>, faults: &mut Sink) {
    if plant::parameter(key).is_none() {
        faults.push(value.fault(no_number(key)));
    }
}

/// The plant has no number `key`.
#[must_use]
pub fn no_number(key: &str) -> Message {
    Message::new(format!("the plant has no number `{}`", key.escape_debug()))
        .hint("write it as in the plant's file, `table.key`: \"switch.v_f\"")
        .did_you_mean(key, plant::parameters().map(|parameter| parameter.key))
}

//! Lists of numbers.

use std::collections::BTreeSet;

use toml_input::{Message, Sink, Value};

/// Seeds that are counted rather than listed at most: the most tasks that a plan may have.
const MOST: u64 = 100_000;

/// A number, a list of numbers, or `{ first = 0, count = 64 }`.
pub(crate) fn read(value: &Value<'_>, faults: &mut Sink) -> Option<Vec<u64>> {
    if !value.is_table() {
        return numbers(value, "seeds: [0, 1, 2] or { first = 0, count = 64 }", faults);
    }
    value.read_table("seeds", faults, |table, faults| {
        let first = table.with_default("first", 0, faults, |value, faults| {
            value.integer(0..=i64::MAX as u64 - MOST, faults)
        });
        let count = table.required("count", "how many: `count = 64`", faults);
        let count = count.and_then(|value| value.integer(1..=MOST, faults))?;
        Some((first..first + count).collect())
    })
}

/// A number, or a list of numbers of which none comes twice.
pub(crate) fn numbers(value: &Value<'_>, expected: &str, faults: &mut Sink) -> Option<Vec<u64>> {
    let whole = |value: &Value<'_>, faults: &mut Sink| value.integer(0..=i64::MAX as u64, faults);
    let Some(items) = value.as_list() else {
        return whole(value, faults).map(|number| vec![number]);
    };
    let found = value.each(expected, faults, whole)?;
    if found.is_empty() {
        faults.push(value.fault(Message::new(format!("`{}` is empty", value.label())).expected(expected)));
        return None;
    }
    let mut seen = BTreeSet::new();
    for (number, item) in found.iter().zip(&items) {
        if !seen.insert(*number) {
            let message = Message::new(format!("`{}` names a number twice", value.label()));
            faults.push(item.fault(message.found(number.to_string()).expected("different numbers")));
        }
    }
    Some(found)
}

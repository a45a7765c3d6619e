//! `filters = [...]` of a feature (contract section 4).

use std::f64::consts::PI;

use toml_input::{Sink, Value};

use super::number_f32;
use crate::catalogue;
use crate::limits::{MAX_FILTERS, MAX_LINE, MAX_TIME_CONSTANT_PERIODS};
use crate::model::Filter;
use crate::model::Interval;
use crate::rounding::inward_f32;

/// What is read behind the word of a kind; the sample period is `None` if the contract's is faulty.
type Reader = fn(&Value<'_>, Option<f64>, &mut Sink) -> Option<Filter>;

/// A kind of filter: its word, how it is written, for hints, and what reads it.
struct Kind {
    word: &'static str,
    written: &'static str,
    read: Reader,
}

/// The only list of kinds: what stands here can be written, is proposed and is read.
const KINDS: [Kind; 6] = [
    Kind {
        word: "delay",
        written: "{ delay = 1 }",
        read: |value, _, faults| {
            let samples = value.integer(1..=MAX_LINE, faults)?;
            Some(Filter::Delay { samples })
        },
    },
    Kind {
        word: "backward_difference",
        written: "\"backward_difference\"",
        read: |value, _, faults| backward_difference(value, faults),
    },
    Kind {
        word: "low_pass",
        written: "{ low_pass = { time_constant = 1e-3 } }",
        read: |value, period, faults| {
            let time_constant = time_constant(value, period, faults)?;
            Some(Filter::LowPass { time_constant })
        },
    },
    Kind {
        word: "filtered_derivative",
        written: "{ filtered_derivative = { time_constant = 1e-3 } }",
        read: |value, period, faults| {
            let time_constant = time_constant(value, period, faults)?;
            Some(Filter::FilteredDerivative { time_constant })
        },
    },
    Kind {
        word: "moving_average",
        written: "{ moving_average = 4 }",
        read: |value, _, faults| {
            let samples = value.integer(2..=MAX_LINE, faults)?;
            Some(Filter::MovingAverage { samples })
        },
    },
    Kind {
        word: "integrator",
        written: "{ integrator = { min = -1.0, max = 1.0 } }",
        read: |value, _, faults| integrator(value, faults),
    },
];

fn words() -> [&'static str; KINDS.len()] {
    KINDS.map(|kind| kind.word)
}

/// Other words for a kind.
const SYNONYMS: [(&str, &str); 7] = [
    ("integral", "integrator"),
    ("sum", "integrator"),
    ("difference", "backward_difference"),
    ("derivative", "backward_difference"),
    ("lowpass", "low_pass"),
    ("mean", "moving_average"),
    ("average", "moving_average"),
];

/// The chain, first to last; `period` is `None` if the contract's is faulty.
pub(crate) fn read(value: &Value<'_>, period: Option<f64>, faults: &mut Sink) -> Option<Vec<Filter>> {
    let items = value.list("an array of filters: [{ delay = 1 }]", faults)?;
    if items.len() > MAX_FILTERS {
        faults.push(value.fault(catalogue::count("filters", items.len(), 0, MAX_FILTERS)));
        return None;
    }
    let filters: Vec<_> = items.iter().map(|item| one(item, period, faults)).collect();
    filters.into_iter().collect()
}

fn one(value: &Value<'_>, period: Option<f64>, faults: &mut Sink) -> Option<Filter> {
    if let Some(text) = value.as_text() {
        return named(value, text, faults);
    }
    let mut section = value.table("filter", faults)?;
    let mut found: Vec<_> = KINDS
        .into_iter()
        .filter_map(|kind| section.optional(kind.word).map(|value| (kind, value)))
        .collect();
    // unknown keys count: `{ delay = 1, dely = 2 }` names two filters
    let number = section.count();
    let before = faults.count();
    // beside two kinds the fault of the unknown key would only be an echo
    if number == 1 || found.is_empty() {
        let inner = |key: &str| matches!(key, "cutoff" | "time_constant");
        section.finish_with(faults, |key| {
            inner(key).then(|| format!("as in {{ low_pass = {{ {key} = ... }} }}"))
        });
    }
    let (Some((kind, inner)), 1) = (found.pop(), number) else {
        if faults.count() == before {
            faults.push(value.fault(catalogue::exactly_one_of("a filter", &words().join(", "), number)));
        }
        return None;
    };
    (kind.read)(&inner, period, faults)
}

fn backward_difference(value: &Value<'_>, faults: &mut Sink) -> Option<Filter> {
    if value.boolean(faults)? {
        return Some(Filter::BackwardDifference);
    }
    let message = catalogue::out_of_range(value.label(), "false", "true");
    faults.push(value.fault(message.hint("leave the filter out")));
    None
}

fn named(value: &Value<'_>, text: &str, faults: &mut Sink) -> Option<Filter> {
    if text == "backward_difference" {
        return Some(Filter::BackwardDifference);
    }
    value.text(faults)?;
    let meant = SYNONYMS.iter().find(|(word, _)| *word == text);
    let word = meant.map_or(text, |(_, word)| *word);
    let written = KINDS.iter().find(|kind| kind.word == word).map(|kind| kind.written);
    faults.push(value.fault(match (written, meant) {
        (Some(written), None) => catalogue::missing_key(
            "value",
            &format!("the filter `{text}`"),
            &format!("write it as {written}"),
        ),
        (Some(written), Some(_)) => {
            catalogue::not_one_of("filters", text, &words()).hint(format!("write it as {written}"))
        }
        (None, _) => catalogue::not_one_of("filters", text, &words()),
    }));
    None
}

/// tau from `{ time_constant = s }` or `{ cutoff = Hz }`: tau = 1/(2 pi f).
fn time_constant(value: &Value<'_>, period: Option<f64>, faults: &mut Sink) -> Option<f64> {
    let mut section = value.table(value.label(), faults)?;
    let tau = section.optional("time_constant");
    let cutoff = section.optional("cutoff");
    section.finish(faults);
    let (at, seconds) = match (tau, cutoff) {
        (Some(tau), None) => (tau.clone(), tau.number(faults)?),
        (None, Some(cutoff)) => {
            let hertz = cutoff.number(faults)?;
            if hertz <= 0.0 {
                faults.push(cutoff.fault(catalogue::not_positive("cutoff", hertz)));
                return None;
            }
            (cutoff, 1.0 / (2.0 * PI * hertz))
        }
        (both, _) => {
            let count = if both.is_some() { 2 } else { 0 };
            faults.push(value.fault(catalogue::exactly_one_of(value.label(), "time_constant, cutoff", count)));
            return None;
        }
    };
    // behind the keys, so that their faults are not lost with the period's
    let period = period?;
    let longest = period * MAX_TIME_CONSTANT_PERIODS;
    if seconds <= 0.0 || seconds > longest {
        faults.push(at.fault(catalogue::time_constant(seconds, longest)));
        return None;
    }
    Some(seconds)
}

fn integrator(value: &Value<'_>, faults: &mut Sink) -> Option<Filter> {
    let mut section = value.table("integrator", faults)?;
    let hint = "an integrator needs both clamps: { min = -1.0, max = 1.0 }";
    let min = section
        .required("min", hint, faults)
        .and_then(|v| number_f32(&v, faults));
    let max = section
        .required("max", hint, faults)
        .and_then(|v| number_f32(&v, faults));
    let start = section.optional("initial");
    let initial = start.as_ref().map_or(Some(0.0), |v| number_f32(v, faults));
    let leak = section.optional("leak").map_or(Some(1.0), |v| leak(&v, faults));
    section.finish(faults);
    let (min, max, initial, leak) = (min?, max?, initial?, leak?);
    // the clamp needs a number of the format between its ends
    if min > max || inward_f32(Interval { low: min, high: max }).is_none() {
        faults.push(value.fault(catalogue::crossed("integrator", min, max).hint("min must lie below max")));
        return None;
    }
    if !(min..=max).contains(&initial) {
        let at = start.unwrap_or_else(|| value.clone());
        faults.push(at.fault(catalogue::outside(
            "initial",
            initial,
            "the integrator's clamps",
            min,
            max,
        )));
        return None;
    }
    Some(Filter::Integrator {
        min,
        max,
        initial,
        leak,
    })
}

/// What an integrator keeps in each period: 0 would be no memory, and more than 1 would grow by itself.
fn leak(value: &Value<'_>, faults: &mut Sink) -> Option<f64> {
    let leak = number_f32(value, faults)?;
    if leak > 0.0 && leak <= 1.0 {
        return Some(leak);
    }
    let message = catalogue::out_of_range(value.label(), &leak.to_string(), "above 0 and at most 1");
    faults.push(value.fault(message.hint("the share of the sum that is kept in each period; 1 keeps all")));
    None
}

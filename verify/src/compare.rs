//! The first difference between what was expected and what came.

use interp::{Sample, status};
use policy::{Policy, Scalar};

use crate::oracle::Chunk;
use crate::protocol::{HELLO_NAMES, Layout, WordKind, encode_sample, numbers};
use crate::report::{Difference, Measured, Value};
use crate::traces::Event;

/// A place in a chunk.
#[derive(Debug, Clone, Copy)]
pub struct Place<'a> {
    /// Control steps before the event.
    pub step: u64,
    /// The event whose answer contains the word.
    pub event: &'a Event,
    /// The word within the answer.
    pub word: usize,
}

/// Index of the first word that differs within the common length.
pub fn first_difference(expected: &[u32], got: &[u32]) -> Option<usize> {
    expected.iter().zip(got).position(|(expected, got)| expected != got)
}

/// The event whose answer contains word `index` of the chunk, if the chunk is that long.
pub fn place<'a>(chunk: &'a Chunk, layout: &Layout, index: usize) -> Option<Place<'a>> {
    let mut step = chunk.first_step;
    let mut start = 0;
    for event in &chunk.events {
        let len = layout.answer_len(event);
        if index < start + len {
            return Some(Place {
                step,
                event,
                word: index - start,
            });
        }
        start += len;
        step += u64::from(matches!(event, Event::Step(_)));
    }
    None
}

/// Describes the difference at word `index` of a chunk; `got` is all that came, at least up to there.
pub fn describe(policy: &Policy, chunk: &Chunk, layout: &Layout, index: usize, got: &[u32]) -> Option<Difference> {
    let place = place(chunk, layout, index)?;
    let word = &layout.answer(place.event)[place.word];
    Some(Difference {
        step: place.step,
        event: event_name(place.event).to_owned(),
        what: word.name.clone(),
        expected: value_at(word.kind, &chunk.expected, index),
        got: value_at(word.kind, got, index),
        measurement: measurement(policy, place.event),
    })
}

/// Describes the first difference in the prologue of a driver.
pub fn describe_hello(layout: &Layout, got: &[u32]) -> Option<Difference> {
    let expected = layout.hello();
    let index = first_difference(&expected, got)?;
    Some(Difference {
        step: 0,
        event: "start".to_owned(),
        what: HELLO_NAMES[index].to_owned(),
        expected: value(WordKind::Integer, expected[index]),
        got: value(WordKind::Integer, got[index]),
        measurement: Vec::new(),
    })
}

/// Name of an event in reports.
pub fn event_name(event: &Event) -> &'static str {
    match event {
        Event::Step(_) => "step",
        Event::SetMapping { .. } => "set_mapping",
        Event::Reset => "reset",
        Event::Init => "init",
        Event::Network(_) => "network",
    }
}

/// The samples of a step, or the coefficients or the observation of another event, by name.
pub fn measurement(policy: &Policy, event: &Event) -> Vec<Measured> {
    let scalar = policy.numeric_format.scalar();
    let floats = |names: Vec<&str>, values: &[f64]| {
        names
            .into_iter()
            .zip(values)
            .map(|(name, x)| Measured {
                signal: name.to_owned(),
                // as the controller gets it: rounded to its format
                sample: match scalar {
                    Scalar::F32 => value(WordKind::Float, (*x as f32).to_bits()),
                    Scalar::F64 => wide(*x),
                },
            })
            .collect()
    };
    match event {
        Event::Step(samples) => policy
            .signals
            .iter()
            .zip(samples)
            .map(|(signal, &sample)| Measured {
                signal: signal.name.clone(),
                sample: sample_value(sample, scalar),
            })
            .collect(),
        Event::SetMapping { a, b, c, r, .. } => floats(vec!["a", "b", "c", "r"], &[*a, *b, *c, r.unwrap_or(0.0)]),
        Event::Network(observation) => floats(
            policy.features.iter().map(|feature| feature.name.as_str()).collect(),
            observation,
        ),
        Event::Reset | Event::Init => Vec::new(),
    }
}

fn sample_value(sample: Sample, scalar: Scalar) -> Value {
    let mut words = Vec::new();
    encode_sample(sample, scalar, &mut words);
    match (sample, words.as_slice()) {
        (Sample::Code(n), [word]) => Value {
            value: n.to_string(),
            bits: format!("{word:#010x}"),
        },
        (_, [word]) => value(WordKind::Float, *word),
        (_, words) => wide(numbers(scalar, words).first().copied().unwrap_or_default()),
    }
}

/// The word at `index`, or the number that it is a half of.
fn value_at(kind: WordKind, words: &[u32], index: usize) -> Value {
    let first = match kind {
        WordKind::Low => index,
        // the low word comes first, so the high one is never at 0
        WordKind::High => index.saturating_sub(1),
        WordKind::Float | WordKind::Integer | WordKind::Status => return value(kind, words[index]),
    };
    // the program may have ended within the number
    let high = words.get(first + 1).copied().unwrap_or_default();
    wide(f64::from_bits(u64::from(words[first]) | u64::from(high) << 32))
}

fn wide(x: f64) -> Value {
    Value {
        value: format!("{x:?}"),
        bits: format!("{:#018x}", x.to_bits()),
    }
}

/// A word, read as `kind` says.
pub fn value(kind: WordKind, word: u32) -> Value {
    let value = match kind {
        // the shortest decimal that gives these bits again
        WordKind::Float => format!("{:?}", f32::from_bits(word)),
        WordKind::Integer | WordKind::Low | WordKind::High => word.to_string(),
        WordKind::Status => status::names(word),
    };
    Value {
        value,
        bits: format!("{word:#010x}"),
    }
}

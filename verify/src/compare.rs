//! The first difference between what was expected and what came.

use interp::{Sample, status};
use policy::Policy;

use crate::oracle::Chunk;
use crate::protocol::{HELLO_NAMES, Layout, WordKind, sample_word};
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

/// Describes the difference at word `index` of a chunk.
pub fn describe(policy: &Policy, chunk: &Chunk, layout: &Layout, index: usize, got: u32) -> Option<Difference> {
    let place = place(chunk, layout, index)?;
    let word = &layout.answer(place.event)[place.word];
    Some(Difference {
        step: place.step,
        event: event_name(place.event).to_owned(),
        what: word.name.clone(),
        expected: value(word.kind, chunk.expected[index]),
        got: value(word.kind, got),
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
    let floats = |names: Vec<&str>, values: &[f32]| {
        names
            .into_iter()
            .zip(values)
            .map(|(name, x)| Measured {
                signal: name.to_owned(),
                sample: value(WordKind::Float, x.to_bits()),
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
                sample: sample_value(sample),
            })
            .collect(),
        Event::SetMapping { a, b, c, r } => floats(vec!["a", "b", "c", "r"], &[*a, *b, *c, r.unwrap_or(0.0)]),
        Event::Network(observation) => floats(
            policy.features.iter().map(|feature| feature.name.as_str()).collect(),
            observation,
        ),
        Event::Reset | Event::Init => Vec::new(),
    }
}

fn sample_value(sample: Sample) -> Value {
    let bits = format!("{:#010x}", sample_word(sample));
    match sample {
        Sample::Physical(x) => Value {
            value: format!("{x:?}"),
            bits,
        },
        Sample::Code(n) => Value {
            value: format!("{n}"),
            bits,
        },
    }
}

/// A word, read as `kind` says.
pub fn value(kind: WordKind, word: u32) -> Value {
    let value = match kind {
        // the shortest decimal that gives these bits again
        WordKind::Float => format!("{:?}", f32::from_bits(word)),
        WordKind::Integer => word.to_string(),
        WordKind::Status => status::names(word),
    };
    Value {
        value,
        bits: format!("{word:#010x}"),
    }
}

//! Words between the host and a driver program.
//!
//! Both directions are streams of 32-bit words in the byte order of the target. A driver writes a [`HELLO_WORDS`]
//! prologue, then reads events (a kind, then its payload) and answers each:
//!
//! | event | payload | answer |
//! |---|---|---|
//! | [`kind::STEP`] | per signal: a number or an i32 code | observation, Q values, duties, duties before the mapping, action indices, status, state, purity |
//! | [`kind::SET_MAPPING`] | output, a, b, c, r (r = 0 in the three-term form) | accepted, state |
//! | [`kind::RESET`], [`kind::INIT`] | | state |
//! | [`kind::NETWORK`] | observation | Q values |
//!
//! A number is the bits of a binary32 number, or in `f64` two words, the low one first. Each answer is flushed, so that a crash or a hang shows at the event that caused it.

use interp::{Real, Sample};
use policy::{DutyPath, Policy, Scalar};

use crate::traces::Event;

/// Event kinds, the first word of an event.
pub mod kind {
    /// One control step.
    pub const STEP: u32 = 0;
    /// An attempt to replace the mapping coefficients.
    pub const SET_MAPPING: u32 = 1;
    /// `reset`.
    pub const RESET: u32 = 2;
    /// A new controller.
    pub const INIT: u32 = 3;
    /// The network alone.
    pub const NETWORK: u32 = 4;
}

/// First word of a driver's prologue.
// `pcv1` in ASCII; in the wrong byte order it reads 0x31766370
pub const MAGIC: u32 = 0x7063_7631;

/// Words of the prologue: magic, self-test, integrity, then the numbers of signals, features, actions, state words.
pub const HELLO_WORDS: usize = 7;

/// Bits of the purity word, 0 if all is well.
pub mod purity {
    /// `eval` changed the state.
    pub const EVAL_CHANGED_STATE: u32 = 1 << 0;
    /// Two calls of `eval` gave two commands.
    pub const EVAL_NOT_REPEATABLE: u32 = 1 << 1;
    /// `step` gave another command than `eval` before it.
    pub const STEP_IS_NOT_EVAL: u32 = 1 << 2;
    /// `eval`, then `commit` led to another state than `step`.
    pub const COMMIT_IS_NOT_STEP: u32 = 1 << 3;
    /// `observe` or `q_values` changed the state.
    pub const OBSERVE_CHANGED_STATE: u32 = 1 << 4;
}

/// How a word is to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordKind {
    /// binary32 bits.
    Float,
    /// Low half of binary64 bits; the high one follows.
    Low,
    /// High half of binary64 bits.
    High,
    /// Unsigned integer.
    Integer,
    /// Bits of [`interp::status`].
    Status,
}

/// Name and meaning of one word of an answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Word {
    /// Such as `q[5]` or `state held.v_out`.
    pub name: String,
    /// How to read it.
    pub kind: WordKind,
}

/// The words of each answer, by name.
#[derive(Debug, Clone)]
pub struct Layout {
    scalar: Scalar,
    signals: usize,
    features: usize,
    four_terms: bool,
    step: Vec<Word>,
    set_mapping: Vec<Word>,
    state: Vec<Word>,
    network: Vec<Word>,
}

impl Layout {
    /// The layout of a policy's answers; `state_names` as [`interp::Controller::state_names`] gives them.
    pub fn new(policy: &Policy, state_names: &[String]) -> Self {
        let scalar = policy.numeric_format.scalar();
        let word = |name: String, kind| Word { name, kind };
        let number = |name: String| -> Vec<Word> {
            match scalar {
                Scalar::F32 => vec![word(name, WordKind::Float)],
                Scalar::F64 => vec![word(name.clone(), WordKind::Low), word(name, WordKind::High)],
            }
        };
        let observation = policy
            .features
            .iter()
            .enumerate()
            .flat_map(|(n, feature)| number(format!("observation[{n}] ({})", feature.name)));
        let network: Vec<Word> = (0..policy.outputs()).flat_map(|n| number(format!("q[{n}]"))).collect();
        let state: Vec<Word> = state_names
            .iter()
            .flat_map(|name| match name.as_str() {
                // the two counters of the state are u32 in every format (section 1)
                "bad_count" | "primed" => vec![word(format!("state {name}"), WordKind::Integer)],
                _ => number(format!("state {name}")),
            })
            .collect();
        let paths = policy.paths();
        let named = |name: &str, path: &DutyPath<'_>| path.name.map_or(name.to_owned(), |own| format!("{name} {own}"));
        let duties = ["duty", "duty_sim"];
        let duties = duties
            .into_iter()
            .flat_map(|name| paths.iter().map(move |path| named(name, path)));
        let indices = paths
            .iter()
            .map(|path| word(named("action_index", path), WordKind::Integer));
        let status = [word("status".to_owned(), WordKind::Status)];
        let command = duties.flat_map(number).chain(indices).chain(status);
        let step = observation
            .chain(network.iter().cloned())
            .chain(command)
            .chain(state.iter().cloned())
            .chain([word("purity of eval".to_owned(), WordKind::Integer)])
            .collect();
        let accepted = word("set_mapping accepted".to_owned(), WordKind::Integer);
        Self {
            scalar,
            signals: policy.signals.len(),
            features: policy.features.len(),
            four_terms: (paths.iter().filter_map(|path| path.mapping)).any(|mapping| mapping.coefficients.r.is_some()),
            step,
            set_mapping: [accepted].into_iter().chain(state.iter().cloned()).collect(),
            state,
            network,
        }
    }

    /// The words that answer `event`.
    pub fn answer(&self, event: &Event) -> &[Word] {
        match event {
            Event::Step(_) => &self.step,
            Event::SetMapping { .. } => &self.set_mapping,
            Event::Reset | Event::Init => &self.state,
            Event::Network(_) => &self.network,
        }
    }

    /// Number of words after which the answer to `event` is complete.
    pub fn answer_len(&self, event: &Event) -> usize {
        self.answer(event).len()
    }

    /// Prologue that an intact driver of this policy sends.
    pub fn hello(&self) -> [u32; HELLO_WORDS] {
        [
            MAGIC,
            0,
            1,
            self.signals as u32,
            self.features as u32,
            (self.network.len() / self.scalar.words()) as u32,
            self.state.len() as u32,
        ]
    }

    /// Format of the numbers.
    pub fn scalar(&self) -> Scalar {
        self.scalar
    }

    /// Whether the mapping has four terms: `set_mapping` then takes `r`.
    pub fn four_terms(&self) -> bool {
        self.four_terms
    }
}

/// Names of the prologue's words.
pub const HELLO_NAMES: [&str; HELLO_WORDS] = [
    "start of the driver",
    "self_test",
    "integrity",
    "number of signals",
    "number of features",
    "number of actions",
    "number of state words",
];

/// Appends the words of an event whose numbers travel in `scalar`.
pub fn encode(event: &Event, scalar: Scalar, words: &mut Vec<u32>) {
    match event {
        Event::Step(samples) => {
            words.push(kind::STEP);
            for sample in samples {
                encode_sample(*sample, scalar, words);
            }
        }
        Event::SetMapping { output, a, b, c, r } => {
            words.extend([kind::SET_MAPPING, *output as u32]);
            // always four: so the length of an event follows from its kind alone
            for number in [*a, *b, *c, r.unwrap_or(0.0)] {
                encode_number(number, scalar, words);
            }
        }
        Event::Reset => words.push(kind::RESET),
        Event::Init => words.push(kind::INIT),
        Event::Network(observation) => {
            words.push(kind::NETWORK);
            for number in observation {
                encode_number(*number, scalar, words);
            }
        }
    }
}

fn encode_number(number: f64, scalar: Scalar, words: &mut Vec<u32>) {
    match scalar {
        Scalar::F32 => (number as f32).append_words(words),
        Scalar::F64 => number.append_words(words),
    }
}

/// Appends the words in which a sample travels.
pub fn encode_sample(sample: Sample, scalar: Scalar, words: &mut Vec<u32>) {
    match (sample, scalar) {
        // a NaN keeps all of its bits
        (Sample::Physical(x), Scalar::F32) => x.append_words(words),
        (Sample::Physical(x), Scalar::F64) => f64::from(x).append_words(words),
        (Sample::Wide(x), _) => encode_number(x, scalar, words),
        (Sample::Code(n), _) => words.push(n.cast_unsigned()),
    }
}

/// Words in which the samples of a step travel.
pub fn sample_words(policy: &Policy) -> usize {
    let number = policy.numeric_format.scalar().words();
    let words = |signal: &policy::Signal| if signal.adc.is_some() { 1 } else { number };
    policy.signals.iter().map(words).sum()
}

/// The numbers that words stand for; half a number at the end is left out.
pub fn numbers(scalar: Scalar, words: &[u32]) -> Vec<f64> {
    // the slices have one or two words, by the format
    let number = |words: &[u32]| match *words {
        [low, high] => f64::from_bits(u64::from(low) | u64::from(high) << 32),
        [bits] => f64::from(f32::from_bits(bits)),
        _ => f64::NAN,
    };
    words.chunks_exact(scalar.words()).map(number).collect()
}

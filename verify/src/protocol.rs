//! Words between the host and a driver program.
//!
//! Both directions are streams of 32-bit words in the byte order of the target. A driver writes a [`HELLO_WORDS`]
//! prologue, then reads events (a kind, then its payload) and answers each:
//!
//! | event | payload | answer |
//! |---|---|---|
//! | [`kind::STEP`] | one word per signal: f32 bits or i32 code | observation, Q values, duty, duty_sim, action_index, status, state, purity |
//! | [`kind::SET_MAPPING`] | a, b, c, r (r = 0 in the three-term form) | accepted, state |
//! | [`kind::RESET`], [`kind::INIT`] | | state |
//! | [`kind::NETWORK`] | observation | Q values |
//!
//! Each answer is flushed, so that a crash or a hang shows at the event that caused it.

use interp::Sample;
use policy::Policy;

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
        let word = |name: String, kind| Word { name, kind };
        let observation = policy
            .features
            .iter()
            .enumerate()
            .map(|(n, feature)| word(format!("observation[{n}] ({})", feature.name), WordKind::Float));
        let network: Vec<Word> = (0..policy.actions.len())
            .map(|n| word(format!("q[{n}]"), WordKind::Float))
            .collect();
        let state: Vec<Word> = state_names
            .iter()
            .map(|name| {
                let integer = name == "bad_count" || name == "primed";
                word(
                    format!("state {name}"),
                    if integer { WordKind::Integer } else { WordKind::Float },
                )
            })
            .collect();
        let command = [
            ("duty", WordKind::Float),
            ("duty_sim", WordKind::Float),
            ("action_index", WordKind::Integer),
            ("status", WordKind::Status),
        ]
        .map(|(name, kind)| word(name.to_owned(), kind));
        let step = observation
            .chain(network.iter().cloned())
            .chain(command)
            .chain(state.iter().cloned())
            .chain([word("purity of eval".to_owned(), WordKind::Integer)])
            .collect();
        let accepted = word("set_mapping accepted".to_owned(), WordKind::Integer);
        Self {
            signals: policy.signals.len(),
            features: policy.features.len(),
            four_terms: policy
                .mapping
                .as_ref()
                .is_some_and(|mapping| mapping.coefficients.r.is_some()),
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
            self.network.len() as u32,
            self.state.len() as u32,
        ]
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

/// Appends the words of an event.
pub fn encode(event: &Event, words: &mut Vec<u32>) {
    match event {
        Event::Step(samples) => {
            words.push(kind::STEP);
            words.extend(samples.iter().map(|sample| sample_word(*sample)));
        }
        Event::SetMapping { a, b, c, r } => {
            words.push(kind::SET_MAPPING);
            words.extend([*a, *b, *c, r.unwrap_or(0.0)].map(f32::to_bits));
        }
        Event::Reset => words.push(kind::RESET),
        Event::Init => words.push(kind::INIT),
        Event::Network(observation) => {
            words.push(kind::NETWORK);
            words.extend(observation.iter().map(|x| x.to_bits()));
        }
    }
}

/// The word in which a sample travels.
pub fn sample_word(sample: Sample) -> u32 {
    match sample {
        Sample::Physical(x) => x.to_bits(),
        Sample::Code(n) => n.cast_unsigned(),
    }
}

//! The moves of a kit, played on the interpreter and written down with its answers.
//!
//! ```text
//!  directed   ends of ranges, bridged samples, coefficients at their ends   what a random run meets now and then
//!  damaged    each number just outside of what a sound state holds          what no run meets
//!  capped     a soft start that stands at the duty itself                   what a run meets by chance
//!  tied       two actions of exactly equal value                            what a run meets once in millions of steps
//!  sided      each action that wins, Q values that are all below 0          what has to be looked for
//!  alike      clips that are alike                                          what has to be looked for
//!  summed     both sides of each bend of an activation, the network alone   what no run need meet
//!  random     the stream of `policyc verify`
//! ```

use codegen::backend::kit::Trace;
use interp::{Controller, InputError, Real, Remembered, Sample, State};
use policy::{Policy, Scalar};

use super::damage::damages;
use super::directed::{self, Move};
use super::sides::Sides;
use crate::oracle::{Chunk, Oracle};
use crate::protocol::{Layout, sample_words};
use crate::traces::{Event, Stream, nudged, sample_of};

/// Steps after which a duty that still moves is left where it is: the longest soft start that a kit waits for.
// they cost no memory but time on the board: 4000 of 30,000 instructions take 2.5 s at 48 MHz
const MOST_TO_REST: usize = 4000;
/// Places in a signal's range between which another action is looked for.
// a convention: each costs the oracle one step
const PLACES: usize = 33;
/// Halvings that bring two numbers of either format next to each other.
const HALVINGS: usize = 64;
/// Numbers to either side of a change of action that are looked at for a tie.
// a convention: Q values in binary32 cross within a few units in the last place, if they meet at all
const BESIDE: i32 = 100;
/// Ties that are worth their steps.
// a convention, as is everything that bounds a kit's memory
const TIES: usize = 4;

/// What of a step is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Seen {
    Numbers,
    CommandAndState,
}

/// The interpreter on its way, and what is written down.
pub struct Course<'a, T> {
    pub(super) policy: &'a Policy,
    pub(super) oracle: Oracle<T>,
    layout: Layout,
    /// All moves so far.
    pub trace: Trace,
    /// Where they have led.
    pub(super) sides: Sides,
}

impl<'a, T: Real> Course<'a, T> {
    /// At a fresh controller.
    pub fn new(policy: &'a Policy) -> Self {
        let oracle = Oracle::<T>::new(policy);
        Self {
            policy,
            layout: oracle.layout().clone(),
            oracle,
            trace: Trace::default(),
            sides: Sides::default(),
        }
    }

    pub(super) fn play(&mut self, event: Event) -> Result<(), InputError> {
        match &event {
            Event::Step(samples) => {
                let trace = self.oracle.controller().eval(samples)?;
                self.sides.note(self.policy, &trace);
            }
            Event::Network(observation) => {
                let layers = self.layers(observation)?.unwrap_or_default();
                self.sides.note_layers(self.policy, &layers);
            }
            _ => {}
        }
        let chunk = self.oracle.chunk_of(vec![event])?;
        append(self.policy, &self.layout, &chunk, Seen::Numbers, &mut self.trace);
        Ok(())
    }

    /// A step in which a NaN arises: of observation and Q values the contract does not say which one.
    fn play_without_numbers(&mut self, samples: &[Sample]) -> Result<(), InputError> {
        let chunk = self.oracle.chunk_of(vec![Event::Step(samples.to_vec())])?;
        append(
            self.policy,
            &self.layout,
            &chunk,
            Seen::CommandAndState,
            &mut self.trace,
        );
        Ok(())
    }

    /// Another state, word by word.
    pub(super) fn put(&mut self, change: impl FnOnce(&mut State<T>)) {
        let mut state = self.oracle.controller().state().clone();
        let mut words = state.words();
        change(&mut state);
        for (at, word) in state.words().into_iter().enumerate() {
            if words[at] != word {
                words[at] = word;
                self.trace.damage(at as u32, word, words.iter().copied());
            }
        }
        self.oracle.restore(&state);
    }

    /// Goes at once where slew limit and soft start would let the duty be in the end: behind them nothing else shows.
    fn settle(&mut self, samples: &[Sample]) -> Result<(), InputError> {
        let mut ahead = self.oracle.controller().clone();
        let ends = |state: &State<T>| -> Vec<(T, Option<T>)> {
            let outputs = (0..state.outputs()).map(|output| state.output(output));
            outputs.map(|own| (own.previous_command, own.soft_cap)).collect()
        };
        for _ in 0..MOST_TO_REST {
            let before = ends(ahead.state());
            ahead.step(samples)?;
            if ends(ahead.state()) == before {
                break;
            }
        }
        let rest = ends(ahead.state());
        self.put(|state| {
            if let Some(first) = rest.first() {
                (state.previous_command, state.soft_cap) = *first;
            }
            for (other, end) in state.others.iter_mut().zip(rest.iter().skip(1)) {
                (other.previous_command, other.soft_cap) = *end;
            }
        });
        Ok(())
    }

    /// The moves of [`directed`].
    pub fn directed(&mut self) -> Result<(), InputError> {
        let usual = directed::usual(self.policy);
        for next in directed::moves(self.policy) {
            match next {
                Move::Do(event) => self.play(event)?,
                Move::Settle => self.settle(&usual)?,
            }
        }
        Ok(())
    }

    /// A step from each state that is not sound by one number or counter, and from those that are just sound.
    pub fn damaged(&mut self) -> Result<(), InputError> {
        let usual = directed::usual(self.policy);
        let fresh = Controller::<T>::new(self.policy);
        for damage in damages(self.policy, &fresh) {
            self.play(Event::Init)?;
            self.put(|state| damage.apply(state));
            let samples = damage.samples(self.policy, &usual);
            match damage.gives_no_number(&fresh, &samples) {
                true => self.play_without_numbers(&samples)?,
                false => self.play(Event::Step(samples))?,
            }
        }
        Ok(())
    }

    /// A cap of a soft start that is exactly the duty before it, and the numbers next to that: as much is not clipped.
    pub fn capped(&mut self) -> Result<(), InputError> {
        let usual = directed::usual(self.policy);
        let scalar = self.policy.numeric_format.scalar();
        for output in 0..self.policy.paths().len() {
            if self.oracle.controller().state().output(output).soft_cap.is_none() {
                continue;
            }
            let nearby: [fn(Scalar, f64) -> f64; 3] = [|_, x| x, Scalar::next_down, Scalar::next_up];
            let before = self.steps_to_a_cap(output, &usual)?;
            for near in nearby {
                self.play(Event::Init)?;
                for _ in 0..before {
                    self.play(Event::Step(usual.clone()))?;
                }
                let duty = self.oracle.controller().eval(&usual)?.decision(output).slewed;
                let cap = Some(T::nearest(near(scalar, duty.to_f64())));
                self.put(|state| {
                    let own = state.output(output);
                    state.set_output(output, Remembered { soft_cap: cap, ..own });
                });
                self.play(Event::Step(usual.clone()))?;
            }
        }
        Ok(())
    }

    /// After how many steps from a fresh start the duty is one that a cap of the soft start can be: a lower one is not sound.
    fn steps_to_a_cap(&self, output: usize, usual: &[Sample]) -> Result<usize, InputError> {
        let limits = self.policy.paths().get(output).map(|path| path.limits);
        let from = limits.and_then(|limits| Some((limits.soft_start?.from, limits.duty.high)));
        let Some((from, high)) = from else { return Ok(1) };
        // one step first: a fresh start alone holds the initial duty
        for steps in [1, 0, 2, 3] {
            let mut ahead = Controller::<T>::new(self.policy);
            for _ in 0..steps {
                ahead.step(usual)?;
            }
            let duty = ahead.eval(usual)?.decision(output).slewed.to_f64();
            if from < duty && duty < high {
                return Ok(steps);
            }
        }
        Ok(1)
    }

    /// Measurements at which two actions of an output have exactly the same, highest value: the lower index is to win.
    ///
    /// Between two measurements with different actions the two values meet. Next to that place the difference goes in steps
    /// of the last digit, so that some measurement near it often makes them equal.
    pub fn tied(&mut self) -> Result<(), InputError> {
        self.play(Event::Init)?;
        self.play(Event::Step(directed::usual(self.policy)))?;
        for output in 0..self.policy.paths().len() {
            self.ties_of(output)?;
        }
        Ok(())
    }

    fn ties_of(&mut self, output: usize) -> Result<(), InputError> {
        let usual = directed::usual(self.policy);
        let mut found = 0;
        for index in 0..self.policy.signals.len() {
            let places: Vec<Vec<Sample>> = (0..PLACES).map(|place| self.at(&usual, index, place)).collect();
            for pair in places.windows(2) {
                if found == TIES {
                    return Ok(());
                }
                if let Some(samples) = self.tie_between(&pair[0], &pair[1], index, output) {
                    self.play(Event::Step(samples))?;
                    found += 1;
                    self.play(Event::Init)?;
                    self.play(Event::Step(usual.clone()))?;
                }
            }
        }
        Ok(())
    }

    /// The usual samples with one signal at a place of its range.
    fn at(&self, usual: &[Sample], index: usize, place: usize) -> Vec<Sample> {
        let signal = &self.policy.signals[index];
        let share = place as f64 / (PLACES - 1) as f64;
        let x = signal.range.low + share * (signal.range.high - signal.range.low);
        let mut samples = usual.to_vec();
        samples[index] = sample_of(self.policy.numeric_format.scalar(), signal, x);
        samples
    }

    fn tie_between(&self, from: &[Sample], to: &[Sample], index: usize, output: usize) -> Option<Vec<Sample>> {
        let controller = self.oracle.controller();
        let action = |samples: &[Sample]| {
            let command = controller.eval(samples).ok()?.commands().nth(output)?;
            Some(command.action_index)
        };
        let columns = self.policy.paths().get(output)?.columns();
        let with = |sample: Sample| {
            let mut samples = from.to_vec();
            samples[index] = sample;
            samples
        };
        let (mut low, mut high) = (from[index], to[index]);
        let first = action(from)?;
        if action(to)? == first {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = between(low, high)?;
            match action(&with(middle))? == first {
                true => low = middle,
                false => high = middle,
            }
        }
        let near = (-BESIDE..=BESIDE).map(|ulps| with(nudged(low, ulps)));
        let is_tied = |samples: &Vec<Sample>| {
            controller.eval(samples).is_ok_and(|trace| {
                let own = || trace.q_values.iter().skip(columns.start).take(columns.len());
                let highest = own().fold(-T::MAX, |highest, &q| if q > highest { q } else { highest });
                trace.usable && own().filter(|q| **q == highest).count() > 1
            })
        };
        near.into_iter().find(is_tied)
    }

    /// Random moves up to so many control steps in all; at least a quarter of them, however many came before.
    pub fn random(&mut self, steps: u32, seed: u64) -> Result<(), InputError> {
        let left = u64::from(steps.saturating_sub(self.trace.steps()).max(steps / 4));
        self.play(Event::Init)?;
        let mut stream = Stream::new(self.policy, seed, &[]);
        let chunk = self.oracle.next_chunk(&mut stream, left)?;
        append(self.policy, &self.layout, &chunk, Seen::Numbers, &mut self.trace);
        Ok(())
    }
}

/// The sample half way; `None` for two kinds of samples.
fn between(low: Sample, high: Sample) -> Option<Sample> {
    Some(match (low, high) {
        (Sample::Physical(low), Sample::Physical(high)) => Sample::Physical(low + 0.5 * (high - low)),
        (Sample::Wide(low), Sample::Wide(high)) => Sample::Wide(low + 0.5 * (high - low)),
        (Sample::Code(low), Sample::Code(high)) => Sample::Code(low.midpoint(high)),
        _ => return None,
    })
}

/// Appends the words of a chunk in the form of the kit: its layout is that of [`crate::protocol`].
fn append(policy: &Policy, layout: &Layout, chunk: &Chunk, seen: Seen, trace: &mut Trace) {
    let number = layout.scalar().words();
    let values = number * (policy.features.len() + policy.outputs());
    let duties = policy.paths().len();
    let (mut input, mut expected) = (chunk.input.as_slice(), chunk.expected.as_slice());
    for event in &chunk.events {
        let answer = take(&mut expected, layout.answer(event).len());
        // the kind comes first
        take(&mut input, 1);
        match event {
            Event::Step(_) => {
                let (before, rest) = answer.split_at(values);
                let (command, state) = rest.split_at((2 * number + 1) * duties + 1);
                // the last word is the driver's verdict on purity
                let state = &state[..state.len() - 1];
                let state = state.iter().copied();
                let measurement = take(&mut input, sample_words(policy));
                match seen {
                    Seen::Numbers => trace.step(measurement, command, before.iter().copied().chain(state)),
                    Seen::CommandAndState => trace.step_without_numbers(measurement, command, state),
                }
            }
            Event::SetMapping { output, r, .. } => {
                // the index of the output: the kit has it in the kind of the move
                take(&mut input, 1);
                let coefficients = take(&mut input, 4 * number);
                // four numbers travel in any case; the kit may call a function of three
                let given = if r.is_some() {
                    coefficients
                } else {
                    &coefficients[..3 * number]
                };
                trace.set_mapping(*output, given, answer[0], answer[1..].iter().copied());
            }
            Event::Reset => trace.reset(answer.iter().copied()),
            Event::Init => trace.init(answer.iter().copied()),
            Event::Network(observation) => {
                let given = take(&mut input, number * observation.len());
                trace.network(given, answer.iter().copied());
            }
        }
    }
}

fn take<'a>(words: &mut &'a [u32], count: usize) -> &'a [u32] {
    let (first, rest) = words.split_at(count.min(words.len()));
    *words = rest;
    first
}

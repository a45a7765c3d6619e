//! The moves of a kit, played on the interpreter and written down with its answers.
//!
//! ```text
//!  directed   ends of ranges, bridged samples, coefficients at their ends   what a random run meets now and then
//!  damaged    each number just outside of what a sound state holds          what no run meets
//!  tied       two actions of exactly equal value                            what a run meets once in millions of steps
//!  random     the stream of `policyc verify`
//! ```

use codegen::backend::kit::Trace;
use interp::{Controller, InputError, Real, Sample, State};
use policy::{Policy, Scalar};

use super::directed::{self, Move};
use crate::oracle::{Chunk, Oracle};
use crate::protocol::{Layout, sample_words};
use crate::traces::{Event, Stream, nudged, sample_of};

/// Steps after which a duty that still moves is left where it is: the longest soft start that a kit waits for.
// they cost no memory but time on the board: 4000 of 30,000 instructions take 2.5 s at 48 MHz
const MOST_TO_REST: usize = 4000;
/// Places in a signal's range between which another action is looked for.
// a convention: each costs the oracle one step
const PLACES: usize = 33;
/// Which of the numbers of a sound, primed state stand at their upper ends, those of even places and those of odd ones: what a filter
/// remembers at its farthest leads a feature beyond clip ends that no measurement reaches in a step, and a filter of two words
/// goes farthest if they stand at different ends.
const PRIMED_PATTERNS: [[bool; 2]; 4] = [[false, false], [true, true], [false, true], [true, false]];
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
    policy: &'a Policy,
    oracle: Oracle<T>,
    layout: Layout,
    /// All moves so far.
    pub trace: Trace,
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
        }
    }

    fn play(&mut self, event: Event) -> Result<(), InputError> {
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
    fn put(&mut self, change: impl FnOnce(&mut State<T>)) {
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
        let ends = |state: &State<T>| (state.previous_command, state.soft_cap);
        for _ in 0..MOST_TO_REST {
            let before = ends(ahead.state());
            ahead.step(samples)?;
            if ends(ahead.state()) == before {
                break;
            }
        }
        let (previous_command, soft_cap) = ends(ahead.state());
        self.put(|state| (state.previous_command, state.soft_cap) = (previous_command, soft_cap));
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
            match damage.gives_no_number(&fresh, &usual) {
                true => self.play_without_numbers(&usual)?,
                false => self.play(Event::Step(usual.clone()))?,
            }
        }
        Ok(())
    }

    /// Measurements at which two actions have exactly the same, highest value: the lower index is to win.
    ///
    /// Between two measurements with different actions the two values meet. Next to that place the difference goes in steps
    /// of the last digit, so that some measurement near it often makes them equal.
    pub fn tied(&mut self) -> Result<(), InputError> {
        self.play(Event::Init)?;
        let usual = directed::usual(self.policy);
        self.play(Event::Step(usual.clone()))?;
        let mut found = 0;
        for index in 0..self.policy.signals.len() {
            let places: Vec<Vec<Sample>> = (0..PLACES).map(|place| self.at(&usual, index, place)).collect();
            for pair in places.windows(2) {
                if found == TIES {
                    return Ok(());
                }
                if let Some(samples) = self.tie_between(&pair[0], &pair[1], index) {
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

    fn tie_between(&self, from: &[Sample], to: &[Sample], index: usize) -> Option<Vec<Sample>> {
        let controller = self.oracle.controller();
        let action = |samples: &[Sample]| Some(controller.eval(samples).ok()?.command.action_index);
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
                let highest = trace
                    .q_values
                    .iter()
                    .fold(-T::MAX, |highest, &q| if q > highest { q } else { highest });
                trace.usable && trace.q_values.iter().filter(|q| **q == highest).count() > 1
            })
        };
        near.into_iter().find(is_tied)
    }

    /// Random moves up to so many control steps in all.
    pub fn random(&mut self, steps: u32, seed: u64) -> Result<(), InputError> {
        let left = u64::from(steps).saturating_sub(u64::from(self.trace.steps()));
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

/// What becomes of the mapping's check word.
#[derive(Debug, Clone, Copy, PartialEq)]
enum CheckWord {
    Kept,
    /// That of the coefficients.
    Anew,
    /// These bits flip.
    Flipped(u64),
}

/// Parts of the state that get other values.
#[derive(Debug, Clone, PartialEq)]
struct Damage<T> {
    /// Place among the numbers, and the value.
    numbers: Vec<(usize, T)>,
    check: CheckWord,
    /// `bad_count` and `primed`.
    counters: Option<(u32, u32)>,
}

impl<T: Real> Damage<T> {
    fn of_numbers(numbers: Vec<(usize, T)>) -> Self {
        Damage {
            numbers,
            check: CheckWord::Kept,
            counters: None,
        }
    }

    /// Whether a step from that state has a NaN among its observation or its Q values.
    fn gives_no_number(&self, fresh: &Controller<T>, samples: &[Sample]) -> bool {
        let mut damaged = fresh.clone();
        let mut state = fresh.state().clone();
        self.apply(&mut state);
        damaged.restore(&state);
        let is_nan = |x: &T| x.to_f64().is_nan();
        damaged
            .eval(samples)
            .is_ok_and(|trace| trace.observation.iter().chain(&trace.q_values).any(is_nan))
    }

    fn apply(&self, state: &mut State<T>) {
        for (at, value) in &self.numbers {
            if let Some(number) = state.numbers_mut().nth(*at) {
                *number = *value;
            }
        }
        state.mapping_check = match self.check {
            CheckWord::Kept => state.mapping_check,
            CheckWord::Anew => state.mapping.map(|own| own.check_word()),
            CheckWord::Flipped(bits) => state.mapping_check.map(|check| check ^ bits),
        };
        if let Some((bad_count, primed)) = self.counters {
            (state.bad_count, state.primed) = (bad_count, primed);
        }
    }
}

/// Each number of the state just outside of what a sound state holds, alone and with the next one; all of them at either end; the counters at their ends
/// and beyond; a soft start one step before its end.
fn damages<T: Real>(policy: &Policy, fresh: &Controller<T>) -> Vec<Damage<T>> {
    let (scalar, hold) = (policy.numeric_format.scalar(), policy.fallback.hold);
    let ends = fresh.sound_ends().into_iter().enumerate();
    let ends: Vec<(usize, (T, T))> = ends.filter_map(|(at, ends)| Some((at, ends?))).collect();
    let all = |pick: fn((T, T)) -> T| Damage {
        check: CheckWord::Anew,
        ..Damage::of_numbers(ends.iter().map(|(at, ends)| (*at, pick(*ends))).collect())
    };
    let mut damages = vec![all(|ends| ends.0), all(|ends| ends.1)];
    damages.extend(PRIMED_PATTERNS.map(|pattern| {
        Damage {
            check: CheckWord::Anew,
            counters: Some((0, 1)),
            ..Damage::of_numbers(
                ends.iter()
                    .map(|&(at, (low, high))| (at, if pattern[at % 2] { high } else { low }))
                    .collect(),
            )
        }
    }));
    // behind a network that passes a NaN on no Q value wins
    damages.push(Damage {
        check: CheckWord::Anew,
        counters: Some((0, 1)),
        ..Damage::of_numbers(ends.iter().map(|(at, _)| (*at, T::nearest(f64::NAN))).collect())
    });
    for &(at, (low, high)) in &ends {
        let (below, above) = (scalar.next_down(low.to_f64()), scalar.next_up(high.to_f64()));
        // what is no number gives one of many in the observation, and the contract does not say which
        let finite = [below, above].into_iter().filter(|end| end.is_finite());
        damages.extend(finite.map(|end| Damage::of_numbers(vec![(at, T::nearest(end))])));
    }
    // neighbours at once: two terms that are wrongly joined can hide each other
    let above = ends.iter().map(|&(at, (_, high))| (at, scalar.next_up(high.to_f64())));
    let above: Vec<(usize, T)> = above
        .filter(|(_, x)| x.is_finite())
        .map(|(at, x)| (at, T::nearest(x)))
        .collect();
    damages.extend(above.windows(2).map(|pair| Damage::of_numbers(pair.to_vec())));
    let counters = [
        (hold.saturating_add(1), 1),
        (hold.saturating_add(2), 1),
        (u32::MAX, 1),
        (0, 2),
        (0, u32::MAX),
    ];
    damages.extend(counters.map(|counters| Damage {
        counters: Some(counters),
        ..Damage::of_numbers(Vec::new())
    }));
    damages.extend(of_mapping(scalar, fresh.state()));
    damages.extend(end_of_soft_start(policy, scalar, fresh.state()));
    damages
}

/// Coefficients of the mapping; they are the last of the numbers.
fn coefficients<T: Real>(state: &State<T>) -> usize {
    state
        .mapping
        .map_or(0, |mapping| if mapping.r.is_some() { 4 } else { 3 })
}

/// What the check word of the mapping alone sees: its own bits, and coefficients that go to the next number or change sign.
fn of_mapping<T: Real>(scalar: Scalar, state: &State<T>) -> Vec<Damage<T>> {
    // the ends of each half: where a number is two words, one of them could be left out
    let bits = (0..32 * scalar.words()).filter(|bit| [0, 31].contains(&(bit % 32)));
    let flips = bits.filter(|_| state.mapping_check.is_some()).map(|bit| Damage {
        check: CheckWord::Flipped(1 << bit),
        ..Damage::of_numbers(Vec::new())
    });
    let mut own = state.clone();
    let numbers: Vec<T> = own.numbers_mut().map(|x| *x).collect();
    let first = numbers.len() - coefficients(state);
    let changed = numbers.into_iter().enumerate().skip(first).flat_map(|(at, x)| {
        let next = T::nearest(scalar.next_up(x.to_f64()));
        [next, -x].map(|x| Damage::of_numbers(vec![(at, x)]))
    });
    flips.chain(changed).collect()
}

/// The cap that one more step brings to the upper limit, and its neighbours: two below, since the limit is rounded inwards.
fn end_of_soft_start<T: Real>(policy: &Policy, scalar: Scalar, state: &State<T>) -> Vec<Damage<T>> {
    let Some(soft) = policy.limits.soft_start.filter(|_| state.soft_cap.is_some()) else {
        return Vec::new();
    };
    let high = policy.limits.duty.high;
    let before = scalar.nearest(high - (high - soft.from) / f64::from(soft.steps));
    // the cap stands before the coefficients
    let numbers = state.clone().numbers_mut().count();
    let at = numbers - coefficients(state) - 1;
    let below = scalar.next_down(before);
    let caps = [scalar.next_down(below), below, before, scalar.next_up(before)];
    caps.map(|cap| Damage::of_numbers(vec![(at, T::nearest(cap))])).to_vec()
}

/// Appends the words of a chunk in the form of the kit: its layout is that of [`crate::protocol`].
fn append(policy: &Policy, layout: &Layout, chunk: &Chunk, seen: Seen, trace: &mut Trace) {
    let number = layout.scalar().words();
    let values = number * (policy.features.len() + policy.outputs());
    let (mut input, mut expected) = (chunk.input.as_slice(), chunk.expected.as_slice());
    for event in &chunk.events {
        let answer = take(&mut expected, layout.answer(event).len());
        // the kind comes first
        take(&mut input, 1);
        match event {
            Event::Step(_) => {
                let (before, rest) = answer.split_at(values);
                let (command, state) = rest.split_at(2 * number + 2);
                // the last word is the driver's verdict on purity
                let state = &state[..state.len() - 1];
                let state = state.iter().copied();
                let measurement = take(&mut input, sample_words(policy));
                match seen {
                    Seen::Numbers => trace.step(measurement, command, before.iter().copied().chain(state)),
                    Seen::CommandAndState => trace.step_without_numbers(measurement, command, state),
                }
            }
            Event::SetMapping { r, .. } => {
                // the index of the output: a kit has the one
                take(&mut input, 1);
                let coefficients = take(&mut input, 4 * number);
                // four numbers travel in any case; the kit calls a function of three
                let given = if r.is_some() {
                    coefficients
                } else {
                    &coefficients[..3 * number]
                };
                trace.set_mapping(given, answer[0], answer[1..].iter().copied());
            }
            Event::Reset => trace.reset(answer.iter().copied()),
            Event::Init => trace.init(answer.iter().copied()),
            // the stream has none of these; the generated code has its own known answers
            Event::Network(observation) => {
                take(&mut input, number * observation.len());
            }
        }
    }
}

fn take<'a>(words: &mut &'a [u32], count: usize) -> &'a [u32] {
    let (first, rest) = words.split_at(count.min(words.len()));
    *words = rest;
    first
}

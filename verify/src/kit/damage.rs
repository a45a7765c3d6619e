//! States that are not sound, or just sound: each number of the state at its ends and beyond, the counters, the check words.

use std::ops::Range;

use interp::{Coefficients, Controller, Real, Remembered, Sample, State};
use policy::{Policy, Scalar};

use super::directed::invalid;

/// Which of the numbers of a sound, primed state stand at their upper ends, those of even places and those of odd ones: what a filter
/// remembers at its farthest leads a feature beyond clip ends that no measurement reaches in a step, and a filter of two words
/// goes farthest if they stand at different ends.
const PRIMED_PATTERNS: [[bool; 2]; 4] = [[false, false], [true, true], [false, true], [true, false]];
/// What becomes of the check words of the mappings.
#[derive(Debug, Clone, Copy, PartialEq)]
enum CheckWord {
    Kept,
    /// Those of the coefficients.
    Anew,
    /// These bits flip in the one of that output.
    Flipped(usize, u64),
}

/// Parts of the state that get other values.
#[derive(Debug, Clone, PartialEq)]
pub struct Damage<T> {
    /// Place among the numbers, and the value.
    numbers: Vec<(usize, T)>,
    check: CheckWord,
    /// `bad_count` and `primed`.
    counters: Option<(u32, u32)>,
    /// The signal that has no valid sample in the step behind, so that its held number takes its place.
    missing: Option<usize>,
}

/// Of a state with more numbers than this, such as one with long averages, not every one is put elsewhere alone.
// a convention, as is everything that bounds a kit's memory: a number takes some 400 bytes
const MOST_ALONE: usize = 64;

/// Farther than any clip end, and yet no sum that a network makes of it leaves binary32.
const FAR: f64 = 1e6;

impl<T: Real> Damage<T> {
    fn of_numbers(numbers: Vec<(usize, T)>) -> Self {
        Damage {
            numbers,
            check: CheckWord::Kept,
            counters: None,
            missing: None,
        }
    }

    /// With filters that are primed, and the check words that belong to the coefficients.
    pub(super) fn primed(numbers: Vec<(usize, T)>) -> Self {
        Damage {
            check: CheckWord::Anew,
            counters: Some((0, 1)),
            ..Damage::of_numbers(numbers)
        }
    }

    /// The samples of the step behind it.
    pub fn samples(&self, policy: &Policy, usual: &[Sample]) -> Vec<Sample> {
        let mut samples = usual.to_vec();
        if let Some((index, signal)) = self.missing.and_then(|index| Some((index, policy.signals.get(index)?))) {
            samples[index] = invalid(policy.numeric_format.scalar(), signal);
        }
        samples
    }

    /// Whether a step from that state has a NaN among its observation or its Q values.
    pub fn gives_no_number(&self, fresh: &Controller<T>, samples: &[Sample]) -> bool {
        let mut damaged = fresh.clone();
        let mut state = fresh.state().clone();
        self.apply(&mut state);
        damaged.restore(&state);
        let is_nan = |x: &T| x.to_f64().is_nan();
        damaged
            .eval(samples)
            .is_ok_and(|trace| trace.observation.iter().chain(&trace.q_values).any(is_nan))
    }

    /// Puts the other values in.
    pub fn apply(&self, state: &mut State<T>) {
        for (at, value) in &self.numbers {
            if let Some(number) = state.numbers_mut().nth(*at) {
                *number = *value;
            }
        }
        let checked = |output: usize, check: Option<u64>, own: Option<Coefficients<T>>| match self.check {
            CheckWord::Anew => own.map(|own| own.check_word()),
            CheckWord::Flipped(at, bits) if at == output => check.map(|check| check ^ bits),
            CheckWord::Kept | CheckWord::Flipped(..) => check,
        };
        state.mapping_check = checked(0, state.mapping_check, state.mapping);
        for (output, other) in (1..).zip(&mut state.others) {
            other.mapping_check = checked(output, other.mapping_check, other.mapping);
        }
        if let Some((bad_count, primed)) = self.counters {
            (state.bad_count, state.primed) = (bad_count, primed);
        }
    }
}

/// Each number of the state just outside of what a sound state holds, alone and with the next one; all of them at either end; each
/// alone at its ends and far outside; the counters at their ends and beyond; a soft start one step before its end.
pub fn damages<T: Real>(policy: &Policy, fresh: &Controller<T>) -> Vec<Damage<T>> {
    let (scalar, hold) = (policy.numeric_format.scalar(), policy.fallback.hold);
    let ends = fresh.sound_ends().into_iter().enumerate();
    let ends: Vec<(usize, (T, T))> = ends.filter_map(|(at, ends)| Some((at, ends?))).collect();
    let all = |pick: fn((T, T)) -> T| Damage {
        check: CheckWord::Anew,
        ..Damage::of_numbers(ends.iter().map(|(at, ends)| (*at, pick(*ends))).collect())
    };
    let mut damages = vec![all(|ends| ends.0), all(|ends| ends.1)];
    damages.extend(PRIMED_PATTERNS.map(|pattern| {
        let end = |&(at, (low, high)): &(usize, (T, T))| (at, if pattern[at % 2] { high } else { low });
        Damage::primed(ends.iter().map(end).collect())
    }));
    // behind a network that passes a NaN on no Q value wins
    let nan = T::nearest(f64::NAN);
    damages.push(Damage::primed(ends.iter().map(|(at, _)| (*at, nan)).collect()));
    damages.extend(alone(policy, fresh));
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
        // each of two neighbours among the four comparisons, and no other: wrongly joined they hide each other
        (1 << 31, 1),
        (u32::MAX, 2),
        (0, 1 << 31),
    ];
    damages.extend(counters.map(|counters| Damage {
        counters: Some(counters),
        ..Damage::of_numbers(Vec::new())
    }));
    for own in places(fresh.state()) {
        damages.extend(of_mapping(scalar, fresh.state(), &own));
        damages.extend(end_of_soft_start(policy, scalar, &own));
    }
    damages
}

/// Each number alone, with the others as `init` leaves them: at its ends, where one clip or limit of several alone is to show, at its
/// ends with the other sign, and far outside. A held one that is far outside stands in for its signal: it leads an observation beyond
/// clip ends that no sound state reaches. A number that no step reads may be anything.
fn alone<T: Real>(policy: &Policy, fresh: &Controller<T>) -> Vec<Damage<T>> {
    let one = |(at, ends): (usize, Option<(T, T)>)| {
        let mut near: Vec<T> = Vec::new();
        for x in ends.into_iter().flat_map(|(low, high)| [low, high, -low, -high]) {
            if !near.iter().any(|known| known.bits() == x.bits()) {
                near.push(x);
            }
        }
        let missing = Some(at).filter(|at| *at < policy.signals.len());
        let far = [FAR, -FAR, f64::NAN].map(|x| Damage {
            missing,
            ..Damage::primed(vec![(at, T::nearest(x))])
        });
        near.into_iter().map(move |x| Damage::primed(vec![(at, x)])).chain(far)
    };
    let ends = fresh.sound_ends();
    // the memory of filters is what may be long, and it is neither first nor last
    let memory = fresh.state().memory.len();
    let stride = ends.len().div_ceil(MOST_ALONE);
    let is_taken = |at: usize| match at.checked_sub(policy.signals.len()) {
        Some(word) if word < memory => word % stride == 0 || word + 1 == memory,
        _ => true,
    };
    let ends = ends.into_iter().enumerate();
    ends.filter(|(at, _)| is_taken(*at)).flat_map(one).collect()
}

/// Where the parts of an output stand among the numbers of the state.
struct Places {
    /// Index of the output.
    output: usize,
    soft_cap: Option<usize>,
    /// Empty without a mapping.
    coefficients: Range<usize>,
}

/// Of each output; the outputs are the last of the numbers.
fn places<T: Real>(state: &State<T>) -> Vec<Places> {
    let outputs: Vec<Remembered<T>> = (0..state.outputs()).map(|output| state.output(output)).collect();
    let coefficients = |own: &Remembered<T>| own.mapping.map_or(0, |mapping| if mapping.r.is_some() { 4 } else { 3 });
    // the duty and the command of the step before come first
    let numbers = |own: &Remembered<T>| 2 + usize::from(own.soft_cap.is_some()) + coefficients(own);
    let mut at = state.clone().numbers_mut().count() - outputs.iter().map(numbers).sum::<usize>();
    let place = |(output, own): (usize, &Remembered<T>)| {
        let first = at + numbers(own) - coefficients(own);
        at += numbers(own);
        Places {
            output,
            soft_cap: own.soft_cap.map(|_| first - 1),
            coefficients: first..at,
        }
    };
    outputs.iter().enumerate().map(place).collect()
}

/// What the check word of a mapping alone sees: its own bits, and coefficients that go to the next number or change sign.
fn of_mapping<T: Real>(scalar: Scalar, state: &State<T>, own: &Places) -> Vec<Damage<T>> {
    // the ends of each half: where a number is two words, one of them could be left out
    let bits = (0..32 * scalar.words()).filter(|bit| [0, 31].contains(&(bit % 32)));
    let flips = bits.filter(|_| !own.coefficients.is_empty()).map(|bit| Damage {
        check: CheckWord::Flipped(own.output, 1 << bit),
        ..Damage::of_numbers(Vec::new())
    });
    let mut state = state.clone();
    let numbers = state.numbers_mut().map(|x| *x).enumerate();
    let changed = numbers
        .filter(|(at, _)| own.coefficients.contains(at))
        .flat_map(|(at, x)| {
            let next = T::nearest(scalar.next_up(x.to_f64()));
            [next, -x].map(|x| Damage::of_numbers(vec![(at, x)]))
        });
    flips.chain(changed).collect()
}

/// The cap that one more step brings to the upper limit, and its neighbours: two below, since the limit is rounded inwards.
fn end_of_soft_start<T: Real>(policy: &Policy, scalar: Scalar, own: &Places) -> Vec<Damage<T>> {
    let paths = policy.paths();
    let limits = paths.get(own.output).map(|path| path.limits);
    let (Some(limits), Some(at)) = (limits, own.soft_cap) else {
        return Vec::new();
    };
    let Some(soft) = limits.soft_start else {
        return Vec::new();
    };
    let high = limits.duty.high;
    let before = scalar.nearest(high - (high - soft.from) / f64::from(soft.steps));
    let below = scalar.next_down(before);
    let caps = [scalar.next_down(below), below, before, scalar.next_up(before)];
    caps.map(|cap| Damage::of_numbers(vec![(at, T::nearest(cap))])).to_vec()
}

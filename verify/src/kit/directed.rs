//! Moves that lead to the places where an edit of the code hides: ends of ranges and the number after them, zeros of both
//! signs, as many bad samples as are bridged and one and two more, coefficients at the ends of what they may be set to.
//!
//! A random stream comes to most of these places only now and then. A kit of a few hundred steps has no time for that.

use interp::Sample;
use policy::{Interval, Policy, Scalar, Signal};

use crate::traces::{Event, nudged, sample_of};

/// More bad samples in a row than this are not worth a kit's memory: what is bridged longer is left to `policyc verify`.
// 1.4 kB with three signals, a twelfth of what a kit's random moves take
const LONGEST_RUN: u32 = 40;

/// A move, or a jump to where slew limit and soft start end for the usual samples.
#[derive(Debug, Clone, PartialEq)]
pub enum Move {
    /// As in a run.
    Do(Event),
    /// No run has it.
    Settle,
}

/// The moves, from a fresh controller on.
#[must_use]
pub fn moves(policy: &Policy) -> Vec<Move> {
    let good = usual(policy);
    let mut moves = vec![Event::Step(good.clone()), Event::Step(good.clone())];
    runs(policy, &good, &mut moves);
    let scalar = policy.numeric_format.scalar();
    for (index, signal) in policy.signals.iter().enumerate() {
        let load = policy.mapping.as_ref().filter(|mapping| mapping.load_current == index);
        let ranges = [Some(signal.range), load.map(|mapping| mapping.valid_i_out)];
        for range in ranges.into_iter().flatten() {
            moves.extend(ends(scalar, signal, range).map(|sample| Event::Step(with(&good, index, sample))));
        }
        if signal.adc.is_none() {
            let zeros = [0.0, -0.0].map(|zero| sample_of(scalar, signal, zero));
            moves.extend(zeros.map(|zero| Event::Step(with(&good, index, zero))));
        }
        moves.push(Event::Step(good.clone()));
    }
    let settled = std::iter::once(Move::Settle).chain(moves.into_iter().map(Move::Do));
    settled.chain(coefficients(policy, &good)).collect()
}

/// A sample in the middle of each range.
#[must_use]
pub fn usual(policy: &Policy) -> Vec<Sample> {
    let scalar = policy.numeric_format.scalar();
    let middle = |signal: &Signal| sample_of(scalar, signal, 0.5 * (signal.range.low + signal.range.high));
    policy.signals.iter().map(middle).collect()
}

fn with(samples: &[Sample], index: usize, sample: Sample) -> Vec<Sample> {
    let mut samples = samples.to_vec();
    samples[index] = sample;
    samples
}

/// Both ends of a range with their neighbours. Those outside stand apart, so that none of them is the second bad sample.
fn ends(scalar: Scalar, signal: &Signal, range: Interval) -> impl Iterator<Item = Sample> {
    let (low, high) = (
        sample_of(scalar, signal, range.low),
        sample_of(scalar, signal, range.high),
    );
    [(low, -1), (low, 1), (low, 0), (high, 0), (high, 1), (high, -1)]
        .into_iter()
        .map(|(end, ulps)| nudged(end, ulps))
}

/// K, K + 1 and K + 2 bad samples in a row, each time with good ones behind.
fn runs(policy: &Policy, good: &[Sample], moves: &mut Vec<Event>) {
    let hold = policy.fallback.hold;
    let Some(signal) = policy.signals.first().filter(|_| hold <= LONGEST_RUN) else {
        return;
    };
    let bad = match signal.adc {
        // the furthest code, as some converters cannot leave their range by less
        Some(adc) if adc.gain < 0.0 => Sample::Code(i32::MIN),
        Some(_) => Sample::Code(i32::MAX),
        None => sample_of(policy.numeric_format.scalar(), signal, f64::NAN),
    };
    for length in hold..=hold + 2 {
        moves.extend((0..length).map(|_| Event::Step(with(good, 0, bad))));
        moves.extend((0..2).map(|_| Event::Step(good.to_vec())));
    }
}

/// Each coefficient of the mapping at the ends of what it may be set to, and next to them, then all at one end, where the
/// duty leaves its limits; the policy's own at last.
fn coefficients(policy: &Policy, good: &[Sample]) -> Vec<Move> {
    let Some(mapping) = &policy.mapping else {
        return Vec::new();
    };
    let scalar = policy.numeric_format.scalar();
    let own = mapping.coefficients;
    let set = |[a, b, c, r]: [f64; 4]| {
        let r = own.r.map(|_| r);
        Move::Do(Event::SetMapping { a, b, c, r })
    };
    let own_values = [own.a, own.b, own.c, own.r.unwrap_or(0.0)].map(|value| scalar.nearest(value));
    let ranges = [mapping.adjust_a, mapping.adjust_b, mapping.adjust_c, mapping.adjust_r];
    let count = if own.r.is_some() { 4 } else { 3 };
    let step = || [Move::Settle, Move::Do(Event::Step(good.to_vec()))];
    let mut moves = Vec::new();
    for (index, range) in ranges.into_iter().enumerate().take(count) {
        for end in [range.low, range.high].map(|end| scalar.nearest(end)) {
            for value in [end, scalar.next_up(end), scalar.next_down(end)] {
                let mut values = own_values;
                values[index] = value;
                moves.push(set(values));
            }
            moves.extend(step());
        }
    }
    for end in [|range: Interval| range.low, |range: Interval| range.high] {
        moves.push(set(ranges.map(|range| scalar.nearest(end(range)))));
        moves.extend(step());
    }
    moves.push(set(own_values));
    moves.extend(step());
    moves
}

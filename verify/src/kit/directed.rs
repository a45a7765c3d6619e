//! Moves that lead to the places where an edit of the code hides: ends of ranges and the number after them, zeros of both
//! signs, as many bad samples as are bridged and one and two more, coefficients at the ends of what they may be set to.
//!
//! A random stream comes to most of these places only now and then. A kit of a few hundred steps has no time for that.

use interp::Sample;
use policy::{Expr, Input, Interval, Mapping, Policy, Scalar, Signal};

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
        let paths = policy.paths();
        let mappings = paths.iter().filter_map(|path| path.mapping);
        let loads = mappings.filter(|mapping| mapping.load_current == index);
        let ranges = std::iter::once(signal.range).chain(loads.map(|mapping| mapping.valid_i_out));
        for range in ranges {
            moves.extend(ends(scalar, signal, range).map(|sample| Event::Step(with(&good, index, sample))));
        }
        if signal.adc.is_none() {
            let zeros = [0.0, -0.0].map(|zero| sample_of(scalar, signal, zero));
            moves.extend(zeros.map(|zero| Event::Step(with(&good, index, zero))));
        }
        moves.push(Event::Step(good.clone()));
    }
    clips(policy, &good, &mut moves);
    // bad samples before the first good one: nothing bridges them
    let blind: Vec<Move> = policy
        .signals
        .iter()
        .take(1)
        .flat_map(|signal| {
            let bad = with(&good, 0, invalid(scalar, signal));
            [bad.clone(), bad].map(|samples| Move::Do(Event::Step(samples)))
        })
        .collect();
    let settled = blind
        .into_iter()
        .chain([Move::Settle])
        .chain(moves.into_iter().map(Move::Do));
    let paths = policy.paths();
    let mappings = paths
        .iter()
        .enumerate()
        .filter_map(|(output, path)| Some((output, path.mapping?)));
    let scalar = policy.numeric_format.scalar();
    let adjusted = mappings.flat_map(|(output, mapping)| coefficients(scalar, output, mapping, &good));
    settled.chain(adjusted).collect()
}

/// The farthest corners of each clipped source: one end, the other twice, and back, so that a difference to the sample before is far
/// both ways, too. The ends of one signal at a time do not reach the clip of a source of several.
fn clips(policy: &Policy, good: &[Sample], moves: &mut Vec<Event>) {
    let scalar = policy.numeric_format.scalar();
    let mut known: Vec<[Vec<Sample>; 2]> = Vec::new();
    for feature in policy.features.iter().filter(|feature| feature.clip.is_some()) {
        let corner = |sign: f64| -> Vec<Sample> {
            let far = |(index, signal): (usize, &Signal)| {
                let weight = sign * weight(&feature.source, index);
                match weight {
                    0.0 => good[index],
                    _ if weight < 0.0 => inner(scalar, signal, signal.range.low),
                    _ => inner(scalar, signal, signal.range.high),
                }
            };
            policy.signals.iter().enumerate().map(far).collect()
        };
        let corners = [corner(-1.0), corner(1.0)];
        let [low, high] = &corners;
        // nothing measured goes in, or the same corners have been visited
        if low == high
            || known
                .iter()
                .any(|[a, b]| (a, b) == (low, high) || (a, b) == (high, low))
        {
            continue;
        }
        let steps = [low, high, high, low, low].map(|samples| Event::Step(samples.clone()));
        moves.extend(steps);
        moves.push(Event::Step(good.to_vec()));
        known.push(corners);
    }
}

/// A sample at that end of a range, or the next to it that is inside whatever the conversion rounds.
fn inner(scalar: Scalar, signal: &Signal, end: f64) -> Sample {
    let range = signal.range;
    let inside = end + 1e-3 * (0.5 * (range.low + range.high) - end);
    sample_of(scalar, signal, if signal.adc.is_some() { inside } else { end })
}

/// What a source rises by with a signal.
fn weight(source: &Expr, index: usize) -> f64 {
    match source {
        Expr::Input(Input::Signal(own)) if *own == index => 1.0,
        Expr::Input(_) | Expr::Constant(_) => 0.0,
        Expr::Neg(x) => -weight(x, index),
        Expr::Add(x, y) => weight(x, index) + weight(y, index),
        Expr::Sub(x, y) => weight(x, index) - weight(y, index),
        Expr::Scale(factor, x) => factor * weight(x, index),
    }
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

/// A sample that no converter and no range lets pass.
pub fn invalid(scalar: Scalar, signal: &Signal) -> Sample {
    match signal.adc {
        // the furthest code, as some converters cannot leave their range by less
        Some(adc) if adc.gain < 0.0 => Sample::Code(i32::MIN),
        Some(_) => Sample::Code(i32::MAX),
        None => sample_of(scalar, signal, f64::NAN),
    }
}

/// K, K + 1 and K + 2 bad samples in a row, each time with good ones behind.
fn runs(policy: &Policy, good: &[Sample], moves: &mut Vec<Event>) {
    let hold = policy.fallback.hold;
    let Some(signal) = policy.signals.first().filter(|_| hold <= LONGEST_RUN) else {
        return;
    };
    let bad = invalid(policy.numeric_format.scalar(), signal);
    for length in hold..=hold + 2 {
        moves.extend((0..length).map(|_| Event::Step(with(good, 0, bad))));
        moves.extend((0..2).map(|_| Event::Step(good.to_vec())));
    }
}

/// Each coefficient of the mapping of an output at the ends of what it may be set to, and next to them, then all at one end, where the
/// duty leaves its limits; the policy's own at last.
fn coefficients(scalar: Scalar, output: usize, mapping: &Mapping, good: &[Sample]) -> Vec<Move> {
    let own = mapping.coefficients;
    let set = |[a, b, c, r]: [f64; 4]| {
        let r = own.r.map(|_| r);
        Move::Do(Event::SetMapping { output, a, b, c, r })
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

#[cfg(test)]
mod tests {
    use super::*;

    fn golden(case: &str) -> Policy {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/cases");
        policy::load(&folder.join(case).join("policy.toml")).unwrap_or_else(|faults| panic!("{faults}"))
    }

    /// The oracle is the source's own range: what its corners give, computed apart from the moves.
    #[test]
    fn a_clip_that_needs_several_signals_at_their_ends_is_reached() {
        let mut policy = golden("minimal");
        let [v, i] = [0, 1].map(|index| Expr::Input(Input::Signal(index)));
        // v from 0 to 250 and i from -5 to 60: the difference goes from -360 to 270, with one signal in the middle only to 195
        policy.features[0].source = Expr::Sub(Box::new(v), Box::new(Expr::Scale(6.0, Box::new(i))));
        policy.features[0].clip = Some(Interval {
            low: -300.0,
            high: 260.0,
        });
        let numbers = |samples: &[Sample]| -> Vec<f64> {
            let number = |sample: &Sample| match sample {
                Sample::Physical(number) => f64::from(*number),
                Sample::Wide(number) => *number,
                Sample::Code(_) => panic!("no codes here"),
            };
            samples.iter().map(number).collect()
        };
        let values: Vec<f64> = moves(&policy)
            .iter()
            .filter_map(|next| match next {
                Move::Do(Event::Step(samples)) => Some(numbers(samples)),
                _ => None,
            })
            .filter(|x| (0.0..=250.0).contains(&x[0]) && (-5.0..=60.0).contains(&x[1]))
            .map(|x| x[0] - 6.0 * x[1])
            .collect();
        assert!(values.iter().any(|value| *value > 260.0), "{values:?}");
        assert!(values.iter().any(|value| *value < -300.0), "{values:?}");
    }
}

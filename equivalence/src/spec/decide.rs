//! Sections 7 to 10: from Q values to the command, and the state behind it.

use policy::{Gain, Head, Scalar, Squash};

use super::{Sensed, Spec, State, curves, status};
use crate::term::Term;

/// What leaves the controller.
pub(crate) struct Command {
    pub duty: Term,
    pub duty_sim: Term,
    pub action_index: Term,
    pub status: Term,
}

/// What sections 7 to 8 make of the network's outputs.
pub(crate) struct Chosen {
    pub index: Term,
    /// Before the mapping; of a residual head the offset, and of a gain schedule nothing.
    pub duty: Term,
    /// Of a gain schedule.
    pub gains: Vec<Term>,
    /// Numbers on the way that are no NaN: the check of the policy bounds an output, and the curve is defined for every number.
    pub numbers: Vec<Term>,
}

/// The greedy action and its duty (sections 7 and 8), the duty of a continuous head (section 7b), or the gains of a gain schedule
/// (section 7c).
pub(crate) fn choose(spec: Spec<'_>, to_cut: u32, outputs: &[Term]) -> Chosen {
    let mut numbers = Vec::new();
    let (duty, gains) = match (&spec.policy.head, outputs) {
        (Head::Continuous(head), [output]) => {
            let map = (Some(head.squash), head.scale, head.offset);
            let output = as_number(spec, to_cut, *output);
            (mapped(spec, map, output, &mut numbers), Vec::new())
        }
        (Head::Schedule(head), outputs) => {
            let both = head.gains.iter().zip(outputs);
            let gains = both.map(|(gain, output)| {
                let output = as_number(spec, to_cut, *output);
                scheduled(spec, gain, output, &mut numbers)
            });
            (spec.zero(), gains.collect())
        }
        _ => {
            let index = best(spec, to_cut, outputs);
            return Chosen {
                index,
                duty: chosen_duty(spec, index),
                gains: Vec::new(),
                numbers,
            };
        }
    };
    Chosen {
        index: spec.counter(0),
        duty,
        gains,
        numbers,
    }
}

/// A gain of its output: squash, scale, offset, then its limits.
fn scheduled(spec: Spec<'_>, gain: &Gain, output: Term, numbers: &mut Vec<Term>) -> Term {
    let value = mapped(spec, (gain.squash, gain.scale, gain.offset), output, numbers);
    gain.limits.map_or(value, |limits| {
        let (low, high) = spec.ends(limits);
        spec.float.clamp(value, low, high)
    })
}

/// An output behind squash, scale and offset.
fn mapped(
    spec: Spec<'_>,
    (squash, scale, offset): (Option<Squash>, f64, f64),
    output: Term,
    numbers: &mut Vec<Term>,
) -> Term {
    let float = spec.float;
    numbers.push(output);
    let squashed = match squash {
        None => output,
        Some(Squash::Clip(clip)) => {
            let (low, high) = spec.ends(clip);
            float.clamp(output, low, high)
        }
        Some(Squash::Curve(curve)) => match curves::of(float, curve, output) {
            Some(curve) => {
                numbers.extend(curve.numbers);
                curve.value
            }
            // the reader lets no other activation through
            None => output,
        },
    };
    let scaled = match scale {
        1.0 => squashed,
        scale => float.mul(squashed, spec.nearest(scale)),
    };
    match offset {
        0.0 => scaled,
        offset => float.add(scaled, spec.nearest(offset)),
    }
}

/// An output as section 6b gives it: integer / 2^(its exponent).
fn as_number(spec: Spec<'_>, to_cut: u32, output: Term) -> Term {
    let scales = policy::scales::of(spec.policy);
    let exponent = scales
        .as_ref()
        .and_then(|scales| scales.layers.last()?.outputs.first().copied());
    let Some(exponent) = exponent else { return output };
    let cut = match to_cut {
        0 => output,
        bits => spec.terms.binary("bvashr", output, spec.counter(u64::from(bits))),
    };
    let unit = spec.float.constant(policy::scales::power_of_two(-exponent));
    spec.float.mul(spec.float.of_i32(cut), unit)
}

/// The argmax of what the network answered. In integer formats that are integers of one exponent, whose order is that of the Q values
/// (section 6b); `to_cut` bits of each are still to be shifted out.
fn best(spec: Spec<'_>, to_cut: u32, outputs: &[Term]) -> Term {
    if !spec.policy.numeric_format.is_integer() {
        return argmax(spec, outputs);
    }
    let amount = spec.counter(u64::from(to_cut));
    let cut = |sum: &Term| match to_cut {
        0 => *sum,
        _ => spec.terms.binary("bvashr", *sum, amount),
    };
    let outputs: Vec<Term> = outputs.iter().map(cut).collect();
    largest(spec, &outputs)
}

/// The lowest index of the largest integer. Section 7 begins below every number, so this begins with the lowest integer.
fn largest(spec: Spec<'_>, outputs: &[Term]) -> Term {
    let terms = spec.terms;
    let (mut best, mut index) = (spec.counter(1 << 31), spec.counter(0));
    for (n, output) in (0..).zip(outputs) {
        let better = terms.order("bvslt", best, *output);
        best = terms.choose(better, *output, best);
        index = terms.choose(better, spec.counter(n), index);
    }
    index
}

/// Section 7: the lowest index among equals wins, a NaN never.
fn argmax(spec: Spec<'_>, q_values: &[Term]) -> Term {
    let (terms, float) = (spec.terms, spec.float);
    let largest = match spec.format() {
        Scalar::F32 => f64::from(f32::MAX),
        Scalar::F64 => f64::MAX,
    };
    let (mut best, mut index) = (float.constant(-largest), spec.counter(0));
    for (n, q) in (0..).zip(q_values) {
        let better = float.gt(*q, best);
        best = terms.choose(better, *q, best);
        index = terms.choose(better, spec.counter(n), index);
    }
    index
}

/// The entry of the table of duties.
fn chosen_duty(spec: Spec<'_>, index: Term) -> Term {
    let terms = spec.terms;
    let mut duties = spec.policy.actions().iter().enumerate().rev();
    let last = duties
        .next()
        .map_or(spec.zero(), |(_, action)| spec.nearest(action.duty));
    duties.fold(last, |rest, (n, action)| {
        let this = terms.equal(index, spec.counter(n as u64));
        terms.choose(this, spec.nearest(action.duty), rest)
    })
}

/// Sections 8 and 9.
pub(crate) fn decide(spec: Spec<'_>, state: &State, sensed: &Sensed, choice: &Chosen) -> Command {
    let (terms, float, policy) = (spec.terms, spec.float, spec.policy);
    let none = terms.truth(false);
    let index = choice.index;
    let chosen = match sensed.base {
        Some((base, still)) if policy.head.schedule().is_some() => {
            let mut sum = base;
            for (gain, factor) in choice.gains.iter().zip(&sensed.factors) {
                let term = factor.map_or(*gain, |factor| float.mul(*gain, factor));
                sum = float.add(sum, term);
            }
            let (low, high) = spec.inwards(policy.limits.duty);
            float.clamp(terms.choose(still, base, sum), low, high)
        }
        Some((base, still)) => {
            let offset = terms.choose(still, spec.zero(), choice.duty);
            let (low, high) = spec.inwards(policy.limits.duty);
            float.clamp(float.add(base, offset), low, high)
        }
        None => choice.duty,
    };
    let (mut t, mut outside) = (chosen, none);
    if let (Some(mapping), [a, b, c, rest @ ..]) = (&policy.mapping, state.coefficients.as_slice()) {
        let current = sensed.signals[mapping.load_current];
        t = float.mul(*a, chosen);
        t = float.add(t, float.mul(*b, current));
        t = float.add(t, *c);
        if let [r] = rest {
            t = float.add(t, float.mul(float.mul(*r, current), chosen));
        }
        let (low, high) = spec.ends(mapping.valid_d_sim);
        outside = float.outside(chosen, low, high);
        let (low, high) = spec.ends(mapping.valid_i_out);
        outside = terms.or(outside, float.outside(current, low, high));
    }
    let mut slewed = none;
    if let Some(step) = spec.slew_step() {
        let low = float.sub(state.previous_command, step);
        let high = float.add(state.previous_command, step);
        slewed = float.outside(t, low, high);
        t = float.clamp(t, low, high);
    }
    let mut capped = none;
    if let Some(cap) = state.soft_cap {
        capped = float.gt(t, cap);
        t = terms.choose(capped, cap, t);
    }
    let (low, high) = spec.inwards(policy.limits.duty);
    let limited = float.outside(t, low, high);
    t = float.clamp(t, low, high);

    let applied = terms.and(sensed.usable, float.within(t, low, high));
    let primes = terms.not(sensed.primed);
    let bits = [
        (terms.not(sensed.all_valid), status::HELD),
        (primes, status::PRIMED),
        (sensed.clipped, status::CLIPPED),
        (outside, status::MAPPING_RANGE),
        (slewed, status::SLEW_LIMITED),
        (capped, status::SOFT_START),
        (limited, status::LIMITED),
    ];
    let damaged = terms.or(terms.not(sensed.sound), float.is_nan(t));
    let bit = |condition: Term, value: u64| terms.choose(condition, spec.counter(value), spec.counter(0));
    let bits = bits.into_iter().map(|(condition, value)| bit(condition, value));
    let good = bits
        .reduce(|x, y| terms.binary("bvor", x, y))
        .unwrap_or(spec.counter(0));
    let bad = terms.binary("bvor", spec.counter(status::FALLBACK), bit(damaged, status::STATE));
    let fallback = spec.nearest(policy.fallback.duty);
    Command {
        duty: terms.choose(applied, t, fallback),
        duty_sim: terms.choose(applied, chosen, fallback),
        action_index: terms.choose(damaged, spec.counter(0), index),
        status: terms.choose(applied, good, bad),
    }
}

/// Section 10; the command may be any, a caller that alters it answers for it.
pub(crate) fn commit(spec: Spec<'_>, state: &State, sensed: &Sensed, duty: Term, duty_sim: Term) -> State {
    let (terms, float) = (spec.terms, spec.float);
    let kept = |pushed: &Vec<Term>| {
        let words = pushed.iter().map(|word| terms.choose(sensed.sound, *word, spec.zero()));
        words.collect()
    };
    let soft_start = state.soft_cap.zip(spec.soft_raise()).zip(spec.soft_range());
    let soft_cap = soft_start.map(|((cap, raise), (from, max))| {
        let raised = float.add(cap, raise);
        let next = terms.choose(float.lt(raised, max), raised, max);
        terms.choose(sensed.usable, next, from)
    });
    let primed = terms.number(sensed.usable, 32);
    State {
        held: sensed.signals.clone(),
        observers: sensed.observed.iter().map(kept).collect(),
        memories: sensed
            .pushed
            .iter()
            .map(|filters| filters.iter().map(kept).collect())
            .collect(),
        previous_duty: duty_sim,
        previous_command: duty,
        soft_cap,
        coefficients: state.coefficients.clone(),
        check: state.check,
        bad_count: terms.choose(sensed.sound, sensed.bad, spec.counter(0)),
        primed: terms.choose(sensed.sound, primed, spec.counter(2)),
    }
}

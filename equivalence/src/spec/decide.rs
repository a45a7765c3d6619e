//! Sections 7 to 10: from Q values to the command, and the state behind it.

use policy::{DutyPath, Gain, Head, Scalar, Squash};

use super::{Own, Sensed, Spec, State, curves, status};
use crate::term::Term;

/// What leaves the controller: a duty, one before its mapping and an index for each output, and one status word.
pub(crate) struct Command {
    pub duty: Vec<Term>,
    pub duty_sim: Vec<Term>,
    pub action_index: Vec<Term>,
    pub status: Term,
}

/// What sections 7 to 8 make of the columns of one output.
pub(crate) struct Chosen {
    pub index: Term,
    /// Before the mapping; of a residual head the offset, and of a gain schedule nothing.
    pub duty: Term,
    /// Of a gain schedule.
    pub gains: Vec<Term>,
    /// Numbers on the way that are no NaN: the check of the policy bounds an output, and the curve is defined for every number.
    pub numbers: Vec<Term>,
}

/// What each output decides over its columns (section 9b), of which a contract with one output has all.
pub(crate) fn choose(spec: Spec<'_>, to_cut: u32, outputs: &[Term]) -> Vec<Chosen> {
    let paths = spec.policy.paths();
    let own = |path: &DutyPath<'_>| chosen(spec, to_cut, path.head, outputs.get(path.columns()).unwrap_or(&[]));
    paths.iter().map(own).collect()
}

/// The greedy action and its duty (sections 7 and 8), the duty of a continuous head (section 7b), or the gains of a gain schedule
/// (section 7c).
fn chosen(spec: Spec<'_>, to_cut: u32, head: &Head, outputs: &[Term]) -> Chosen {
    let mut numbers = Vec::new();
    let (duty, gains) = match (head, outputs) {
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
                duty: chosen_duty(spec, head, index),
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
/// (section 6b); `to_cut` bits of each are still to be shifted out. With several outputs it is one over the numbers (section 9b).
fn best(spec: Spec<'_>, to_cut: u32, outputs: &[Term]) -> Term {
    if !spec.policy.numeric_format.is_integer() {
        return argmax(spec, outputs);
    }
    if matches!(spec.policy.head, Head::Several(_)) {
        let numbers: Vec<Term> = outputs.iter().map(|output| as_number(spec, to_cut, *output)).collect();
        return argmax(spec, &numbers);
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
fn chosen_duty(spec: Spec<'_>, head: &Head, index: Term) -> Term {
    let duties = head.actions().iter().map(|action| spec.nearest(action.duty));
    let duties: Vec<Term> = duties.collect();
    spec.terms.entry(index, &duties).unwrap_or(spec.zero())
}

/// What sections 8 and 9 give of one output, before it is known whether the step is trusted.
struct Limited {
    chosen: Term,
    t: Term,
    /// `t` lies within the limits, and is a number then.
    inside: Term,
    bits: [(Term, u64); 4],
}

/// Sections 8 and 9 of each output, and what section 9b says of all together.
pub(crate) fn decide(spec: Spec<'_>, state: &State, sensed: &Sensed, choices: &[Chosen]) -> Command {
    let (terms, float) = (spec.terms, spec.float);
    let paths = spec.policy.paths();
    let each = paths.iter().zip(&state.outputs).zip(choices);
    let each: Vec<Limited> = each
        .map(|((path, own), choice)| limited(spec, path, own, sensed, choice))
        .collect();
    // with one output that cannot be trusted none is
    let applied = terms.and(sensed.usable, terms.all(each.iter().map(|own| own.inside)));
    let stray = each
        .iter()
        .fold(terms.truth(false), |any, own| terms.or(any, float.is_nan(own.t)));
    let damaged = terms.or(terms.not(sensed.sound), stray);
    let step = [
        (terms.not(sensed.all_valid), status::HELD),
        (terms.not(sensed.primed), status::PRIMED),
        (sensed.clipped, status::CLIPPED),
    ];
    let bit = |condition: Term, value: u64| terms.choose(condition, spec.counter(value), spec.counter(0));
    let bits = step.into_iter().chain(each.iter().flat_map(|own| own.bits));
    let bits = bits.map(|(condition, value)| bit(condition, value));
    let good = bits
        .reduce(|x, y| terms.binary("bvor", x, y))
        .unwrap_or(spec.counter(0));
    let bad = terms.binary("bvor", spec.counter(status::FALLBACK), bit(damaged, status::STATE));
    let or_fallback = |path: &DutyPath<'_>, duty| terms.choose(applied, duty, spec.nearest(path.fallback));
    let both = || paths.iter().zip(&each);
    Command {
        duty: both().map(|(path, own)| or_fallback(path, own.t)).collect(),
        duty_sim: both().map(|(path, own)| or_fallback(path, own.chosen)).collect(),
        action_index: choices
            .iter()
            .map(|choice| terms.choose(damaged, spec.counter(0), choice.index))
            .collect(),
        status: terms.choose(applied, good, bad),
    }
}

/// The duty before the mapping: that of the columns, or what a law of control makes of them.
fn before_mapping(spec: Spec<'_>, path: &DutyPath<'_>, sensed: &Sensed, choice: &Chosen) -> Term {
    let (terms, float) = (spec.terms, spec.float);
    let (low, high) = spec.inwards(path.limits.duty);
    match sensed.base {
        Some((base, still)) if path.head.schedule().is_some() => {
            let mut sum = base;
            for (gain, factor) in choice.gains.iter().zip(&sensed.factors) {
                let term = factor.map_or(*gain, |factor| float.mul(*gain, factor));
                sum = float.add(sum, term);
            }
            float.clamp(terms.choose(still, base, sum), low, high)
        }
        Some((base, still)) => {
            let offset = terms.choose(still, spec.zero(), choice.duty);
            float.clamp(float.add(base, offset), low, high)
        }
        None => choice.duty,
    }
}

fn limited(spec: Spec<'_>, path: &DutyPath<'_>, own: &Own, sensed: &Sensed, choice: &Chosen) -> Limited {
    let (terms, float, limits) = (spec.terms, spec.float, path.limits);
    let none = terms.truth(false);
    let chosen = before_mapping(spec, path, sensed, choice);
    let (mut t, mut outside) = (chosen, none);
    if let (Some(mapping), [a, b, c, rest @ ..]) = (path.mapping, own.coefficients.as_slice()) {
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
    if let Some(step) = spec.slew_step(limits) {
        let low = float.sub(own.previous_command, step);
        let high = float.add(own.previous_command, step);
        slewed = float.outside(t, low, high);
        t = float.clamp(t, low, high);
    }
    let mut capped = none;
    if let Some(cap) = own.soft_cap {
        capped = float.gt(t, cap);
        t = terms.choose(capped, cap, t);
    }
    let (low, high) = spec.inwards(limits.duty);
    let limited = float.outside(t, low, high);
    t = float.clamp(t, low, high);

    Limited {
        chosen,
        t,
        inside: float.within(t, low, high),
        bits: [
            (outside, status::MAPPING_RANGE),
            (slewed, status::SLEW_LIMITED),
            (capped, status::SOFT_START),
            (limited, status::LIMITED),
        ],
    }
}

/// Section 10; the command may be any, a caller that alters it answers for it.
pub(crate) fn commit(spec: Spec<'_>, state: &State, sensed: &Sensed, command: &Command) -> State {
    let terms = spec.terms;
    let kept = |pushed: &Vec<Term>| {
        let words = pushed.iter().map(|word| terms.choose(sensed.sound, *word, spec.zero()));
        words.collect()
    };
    let paths = spec.policy.paths();
    let duties = command.duty.iter().zip(&command.duty_sim);
    let outputs = state.outputs.iter().zip(&paths).zip(duties);
    let outputs = outputs.map(|((own, path), (duty, duty_sim))| Own {
        previous_duty: *duty_sim,
        previous_command: *duty,
        soft_cap: raised(spec, path, own, sensed),
        ..own.clone()
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
        outputs: outputs.collect(),
        bad_count: terms.choose(sensed.sound, sensed.bad, spec.counter(0)),
        primed: terms.choose(sensed.sound, primed, spec.counter(2)),
    }
}

/// The soft cap behind the step.
fn raised(spec: Spec<'_>, path: &DutyPath<'_>, own: &Own, sensed: &Sensed) -> Option<Term> {
    let (terms, float, limits) = (spec.terms, spec.float, path.limits);
    let (from, max) = spec.soft_range(limits)?;
    let raised = float.add(own.soft_cap?, spec.soft_raise(limits)?);
    let next = terms.choose(float.lt(raised, max), raised, max);
    Some(terms.choose(sensed.usable, next, from))
}

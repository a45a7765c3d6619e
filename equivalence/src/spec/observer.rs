//! Section 2b: the observers.

use policy::{Circuit, Estimate, InputVoltage, Observer, OnTime};

use super::{Spec, State};
use crate::term::Term;

/// What an observer gives in one step, and its words behind the push.
pub(crate) struct Observed {
    /// The surplus is +0 without a voltage to hold.
    pub estimates: [Term; 4],
    pub words: Vec<Term>,
}

/// What the step knows when its observers run.
pub(crate) struct Measured<'a> {
    pub signals: &'a [Term],
    pub valid: &'a [Term],
    pub primed: Term,
}

/// What a prediction rests on beside the estimates.
struct Drive {
    d: Term,
    o: Term,
    u: Term,
}

pub(crate) fn observe(
    spec: Spec<'_>,
    observer: &Observer,
    words: &[Term],
    state: &State,
    measured: &Measured<'_>,
) -> Observed {
    let signals = measured.signals;
    let y = signals[observer.output_voltage];
    let o = signals[observer.load_current];
    // section 2b: of several outputs that of the one which the observer names
    let d = state.outputs[observer.output].previous_command;
    let (u, kept_u) = match observer.input_voltage {
        InputVoltage::Constant(volts) => (spec.nearest(volts), None),
        InputVoltage::Signal(index) => (signals[index], Some(signals[index])),
    };
    let held = observer
        .hold
        .map_or(o, |hold| spec.float.mul(o, spec.nearest(hold.start)));
    let start = [clamped(spec, observer, Estimate::Current, held), y, spec.zero()];
    let known = |x: [Term; 3]| [0, 1, 2].map(|n| spec.terms.choose(measured.primed, x[n], start[n]));
    let memory = [words[0], words[1], words[2]];
    let valid = measured.valid[observer.output_voltage];
    if observer.compute_delay == 1 {
        let x = correct(spec, observer, known(memory), y, valid);
        let now = Drive { d, o, u };
        let x = predict(spec, observer, x, &now);
        return Observed {
            estimates: with_surplus(spec, observer, x, &now),
            words: x.to_vec(),
        };
    }
    let before = Drive {
        d,
        o: words[3],
        u: words.get(4).copied().unwrap_or(u),
    };
    let x = known(predict(spec, observer, memory, &before));
    let x = correct(spec, observer, x, y, valid);
    Observed {
        estimates: with_surplus(spec, observer, x, &Drive { d, o, u }),
        words: x.into_iter().chain([o]).chain(kept_u).collect(),
    }
}

/// Words of an observer's memory (section 1).
pub(crate) fn words(observer: &Observer) -> usize {
    match (observer.compute_delay, observer.input_voltage) {
        (1, _) => 3,
        (_, InputVoltage::Constant(_)) => 4,
        (_, InputVoltage::Signal(_)) => 5,
    }
}

fn correct(spec: Spec<'_>, observer: &Observer, x: [Term; 3], y: Term, valid: Term) -> [Term; 3] {
    let float = spec.float;
    let e = spec.terms.choose(valid, float.sub(y, x[1]), spec.zero());
    let one = |n: usize, estimate, gain: f64| {
        let sum = float.add(x[n], float.mul(spec.nearest(gain), e));
        clamped(spec, observer, estimate, sum)
    };
    [
        one(0, Estimate::Current, observer.gains.current),
        one(1, Estimate::Voltage, observer.gains.voltage),
        one(2, Estimate::Bias, observer.gains.bias),
    ]
}

fn predict(spec: Spec<'_>, observer: &Observer, [i, v, b]: [Term; 3], drive: &Drive) -> [Term; 3] {
    let float = spec.float;
    let half = spec.nearest(0.5);
    let h = spec.nearest(spec.policy.sample_period / observer.inductance);
    let g = spec.nearest(spec.policy.sample_period / observer.capacitance);
    let Drive { d, o, u } = *drive;
    if observer.topology != Circuit::Buck {
        return switched_output(spec, observer, [i, v, b], drive);
    }
    let m = match observer.carrier {
        OnTime::Trailing => float.sub(d, float.mul(float.mul(d, d), half)),
        OnTime::Centre => float.mul(d, half),
    };
    let a = float.sub(float.mul(u, m), float.mul(v, half));
    let a = float.add(a, float.mul(b, half));
    let a = clamped(spec, observer, Estimate::Current, float.add(i, float.mul(a, h)));
    let next = float.add(v, float.mul(float.sub(a, o), g));
    let next = clamped(spec, observer, Estimate::Voltage, next);
    let s = float.sub(float.mul(u, d), float.mul(float.add(v, next), half));
    let s = float.add(s, b);
    let end = clamped(spec, observer, Estimate::Current, float.add(i, float.mul(s, h)));
    [end, next, b]
}

/// A boost or a buck-boost.
fn switched_output(spec: Spec<'_>, observer: &Observer, [i, v, b]: [Term; 3], drive: &Drive) -> [Term; 3] {
    let float = spec.float;
    let half = spec.nearest(0.5);
    let h = spec.nearest(spec.policy.sample_period / observer.inductance);
    let g = spec.nearest(spec.policy.sample_period / observer.capacitance);
    let Drive { d, o, u } = *drive;
    let r = float.sub(spec.nearest(1.0), d);
    let on = float.mul(u, d);
    let f = if observer.topology == Circuit::Boost { u } else { on };
    let w = |x: Term| float.add(float.sub(f, float.mul(r, x)), b);
    let a = float.mul(w(v), half);
    let a = match observer.carrier {
        OnTime::Trailing => float.add(a, float.mul(on, half)),
        OnTime::Centre => a,
    };
    let a = clamped(spec, observer, Estimate::Current, float.add(i, float.mul(a, h)));
    let charge = float.sub(float.mul(r, a), o);
    let next = clamped(spec, observer, Estimate::Voltage, float.add(v, float.mul(charge, g)));
    let s = w(float.mul(float.add(v, next), half));
    let end = clamped(spec, observer, Estimate::Current, float.add(i, float.mul(s, h)));
    [end, next, b]
}

fn with_surplus(spec: Spec<'_>, observer: &Observer, [i, v, b]: [Term; 3], now: &Drive) -> [Term; 4] {
    let float = spec.float;
    let Some(hold) = observer.hold else {
        return [i, v, b, spec.zero()];
    };
    let q = float.mul(float.add(now.u, b), spec.nearest(hold.share));
    let m = match observer.carrier {
        OnTime::Centre => i,
        OnTime::Trailing => {
            let h = spec.nearest(spec.policy.sample_period / observer.inductance);
            let rise = float.mul(now.u, float.sub(spec.nearest(1.0), q));
            float.add(i, float.mul(float.mul(rise, spec.nearest(0.5)), h))
        }
    };
    let c = float.sub(float.mul(q, m), now.o);
    [i, v, b, clamped(spec, observer, Estimate::Surplus, c)]
}

fn clamped(spec: Spec<'_>, observer: &Observer, estimate: Estimate, x: Term) -> Term {
    let (low, high) = spec.ends(observer.range(estimate));
    spec.float.clamp(x, low, high)
}

//! Sections 2 to 5: from a measurement to the observation.

use policy::{Estimate, Expr, Factor, Head, Input};

use super::filter::filter;
use super::{Spec, State, observer};
use crate::term::Term;

/// What a step knows before the network runs.
#[derive(Clone)]
pub(crate) struct Sensed {
    pub sound: Term,
    pub all_valid: Term,
    pub signals: Vec<Term>,
    pub bad: Term,
    pub usable: Term,
    pub primed: Term,
    pub observation: Vec<Term>,
    /// What the law of a residual head says, clamped, or the base of a gain schedule, and whether nothing is added to it (sections
    /// 7c and 8).
    pub base: Option<(Term, Term)>,
    /// What each gain of a gain schedule is multiplied with; `None` where that is nothing (section 7c).
    pub factors: Vec<Option<Term>>,
    /// The features behind their filters.
    pub filtered: Vec<Term>,
    pub clipped: Term,
    /// The observers' words as `commit` leaves them in a sound state.
    pub observed: Vec<Vec<Term>>,
    /// The filters' lines as `commit` leaves them in a sound state.
    pub pushed: Vec<Vec<Vec<Term>>>,
}

/// Any measurement: a number of the format per physical signal, a code of 32 bits per ADC signal.
pub(crate) fn measurement(spec: Spec<'_>) -> Vec<Term> {
    let width = |adc: bool| if adc { 32 } else { spec.float.width() };
    let word = |signal: &policy::Signal| {
        let start = if signal.adc.is_some() { "code" } else { "measurement" };
        spec.terms
            .input(&format!("{start}_{}", signal.name), width(signal.adc.is_some()))
    };
    spec.policy.signals.iter().map(word).collect()
}

pub(crate) fn sense(spec: Spec<'_>, state: &State, measurement: &[Term]) -> Sensed {
    let (terms, float) = (spec.terms, spec.float);
    let (mut valid, mut signals) = (Vec::new(), Vec::new());
    for ((signal, word), held) in spec.policy.signals.iter().zip(measurement).zip(&state.held) {
        let x = match signal.adc {
            Some(adc) => {
                let scaled = float.mul(spec.nearest(adc.gain), float.of_i32(*word));
                float.add(scaled, spec.nearest(adc.offset))
            }
            None => *word,
        };
        let (low, high) = spec.inwards(signal.range);
        let inside = float.within(x, low, high);
        valid.push(inside);
        signals.push(terms.choose(inside, x, *held));
    }
    let all_valid = terms.all(valid.iter().copied());
    let count = state.bad_count;
    let counts = terms.order("bvule", count, spec.counter(spec.hold()));
    let raised = terms.choose(counts, terms.binary("bvadd", count, spec.counter(1)), count);
    let bad = terms.choose(all_valid, spec.counter(0), raised);
    let expired = terms.order("bvult", spec.counter(spec.hold()), bad);
    let primed = state.is_primed(spec);
    let bridged = terms.and(primed, terms.not(expired));
    let sound = state.sound(spec);
    let usable = terms.and(sound, terms.or(all_valid, bridged));
    let mut sensed = Sensed {
        sound,
        all_valid,
        signals,
        bad,
        usable,
        primed,
        observation: Vec::new(),
        base: None,
        factors: Vec::new(),
        filtered: Vec::new(),
        clipped: terms.truth(false),
        observed: Vec::new(),
        pushed: Vec::new(),
    };
    let measured = observer::Measured {
        signals: &sensed.signals,
        valid: &valid,
        primed,
    };
    let observers = spec.policy.observers.iter().zip(&state.observers);
    let observed = observers.map(|(each, words)| observer::observe(spec, each, words, state, &measured));
    let (estimates, words) = observed
        .map(|each| (each.estimates, each.words))
        .unzip::<_, _, Vec<_>, _>();
    sensed.observed = words;
    observe(spec, state, &estimates, &mut sensed);
    law(spec, state, &estimates, &mut sensed);
    sensed
}

/// What a law of control says before the network does (sections 7c and 8).
fn law(spec: Spec<'_>, state: &State, estimates: &[[Term; 4]], sensed: &mut Sensed) {
    let (terms, float) = (spec.terms, spec.float);
    let of = |own: &policy::Source| source(spec, &own.tree, state, &sensed.signals, estimates);
    let is_still = |zone: &[policy::Still]| {
        let within = zone.iter().map(|zone| {
            let (low, high) = (spec.nearest(-zone.within), spec.nearest(zone.within));
            float.within(of(&zone.source), low, high)
        });
        if zone.is_empty() {
            terms.truth(false)
        } else {
            terms.all(within)
        }
    };
    let (base, factors) = match &spec.policy.head {
        Head::Choice(_) | Head::Continuous(_) | Head::Several(_) => return,
        Head::Residual(head) => {
            let (low, high) = spec.inwards(head.limits);
            let base = float.clamp(of(&head.base), low, high);
            ((base, is_still(&head.dead_zone)), Vec::new())
        }
        Head::Schedule(head) => {
            let factors = head.gains.iter().map(|gain| match &gain.factor {
                Factor::Source(own) => Some(of(own)),
                Factor::Feature(index) => sensed.filtered.get(*index).copied(),
                Factor::One => None,
            });
            ((of(&head.base), is_still(&head.dead_zone)), factors.collect())
        }
    };
    sensed.base = Some(base);
    sensed.factors = factors;
}

fn observe(spec: Spec<'_>, state: &State, estimates: &[[Term; 4]], sensed: &mut Sensed) {
    let (terms, float) = (spec.terms, spec.float);
    for (feature, lines) in spec.policy.features.iter().zip(&state.memories) {
        let mut y = source(spec, &feature.source, state, &sensed.signals, estimates);
        let mut pushed = Vec::new();
        for (each, line) in feature.filters.iter().zip(lines) {
            let filtered = filter(spec, each, line, sensed.primed, y);
            y = filtered.y;
            pushed.push(filtered.words);
        }
        sensed.pushed.push(pushed);
        sensed.filtered.push(y);
        if feature.scale != 1.0 {
            y = float.mul(y, spec.nearest(feature.scale));
        }
        if feature.offset != 0.0 {
            y = float.add(y, spec.nearest(feature.offset));
        }
        if let Some(clip) = feature.clip {
            let (low, high) = spec.ends(clip);
            sensed.clipped = terms.or(sensed.clipped, float.outside(y, low, high));
            y = float.clamp(y, low, high);
        }
        sensed.observation.push(y);
    }
}

/// Section 3: every `+`, `-` and product with a constant is one rounding, as the tree stands.
fn source(spec: Spec<'_>, expr: &Expr, state: &State, signals: &[Term], estimates: &[[Term; 4]]) -> Term {
    let float = spec.float;
    let of = |x: &Expr| source(spec, x, state, signals, estimates);
    match expr {
        Expr::Input(Input::Signal(index)) => signals[*index],
        Expr::Input(Input::PreviousDuty) => state.outputs[0].previous_duty,
        Expr::Input(Input::PreviousCommand) => state.outputs[0].previous_command,
        Expr::Input(Input::OutputDuty(index)) => state.outputs[*index].previous_duty,
        Expr::Input(Input::OutputCommand(index)) => state.outputs[*index].previous_command,
        Expr::Input(Input::Estimate(index, estimate)) => {
            let [current, voltage, bias, surplus] = estimates[*index];
            match estimate {
                Estimate::Current => current,
                Estimate::Voltage => voltage,
                Estimate::Bias => bias,
                Estimate::Surplus => surplus,
            }
        }
        Expr::Constant(value) => spec.nearest(*value),
        Expr::Neg(x) => float.neg(of(x)),
        Expr::Add(x, y) => float.add(of(x), of(y)),
        Expr::Sub(x, y) => float.sub(of(x), of(y)),
        Expr::Scale(by, x) => float.mul(of(x), spec.nearest(*by)),
    }
}

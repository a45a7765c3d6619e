//! Section 1: the state, which states are sound, and what `init` and `reset` leave. Section 8: coefficients set at run time.

use policy::{Activation, DutyPath, Expr, Feature, Filter, Head, Input, Mapping, Squash, memory_bounds};

use super::Spec;
use crate::term::Term;

/// The state in the order of section 1.
#[derive(Clone)]
pub(crate) struct State {
    pub held: Vec<Term>,
    /// By observer: current, voltage, bias, then what it keeps of the last measurement.
    pub observers: Vec<Vec<Term>>,
    /// By feature, then filter, then word: oldest first.
    pub memories: Vec<Vec<Vec<Term>>>,
    /// By output (section 9b); a contract with one has one of these.
    pub outputs: Vec<Own>,
    pub bad_count: Term,
    pub primed: Term,
}

/// What is remembered of one output.
#[derive(Clone)]
pub(crate) struct Own {
    pub previous_duty: Term,
    pub previous_command: Term,
    pub soft_cap: Option<Term>,
    /// a, b, c and in the four-term form r; none without a mapping.
    pub coefficients: Vec<Term>,
    /// Their check word, as wide as the format; none without a mapping.
    pub check: Option<Term>,
}

impl State {
    /// Any state of the policy, inside the invariant or not: an input for every word.
    pub(crate) fn any(spec: Spec<'_>) -> Self {
        let number = |name: &str| spec.terms.input(name, spec.float.width());
        let memories = spec.policy.features.iter().enumerate().map(|(f, feature)| {
            let filters = feature.filters.iter().enumerate().map(|(g, filter)| {
                let words = (0..words(filter)).map(|w| number(&format!("memory_{f}_{g}_{w}")));
                words.collect()
            });
            filters.collect()
        });
        let observers = spec.policy.observers.iter().enumerate().map(|(n, each)| {
            let words = 0..super::observer::words(each);
            words.map(|w| number(&format!("observer_{n}_{w}"))).collect()
        });
        State {
            held: (0..spec.policy.signals.len())
                .map(|s| number(&format!("held_{s}")))
                .collect(),
            observers: observers.collect(),
            memories: memories.collect(),
            outputs: spec.policy.paths().iter().map(|path| Own::any(spec, path)).collect(),
            bad_count: spec.terms.input("bad_count", 32),
            primed: spec.terms.input("primed", 32),
        }
    }

    /// All words of the memories, in the order of section 1.
    pub(crate) fn memory(&self) -> impl Iterator<Item = &Term> {
        self.observers
            .iter()
            .flatten()
            .chain(self.memories.iter().flatten().flatten())
    }

    /// The same, to be filled in.
    pub(crate) fn memory_mut(&mut self) -> impl Iterator<Item = &mut Term> {
        let filters = self.memories.iter_mut().flatten().flatten();
        self.observers.iter_mut().flatten().chain(filters)
    }

    /// The lowest bit of the word (section 2).
    pub(crate) fn is_primed(&self, spec: Spec<'_>) -> Term {
        let one = spec.counter(1);
        spec.terms.equal(spec.terms.binary("bvand", self.primed, one), one)
    }

    /// Whether the state is one that the controller writes.
    pub(crate) fn sound(&self, spec: Spec<'_>) -> Term {
        let (terms, float) = (spec.terms, spec.float);
        let mut all = Vec::new();
        for (held, signal) in self.held.iter().zip(&spec.policy.signals) {
            let (low, high) = spec.inwards(signal.range);
            all.push(float.within(*held, low, high));
        }
        for (word, bound) in self.memory().zip(memory_bounds(spec.policy)) {
            all.push(float.within(*word, spec.nearest(-bound), spec.nearest(bound)));
        }
        for (own, path) in self.outputs.iter().zip(spec.policy.paths()) {
            own.sound(spec, &path, &mut all);
        }
        all.push(terms.order("bvule", self.bad_count, spec.counter(spec.hold() + 1)));
        all.push(terms.order("bvule", self.primed, spec.counter(1)));
        terms.all(all)
    }
}

impl Own {
    fn any(spec: Spec<'_>, path: &DutyPath<'_>) -> Self {
        let number = |stem: &str| spec.terms.input(&path.named(stem), spec.float.width());
        let check = path.named("word_mapping_check");
        Own {
            previous_duty: number("previous_duty"),
            previous_command: number("previous_command"),
            soft_cap: path.limits.soft_start.map(|_| number("soft_cap")),
            coefficients: coefficients(path.mapping)
                .iter()
                .map(|(name, _, _)| number(&format!("mapping_{name}")))
                .collect(),
            check: (path.mapping.is_some()).then(|| spec.terms.input(&check, spec.float.width())),
        }
    }

    /// What has to hold of a sound state (section 1), of one output those of section 9b.
    fn sound(&self, spec: Spec<'_>, path: &DutyPath<'_>, all: &mut Vec<Term>) {
        let (terms, float, limits) = (spec.terms, spec.float, path.limits);
        let start = [limits.initial_duty, path.fallback].map(|duty| spec.format().nearest(duty));
        if reads(spec, path.previous_duty) {
            let duties = duties(spec, path).into_iter().chain(start);
            all.push(between(spec, self.previous_duty, duties));
        }
        let range = [spec.format().up(limits.duty.low), spec.format().down(limits.duty.high)];
        if reads(spec, path.previous_command) || limits.slew.is_some() {
            all.push(between(spec, self.previous_command, range.into_iter().chain(start)));
        }
        if let Some((cap, (low, high))) = self.soft_cap.zip(spec.soft_range(limits)) {
            all.push(float.within(cap, low, high));
        }
        all.extend(
            self.check
                .map(|check| terms.equal(check, check_word(spec, &self.coefficients))),
        );
    }

    /// After `reset`, which keeps the coefficients and their check word.
    fn reset(&self, spec: Spec<'_>, path: &DutyPath<'_>) -> Self {
        Own {
            previous_duty: spec.nearest(path.limits.initial_duty),
            previous_command: spec.nearest(path.limits.initial_duty),
            soft_cap: path.limits.soft_start.map(|start| spec.nearest(start.from)),
            ..self.clone()
        }
    }

    /// After `init`: the coefficients are those of the file.
    fn initial(&self, spec: Spec<'_>, path: &DutyPath<'_>) -> Self {
        let coefficients = coefficients(path.mapping);
        let coefficients: Vec<Term> = coefficients.iter().map(|(_, value, _)| spec.nearest(*value)).collect();
        Own {
            check: self.check.map(|_| check_word(spec, &coefficients)),
            coefficients,
            ..self.reset(spec, path)
        }
    }
}

/// The duties of all actions, those of a continuous head at both ends of its squash (section 7b), or the
/// limits of a law (sections 7c and 8).
fn duties(spec: Spec<'_>, path: &DutyPath<'_>) -> Vec<f64> {
    let format = spec.format();
    match path.head {
        Head::Choice(actions) => actions.iter().map(|action| format.nearest(action.duty)).collect(),
        Head::Residual(_) | Head::Schedule(_) => {
            let limits = path.limits.duty;
            vec![format.up(limits.low), format.down(limits.high)]
        }
        Head::Continuous(head) => {
            let ends = match head.squash {
                Squash::Curve(Activation::Sigmoid | Activation::HardSigmoid) => [0.0, 1.0],
                Squash::Curve(_) => [-1.0, 1.0],
                Squash::Clip(clip) => [clip.low, clip.high],
            };
            // binary64 has more than twice the digits of binary32: what is rounded to it first is rounded no other way
            ends.map(|s| {
                let scaled = format.nearest(format.nearest(s) * format.nearest(head.scale));
                format.nearest(scaled + format.nearest(head.offset))
            })
            .to_vec()
        }
        // each of several is a path with a head of its own
        Head::Several(_) => Vec::new(),
    }
}

/// Words of a filter's memory (section 4).
fn words(filter: &Filter) -> usize {
    match *filter {
        Filter::Delay { samples } => samples,
        Filter::MovingAverage { samples } => samples - 1,
        Filter::FilteredDerivative { .. } => 2,
        Filter::BackwardDifference | Filter::LowPass { .. } | Filter::Integrator { .. } => 1,
    }
}

fn between(spec: Spec<'_>, x: Term, values: impl Iterator<Item = f64>) -> Term {
    let ends = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    });
    spec.float
        .within(x, spec.float.constant(ends.0), spec.float.constant(ends.1))
}

/// Whether any source reads `input`.
fn reads(spec: Spec<'_>, input: Input) -> bool {
    fn in_tree(expr: &Expr, input: Input) -> bool {
        match expr {
            Expr::Input(found) => *found == input,
            Expr::Constant(_) => false,
            Expr::Neg(x) | Expr::Scale(_, x) => in_tree(x, input),
            Expr::Add(x, y) | Expr::Sub(x, y) => in_tree(x, input) || in_tree(y, input),
        }
    }
    let features: &[Feature] = &spec.policy.features;
    let mut law = spec.policy.head.sources();
    if law.any(|source| in_tree(&source.tree, input)) {
        return true;
    }
    // every observer is driven by the last command, of several outputs by that of the one it names
    let mut drives = spec.policy.observers.iter().map(|observer| match spec.policy.head {
        Head::Several(_) => Input::OutputCommand(observer.output),
        _ => Input::PreviousCommand,
    });
    drives.any(|drive| drive == input) || features.iter().any(|feature| in_tree(&feature.source, input))
}

/// Name, value and allowed interval of every coefficient of a mapping; nothing without one.
fn coefficients(mapping: Option<&Mapping>) -> Vec<(&'static str, f64, policy::Interval)> {
    let Some(mapping) = mapping else {
        return Vec::new();
    };
    let Mapping { coefficients: k, .. } = mapping;
    let mut all = vec![
        ("a", k.a, mapping.adjust_a),
        ("b", k.b, mapping.adjust_b),
        ("c", k.c, mapping.adjust_c),
    ];
    all.extend(k.r.map(|r| ("r", r, mapping.adjust_r)));
    all
}

/// Section 1: the check word of coefficients, whose terms are their bits.
pub(crate) fn check_word(spec: Spec<'_>, coefficients: &[Term]) -> Term {
    // 4B in every byte
    let constant = 0x4B4B_4B4B_4B4B_4B4B >> (64 - spec.float.width());
    let constant = spec.terms.bits(constant, spec.float.width());
    let combined = |word, bits: &Term| spec.terms.binary("bvxor", word, *bits);
    coefficients.iter().fold(constant, combined)
}

/// Section 8: whether coefficients of an output are accepted at run time. True without a mapping.
pub(crate) fn accepted(spec: Spec<'_>, path: &DutyPath<'_>, values: &[Term]) -> Term {
    let float = spec.float;
    let mut all = Vec::new();
    for (value, (_, _, range)) in values.iter().zip(coefficients(path.mapping)) {
        let (low, high) = spec.inwards(range);
        all.push(float.within(*value, low, high));
    }
    if let (Some(mapping), [a, _, _, r]) = (path.mapping, values) {
        for end in [mapping.valid_i_out.low, mapping.valid_i_out.high] {
            let gain = float.add(*a, float.mul(*r, spec.nearest(end)));
            all.push(float.gt(gain, spec.zero()));
        }
    }
    spec.terms.all(all)
}

/// The state after `reset`, which keeps the coefficients of the state before and their check word.
pub(crate) fn reset(spec: Spec<'_>, before: &State) -> State {
    let held = spec.policy.signals.iter().map(|signal| {
        let (low, high) = (
            spec.format().up(signal.range.low),
            spec.format().down(signal.range.high),
        );
        // the value of the range nearest to 0; a +0 where the range has it inside
        let nearest = if low > 0.0 {
            low
        } else if high < 0.0 {
            high
        } else {
            0.0
        };
        spec.float.constant(nearest)
    });
    let zeros = |filters: &Vec<Vec<Term>>| filters.iter().map(|words| vec![spec.zero(); words.len()]).collect();
    State {
        held: held.collect(),
        observers: zeros(&before.observers),
        memories: before.memories.iter().map(zeros).collect(),
        outputs: each(spec, before, Own::reset),
        bad_count: spec.counter(0),
        primed: spec.counter(0),
    }
}

/// The state after `init`: the coefficients are those of the file.
pub(crate) fn initial(spec: Spec<'_>, before: &State) -> State {
    State {
        outputs: each(spec, before, Own::initial),
        ..reset(spec, before)
    }
}

fn each<'a>(spec: Spec<'a>, before: &State, of: fn(&Own, Spec<'a>, &DutyPath<'a>) -> Own) -> Vec<Own> {
    let paths = spec.policy.paths();
    let both = before.outputs.iter().zip(&paths);
    both.map(|(own, path)| of(own, spec, path)).collect()
}

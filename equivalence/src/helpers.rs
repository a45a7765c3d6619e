//! The mask helpers of the emitted code against their plain models, for all bit patterns.

use policy::Activation;
use policy::limits::MAX_MAGNITUDE;

use crate::emitted::Emitted;
use crate::float::Float;
use crate::goal::{Goal, holds};
use crate::machine::{I32, Kind, Number, U32};
use crate::refusal::Refusal;
use crate::smt::Arithmetic;
use crate::spec::{Spec, curves};
use crate::term::Term;

/// What a helper is to give: from its arguments the preconditions and the claim about the number that it gave.
struct Model {
    name: &'static str,
    arguments: &'static [(&'static str, Of)],
    says: &'static str,
    arithmetic: Arithmetic,
    claim: fn(Float<'_>, &[Term], Term) -> Claim,
}

/// Type of an argument.
#[derive(Clone, Copy)]
enum Of {
    Number,
    /// The unsigned integer as wide as a number.
    Word,
    Flag,
    Integer,
}

/// The claim, and what may be taken for granted of the arguments.
struct Claim {
    given: Vec<Term>,
    holds: Term,
}

const PLAIN: Arithmetic = Arithmetic::Uninterpreted;

const MODELS: [Model; 15] = [
    Model {
        name: "select",
        arguments: &[("flag", Of::Flag), ("then", Of::Number), ("otherwise", Of::Number)],
        says: "is `flag ? then : otherwise` for a flag of 0 or 1, to the bit",
        arithmetic: PLAIN,
        claim: chosen,
    },
    Model {
        name: "select_integer",
        arguments: &[("flag", Of::Flag), ("then", Of::Integer), ("otherwise", Of::Integer)],
        says: "is `flag ? then : otherwise` for a flag of 0 or 1",
        arithmetic: PLAIN,
        claim: chosen,
    },
    Model {
        name: "within",
        arguments: &[("x", Of::Number), ("low", Of::Number), ("high", Of::Number)],
        says: "is 1 if `x >= low and x <= high`, else 0",
        arithmetic: PLAIN,
        claim: |float, x, got| always(float, got, float.within(x[0], x[1], x[2])),
    },
    Model {
        name: "outside",
        arguments: &[("x", Of::Number), ("low", Of::Number), ("high", Of::Number)],
        says: "is 1 if `x < low or x > high`, else 0",
        arithmetic: PLAIN,
        claim: |float, x, got| always(float, got, float.outside(x[0], x[1], x[2])),
    },
    Model {
        name: "clamp",
        arguments: &[("x", Of::Number), ("low", Of::Number), ("high", Of::Number)],
        says: "is the clamp of section 4, NaN included; with `low <= high` it changes the bits exactly if it was active",
        arithmetic: PLAIN,
        claim: |float, x, got| {
            let terms = float.terms;
            let changed = terms.not(terms.equal(got, x[0]));
            let active = terms.equal(changed, float.outside(x[0], x[1], x[2]));
            let ordered = float.le(x[1], x[2]);
            Claim {
                given: Vec::new(),
                holds: terms.and(
                    terms.equal(got, float.clamp(x[0], x[1], x[2])),
                    terms.or(terms.not(ordered), active),
                ),
            }
        },
    },
    Model {
        name: "far",
        arguments: &[("x", Of::Number), ("bound", Of::Word)],
        says: "has its highest bit set exactly if |x| is not at most the number with the bits `bound`",
        arithmetic: PLAIN,
        claim: |float, x, got| Claim {
            given: vec![is_magnitude(float, x[1])],
            holds: stray(float, got, float.within(x[0], float.neg(x[1]), x[1])),
        },
    },
    Model {
        name: "aside",
        arguments: &[("x", Of::Number), ("low", Of::Word), ("high", Of::Word)],
        says: "has its highest bit set exactly if x is not between the numbers with the bits `low`, whose sign is set, and `high`",
        arithmetic: PLAIN,
        claim: |float, x, got| Claim {
            given: vec![is_magnitude(float, float.neg(x[1])), is_magnitude(float, x[2])],
            holds: stray(float, got, float.within(x[0], x[1], x[2])),
        },
    },
    Model {
        name: "beyond",
        arguments: &[("x", Of::Number), ("low", Of::Word), ("width", Of::Word)],
        says: "has its highest bit set exactly if x is not between the positive numbers with the bits `low` and `low + width`",
        arithmetic: PLAIN,
        claim: |float, x, got| {
            let terms = float.terms;
            let high = terms.binary("bvadd", x[1], x[2]);
            let zero = terms.bits(0, float.width());
            let positive = terms.not(terms.equal(x[1], zero));
            Claim {
                given: vec![
                    positive,
                    is_magnitude(float, x[1]),
                    is_magnitude(float, x[2]),
                    is_magnitude(float, high),
                ],
                holds: stray(float, got, float.within(x[0], x[1], high)),
            }
        },
    },
    Model {
        name: "relu",
        arguments: &[("x", Of::Number)],
        says: "is `x if x > 0 else +0` for every number that the check of a policy lets arise, in the arithmetic of IEEE 754",
        arithmetic: Arithmetic::Ieee,
        claim: |float, x, got| {
            let zero = float.constant(0.0);
            let most = float.constant(MAX_MAGNITUDE);
            Claim {
                given: vec![float.within(x[0], float.neg(most), most)],
                holds: float
                    .terms
                    .equal(got, float.terms.choose(float.gt(x[0], zero), x[0], zero)),
            }
        },
    },
    Model {
        name: "leaky_relu",
        arguments: &[("x", Of::Number), ("slope", Of::Number)],
        says: "is `x if x > 0 else fl(slope * x)` for every number x and 0 < slope < 1, if fl(slope * +0) is +0",
        arithmetic: PLAIN,
        claim: |float, x, got| {
            let zero = float.constant(0.0);
            let scaled = float.mul(x[1], x[0]);
            let is_zero = float.terms.equal(x[0], zero);
            let keeps_zero = float
                .terms
                .or(float.terms.not(is_zero), float.terms.equal(scaled, zero));
            let plain = float.terms.choose(float.gt(x[0], zero), x[0], scaled);
            Claim {
                given: vec![keeps_zero, float.terms.not(float.is_nan(x[0]))],
                holds: float.terms.equal(got, plain),
            }
        },
    },
    Model {
        name: "limit",
        arguments: &[("x", Of::Number), ("limit", Of::Word)],
        says: "is the clamp of a number to plus and minus the number with the bits `limit`",
        arithmetic: PLAIN,
        claim: |float, x, got| Claim {
            given: vec![is_magnitude(float, x[1]), float.terms.not(float.is_nan(x[0]))],
            holds: float.terms.equal(got, float.clamp(x[0], float.neg(x[1]), x[1])),
        },
    },
    Model {
        name: "absolute",
        arguments: &[("x", Of::Number)],
        says: "is x without its sign, for every number x",
        arithmetic: PLAIN,
        claim: |float, x, got| Claim {
            given: vec![float.terms.not(float.is_nan(x[0]))],
            holds: float.terms.equal(
                got,
                float.terms.choose(
                    float
                        .terms
                        .equal(float.terms.binary("bvand", x[0], float.sign()), float.constant(0.0)),
                    x[0],
                    float.neg(x[0]),
                ),
            ),
        },
    },
    Model {
        name: "most",
        arguments: &[("x", Of::Integer), ("y", Of::Integer)],
        says: "is the larger of two integers whose difference fits",
        arithmetic: PLAIN,
        claim: |float, x, got| of_two(float, x, got, x[0], x[1]),
    },
    Model {
        name: "least",
        arguments: &[("x", Of::Integer), ("y", Of::Integer)],
        says: "is the smaller of two integers whose difference fits",
        arithmetic: PLAIN,
        claim: |float, x, got| of_two(float, x, got, x[1], x[0]),
    },
    Model {
        name: "positive",
        arguments: &[("x", Of::Integer)],
        says: "is x if x > 0 else 0, for integers of 16 bits",
        arithmetic: PLAIN,
        claim: |float, x, got| {
            let terms = float.terms;
            let zero = terms.bits(0, 32);
            let plain = terms.choose(terms.order("bvslt", zero, x[0]), x[0], zero);
            let fits = terms.equal(terms.resize(terms.extract(x[0], 15, 0), 32, true), x[0]);
            Claim {
                given: vec![fits],
                holds: terms.equal(terms.resize(got, 32, true), plain),
            }
        },
    },
];

fn is_flag(float: Float<'_>, flag: Term) -> Term {
    float.terms.order("bvule", flag, float.terms.bits(1, 32))
}

fn is_set(float: Float<'_>, flag: Term) -> Term {
    float.terms.equal(flag, float.terms.bits(1, 32))
}

/// Bits of a number that is not negative: what a bound has.
fn is_magnitude(float: Float<'_>, bits: Term) -> Term {
    float.terms.order("bvule", bits, float.constant(f64::INFINITY))
}

/// The second argument if the flag is 1, the third if it is 0.
fn chosen(float: Float<'_>, x: &[Term], got: Term) -> Claim {
    Claim {
        given: vec![is_flag(float, x[0])],
        holds: float
            .terms
            .equal(got, float.terms.choose(is_set(float, x[0]), x[1], x[2])),
    }
}

fn always(float: Float<'_>, got: Term, condition: Term) -> Claim {
    Claim {
        given: Vec::new(),
        holds: float.terms.equal(got, float.terms.number(condition, 32)),
    }
}

/// That the highest bit says `not inside`.
fn stray(float: Float<'_>, got: Term, inside: Term) -> Term {
    let top = float.width() - 1;
    let is_set = float
        .terms
        .equal(float.terms.extract(got, top, top), float.terms.bits(1, 1));
    float.terms.equal(is_set, float.terms.not(inside))
}

/// That `got` is the first of `larger` and `other` if it is not below the second.
fn of_two(float: Float<'_>, x: &[Term], got: Term, larger: Term, other: Term) -> Claim {
    let terms = float.terms;
    let wide = |x: Term| terms.resize(x, 64, true);
    let difference = terms.binary("bvsub", wide(x[0]), wide(x[1]));
    let fits = |d: Term| terms.equal(wide(terms.extract(d, 31, 0)), d);
    let other_way = terms.binary("bvsub", wide(x[1]), wide(x[0]));
    let first = terms.order("bvslt", other, larger);
    Claim {
        given: vec![fits(difference), fits(other_way)],
        holds: terms.equal(got, terms.choose(first, x[0], x[1])),
    }
}

/// What a curve gives. What it takes for granted beside its argument, a goal of another helper shows.
fn curve(float: Float<'_>, activation: Activation, x: Term, got: Term) -> Option<Claim> {
    let curve = curves::of(float, activation, x)?;
    let mut given: Vec<Term> = curve
        .numbers
        .iter()
        .map(|x| float.terms.not(float.is_nan(*x)))
        .collect();
    given.extend(curve.shown);
    Some(Claim {
        given,
        holds: float.terms.equal(got, curve.value),
    })
}

/// One goal for each curve that the code has.
fn curve_goals(spec: Spec<'_>, emitted: &dyn Emitted, goals: &mut Vec<Goal>) -> Result<(), Refusal> {
    let language = emitted.language();
    let x = argument(spec, "x", Of::Number);
    for activation in Activation::EACH {
        let word = activation.word();
        if activation.curve().is_none() {
            continue;
        }
        let Some(given) = emitted.helper(word, std::slice::from_ref(&x)) else {
            continue;
        };
        let (got, obligations) = given?;
        let Some(claim) = curve(spec.float, *activation, x.term, got.term) else {
            continue;
        };
        goals.push(holds(
            spec.float,
            &format!("{}.helper.{word}", language.to_lowercase()),
            format!(
                "{language}: `{word}` is that of section 6, operation by operation, for every number that the check of a policy lets arise \
                 and on the way to which no quotient is NaN"
            ),
            spec.terms.and(claim.holds, spec.terms.all(obligations)),
            &claim.given,
            PLAIN,
        ));
    }
    Ok(())
}

/// One goal for each helper that the code has.
pub(crate) fn goals(spec: Spec<'_>, emitted: &dyn Emitted) -> Result<Vec<Goal>, Refusal> {
    let language = emitted.language();
    let mut goals = Vec::new();
    for model in &MODELS {
        let arguments: Vec<Number> = model
            .arguments
            .iter()
            .map(|(name, of)| argument(spec, name, *of))
            .collect();
        let Some(given) = emitted.helper(model.name, &arguments) else {
            continue;
        };
        let (got, obligations) = given?;
        let terms: Vec<Term> = arguments.iter().map(|argument| argument.term).collect();
        let claim = (model.claim)(spec.float, &terms, got.term);
        let defined = spec.terms.all(obligations);
        goals.push(holds(
            spec.float,
            &format!("{}.helper.{}", language.to_lowercase(), model.name),
            format!("{language}: `{}` {}", model.name, model.says),
            spec.terms.and(claim.holds, defined),
            &claim.given,
            model.arithmetic,
        ));
    }
    curve_goals(spec, emitted, &mut goals)?;
    Ok(goals)
}

fn argument(spec: Spec<'_>, name: &str, of: Of) -> Number {
    let bits = spec.float.width();
    let kind = match of {
        Of::Number => Kind::Float(spec.float.format),
        Of::Word => Kind::Integer { bits, signed: false },
        Of::Flag => U32,
        Of::Integer => I32,
    };
    let start = match of {
        Of::Number => "",
        Of::Word | Of::Flag => "word_",
        Of::Integer => "output_",
    };
    Number {
        term: spec.terms.input(&format!("{start}{name}"), kind.width()),
        kind,
    }
}

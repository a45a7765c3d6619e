//! The curves of section 6 that rest on its tanh, operation by operation.

use policy::activation as facts;

use super::formula::{Formula, Step, Value};

const HALF: Value = Value::Number(0.5);
const ONE: Value = Value::Number(1.0);

pub(super) fn sigmoid() -> Formula {
    let mut f = Formula::new("sigmoid", "1 / (1 + exp(-x)) by the tanh of half of x");
    let half = f.line("halved", Step::Mul(Value::X, HALF));
    let t = f.line("t", Step::Tanh(half));
    let s = f.line("s", Step::Mul(t, HALF));
    f.line("y", Step::Add(s, HALF));
    f
}

pub(super) fn hard_sigmoid() -> Formula {
    let mut f = Formula::new("hard_sigmoid", "x / 6 + 1 / 2 within 0 and 1");
    let s = f.line("s", Step::Mul(Value::X, Value::Number(facts::HARD_SLOPE)));
    let t = f.line("t", Step::Limit(s, 0.5));
    f.line("y", Step::Add(t, HALF));
    f
}

pub(super) fn elu() -> Formula {
    let mut f = Formula::new("elu", "x above 0, exp(x) - 1 below by the tanh of half of x");
    let minus = f.line("minus", Step::Neg(Value::X));
    let below = f.line("below", Step::Relu(minus));
    let half = f.line("halved", Step::Mul(below, HALF));
    let s = f.line("s", Step::Tanh(half));
    // no number is below 0 here; without its sign intervals see it, too, and that the quotient has no pole
    let t = f.line("t", Step::Absolute(s));
    let twice = f.line("twice", Step::Add(t, t));
    let sum = f.line("sum", Step::Add(ONE, t));
    let e = f.line("e", Step::Div(twice, sum));
    let above = f.line("above", Step::Relu(Value::X));
    f.line("y", Step::Sub(above, e));
    f
}

pub(super) fn softplus() -> Formula {
    let mut f = Formula::new(
        "softplus",
        "ln(1 + exp(x)): 2 artanh(v) above the positive part of x, v by the tanh of half of x",
    );
    let a = f.line("a", Step::Absolute(Value::X));
    let half = f.line("halved", Step::Mul(a, HALF));
    let t = f.line("t", Step::Tanh(half));
    let rest = f.line("rest", Step::Sub(ONE, t));
    let sum = f.line("sum", Step::Add(Value::Number(3.0), t));
    let v = f.line("v", Step::Div(rest, sum));
    let z = f.line("z", Step::Mul(v, v));
    let p = f.polynomial(&facts::SOFTPLUS_TERMS, z);
    let l = f.line("l", Step::Mul(p, v));
    let above = f.line("above", Step::Relu(Value::X));
    f.line("y", Step::Add(above, l));
    f
}

pub(super) fn silu() -> Formula {
    let mut f = Formula::new(
        "silu",
        "x / (1 + exp(-x)): the positive part of x less what the gate leaves of |x|",
    );
    let a = magnitude(&mut f, facts::SILU_RANGE);
    let u = f.line("u", Step::Mul(a, HALF));
    gate(f, a, u)
}

pub(super) fn gelu() -> Formula {
    let f = Formula::new(
        "gelu",
        "x (1 + erf(x / sqrt(2))) / 2: the positive part of x less what the gate leaves of |x|",
    );
    gate_of(f, facts::GELU_RANGE, &facts::GELU_TERMS)
}

pub(super) fn gelu_tanh() -> Formula {
    let f = Formula::new(
        "gelu_tanh",
        "x (1 + tanh(0.798 x + 0.0357 x^3)) / 2: as the others with a gate",
    );
    gate_of(f, facts::GELU_TANH_RANGE, &facts::GELU_TANH_TERMS)
}

pub(super) fn hard_swish() -> Formula {
    let mut f = Formula::new(
        "hard_swish",
        "x times its hard sigmoid: the positive part of x less what the gate leaves of |x|",
    );
    let a = magnitude(&mut f, facts::HARD_RANGE);
    let s = f.line("s", Step::Mul(a, Value::Number(facts::HARD_SLOPE)));
    let t = f.line("t", Step::Limit(s, 0.5));
    left(f, a, t)
}

/// |x|, limited.
fn magnitude(f: &mut Formula, range: f64) -> Value {
    let limited = f.line("limited", Step::Limit(Value::X, range));
    f.line("a", Step::Absolute(limited))
}

/// The gate of an odd polynomial in x.
fn gate_of(mut f: Formula, range: f64, terms: &[f64]) -> Formula {
    let a = magnitude(&mut f, range);
    let z = f.line("z", Step::Mul(a, a));
    let p = f.polynomial(terms, z);
    let u = f.line("u", Step::Mul(a, p));
    gate(f, a, u)
}

fn gate(mut f: Formula, a: Value, u: Value) -> Formula {
    let s = f.line("s", Step::Tanh(u));
    let t = f.line("t", Step::Mul(s, HALF));
    left(f, a, t)
}

/// The positive part of x less `a (1/2 - t)`.
fn left(mut f: Formula, a: Value, t: Value) -> Formula {
    let h = f.line("h", Step::Sub(HALF, t));
    let rest = f.line("rest", Step::Mul(a, h));
    let above = f.line("above", Step::Relu(Value::X));
    f.line("y", Step::Sub(above, rest));
    f
}

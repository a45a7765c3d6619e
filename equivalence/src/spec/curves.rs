//! The curves of section 6 that rest on its tanh.

use policy::Activation;
use policy::limits::MAX_MAGNITUDE;

use super::tables;
use crate::float::Float;
use crate::term::Term;

/// A curve's value, and what it takes for granted.
pub(crate) struct Curve {
    pub value: Term,
    /// Numbers on the way that are no NaN.
    pub numbers: Vec<Term>,
    /// What another goal shows of the operations on the way.
    pub shown: Vec<Term>,
}

/// A curve being written down.
struct Course<'a> {
    float: Float<'a>,
    numbers: Vec<Term>,
    shown: Vec<Term>,
}

/// The value of a curve; `None` for an activation of two straight lines.
pub(crate) fn of(float: Float<'_>, activation: Activation, x: Term) -> Option<Curve> {
    let mut course = Course {
        float,
        numbers: vec![x],
        shown: Vec::new(),
    };
    let value = match activation {
        Activation::Identity | Activation::Relu | Activation::LeakyRelu { .. } => return None,
        Activation::Tanh => course.tanh(x),
        Activation::Softsign => tables::softsign(float, x),
        Activation::Sigmoid => course.sigmoid(x),
        Activation::HardSigmoid => course.hard_sigmoid(x),
        Activation::Elu => course.elu(x),
        Activation::Softplus => course.softplus(x),
        Activation::Silu => course.silu(x),
        Activation::Gelu => course.gated(x, 5.6, &GELU),
        Activation::GeluTanh => course.gated(x, 6.0, &GELU_TANH),
        Activation::HardSwish => course.hard_swish(x),
    };
    Some(Curve {
        value,
        numbers: course.numbers,
        shown: course.shown,
    })
}

/// `g0..g5`
const GELU: [f64; 6] = [
    0.797_872_165,
    0.036_366_780_8,
    -5.863_892_84e-5,
    -4.705_679_26e-5,
    2.775_528_46e-6,
    -5.575_962_19e-8,
];
/// `h0, h1`
const GELU_TANH: [f64; 2] = [0.797_884_560_802_865_4, 0.035_677_408_136_300_125];
/// `s0..s3`
const SOFTPLUS: [f64; 4] = [2.0, 0.666_761_4, 0.395_672_6, 0.343_975_4];

impl Course<'_> {
    fn number(&self, value: f64) -> Term {
        self.float.constant(self.float.format.nearest(value))
    }

    fn half(&self, x: Term) -> Term {
        self.float.mul(x, self.number(0.5))
    }

    fn tanh(&mut self, x: Term) -> Term {
        let (quotient, value) = tables::tanh(self.float, x);
        self.numbers.extend([x, quotient]);
        value
    }

    fn limited(&mut self, x: Term, end: f64) -> Term {
        self.numbers.push(x);
        self.float.clamp(x, self.number(-end), self.number(end))
    }

    /// x without its sign.
    fn magnitude(&self, x: Term) -> Term {
        let float = self.float;
        float.terms.binary("bvand", x, float.terms.unary("bvnot", float.sign()))
    }

    /// `x if x > 0 else +0`. Where sum and product of the target are fast, code has them: that they give the same is what the
    /// goal of the helper shows, in the arithmetic of IEEE 754.
    fn relu(&mut self, x: Term) -> Term {
        let float = self.float;
        let most = float.constant(MAX_MAGNITUDE);
        let value = float.terms.choose(float.gt(x, self.number(0.0)), x, self.number(0.0));
        let summed = self.half(float.add(x, self.magnitude(x)));
        let small = float.within(x, float.neg(most), most);
        self.shown
            .push(float.terms.or(float.terms.not(small), float.terms.equal(summed, value)));
        self.shown.push(small);
        value
    }

    fn polynomial(&self, terms: &[f64], z: Term) -> Term {
        let start = self.number(terms.last().copied().unwrap_or_default());
        let lower = terms.iter().rev().skip(1);
        lower.fold(start, |sum, term| {
            self.float.add(self.float.mul(sum, z), self.number(*term))
        })
    }

    fn sigmoid(&mut self, x: Term) -> Term {
        let t = self.tanh(self.half(x));
        self.float.add(self.half(t), self.number(0.5))
    }

    fn hard_sigmoid(&mut self, x: Term) -> Term {
        let t = self.float.mul(x, self.number(1.0 / 6.0));
        let t = self.limited(t, 0.5);
        self.float.add(t, self.number(0.5))
    }

    fn elu(&mut self, x: Term) -> Term {
        let m = self.relu(self.float.neg(x));
        let t = self.tanh(self.half(m));
        let t = self.magnitude(t);
        let e = self
            .float
            .div(self.float.add(t, t), self.float.add(self.number(1.0), t));
        self.float.sub(self.relu(x), e)
    }

    fn softplus(&mut self, x: Term) -> Term {
        let t = self.tanh(self.half(self.magnitude(x)));
        let v = self
            .float
            .div(self.float.sub(self.number(1.0), t), self.float.add(self.number(3.0), t));
        let p = self.polynomial(&SOFTPLUS, self.float.mul(v, v));
        self.float.add(self.relu(x), self.float.mul(p, v))
    }

    fn silu(&mut self, x: Term) -> Term {
        let a = self.limited(x, 18.0);
        let a = self.magnitude(a);
        let u = self.half(a);
        self.gate(x, a, u)
    }

    fn gated(&mut self, x: Term, end: f64, terms: &[f64]) -> Term {
        let a = self.limited(x, end);
        let a = self.magnitude(a);
        let p = self.polynomial(terms, self.float.mul(a, a));
        let u = self.float.mul(a, p);
        self.gate(x, a, u)
    }

    fn hard_swish(&mut self, x: Term) -> Term {
        let a = self.limited(x, 3.0);
        let a = self.magnitude(a);
        let t = self.float.mul(a, self.number(1.0 / 6.0));
        let t = self.limited(t, 0.5);
        self.left(x, a, t)
    }

    /// Section 6, "the gate".
    fn gate(&mut self, x: Term, a: Term, u: Term) -> Term {
        let t = self.tanh(u);
        let t = self.half(t);
        self.left(x, a, t)
    }

    fn left(&mut self, x: Term, a: Term, t: Term) -> Term {
        let h = self.float.sub(self.number(0.5), t);
        self.float.sub(self.relu(x), self.float.mul(a, h))
    }
}

//! Numbers of the format as terms: what numeric contract and code both say about them.

use policy::Scalar;

use crate::term::{Comparison, Term, Terms};

/// Rounded operations are uninterpreted, so a goal holds for every rounding that is a function of its operands' bits.
#[derive(Clone, Copy)]
pub(crate) struct Float<'a> {
    pub terms: &'a Terms,
    pub format: Scalar,
}

impl Float<'_> {
    pub(crate) fn width(self) -> u32 {
        width(self.format)
    }

    /// A number that is one of the format already.
    pub(crate) fn constant(self, value: f64) -> Term {
        let bits = match self.format {
            Scalar::F32 => u64::from((value as f32).to_bits()),
            Scalar::F64 => value.to_bits(),
        };
        self.terms.bits(bits, self.width())
    }

    pub(crate) fn sign(self) -> Term {
        self.terms.bits(1 << (self.width() - 1), self.width())
    }

    /// The finite number of a constant.
    fn known(self, x: Term) -> Option<f64> {
        let bits = self.terms.known(x)?;
        let value = match self.format {
            Scalar::F32 => f64::from(f32::from_bits(bits as u32)),
            Scalar::F64 => f64::from_bits(bits),
        };
        value.is_finite().then_some(value)
    }

    /// A constant stands first: sums and products of IEEE 754 commute, and the order in which code writes a constant is one of style. Two
    /// operands that are no constants stay as they are written.
    fn constant_first(self, x: Term, y: Term) -> [Term; 2] {
        match (self.terms.known(x), self.terms.known(y)) {
            (None, Some(_)) => [y, x],
            _ => [x, y],
        }
    }

    pub(crate) fn add(self, x: Term, y: Term) -> Term {
        let name = match self.format {
            Scalar::F32 => "add32",
            Scalar::F64 => "add64",
        };
        self.terms.call(name, &self.constant_first(x, y), self.width())
    }

    pub(crate) fn sub(self, x: Term, y: Term) -> Term {
        let name = match self.format {
            Scalar::F32 => "sub32",
            Scalar::F64 => "sub64",
        };
        self.terms.call(name, &[x, y], self.width())
    }

    pub(crate) fn mul(self, x: Term, y: Term) -> Term {
        if let (Some(x), Some(y)) = (self.known(x), self.known(y)) {
            // exact: both are binary32 numbers or the format is binary64
            return self.constant(self.format.nearest(x * y));
        }
        let name = match self.format {
            Scalar::F32 => "mul32",
            Scalar::F64 => "mul64",
        };
        self.terms.call(name, &self.constant_first(x, y), self.width())
    }

    pub(crate) fn div(self, x: Term, y: Term) -> Term {
        let name = match self.format {
            Scalar::F32 => "div32",
            Scalar::F64 => "div64",
        };
        self.terms.call(name, &[x, y], self.width())
    }

    /// An integer of 32 bits with sign, rounded to the format.
    pub(crate) fn of_i32(self, x: Term) -> Term {
        if let Some(bits) = self.terms.known(x) {
            return self.constant(self.format.nearest(f64::from(bits as u32 as i32)));
        }
        let name = match self.format {
            Scalar::F32 => "i32_to_f32",
            Scalar::F64 => "i32_to_f64",
        };
        self.terms.call(name, &[x], self.width())
    }

    /// Exact: the sign bit alone.
    pub(crate) fn neg(self, x: Term) -> Term {
        self.terms.binary("bvxor", x, self.sign())
    }

    pub(crate) fn lt(self, x: Term, y: Term) -> Term {
        self.terms.compare(Comparison::Less, x, y)
    }

    pub(crate) fn le(self, x: Term, y: Term) -> Term {
        self.terms.compare(Comparison::LessOrEqual, x, y)
    }

    pub(crate) fn gt(self, x: Term, y: Term) -> Term {
        self.lt(y, x)
    }

    pub(crate) fn ge(self, x: Term, y: Term) -> Term {
        self.le(y, x)
    }

    pub(crate) fn eq(self, x: Term, y: Term) -> Term {
        self.terms.compare(Comparison::Equal, x, y)
    }

    /// `low <= x <= high`; no NaN is.
    pub(crate) fn within(self, x: Term, low: Term, high: Term) -> Term {
        self.terms.and(self.ge(x, low), self.le(x, high))
    }

    /// `x < low or x > high`; no NaN is.
    pub(crate) fn outside(self, x: Term, low: Term, high: Term) -> Term {
        self.terms.or(self.lt(x, low), self.gt(x, high))
    }

    /// `clamp` of section 4: a NaN stays as it is.
    pub(crate) fn clamp(self, x: Term, low: Term, high: Term) -> Term {
        let t = self.terms.choose(self.lt(x, low), low, x);
        self.terms.choose(self.gt(t, high), high, t)
    }

    pub(crate) fn is_nan(self, x: Term) -> Term {
        self.terms.not(self.eq(x, x))
    }
}

/// Bits of a number.
pub(crate) fn width(format: Scalar) -> u32 {
    match format {
        Scalar::F32 => 32,
        Scalar::F64 => 64,
    }
}

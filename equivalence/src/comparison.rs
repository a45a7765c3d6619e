//! What is known of a comparison of numbers before a solver sees it. Of a number that is compared code and contract say in different words
//! that it is no NaN: here they become one.

use crate::term::{Comparison, Op, Term, Terms};

impl Terms {
    /// The operands of a comparison of numbers.
    pub(crate) fn compared(&self, x: Term) -> Option<(Comparison, [Term; 2])> {
        let node = self.node(x);
        match (&node.op, node.args.as_slice()) {
            (Op::Float(comparison), &[x, y]) => Some((*comparison, [x, y])),
            _ => None,
        }
    }

    /// A comparison of a number with itself, with a NaN, or of two constants; an equality has its operands in the order of the store.
    pub(crate) fn simple_compare(&self, comparison: Comparison, x: Term, y: Term) -> Option<Term> {
        let values = [self.number_of(x), self.number_of(y)];
        match values {
            [Some(a), _] if a.is_nan() => return Some(self.truth(false)),
            [_, Some(b)] if b.is_nan() => return Some(self.truth(false)),
            [Some(a), Some(b)] => {
                return Some(self.truth(match comparison {
                    Comparison::Less => a < b,
                    Comparison::LessOrEqual => a <= b,
                    Comparison::Equal => a == b,
                }));
            }
            _ => {}
        }
        self.with_infinity(comparison, [x, y], values)
            .or_else(|| self.with_zero(comparison, [x, y], values))
            .or_else(|| self.with_choice(comparison, x, y))
            .or_else(|| self.mirrored(comparison, x, y))
            .or_else(|| match comparison {
                Comparison::Less if x == y => Some(self.truth(false)),
                Comparison::LessOrEqual if x == y => Some(self.compare(Comparison::Equal, x, y)),
                Comparison::Equal if y < x => Some(self.compare(Comparison::Equal, y, x)),
                _ => None,
            })
    }

    /// Every number lies between the infinities.
    fn with_infinity(&self, comparison: Comparison, [x, y]: [Term; 2], values: [Option<f64>; 2]) -> Option<Term> {
        let (low, high) = (Some(f64::NEG_INFINITY), Some(f64::INFINITY));
        match (comparison, values) {
            (Comparison::LessOrEqual, [value, _]) if value == low => Some(self.compare(Comparison::Equal, y, y)),
            (Comparison::LessOrEqual, [_, value]) if value == high => Some(self.compare(Comparison::Equal, x, x)),
            (Comparison::Less, [value, _]) if value == high => Some(self.truth(false)),
            (Comparison::Less, [_, value]) if value == low => Some(self.truth(false)),
            _ => None,
        }
    }

    /// Both zeros are one number: of a constant the one without a sign.
    fn with_zero(&self, comparison: Comparison, [x, y]: [Term; 2], values: [Option<f64>; 2]) -> Option<Term> {
        let is_negative = |value: Option<f64>| value.is_some_and(|value| value == 0.0 && value.is_sign_negative());
        match values.map(is_negative) {
            [true, _] => Some(self.compare(comparison, self.bits(0, self.width(x)), y)),
            [_, true] => Some(self.compare(comparison, x, self.bits(0, self.width(y)))),
            _ => None,
        }
    }

    /// `-x` beside a constant is x beside the constant with the other sign.
    fn mirrored(&self, comparison: Comparison, x: Term, y: Term) -> Option<Term> {
        let width = self.width(x);
        let sign = self.bits(1 << (width - 1), width);
        let negative = |x: Term| {
            let node = self.node(x);
            match (&node.op, node.args.as_slice()) {
                (Op::Bits("bvxor"), &[x, by]) if by == sign => Some(x),
                _ => None,
            }
        };
        let constant = |x: Term| Some(self.bits(self.known(x)? ^ self.known(sign)?, width));
        let (x, y) = match (negative(x), negative(y)) {
            (Some(x), None) => (x, constant(y)?),
            (None, Some(y)) => (constant(x)?, y),
            _ => return None,
        };
        Some(self.compare(comparison, y, x))
    }

    /// A choice between a constant and something else, compared with a constant or with itself: of the one it is known at once.
    fn with_choice(&self, comparison: Comparison, x: Term, y: Term) -> Option<Term> {
        let parts = |x: Term| {
            let choice = self.choice(x);
            choice.filter(|[_, yes, no]| self.known(*yes).is_some() || self.known(*no).is_some())
        };
        let each = |condition: Term, yes: [Term; 2], no: [Term; 2]| {
            let of = |[x, y]: [Term; 2]| self.compare(comparison, x, y);
            self.choose(condition, of(yes), of(no))
        };
        let (left, right) = (parts(x), parts(y));
        match (left, right) {
            (Some([condition, yes, no]), _) if x == y => Some(each(condition, [yes, yes], [no, no])),
            (Some([condition, yes, no]), _) if self.known(y).is_some() => Some(each(condition, [yes, y], [no, y])),
            (_, Some([condition, yes, no])) if self.known(x).is_some() => Some(each(condition, [x, yes], [x, no])),
            _ => None,
        }
    }

    /// The number whose bits a constant is; every binary32 number is one of binary64.
    fn number_of(&self, x: Term) -> Option<f64> {
        let bits = self.known(x)?;
        match self.width(x) {
            32 => Some(f32::from_bits(bits as u32).into()),
            64 => Some(f64::from_bits(bits)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of every pair of a NaN, zeros of both signs, subnormals, ordinary numbers and infinities, the values come from the machine.
    #[test]
    fn comparisons_of_constants_are_those_of_the_machine() {
        let terms = Terms::default();
        let numbers = [
            f32::NAN,
            -f32::NAN,
            0.0,
            -0.0,
            1e-45,
            -1e-45,
            1.0,
            -2.5,
            f32::INFINITY,
            f32::NEG_INFINITY,
        ];
        let of = |x: f32| terms.bits(x.to_bits().into(), 32);
        for x in numbers {
            for y in numbers {
                let is = [x < y, x <= y, x == y].map(|truth| terms.truth(truth));
                let all = [Comparison::Less, Comparison::LessOrEqual, Comparison::Equal];
                assert_eq!(
                    all.map(|comparison| terms.compare(comparison, of(x), of(y))),
                    is,
                    "{x} {y}"
                );
            }
        }
    }

    #[test]
    fn a_comparison_that_holds_says_that_both_are_numbers() {
        let terms = Terms::default();
        let [x, y, z] = ["x", "y", "z"].map(|name| terms.input(name, 32));
        let is_number = |x: Term| terms.compare(Comparison::Equal, x, x);
        let below = terms.compare(Comparison::Less, x, y);
        for operand in [x, y] {
            assert_eq!(terms.and(is_number(operand), below), below);
            assert_eq!(terms.or(below, is_number(operand)), is_number(operand));
        }
        // of a third number it says nothing
        assert_ne!(terms.and(is_number(z), below), below);
        assert_eq!(terms.compare(Comparison::LessOrEqual, x, x), is_number(x));
        assert_eq!(terms.compare(Comparison::Less, x, x), terms.truth(false));
        // no NaN is below, equal to or above anything
        let nan = terms.bits(f32::NAN.to_bits().into(), 32);
        assert_eq!(terms.compare(Comparison::LessOrEqual, nan, x), terms.truth(false));
    }
}

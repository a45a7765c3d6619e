//! What is known of a comparison of numbers before a solver sees it. Of a number that is compared code and contract say in different words
//! that it is no NaN: here they become one.

use crate::term::{Comparison, Op, Term, Terms};

impl Terms {
    /// The operands of a comparison of numbers.
    fn compared(&self, x: Term) -> Option<(Comparison, [Term; 2])> {
        let node = self.node(x);
        match (&node.op, node.args.as_slice()) {
            (Op::Float(comparison), &[x, y]) => Some((*comparison, [x, y])),
            _ => None,
        }
    }

    /// Whether `y` is `a == a`, which says that `a` is no NaN, and `x` is another comparison of `a`, which says so too.
    pub(crate) fn implies_number(&self, x: Term, y: Term) -> bool {
        let Some((Comparison::Equal, [a, b])) = self.compared(y) else {
            return false;
        };
        a == b && self.compared(x).is_some_and(|(_, args)| args.contains(&a))
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
        match comparison {
            Comparison::Less if x == y => Some(self.truth(false)),
            Comparison::LessOrEqual if x == y => Some(self.compare(Comparison::Equal, x, y)),
            Comparison::Equal if y < x => Some(self.compare(Comparison::Equal, y, x)),
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

//! What the guard of the state says in sign bits of differences, as comparisons: the contract's words for the same. And what the sign and
//! the lowest bit of a word are of its parts.
//!
//! The claims `helper.far`, `helper.aside` and `helper.beyond` show the same of bounds that are any numbers, where no rule applies.

use crate::term::{Comparison, Op, Sort, Term, Terms, mask};

impl Terms {
    /// Name and operands of an operation on two words.
    pub(crate) fn of_words(&self, x: Term) -> Option<(&'static str, [Term; 2])> {
        let node = self.node(x);
        match (&node.op, node.args.as_slice()) {
            (Op::Bits(name), &[x, y]) => Some((name, [x, y])),
            _ => None,
        }
    }

    /// The word that is negated bit by bit.
    fn inverted(&self, x: Term) -> Option<Term> {
        let node = self.node(x);
        match (&node.op, node.args.as_slice()) {
            (Op::Bits("bvnot"), &[x]) => Some(x),
            _ => None,
        }
    }

    /// Whether a bit is set; the lowest one is number 0.
    pub(crate) fn bit(&self, x: Term, number: u32) -> Term {
        let width = self.width(x);
        if let Some(value) = self.known(x) {
            return self.truth(value >> number & 1 == 1);
        }
        if let Some(no_number) = self.limited_bit(x, number) {
            return no_number;
        }
        if let Some([condition, yes, no]) = self.choice(x) {
            return self.choose(condition, self.bit(yes, number), self.bit(no, number));
        }
        let node = self.node(x);
        match (&node.op, node.args.as_slice()) {
            (Op::Bits("bvnot"), &[inner]) => self.not(self.bit(inner, number)),
            (Op::Extract(_, low), &[inner]) => self.bit(inner, number + low),
            (Op::ZeroExtend(_), &[inner]) if number >= self.width(inner) => self.truth(false),
            (Op::ZeroExtend(_), &[inner]) => self.bit(inner, number),
            (Op::SignExtend(_), &[inner]) => self.bit(inner, number.min(self.width(inner) - 1)),
            (Op::Bits(name), &[a, b]) => self
                .bit_of_two(name, [a, b], number, width)
                .unwrap_or_else(|| self.raw_bit(x, number)),
            _ => self.raw_bit(x, number),
        }
    }

    fn bit_of_two(&self, name: &str, [a, b]: [Term; 2], number: u32, width: u32) -> Option<Term> {
        let is_sign = number == width - 1;
        let shift = || self.known(b).filter(|by| *by < width.into()).map(|by| by as u32);
        match name {
            "bvor" if is_sign => [(a, b), (b, a)]
                .into_iter()
                .find_map(|(a, b)| self.aside(a, b).or_else(|| self.any_bit(a, b)))
                .or_else(|| Some(self.or(self.bit(a, number), self.bit(b, number)))),
            "bvor" => Some(self.or(self.bit(a, number), self.bit(b, number))),
            "bvand" => Some(self.and(self.bit(a, number), self.bit(b, number))),
            "bvxor" => match self.known(self.known(b).map(|_| self.bit(b, number))?) {
                Some(1) => Some(self.not(self.bit(a, number))),
                _ => Some(self.bit(a, number)),
            },
            "bvsub" if is_sign => self.far(a, b).or_else(|| self.near(a, b)),
            "bvlshr" => shift().map(|by| match number + by < width {
                true => self.bit(a, number + by),
                false => self.truth(false),
            }),
            "bvshl" => shift().map(|by| match number >= by {
                true => self.bit(a, number - by),
                false => self.truth(false),
            }),
            _ => None,
        }
    }

    fn raw_bit(&self, x: Term, number: u32) -> Term {
        let width = self.width(x);
        let (op, args) = match number {
            0 => (Op::Bits("bvand"), vec![x, self.bits(1, width)]),
            _ if number == width - 1 => (Op::Bits("bvlshr"), vec![x, self.bits(number.into(), width)]),
            _ => {
                let bit = self.make(Op::Extract(number, number), vec![x], Sort::Bits(1));
                return self.make(Op::Equal, vec![bit, self.bits(1, 1)], Sort::Truth);
            }
        };
        let word = self.make(op, args, Sort::Bits(width));
        self.make(Op::Equal, vec![word, self.bits(1, width)], Sort::Truth)
    }

    /// Of a number that is limited to a range from 0 on that ends below 2 the highest bit of the exponent: whether it is no number.
    fn limited_bit(&self, x: Term, number: u32) -> Option<Term> {
        let width = self.width(x);
        let (of, [low, high]) = self.clamped(x).filter(|_| number + 2 == width)?;
        let ends = self.known(low).zip(self.known(high))?;
        self.infinity(width)?;
        let fits = ends.0 <= ends.1 && ends.1 < 1 << (width - 2);
        fits.then(|| self.not(self.compare(Comparison::Equal, of, of)))
    }

    /// What is clamped, and the ends.
    fn clamped(&self, x: Term) -> Option<(Term, [Term; 2])> {
        let [over, high, raised] = self.choice(x)?;
        let [under, low, of] = self.choice(raised)?;
        let is_clamp =
            under == self.compare(Comparison::Less, of, low) && over == self.compare(Comparison::Less, high, raised);
        is_clamp.then_some((of, [low, high]))
    }

    /// The word whose sign this truth says.
    pub(crate) fn signed_word(&self, x: Term) -> Option<Term> {
        let node = self.node(x);
        let (&Op::Equal, &[shifted, one]) = (&node.op, node.args.as_slice()) else {
            return None;
        };
        let ("bvlshr", [word, by]) = self.of_words(shifted)? else {
            return None;
        };
        let width = u64::from(self.width(word));
        (self.known(one) == Some(1) && self.known(by) == Some(width - 1)).then_some(word)
    }

    /// The bits of the infinity of that width, of which the check is that there are numbers as wide.
    pub(crate) fn infinity(&self, width: u32) -> Option<u64> {
        match width {
            32 => Some(f32::INFINITY.to_bits().into()),
            64 => Some(f64::INFINITY.to_bits()),
            _ => None,
        }
    }

    /// `low <= x <= high` of numbers, by their bits.
    fn within(&self, x: Term, low: u64, high: u64) -> Term {
        let [low, high] = [low, high].map(|bits| self.bits(bits, self.width(x)));
        let at_most = |x, y| self.compare(Comparison::LessOrEqual, x, y);
        self.and(at_most(low, x), at_most(x, high))
    }

    /// The sign of `bound - (x without its sign)`: whether `|x|` is not at most the bound.
    fn far(&self, bound: Term, magnitude: Term) -> Option<Term> {
        let (bound, width) = (self.known(bound)?, self.width(magnitude));
        let ("bvand", [x, kept]) = self.of_words(magnitude)? else {
            return None;
        };
        let is_magnitude = self.known(kept) == Some(mask(width - 1)) && bound <= self.infinity(width)?;
        is_magnitude.then(|| self.not(self.within(x, bound | 1 << (width - 1), bound)))
    }

    /// The sign of `((low - x) & x) | ((high - x) & ~x)`: whether x is not between a number with a sign and one without.
    fn aside(&self, below: Term, above: Term) -> Option<Term> {
        let (low, x) = self.difference_beside(below, |x, other| x == other)?;
        let (high, same) = self.difference_beside(above, |x, other| self.inverted(other) == Some(x))?;
        let width = self.width(x);
        let (sign, infinity) = (1 << (width - 1), self.infinity(width)?);
        let fits = same == x && low & sign != 0 && low ^ sign <= infinity && high <= infinity;
        fits.then(|| self.not(self.within(x, low, high)))
    }

    /// Constant and x of `(constant - x) & other`.
    fn difference_beside(&self, term: Term, fits: impl Fn(Term, Term) -> bool) -> Option<(u64, Term)> {
        let ("bvand", [a, b]) = self.of_words(term)? else {
            return None;
        };
        [(a, b), (b, a)].into_iter().find_map(|(difference, other)| {
            let ("bvsub", [constant, x]) = self.of_words(difference)? else {
                return None;
            };
            fits(x, other).then_some((self.known(constant)?, x))
        })
    }

    /// The sign of `x | -x`: whether any bit is set.
    fn any_bit(&self, x: Term, negative: Term) -> Option<Term> {
        let ("bvsub", [zero, same]) = self.of_words(negative)? else {
            return None;
        };
        let is_negative = same == x && self.known(zero) == Some(0);
        is_negative.then(|| self.not(self.equal(x, self.bits(0, self.width(x)))))
    }

    /// Signs of the words `x - low` and `high - x`, one of which is set: whether x lies outside of the range as an integer without a sign, and as
    /// a number if all in the range are numbers of one sign.
    pub(crate) fn outside_range(&self, from: Term, to: Term) -> Option<Term> {
        let ("bvsub", [high, x]) = self.of_words(to)? else {
            return None;
        };
        let high = self.known(high)?;
        let low = match self.of_words(from) {
            _ if from == x => 0,
            Some(("bvsub", [same, low])) if same == x => self.known(low)?,
            _ => return None,
        };
        let width = self.width(x);
        let sign = 1 << (width - 1);
        if high < low || high & sign != low & sign {
            return None;
        }
        let infinity = self.infinity(width)?;
        let inside = match () {
            () if low == 0 => self.order("bvule", x, self.bits(high, width)),
            () if low & sign == 0 && high <= infinity => self.within(x, low, high),
            // the larger pattern is the lower number
            () if low > sign && high ^ sign <= infinity => self.within(x, high, low),
            () => return None,
        };
        Some(self.not(inside))
    }

    /// Equality of words that are exclusive ors: each operand once, what stands on both sides on none.
    pub(crate) fn equal_sums(&self, x: Term, y: Term) -> Option<Term> {
        let width = self.width(x);
        let is_sum = |x: Term| matches!(self.of_words(x), Some(("bvxor", _)));
        if !is_sum(x) && !is_sum(y) {
            return None;
        }
        let (mut constant, mut operands, mut open) = (0, Vec::new(), vec![x, y]);
        while let Some(term) = open.pop() {
            match (self.known(term), self.of_words(term)) {
                (Some(value), _) => constant ^= value,
                (_, Some(("bvxor", parts))) => open.extend(parts),
                _ => operands.push(term),
            }
        }
        operands.sort_unstable();
        let mut single: Vec<Term> = Vec::new();
        for term in operands {
            match single.last() == Some(&term) {
                true => drop(single.pop()),
                false => single.push(term),
            }
        }
        let Some((first, rest)) = single.split_first() else {
            return Some(self.truth(constant == 0));
        };
        let constant = self.bits(constant, width);
        let sum = rest.split_first().map_or(constant, |(second, rest)| {
            let others = rest
                .iter()
                .copied()
                .chain((self.known(constant) != Some(0)).then_some(constant));
            others.fold(*second, |sum, term| {
                self.make(Op::Bits("bvxor"), vec![sum, term], Sort::Bits(width))
            })
        });
        Some(match is_sum(sum) {
            true => self.make(Op::Equal, vec![*first, sum], Sort::Truth),
            false => self.equal(*first, sum),
        })
    }

    /// `clamp(x) == x`: whether x lies on neither side of the ends.
    pub(crate) fn unclamped(&self, x: Term, clamped: Term) -> Option<Term> {
        let (_, [low, high]) = self.clamped(clamped).filter(|(of, _)| *of == x)?;
        let under = self.compare(Comparison::Less, x, low);
        // raised to a lower end that lies above the upper one, x might come back to where it was
        let crossed = self.compare(Comparison::Less, high, low);
        let back = self.and(crossed, self.make(Op::Equal, vec![x, high], Sort::Truth));
        let beyond = self.compare(Comparison::Less, high, x);
        Some(self.choose(under, back, self.not(beyond)))
    }

    /// `x == 0` where x is made of bits that all are 0 then.
    pub(crate) fn is_zero(&self, x: Term, zero: Term) -> Option<Term> {
        let none = |x: Term| self.equal(x, self.bits(0, self.width(x)));
        let node = self.node(x);
        let word = match (self.known(zero)?, &node.op, node.args.as_slice()) {
            (0, Op::Bits("bvor"), &[a, b]) => {
                let whole = self.halves(a, b).or_else(|| self.halves(b, a));
                return Some(whole.map_or_else(|| self.and(none(a), none(b)), none));
            }
            (0, Op::ZeroExtend(_), &[inner]) => return Some(none(inner)),
            (0, Op::Bits("bvlshr"), &[word, _]) => word,
            _ => return None,
        };
        let width = self.width(word);
        let by = self.known(node.args[1]).filter(|by| *by < width.into())?;
        Some(self.order("bvule", word, self.bits(mask(by as u32), width)))
    }

    /// The word whose lower and upper half they are.
    fn halves(&self, lower: Term, upper: Term) -> Option<Term> {
        let lowest = |x: Term| {
            let node = self.node(x);
            match (&node.op, node.args.as_slice()) {
                (Op::Extract(31, 0), &[word]) => Some(word),
                _ => None,
            }
        };
        let word = lowest(lower).filter(|word| self.width(*word) == 64)?;
        match self.of_words(lowest(upper)?) {
            Some(("bvlshr", [same, by])) if same == word && self.known(by) == Some(32) => Some(word),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    /// Patterns around every end that a rule distinguishes.
    fn patterns() -> Vec<u32> {
        let ends = [
            0,
            1,
            0x3E80_0000,
            0x3F80_0000,
            0x4000_0000,
            0x7F80_0000,
            0x7FC0_0000,
            0x7FFF_FFFF,
        ];
        let near = ends
            .into_iter()
            .flat_map(|end: u32| [end.wrapping_sub(1), end, end + 1]);
        let near = near.flat_map(|bits| [bits, bits ^ 0x8000_0000]);
        near.collect()
    }

    /// That a rule's truth about x is what the machine computes, for all patterns.
    fn agrees(terms: &Terms, x: Term, truth: Term, machine: impl Fn(u32) -> bool) {
        for bits in patterns() {
            let anew = HashMap::from([(x, terms.bits(bits.into(), 32))]);
            let found = terms.known(terms.with(anew, truth));
            assert_eq!(
                found,
                Some(machine(bits).into()),
                "{bits:08X} of {:?}",
                terms.node(truth)
            );
        }
    }

    /// The words are computed on the machine as the emitted code has them; nothing of the rules goes in.
    #[test]
    fn signs_of_differences_are_comparisons() {
        let ends = [0, 1, 0x3E80_0000_u32, 0x3F80_0000, 0x7F80_0000];
        for low in ends.iter().flat_map(|end| [*end, end | 1 << 31]) {
            for high in ends.iter().flat_map(|end| [*end, end | 1 << 31]) {
                let terms = Terms::default();
                let x = terms.input("x", 32);
                let [l, h] = [low, high].map(|bits| terms.bits(bits.into(), 32));
                let [sub, and, or] = ["bvsub", "bvand", "bvor"].map(|name| |x: Term, y: Term| terms.binary(name, x, y));
                let far = sub(l, and(x, terms.bits(0x7FFF_FFFF, 32)));
                let sign = |bits: u32| bits >> 31 == 1;
                agrees(&terms, x, terms.bit(far, 31), |x| {
                    sign(low.wrapping_sub(x & 0x7FFF_FFFF))
                });
                let inverted = terms.unary("bvnot", x);
                let aside = or(and(sub(l, x), x), and(sub(h, x), inverted));
                let by_machine = |x: u32| sign((low.wrapping_sub(x) & x) | (high.wrapping_sub(x) & !x));
                agrees(&terms, x, terms.bit(aside, 31), by_machine);
                let beyond = or(sub(x, l), sub(h, x));
                agrees(&terms, x, terms.bit(beyond, 31), |x| {
                    sign(x.wrapping_sub(low) | high.wrapping_sub(x))
                });
                let any = or(x, sub(terms.bits(0, 32), x));
                agrees(&terms, x, terms.bit(any, 31), |x| x != 0);
                agrees(&terms, x, terms.bit(or(sub(h, x), x), 31), |x| {
                    sign(high.wrapping_sub(x) | x)
                });
            }
        }
    }

    #[test]
    fn clamped_numbers_are_known_by_their_bits() {
        let number = f32::from_bits;
        for low in [0, 0x3E80_0000, 0xBF80_0000_u32] {
            for high in [0x3F80_0000, 0x4000_0000_u32, 0x3E00_0000] {
                let terms = Terms::default();
                let x = terms.input("x", 32);
                let [l, h] = [low, high].map(|bits| terms.bits(bits.into(), 32));
                let less = |x, y| terms.compare(Comparison::Less, x, y);
                let raised = terms.choose(less(x, l), l, x);
                let clamped = terms.choose(less(h, raised), h, raised);
                let by_machine = |x: u32| {
                    let raised = if number(x) < number(low) { low } else { x };
                    if number(raised) > number(high) { high } else { raised }
                };
                agrees(&terms, x, terms.bit(clamped, 30), |x| by_machine(x) >> 30 & 1 == 1);
                agrees(&terms, x, terms.equal(x, clamped), |x| by_machine(x) == x);
                let changed = terms.binary("bvxor", x, clamped);
                agrees(&terms, x, terms.equal(changed, terms.bits(0, 32)), |x| {
                    by_machine(x) == x
                });
                for other in patterns() {
                    let other_term = terms.bits(other.into(), 32);
                    let compared = terms.compare(Comparison::LessOrEqual, clamped, other_term);
                    agrees(&terms, x, compared, |x| number(by_machine(x)) <= number(other));
                    let negated = terms.binary("bvxor", x, terms.bits(1 << 31, 32));
                    agrees(&terms, x, less(negated, other_term), |x| -number(x) < number(other));
                }
            }
        }
    }

    #[test]
    fn bits_are_those_of_the_word() {
        let terms = Terms::default();
        let x = terms.input("x", 32);
        let constant = |value: u32| terms.bits(value.into(), 32);
        let wide = terms.resize(x, 64, true);
        let upper = terms.extract(terms.binary("bvlshr", wide, terms.bits(8, 64)), 31, 0);
        for (word, by_machine) in [
            (
                terms.binary("bvxor", x, constant(0x8000_0001)),
                (|x| x ^ 0x8000_0001) as fn(u32) -> u32,
            ),
            (terms.binary("bvshl", x, constant(3)), |x| x << 3),
            (terms.binary("bvlshr", x, constant(30)), |x| x >> 30),
            (upper, |x| ((i64::from(x as i32) >> 8) & 0xFFFF_FFFF) as u32),
        ] {
            for number in [0, 2, 17, 30, 31] {
                agrees(&terms, x, terms.bit(word, number), |x| by_machine(x) >> number & 1 == 1);
            }
            agrees(&terms, x, terms.equal(word, constant(0)), |x| by_machine(x) == 0);
        }
    }
}

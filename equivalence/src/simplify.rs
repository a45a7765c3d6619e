//! What is known of a term before a solver sees it: selections by masks are choices, and flags of 0 and 1 are truths. So both sides of most
//! goals become one term, and what is left to the solver is where code and contract do not say the same word for word.
//!
//! Every rule holds for all bits; the tests compare what they give with values computed without them.

use crate::term::{Op, Sort, Term, Terms, mask};

impl Terms {
    /// The parts of a choice.
    pub(crate) fn choice(&self, x: Term) -> Option<[Term; 3]> {
        let node = self.node(x);
        match (&node.op, node.args.as_slice()) {
            (Op::Choose, &[condition, yes, no]) => Some([condition, yes, no]),
            _ => None,
        }
    }

    /// A choice between two constants.
    pub(crate) fn constants(&self, x: Term) -> Option<(Term, u64, u64)> {
        let [condition, yes, no] = self.choice(x)?;
        Some((condition, self.known(yes)?, self.known(no)?))
    }

    /// `value` where a condition holds, and 0 elsewhere.
    pub(crate) fn flag(&self, x: Term) -> Option<(Term, u64)> {
        match self.constants(x)? {
            (condition, value, 0) => Some((condition, value)),
            (condition, 0, value) => Some((self.not(condition), value)),
            _ => None,
        }
    }

    /// A choice that is none, or one without a negation.
    pub(crate) fn simple_choice(&self, condition: Term, yes: Term, no: Term) -> Option<Term> {
        if yes == no {
            return Some(yes);
        }
        if self.sort(yes) == Sort::Truth
            && let Some(truth) = self.choice_of_truths(condition, yes, no)
        {
            return Some(truth);
        }
        if let Some(limited) = self.limited_choice(condition, yes, no) {
            return Some(limited);
        }
        // of a condition and its opposite the one that was made first
        let opposite = self.not(condition);
        if opposite < condition {
            return Some(self.choose(opposite, no, yes));
        }
        if let Some([inner, a, b]) = self.choice(yes) {
            match () {
                () if inner == condition => return Some(self.choose(condition, a, no)),
                () if no == b => return Some(self.choose(self.and(condition, inner), a, b)),
                () if no == a => return Some(self.choose(self.or(opposite, inner), a, b)),
                () => {}
            }
        }
        let [inner, a, b] = self.choice(no)?;
        match () {
            () if inner == condition => Some(self.choose(condition, yes, b)),
            () if yes == a => Some(self.choose(self.or(condition, inner), a, b)),
            () if yes == b => Some(self.choose(self.and(opposite, inner), a, b)),
            () => None,
        }
    }

    /// Whether a choice between two constants gives a third; whether a number is still itself behind a clamp.
    pub(crate) fn simple_equal(&self, x: Term, y: Term) -> Option<Term> {
        if x == y {
            return Some(self.truth(true));
        }
        self.equal_choice(x, y)
            .or_else(|| self.equal_sums(x, y))
            .or_else(|| self.unclamped(x, y))
            .or_else(|| self.unclamped(y, x))
            .or_else(|| self.is_zero(x, y))
            .or_else(|| self.is_zero(y, x))
    }

    fn equal_choice(&self, x: Term, y: Term) -> Option<Term> {
        let (choice, value) = match (self.constants(x), self.constants(y)) {
            (Some(choice), None) => (choice, self.known(y)?),
            (None, Some(choice)) => (choice, self.known(x)?),
            _ => return None,
        };
        let (condition, yes, no) = choice;
        Some(match (yes == value, no == value) {
            (true, true) => self.truth(true),
            (true, false) => condition,
            (false, true) => self.not(condition),
            (false, false) => self.truth(false),
        })
    }

    /// An operation of one operand on a choice between constants.
    pub(crate) fn simple_unary(&self, name: &'static str, x: Term) -> Option<Term> {
        let (condition, yes, no) = self.constants(x)?;
        let of = |value| self.unary(name, self.bits(value, self.width(x)));
        Some(self.choose(condition, of(yes), of(no)))
    }

    /// `change` of both constants of a choice, such as another width.
    pub(crate) fn each_constant(&self, x: Term, change: impl Fn(Term) -> Term) -> Option<Term> {
        let (condition, yes, no) = self.constants(x)?;
        let of = |value| change(self.bits(value, self.width(x)));
        Some(self.choose(condition, of(yes), of(no)))
    }

    /// An operation of two operands of one width.
    pub(crate) fn simple_binary(&self, name: &'static str, x: Term, y: Term) -> Option<Term> {
        self.neutral(name, x, y)
            .or_else(|| self.single_bit(name, x, y))
            .or_else(|| self.difference(name, x, y))
            .or_else(|| self.of_flags(name, x, y))
            .or_else(|| self.counted(name, x, y))
            .or_else(|| self.of_one_choice(name, x, y))
            .or_else(|| self.masked(name, x, y))
            .or_else(|| self.with_sign(name, x, y))
            .or_else(|| self.raised(name, x, y))
            .or_else(|| self.joined(name, x, y))
            .or_else(|| self.joined(name, y, x))
    }

    /// Operands that may be exchanged: a constant last, others in the order of the store.
    pub(crate) fn in_order(&self, name: &'static str, x: Term, y: Term) -> [Term; 2] {
        let commutes = matches!(name, "bvadd" | "bvand" | "bvor" | "bvxor" | "bvmul");
        let is_late = |x: Term| (self.known(x).is_some(), x);
        match commutes && is_late(y) < is_late(x) {
            true => [y, x],
            false => [x, y],
        }
    }

    /// The lowest or the highest bit of a word is a flag.
    fn single_bit(&self, name: &'static str, x: Term, y: Term) -> Option<Term> {
        let width = self.width(x);
        match (name, self.known(y)?) {
            ("bvand", 1) => Some(self.number(self.bit(x, 0), width)),
            ("bvlshr", by) if by == u64::from(width) - 1 => Some(self.number(self.bit(x, width - 1), width)),
            _ => None,
        }
    }

    /// A constant that changes nothing, or decides.
    fn neutral(&self, name: &'static str, x: Term, y: Term) -> Option<Term> {
        let ones = mask(self.width(x));
        let (value, other) = match (self.known(x), self.known(y)) {
            (None, Some(value)) => (value, x),
            (Some(value), None) if matches!(name, "bvadd" | "bvand" | "bvor" | "bvxor") => (value, y),
            _ => return None,
        };
        match (name, value) {
            ("bvadd" | "bvsub" | "bvor" | "bvxor" | "bvshl" | "bvlshr" | "bvashr", 0) => Some(other),
            ("bvand", value) if value == ones => Some(other),
            ("bvand", 0) => Some(self.bits(0, self.width(x))),
            ("bvor", value) if value == ones => Some(self.bits(ones, self.width(x))),
            _ => None,
        }
    }

    /// `x - (y - z)` as `(z + x) - y`: the upper end of an interval, which the contract has in the same form. Of two forms of one sum a
    /// solver has to find out bit by bit that they are the same: with 64 bits that took 2.3 s, and takes .08 s.
    fn difference(&self, name: &'static str, x: Term, y: Term) -> Option<Term> {
        let node = self.node(y);
        match (name, &node.op, node.args.as_slice()) {
            ("bvsub", Op::Bits("bvsub"), &[y, z]) => Some(self.binary("bvsub", self.binary("bvadd", z, x), y)),
            _ => None,
        }
    }

    /// `and` and `or` of two flags of one value are those of their conditions.
    fn of_flags(&self, name: &'static str, x: Term, y: Term) -> Option<Term> {
        if !matches!(name, "bvand" | "bvor") {
            return None;
        }
        let ((p, value), (q, other)) = (self.flag(x)?, self.flag(y)?);
        if value != other {
            return None;
        }
        let condition = if name == "bvand" { self.and(p, q) } else { self.or(p, q) };
        let width = self.width(x);
        Some(self.choose(condition, self.bits(value, width), self.bits(0, width)))
    }

    /// Half of a sum of two flags of 1 is their `and`; with 1 more, their `or`.
    fn counted(&self, name: &'static str, x: Term, y: Term) -> Option<Term> {
        if name != "bvlshr" || self.known(y) != Some(1) || self.width(x) < 3 {
            return None;
        }
        let sum = |x: Term| {
            let node = self.node(x);
            match (&node.op, node.args.as_slice()) {
                (Op::Bits("bvadd"), &[x, y]) => Some((x, y)),
                _ => None,
            }
        };
        let one = |x: Term| {
            self.flag(x)
                .filter(|(_, value)| *value == 1)
                .map(|(condition, _)| condition)
        };
        let (first, second) = sum(x)?;
        let condition = match (one(first), one(second)) {
            (Some(p), Some(q)) => self.and(p, q),
            _ if self.known(second) == Some(1) => {
                let (first, second) = sum(first)?;
                self.or(one(first)?, one(second)?)
            }
            _ => return None,
        };
        Some(self.number(condition, self.width(x)))
    }

    /// Two choices by one condition, or a choice and a constant: the choice of both results, where each is known at once.
    fn of_one_choice(&self, name: &'static str, x: Term, y: Term) -> Option<Term> {
        let (condition, [a, b], [c, d]) = match (self.choice(x), self.choice(y)) {
            (Some([p, a, b]), Some([q, c, d])) if p == q => (p, [a, b], [c, d]),
            (Some([p, a, b]), _) if self.known(y).is_some() => (p, [a, b], [y, y]),
            (_, Some([p, c, d])) if self.known(x).is_some() => (p, [x, x], [c, d]),
            _ => return None,
        };
        let is_simple = |x: Term, y: Term| {
            (self.known(x).is_some() && self.known(y).is_some()) || self.neutral(name, x, y).is_some()
        };
        let simple = is_simple(a, c) && is_simple(b, d);
        simple.then(|| self.choose(condition, self.binary(name, a, c), self.binary(name, b, d)))
    }

    /// What a mask leaves that is 0 where a condition fails.
    fn masked(&self, name: &'static str, x: Term, y: Term) -> Option<Term> {
        if name != "bvand" {
            return None;
        }
        let ((condition, value), other) = match (self.flag(y), self.flag(x)) {
            (Some(flag), _) => (flag, x),
            (None, Some(flag)) => (flag, y),
            (None, None) => return None,
        };
        let width = self.width(x);
        let kept = self.binary(name, other, self.bits(value, width));
        Some(self.choose(condition, kept, self.bits(0, width)))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use random::{Random, SplitMix};

    use super::*;

    /// Narrow, so that random constants meet.
    const WIDTH: u32 = 4;

    /// A term, and its value computed from the operands as numbers.
    type Pair = (Term, u64);

    /// The value of a term node by node, under the values of the inputs.
    fn value(terms: &Terms, term: Term, inputs: &HashMap<String, u64>) -> u64 {
        let node = terms.node(term);
        let args: Vec<u64> = node.args.iter().map(|arg| value(terms, *arg, inputs)).collect();
        let width = terms.width(term);
        match (&node.op, args.as_slice()) {
            (Op::Constant(value), _) => *value,
            (Op::Input(name), _) => inputs[name],
            (Op::Not, &[x]) => 1 - x,
            (Op::And, &[x, y]) => x & y,
            (Op::Or, &[x, y]) => x | y,
            (Op::Choose, &[p, x, y]) => {
                if p == 1 {
                    x
                } else {
                    y
                }
            }
            (Op::Equal, &[x, y]) => u64::from(x == y),
            (Op::Bits(name), &[x]) => of_one(name, x),
            (Op::Bits("bvule"), &[x, y]) => u64::from(x <= y),
            (Op::Bits(name), &[x, y]) => of_two(name, x, y),
            (Op::Extract(_, low), &[x]) => (x >> low) & mask(width),
            (Op::ZeroExtend(_), &[x]) => x,
            (Op::SignExtend(by), &[x]) => extended(x, width - by) & mask(width),
            other => panic!("{other:?}"),
        }
    }

    fn extended(x: u64, from: u32) -> u64 {
        if x >> (from - 1) & 1 == 1 { x | !mask(from) } else { x }
    }

    fn of_one(name: &str, x: u64) -> u64 {
        mask(WIDTH) & if name == "bvnot" { !x } else { x.wrapping_neg() }
    }

    fn of_two(name: &str, x: u64, y: u64) -> u64 {
        let shift = |shifted: u64| if y < WIDTH.into() { shifted } else { 0 };
        mask(WIDTH)
            & match name {
                "bvadd" => x.wrapping_add(y),
                "bvsub" => x.wrapping_sub(y),
                "bvand" => x & y,
                "bvor" => x | y,
                "bvxor" => x ^ y,
                "bvshl" => shift(x << (y % 8)),
                _ => shift(x >> (y % 8)),
            }
    }

    const NAMES: [&str; 7] = ["bvadd", "bvsub", "bvand", "bvor", "bvxor", "bvshl", "bvlshr"];

    /// One more bit vector or truth, of those that there are; constants that masks and flags are made of come often.
    fn grow(terms: &Terms, rng: &mut SplitMix, bits: &mut Vec<Pair>, truths: &mut Vec<Pair>) {
        let constants = [0, 1, mask(WIDTH), rng.below(16) as u64];
        let any = |rng: &mut SplitMix, from: &[Pair]| from[rng.below(from.len())];
        let number = |rng: &mut SplitMix, bits: &[Pair]| match rng.below(3) {
            0 => {
                let value = constants[rng.below(4)];
                (terms.bits(value, WIDTH), value)
            }
            _ => any(rng, bits),
        };
        let (x, y) = (number(rng, bits), number(rng, bits));
        let (p, q) = (any(rng, truths), any(rng, truths));
        match rng.below(9) {
            0 => truths.push((terms.not(p.0), 1 - p.1)),
            1 => truths.push((terms.and(p.0, q.0), p.1 & q.1)),
            2 => truths.push((terms.or(p.0, q.0), p.1 | q.1)),
            3 => truths.push((terms.equal(x.0, y.0), u64::from(x.1 == y.1))),
            4 | 5 => bits.push((terms.choose(p.0, x.0, y.0), if p.1 == 1 { x.1 } else { y.1 })),
            6 => {
                let name = ["bvnot", "bvneg"][rng.below(2)];
                bits.push((terms.unary(name, x.0), of_one(name, x.1)));
            }
            7 => {
                let sign = rng.one_in(2);
                let wide = terms.resize(x.0, 2 * WIDTH, sign);
                let low = 1 + rng.below(4) as u32;
                let is = (if sign { extended(x.1, WIDTH) } else { x.1 } >> low) & mask(WIDTH);
                bits.push((terms.extract(wide, low + WIDTH - 1, low), is));
            }
            _ => {
                let name = NAMES[rng.below(NAMES.len())];
                bits.push((terms.binary(name, x.0, y.0), of_two(name, x.1, y.1)));
            }
        }
    }

    #[test]
    fn simplified_terms_have_the_values_of_what_they_were_made_of() {
        for seed in 0..3_000 {
            let (terms, mut rng) = (Terms::default(), SplitMix::new(seed));
            let mut inputs = HashMap::new();
            let mut input = |name: &str, width: u32, value: u64| {
                inputs.insert(name.to_owned(), value);
                (terms.input(name, width), value)
            };
            let [x, y] = ["x", "y"].map(|name| input(name, WIDTH, rng.below(16) as u64));
            let [p, q] = ["p", "q"].map(|name| input(name, 1, rng.below(2) as u64));
            let truth = |(term, value): Pair| (terms.equal(term, terms.bits(1, 1)), value);
            let (mut bits, mut truths) = (vec![x, y], vec![truth(p), truth(q)]);
            for _ in 0..40 {
                grow(&terms, &mut rng, &mut bits, &mut truths);
            }
            for (term, is) in bits.into_iter().chain(truths) {
                assert_eq!(value(&terms, term, &inputs), is, "seed {seed}: {:?}", terms.node(term));
            }
        }
    }

    #[test]
    fn a_selection_by_a_mask_is_a_choice() {
        let terms = Terms::default();
        let [x, y, low] = ["x", "y", "low"].map(|name| terms.input(name, 32));
        let condition = terms.equal(x, y);
        let by_mask = terms.binary("bvsub", terms.bits(0, 32), terms.number(condition, 32));
        let kept = terms.binary("bvand", x, by_mask);
        let other = terms.binary("bvand", low, terms.unary("bvnot", by_mask));
        assert_eq!(terms.binary("bvor", kept, other), terms.choose(condition, x, low));
    }

    #[test]
    fn counted_flags_are_truths() {
        let terms = Terms::default();
        let [x, y, z] = ["x", "y", "z"].map(|name| terms.input(name, 32));
        let (p, q) = (terms.equal(x, y), terms.equal(y, z));
        let one = terms.bits(1, 32);
        let sum = terms.binary("bvadd", terms.number(p, 32), terms.number(q, 32));
        assert_eq!(terms.binary("bvlshr", sum, one), terms.number(terms.and(p, q), 32));
        let more = terms.binary("bvadd", sum, one);
        assert_eq!(terms.binary("bvlshr", more, one), terms.number(terms.or(p, q), 32));
    }
}

//! A number limited to a magnitude, as code has it in bits or in branches: the clamp that the contract says, if it is a number.
//!
//! `(x & sign) | (|x| if P else 0) | (0 if P else m)` with P saying `|x| < m` is x where P holds, and m with the sign of x elsewhere. Of a number that is the
//! clamp to -m and m. Of a NaN it is m with its sign, where a clamp leaves the NaN: so the rule says both, and what is assumed of a goal decides.

use crate::term::{Comparison, Term, Terms, mask};

impl Terms {
    /// The sign of `(x without its sign) - bound`: whether x is a number nearer to 0 than the bound.
    pub(crate) fn near(&self, magnitude: Term, bound: Term) -> Option<Term> {
        let (bound, width) = (self.known(bound)?, self.width(magnitude));
        let x = self.kept(magnitude, mask(width - 1))?;
        if bound > self.infinity(width)? {
            return None;
        }
        let ends = [bound | 1 << (width - 1), bound].map(|bits| self.bits(bits, width));
        Some(self.inside(x, ends))
    }

    /// `low < x < high`.
    fn inside(&self, x: Term, [low, high]: [Term; 2]) -> Term {
        let less = |x, y| self.compare(Comparison::Less, x, y);
        self.and(less(low, x), less(x, high))
    }

    /// Of which word these bits are kept.
    fn kept(&self, x: Term, bits: u64) -> Option<Term> {
        let ("bvand", [word, kept]) = self.of_words(x)? else {
            return None;
        };
        (self.known(kept) == Some(bits)).then_some(word)
    }

    /// Sign and magnitude of a word joined where a condition holds; then the bound joined where it fails.
    pub(crate) fn with_sign(&self, name: &'static str, x: Term, y: Term) -> Option<Term> {
        let sides = [(x, y), (y, x)];
        (name == "bvor")
            .then(|| {
                sides
                    .into_iter()
                    .find_map(|(x, y)| self.whole(x, y).or_else(|| self.ended(x, y)))
            })
            .flatten()
    }

    /// `(x & sign) | (|x| if P else 0)`: x where P holds, its sign elsewhere.
    fn whole(&self, sign: Term, magnitude: Term) -> Option<Term> {
        let width = self.width(sign);
        let x = self.kept(sign, 1 << (width - 1))?;
        let [condition, yes, no] = self.choice(magnitude)?;
        let (condition, kept) = match (self.known(yes), self.known(no)) {
            (_, Some(0)) => (condition, yes),
            (Some(0), _) => (self.not(condition), no),
            _ => return None,
        };
        (self.kept(kept, mask(width - 1)) == Some(x)).then(|| self.choose(condition, x, sign))
    }

    /// What [`Terms::whole`] gives, joined with a bound without a sign where the condition fails.
    fn ended(&self, x: Term, bound: Term) -> Option<Term> {
        let width = self.width(x);
        let sign = 1 << (width - 1);
        let [condition, yes, no] = self.choice(x)?;
        let (fails, bound) = self.flag(bound).filter(|(_, bound)| bound & sign == 0)?;
        let holds = self.not(fails);
        let (whole, of_sign) = if condition == holds { (yes, no) } else { (no, yes) };
        let fits = (condition == holds || condition == fails) && self.kept(of_sign, sign) == Some(whole);
        let ends = [bound | sign, bound].map(|bits| self.bits(bits, width));
        fits.then(|| self.choose(holds, whole, self.choose(self.bit(whole, width - 1), ends[0], ends[1])))
    }

    /// `x if -m < x < m else (-m or m by the sign of x)`: of a number the clamp.
    pub(crate) fn limited_choice(&self, condition: Term, yes: Term, no: Term) -> Option<Term> {
        let opposite = || self.not(condition);
        self.limited(condition, yes, no)
            .or_else(|| self.limited(opposite(), no, yes))
    }

    fn limited(&self, condition: Term, x: Term, ends: Term) -> Option<Term> {
        let (by, yes, no) = self.constants(ends)?;
        let width = self.width(x);
        let sign = 1 << (width - 1);
        if yes ^ no != sign || yes.min(no) > self.infinity(width)? {
            return None;
        }
        let is_negative = if yes > no { by } else { self.not(by) };
        let [high, low] = [yes.min(no), yes.max(no)].map(|bits| self.bits(bits, width));
        if is_negative != self.bit(x, width - 1) || condition != self.inside(x, [low, high]) {
            return None;
        }
        let less = |x, y| self.compare(Comparison::Less, x, y);
        let raised = self.choose(less(x, low), low, x);
        let clamped = self.choose(less(high, raised), high, raised);
        Some(self.choose(self.compare(Comparison::Equal, x, x), clamped, ends))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    /// Both forms against the machine, for numbers around every end, infinities and NaN; and that of a number they are the contract's clamp.
    #[test]
    fn what_is_limited_by_bits_is_the_clamp_of_a_number() {
        let ends = [1, 0x3F80_0000_u32, 0x4110_0000, 0x7F7F_FFFF, 0x7F80_0000];
        for bound in ends {
            let terms = Terms::default();
            let x = terms.input("x", 32);
            let constant = |bits: u32| terms.bits(bits.into(), 32);
            let [and, or, sub] = ["bvand", "bvor", "bvsub"].map(|name| |x: Term, y: Term| terms.binary(name, x, y));
            let magnitude = and(x, constant(0x7FFF_FFFF));
            let shifted = terms.binary("bvlshr", sub(magnitude, constant(bound)), constant(31));
            let below = sub(constant(0), shifted);
            let sign = and(x, constant(1 << 31));
            let not_below = terms.unary("bvnot", below);
            let by_bits = or(or(sign, and(magnitude, below)), and(constant(bound), not_below));
            let [low, high] = [bound | 1 << 31, bound].map(constant);
            let by_sign = terms.choose(terms.bit(x, 31), low, high);
            let by_branches = terms.choose(terms.inside(x, [low, high]), x, by_sign);
            for near in ends.into_iter().chain([0, 0x7FC0_0000]) {
                for bits in [near.wrapping_sub(1), near, near + 1]
                    .into_iter()
                    .flat_map(|x| [x, x ^ 1 << 31])
                {
                    let magnitude = bits & 0x7FFF_FFFF;
                    let machine = bits & 1 << 31 | magnitude.min(bound);
                    for form in [by_bits, by_branches] {
                        let anew = HashMap::from([(x, constant(bits))]);
                        let found = terms.known(terms.with(anew, form));
                        assert_eq!(found, Some(machine.into()), "{bits:08X} within {bound:08X}");
                    }
                }
            }
            let less = |x, y| terms.compare(Comparison::Less, x, y);
            let raised = terms.choose(less(x, low), low, x);
            let clamp = terms.choose(less(high, raised), high, raised);
            let number = terms.compare(Comparison::Equal, x, x);
            for form in [by_bits, by_branches] {
                assert_eq!(terms.under(&[number], form), clamp, "{bound:08X}");
            }
        }
    }
    /// The mask of a lower end of 0 leaves nothing, and is not in the text.
    #[test]
    fn a_clamp_from_0_by_masks_is_the_contracts() {
        let terms = Terms::default();
        let x = terms.input("x", 32);
        let less = |x, y| terms.compare(Comparison::Less, x, y);
        let [zero, high] = [0, 0x4110_0000].map(|bits| terms.bits(bits, 32));
        let below = less(x, zero);
        let above = terms.and(terms.not(below), less(high, x));
        let raised = terms.choose(below, zero, x);
        let clamp = terms.choose(less(high, raised), high, raised);
        let kept = terms.choose(terms.or(below, above), zero, x);
        let ended = terms.choose(above, high, zero);
        for by_masks in [terms.binary("bvor", ended, kept), terms.binary("bvor", kept, ended)] {
            assert_eq!(by_masks, clamp);
        }
    }
}

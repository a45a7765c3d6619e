//! Truths in one form: negations at the leaves, the operands of a chain of `and` or `or` in the order of the store, each once. So two
//! formulas that say the same with the same words become one term.

use std::collections::HashMap;

use crate::term::{Comparison, Op, Sort, Term, Terms};

impl Terms {
    /// What is negated.
    pub(crate) fn negated(&self, x: Term) -> Option<Term> {
        let node = self.node(x);
        match (&node.op, node.args.as_slice()) {
            (Op::Not, &[inner]) => Some(inner),
            _ => None,
        }
    }

    pub(crate) fn not(&self, x: Term) -> Term {
        if let Some(opposite) = self.opposite(x) {
            return opposite;
        }
        let node = self.node(x);
        let opposite = match (&node.op, node.args.as_slice()) {
            (Op::Constant(value), _) => return self.truth(*value == 0),
            (Op::And | Op::Or, _) => {
                let all = node.op == Op::And;
                let opposites = self.operands(all, [x]).into_iter().map(|x| self.not(x));
                self.junction(!all, opposites)
            }
            (Op::Choose, &[condition, yes, no]) => self.choose(condition, self.not(yes), self.not(no)),
            _ => self.make(Op::Not, vec![x], Sort::Truth),
        };
        self.keep_opposites(x, opposite);
        opposite
    }

    pub(crate) fn and(&self, x: Term, y: Term) -> Term {
        self.junction(true, [x, y])
    }

    pub(crate) fn or(&self, x: Term, y: Term) -> Term {
        self.junction(false, [x, y])
    }

    pub(crate) fn all(&self, terms: impl IntoIterator<Item = Term>) -> Term {
        self.junction(true, terms)
    }

    /// A choice between truths of which one is known.
    pub(crate) fn choice_of_truths(&self, condition: Term, yes: Term, no: Term) -> Option<Term> {
        Some(match (self.known(yes), self.known(no)) {
            (Some(1), _) => self.or(condition, no),
            (Some(_), _) => self.and(self.not(condition), no),
            (_, Some(1)) => self.or(self.not(condition), yes),
            (_, Some(_)) => self.and(condition, yes),
            _ => return None,
        })
    }

    /// Whether all that one truth asks for is asked for by the other one, too.
    pub(crate) fn implies(&self, x: Term, y: Term) -> bool {
        let all = self.operands(true, [x]);
        self.operands(true, [y]).iter().all(|operand| all.contains(operand))
    }

    /// The operands of chains of `and` (or, if not `all`, of `or`), in no order.
    pub(crate) fn operands(&self, all: bool, terms: impl IntoIterator<Item = Term>) -> Vec<Term> {
        let op = if all { Op::And } else { Op::Or };
        let (mut operands, mut open) = (Vec::new(), Vec::from_iter(terms));
        while let Some(term) = open.pop() {
            let node = self.node(term);
            match node.op == op {
                true => open.extend(&node.args),
                false => operands.push(term),
            }
        }
        operands
    }

    /// `and` of all terms, or `or` of any.
    fn junction(&self, all: bool, terms: impl IntoIterator<Item = Term>) -> Term {
        let mut operands = self.operands(all, terms);
        loop {
            operands.sort_unstable();
            operands.dedup();
            if operands.iter().any(|x| self.known(*x) == Some(u64::from(!all))) || self.contradicts(&operands) {
                return self.truth(!all);
            }
            operands.retain(|x| self.known(*x).is_none());
            let implied = self.implied(all, &operands);
            operands.retain(|x| !implied.contains(x));
            let Some(([x, y], together)) = self.pair(all, &operands) else {
                break;
            };
            operands.retain(|operand| *operand != x && *operand != y);
            operands.extend(self.operands(all, [together]));
        }
        let op = if all { Op::And } else { Op::Or };
        let chain = operands
            .into_iter()
            .reduce(|x, y| self.make(op.clone(), vec![x, y], Sort::Truth));
        chain.unwrap_or(self.truth(all))
    }

    /// Whether a term and its opposite are among them.
    fn contradicts(&self, operands: &[Term]) -> bool {
        let has = |x: Term| operands.binary_search(&x).is_ok();
        operands.iter().any(|x| self.negated(*x).is_some_and(has))
    }

    /// A term without its negation, and whether it had none.
    fn polarity(&self, x: Term) -> (Term, bool) {
        self.negated(x).map_or((x, true), |inner| (inner, false))
    }

    /// What the others say already: `a == a` says that `a` is no NaN, and so does every comparison of it that holds.
    fn implied(&self, all: bool, operands: &[Term]) -> Vec<Term> {
        let compared: Vec<_> = operands
            .iter()
            .filter_map(|term| {
                let (truth, holds) = self.polarity(*term);
                Some((*term, holds, self.compared(truth)?))
            })
            .collect();
        let mut implied = Vec::new();
        for (number, holds, (comparison, [a, b])) in &compared {
            if (*comparison, a) != (Comparison::Equal, b) {
                continue;
            }
            let others = compared
                .iter()
                .filter(|(other, same, (_, args))| other != number && same == holds && args.contains(a));
            // of truths that all hold the weaker one is said already, and of those of which any does the stronger one
            match *holds == all {
                true => implied.extend(others.map(|_| *number)),
                false => implied.extend(others.map(|(other, ..)| *other)),
            }
        }
        implied
    }

    /// Two operands that are another truth together. Of an `and` their opposites are looked at, as of an `or`.
    fn pair(&self, all: bool, operands: &[Term]) -> Option<([Term; 2], Term)> {
        let of_sign = |term: &Term| {
            let (truth, holds) = self.polarity(*term);
            (holds != all).then_some((*term, truth))
        };
        let found = self
            .signs_together(operands.iter().filter_map(of_sign))
            .or_else(|| self.comparisons_together(operands.iter().filter_map(of_sign)));
        found.map(|(pair, truth)| (pair, if all { self.not(truth) } else { truth }))
    }

    /// Two signs of which one is set where a word lies outside of a range.
    fn signs_together(&self, operands: impl Iterator<Item = (Term, Term)>) -> Option<([Term; 2], Term)> {
        let words: Vec<(Term, Term)> = operands
            .filter_map(|(term, truth)| Some((term, self.signed_word(truth)?)))
            .collect();
        let pairs = words.iter().flat_map(|x| words.iter().map(move |y| (x, y)));
        let mut pairs = pairs.filter(|(x, y)| x != y);
        pairs.find_map(|((x, from), (y, to))| Some(([*x, *y], self.outside_range(*from, *to)?)))
    }

    /// `a < b` or `b <= a`: both are numbers.
    fn comparisons_together(&self, operands: impl Iterator<Item = (Term, Term)>) -> Option<([Term; 2], Term)> {
        let compared = operands.filter_map(|(term, truth)| Some((term, self.compared(truth)?)));
        let (below, others): (Vec<_>, Vec<_>) = compared.partition(|(_, (how, _))| *how == Comparison::Less);
        let from: HashMap<[Term; 2], Term> = others
            .into_iter()
            .filter(|(_, (how, _))| *how == Comparison::LessOrEqual)
            .map(|(term, (_, args))| (args, term))
            .collect();
        below.into_iter().find_map(|(x, (_, [a, b]))| {
            let y = from.get(&[b, a])?;
            let number = |x: Term| self.compare(Comparison::Equal, x, x);
            Some(([x, *y], self.and(number(a), number(b))))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_have_one_form() {
        let terms = Terms::default();
        let [x, y, z] = ["x", "y", "z"].map(|name| terms.equal(terms.input(name, 32), terms.bits(7, 32)));
        let one = terms.and(terms.and(x, y), z);
        assert_eq!(terms.and(y, terms.and(z, terms.and(x, y))), one);
        assert_eq!(
            terms.not(terms.or(terms.not(z), terms.or(terms.not(y), terms.not(x)))),
            one
        );
        assert_eq!(terms.and(one, terms.not(y)), terms.truth(false));
        assert_eq!(terms.not(terms.not(one)), one);
        assert_eq!(terms.choose(terms.not(one), x, y), terms.choose(one, y, x));
    }

    #[test]
    fn a_number_is_below_a_constant_or_not() {
        let terms = Terms::default();
        let (x, limit) = (terms.input("x", 32), terms.bits(1.0_f32.to_bits().into(), 32));
        let below = terms.compare(Comparison::Less, x, limit);
        let from = terms.compare(Comparison::LessOrEqual, limit, x);
        let number = terms.compare(Comparison::Equal, x, x);
        assert_eq!(terms.or(below, from), number);
        assert_eq!(terms.and(terms.not(from), terms.not(below)), terms.not(number));
        assert_ne!(terms.or(below, terms.compare(Comparison::Less, limit, x)), number);
    }
}

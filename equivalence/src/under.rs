//! A term where something holds: what is assumed of a goal is known in it.

use std::collections::HashMap;

use crate::term::{Op, Sort, Term, Terms};

impl Terms {
    /// `claim` with every truth of `given` in its place, made anew so that all rules see it.
    pub(crate) fn under(&self, given: &[Term], claim: Term) -> Term {
        let mut anew: HashMap<Term, Term> = HashMap::new();
        for truth in given {
            anew.insert(*truth, self.truth(true));
            anew.insert(self.not(*truth), self.truth(false));
        }
        self.with(anew, claim)
    }

    /// `claim` with other terms in the places of some.
    pub(crate) fn with(&self, mut anew: HashMap<Term, Term>, claim: Term) -> Term {
        // a term is made behind its parts, so the order of the store is one of making them
        for term in self.parts(claim) {
            if !anew.contains_key(&term) {
                let made = self.again(term, &anew);
                // it may have become one that is known itself
                let made = anew.get(&made).copied().unwrap_or(made);
                anew.insert(term, made);
            }
        }
        anew.get(&claim).copied().unwrap_or(claim)
    }

    /// Whether two terms are the same where `given` holds. Of two choices by one condition each side is looked at where the condition holds,
    /// or does not: what a mask or a flag leaves out there says nothing.
    pub(crate) fn same_under(&self, given: &[Term], x: Term, y: Term) -> Term {
        let [x, y] = [x, y].map(|x| self.under(given, x));
        match (self.choice(x), self.choice(y)) {
            _ if x == y => self.truth(true),
            (Some([condition, a, b]), Some([same, c, d])) if condition == same => {
                let opposite = self.not(condition);
                let where_it_holds = self.same_under(&self.operands(true, [condition]), a, c);
                let elsewhere = self.same_under(&self.operands(true, [opposite]), b, d);
                self.and(self.or(opposite, where_it_holds), self.or(condition, elsewhere))
            }
            _ => self.equal(x, y),
        }
    }

    /// A term and all that it is made of, in the order of the store.
    fn parts(&self, term: Term) -> Vec<Term> {
        let mut needed = vec![false; self.count()];
        let mut open = vec![term];
        while let Some(term) = open.pop() {
            if !std::mem::replace(&mut needed[term.number() as usize], true) {
                open.extend(&self.node(term).args);
            }
        }
        let all = needed.into_iter().enumerate().filter(|(_, is_needed)| *is_needed);
        all.map(|(number, _)| self.at(number)).collect()
    }

    /// The same operation on what its operands have become.
    fn again(&self, term: Term, anew: &HashMap<Term, Term>) -> Term {
        let node = self.node(term);
        let args: Vec<Term> = node.args.iter().map(|arg| *anew.get(arg).unwrap_or(arg)).collect();
        if args == node.args {
            return term;
        }
        match (&node.op, args.as_slice()) {
            (Op::Not, &[x]) => self.not(x),
            (Op::And, &[x, y]) => self.and(x, y),
            (Op::Or, &[x, y]) => self.or(x, y),
            (Op::Choose, &[condition, yes, no]) => self.choose(condition, yes, no),
            (Op::Equal, &[x, y]) => self.equal(x, y),
            (Op::Float(comparison), &[x, y]) => self.compare(*comparison, x, y),
            (Op::Call(name), args) => self.call(name, args, self.width(term)),
            (Op::Bits(name), &[x]) => self.unary(name, x),
            (Op::Bits(name), &[x, y]) if node.sort == Sort::Truth => self.order(name, x, y),
            (Op::Bits(name), &[x, y]) => self.binary(name, x, y),
            (Op::Extract(high, low), &[x]) => self.extract(x, *high, *low),
            (Op::ZeroExtend(_), &[x]) => self.resize(x, self.width(term), false),
            (Op::SignExtend(_), &[x]) => self.resize(x, self.width(term), true),
            // of constants, inputs and what there is not, nothing has changed
            _ => term,
        }
    }
}

//! What is known of sums, joins and tables of choices before a solver sees them: masks that leave parts of a word are a choice of the parts.

use crate::term::{Op, Term, Terms};

impl Terms {
    /// A counter that is raised where a condition holds.
    pub(crate) fn raised(&self, name: &'static str, x: Term, y: Term) -> Option<Term> {
        let is_counter = |x: Term| matches!(self.node(x).op, Op::Input(_));
        let (counter, flag) = match (is_counter(x), is_counter(y)) {
            (true, false) => (x, y),
            (false, true) => (y, x),
            _ => return None,
        };
        let (condition, value) = self.flag(flag).filter(|_| name == "bvadd")?;
        let more = self.binary(name, counter, self.bits(value, self.width(x)));
        Some(self.choose(condition, more, counter))
    }

    /// Two choices joined of which one says something of the other's condition: a choice of three.
    pub(crate) fn joined(&self, name: &'static str, x: Term, y: Term) -> Option<Term> {
        let [condition, yes, no] = self.choice(x).filter(|_| name == "bvor")?;
        if let Some(choice) = self.spared(x, y) {
            return Some(choice);
        }
        if let Some(choice) = self.parted([condition, yes, no], y) {
            return Some(choice);
        }
        let (other, set, unset) = self.constants(y)?;
        let with = |x: Term, value: u64| self.binary(name, x, self.bits(value, self.width(x)));
        if self.implies(condition, other) {
            let otherwise = self.choose(other, with(no, set), with(no, unset));
            return Some(self.choose(condition, with(yes, set), otherwise));
        }
        let opposite = self.not(condition);
        if unset != 0 || !self.implies(other, opposite) {
            return None;
        }
        // of the other condition what the first one leaves open
        let known = self.operands(true, [opposite]);
        let rest = self
            .operands(true, [other])
            .into_iter()
            .filter(|operand| !known.contains(operand));
        Some(self.choose(condition, yes, self.choose(self.all(rest), with(no, set), no)))
    }

    /// A flag joined with what is 0 wherever the flag is set, as a clamp whose lower end is 0 leaves of its three masks two.
    fn spared(&self, flag: Term, y: Term) -> Option<Term> {
        let (set, value) = self.flag(flag)?;
        let [condition, yes, no] = self.choice(y)?;
        let (is_zero, rest) = match (self.known(yes), self.known(no)) {
            (Some(0), _) => (condition, no),
            (_, Some(0)) => (self.not(condition), yes),
            _ => return None,
        };
        let [own, all] = [set, is_zero].map(|condition| self.operands(false, [condition]));
        if !own.iter().all(|operand| all.contains(operand)) {
            return None;
        }
        let others = all.into_iter().filter(|operand| !own.contains(operand));
        let otherwise = others.fold(self.truth(false), |any, operand| self.or(any, operand));
        let [value, zero] = [value, 0].map(|bits| self.bits(bits, self.width(y)));
        Some(self.choose(set, value, self.choose(otherwise, zero, rest)))
    }

    /// What two masks leave that are both 0 where a third one is, and of which elsewhere one is 0 where the other is not.
    fn parted(&self, [condition, yes, no]: [Term; 3], y: Term) -> Option<Term> {
        let [other, set, unset] = self.choice(y)?;
        if self.known(no) != Some(0) || self.known(unset) != Some(0) {
            return None;
        }
        let [own, others] = [condition, other].map(|condition| self.operands(true, [condition]));
        let without = |all: &[Term], left_out: &[Term]| {
            let kept = all.iter().copied().filter(|operand| !left_out.contains(operand));
            self.all(kept)
        };
        let (first, second) = (without(&own, &others), without(&others, &own));
        if self.not(first) != second {
            return None;
        }
        let common = own.iter().copied().filter(|operand| others.contains(operand));
        Some(self.choose(self.all(common), self.choose(first, yes, set), no))
    }

    /// The entry of a table, the last one for what is behind; nothing of an empty table. Of an index that is chosen from constants the
    /// entries are chosen: so a table that is looked up and an entry that is carried along with its index are one term.
    pub(crate) fn entry(&self, index: Term, entries: &[Term]) -> Option<Term> {
        let last = *entries.last()?;
        if let Some(value) = self.known(index) {
            let found = usize::try_from(value).ok().and_then(|index| entries.get(index));
            return Some(*found.unwrap_or(&last));
        }
        if let Some([condition, yes, no]) = self.choice(index)
            && (self.known(yes).is_some() || self.known(no).is_some())
        {
            return Some(self.choose(condition, self.entry(yes, entries)?, self.entry(no, entries)?));
        }
        let all = entries.iter().enumerate().rev();
        Some(all.fold(last, |rest, (n, entry)| {
            let this = self.equal(index, self.bits(n as u64, self.width(index)));
            self.choose(this, *entry, rest)
        }))
    }
}

//! A goal: what is claimed, its assumptions, its text for a solver, and how to read a counterexample.

use crate::float::Float;
use crate::machine::Kind;
use crate::smt::{Arithmetic, Script, script};
use crate::term::{Term, Terms};

/// One claim as a text that any solver of SMT-LIB 2 takes: `unsat` proves it, `sat` refutes it.
#[derive(Debug, Clone)]
pub struct Goal {
    /// Short name, unique among the goals of a policy: `c.duty`, `rust.step`, `fact.comparisons`.
    pub name: String,
    /// What is claimed, in a sentence.
    pub claim: String,
    /// What is taken for granted beside the claim, one sentence each; each is a goal of its own (`fact. ...`).
    pub assumptions: Vec<String>,
    /// SMT-LIB 2, up to `(check-sat)`.
    pub text: String,
    pub(crate) shown: Vec<Shown>,
}

/// A value that makes a counterexample readable.
#[derive(Debug, Clone)]
pub(crate) struct Shown {
    /// What it is called in words.
    pub label: String,
    /// What it is called in the script.
    pub term: String,
    pub kind: Kind,
}

/// Two terms that have to be the same bits, and what they are.
pub(crate) struct Pair {
    pub label: String,
    pub emitted: Term,
    pub specified: Term,
    pub kind: Kind,
}

/// What a goal may use beside its claim.
#[derive(Clone)]
pub(crate) struct Assumption {
    pub term: Term,
    /// Of which one holds, if the assumption is that: each is looked at alone, since half of an `or` is known in no term. Nothing otherwise.
    pub cases: Vec<Term>,
    pub text: String,
}

/// That the pairs are equal wherever the assumptions hold.
pub(crate) fn equal(float: Float<'_>, name: String, claim: String, pairs: &[Pair], given: &[Assumption]) -> Goal {
    let terms = float.terms;
    let shown: Vec<Term> = pairs.iter().flat_map(|pair| [pair.emitted, pair.specified]).collect();
    let asserted: Vec<Term> = given.iter().map(|assumption| assumption.term).collect();
    let truth = terms.all(pairs.iter().map(|pair| same(terms, pair, given)));
    let script = script(terms, &asserted, truth, &shown, Arithmetic::Uninterpreted);
    let mut shown = inputs(float, &script);
    for pair in pairs {
        for (side, term) in [("emitted", pair.emitted), ("specified", pair.specified)] {
            shown.push(Shown {
                label: format!("{} {side}", pair.label),
                term: script.name(term),
                kind: pair.kind,
            });
        }
    }
    Goal {
        name,
        claim,
        assumptions: given.iter().map(|assumption| assumption.text.clone()).collect(),
        text: script.text,
        shown,
    }
}

/// Whether a pair is the same where all assumptions hold.
fn same(terms: &Terms, pair: &Pair, given: &[Assumption]) -> Term {
    let plain = given.iter().filter(|assumption| assumption.cases.is_empty());
    let plain: Vec<Term> = plain.map(|assumption| assumption.term).collect();
    let under = |known: &[Term]| terms.same_under(known, pair.emitted, pair.specified);
    match given.iter().find(|assumption| !assumption.cases.is_empty()) {
        None => under(&plain),
        Some(assumption) => terms.all(assumption.cases.iter().map(|case| {
            let known = [plain.clone(), terms.operands(true, [*case])].concat();
            terms.or(terms.not(*case), under(&known))
        })),
    }
}

/// That `claim` is true wherever the assumptions hold.
pub(crate) fn holds(float: Float<'_>, name: &str, text: String, claim: Term, given: &[Term], how: Arithmetic) -> Goal {
    let script = script(float.terms, given, claim, &[], how);
    Goal {
        name: name.to_owned(),
        claim: text,
        assumptions: Vec::new(),
        shown: inputs(float, &script),
        text: script.text,
    }
}

/// Inputs of counters and codes are integers, all others are numbers of the format.
fn inputs(float: Float<'_>, script: &Script) -> Vec<Shown> {
    let is_word = |name: &str| {
        ["bad_count", "primed", "index", "code_", "output_", "word_"]
            .iter()
            .any(|start| name.starts_with(start))
    };
    let inputs = script.inputs.iter().map(|(name, width)| Shown {
        label: name.clone(),
        term: name.clone(),
        kind: match (is_word(name), *width == float.width()) {
            (false, true) => Kind::Float(float.format),
            _ => Kind::Integer {
                bits: *width,
                signed: name.starts_with("code_") || name.starts_with("output_"),
            },
        },
    });
    inputs.collect()
}

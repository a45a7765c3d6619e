//! What the goals take for granted of rounded sums, and the goals that show it.

use policy::DutyPath;

use crate::goal::{Assumption, Goal, holds};
use crate::smt::{Arithmetic, definitions, to_number};
use crate::spec::{Own, Spec, State};
use crate::term::Term;

/// Facts about this policy's constants that uninterpreted sums do not know, output by output.
pub(crate) fn assumptions(spec: Spec<'_>, state: &State) -> Vec<Assumption> {
    let mut all = Vec::new();
    for (path, own) in spec.policy.paths().iter().zip(&state.outputs) {
        if let Some(term) = slew_is_ordered(spec, path, own) {
            let command = path.named("previous_command");
            all.push(Assumption {
                cases: Vec::new(),
                term,
                text: format!("fl({command} - s) is not above fl({command} + s)"),
            });
        }
        if let Some(term) = raised_is_number(spec, path, own) {
            let cap = path.named("soft_cap");
            all.push(Assumption {
                cases: Vec::new(),
                term,
                text: format!("fl({cap} + inc) is a number if {cap} is one between `from` and the upper limit"),
            });
        }
    }
    all
}

/// Where the lower end of the slew limit lay above the upper, the two clamps would not commute with the flag.
fn slew_is_ordered(spec: Spec<'_>, path: &DutyPath<'_>, own: &Own) -> Option<Term> {
    let (step, previous) = (spec.slew_step(path.limits)?, own.previous_command);
    let (low, high) = (spec.float.sub(previous, step), spec.float.add(previous, step));
    Some(spec.terms.not(spec.float.gt(low, high)))
}

fn raised_is_number(spec: Spec<'_>, path: &DutyPath<'_>, own: &Own) -> Option<Term> {
    let (cap, raise) = (own.soft_cap?, spec.soft_raise(path.limits)?);
    let (low, high) = spec.soft_range(path.limits)?;
    let raised = spec.float.add(cap, raise);
    let inside = spec.float.within(cap, low, high);
    Some(
        spec.terms
            .or(spec.terms.not(inside), spec.terms.not(spec.float.is_nan(raised))),
    )
}

/// The goals that the assumptions and the definitions of the other goals rest on.
pub(crate) fn goals(spec: Spec<'_>) -> Vec<Goal> {
    let state = State::any(spec);
    let mut goals = vec![comparisons(spec)];
    let assumptions = assumptions(spec, &state);
    for (number, assumption) in (1..).zip(&assumptions) {
        let name = format!("fact.rounding.{number}");
        let claim = format!("IEEE 754: {}", assumption.text);
        goals.push(holds(spec.float, &name, claim, assumption.term, &[], Arithmetic::Ieee));
    }
    goals
}

/// That the comparisons, which are defined on bits, are those of IEEE 754.
fn comparisons(spec: Spec<'_>) -> Goal {
    let width = spec.float.width();
    let mut text = String::from("(set-option :produce-models true)\n(set-logic QF_BVFP)\n");
    definitions(&mut text);
    let number = to_number(width);
    for name in ["x", "y"] {
        text.push_str(&format!("(declare-const {name} (_ BitVec {width}))\n"));
    }
    text.push_str("(assert (not (and");
    for (ours, ieee) in [("below", "fp.lt"), ("at_most", "fp.leq"), ("same_number", "fp.eq")] {
        text.push_str(&format!(
            "\n  (= ({ours}{width} x y) ({ieee} ({number} x) ({number} y)))"
        ));
    }
    text.push_str(")))\n(check-sat)\n");
    Goal {
        name: "fact.comparisons".into(),
        claim: "the comparisons of bit patterns that all goals use are those of IEEE 754".into(),
        assumptions: Vec::new(),
        text,
        shown: Vec::new(),
    }
}

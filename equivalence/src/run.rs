//! Goals to a solver, several at a time, and what it answers in words.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use policy::Scalar;

use crate::goal::{Goal, Shown};
use crate::machine::Kind;
use crate::solver::{Silence, Solver};

/// What became of a goal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// No state and no measurement contradicts the claim.
    Proved,
    /// A state and a measurement that contradict it, one value a line. Rounded operations are chosen by the solver: where the numbers
    /// of the model are not those of IEEE 754, the claim hangs on a property of rounding that was not assumed.
    Refuted(Vec<String>),
    /// No answer, and why.
    Unknown(String),
    /// The solver was not asked, and why.
    NotRun(String),
}

/// A goal with its verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    /// [`Goal::name`]
    pub name: String,
    /// [`Goal::claim`]
    pub claim: String,
    /// What became of it.
    pub verdict: Verdict,
    /// Wall time of the solver, s.
    pub seconds: f64,
    /// Name and version of the solver.
    pub solver: String,
}

/// How goals are run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Time for one goal, where the solver's own limit of work ([`Solver::work`]) does not come first.
    pub limit: Duration,
    /// Solvers at a time.
    pub parallel: usize,
}

impl Default for Options {
    /// Ten minutes a goal, two at a time.
    fn default() -> Self {
        Options {
            // a busy machine reaches the limit of work within it, so that the answer does not depend on the machine
            limit: Duration::from_secs(600),
            parallel: 2,
        }
    }
}

/// Asks the solver about every goal. `done` hears of each as it is decided, in any order; the answer is in the order of the goals.
/// When `interrupt` becomes true the running solvers are ended, and what is left is [`Verdict::NotRun`].
pub fn run(
    goals: &[Goal],
    solver: &Solver,
    options: Options,
    interrupt: &AtomicBool,
    mut done: impl FnMut(&Claim),
) -> Vec<Claim> {
    let next = AtomicUsize::new(0);
    let groups = alike(goals);
    let mut claims: Vec<Option<Claim>> = vec![None; goals.len()];
    thread::scope(|scope| {
        let (answers, heard) = mpsc::channel();
        for _ in 0..options.parallel.max(1) {
            let (answers, next, groups) = (answers.clone(), &next, &groups);
            scope.spawn(move || {
                let ask = |index: &usize| decide(&goals[*index], solver, options.limit, interrupt);
                while let Some(group) = groups.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let mut first: Option<Claim> = None;
                    for index in group {
                        let claim = match &first {
                            // a refutation names the values of each
                            Some(claim) if claim.verdict == Verdict::Proved => of_twin(&goals[*index], claim),
                            _ => ask(index),
                        };
                        if answers.send((*index, claim.clone())).is_err() {
                            return;
                        }
                        first.get_or_insert(claim);
                    }
                }
            });
        }
        drop(answers);
        for (index, claim) in heard {
            done(&claim);
            claims[index] = Some(claim);
        }
    });
    claims.into_iter().flatten().collect()
}

/// Places of goals that are one text: where C and Rust have become the same terms, one answer is the answer of both.
fn alike(goals: &[Goal]) -> Vec<Vec<usize>> {
    let mut groups: Vec<Vec<usize>> = Vec::new();
    let mut known: HashMap<&str, usize> = HashMap::new();
    for (index, goal) in goals.iter().enumerate() {
        let group = *known.entry(&goal.text).or_insert(groups.len());
        match groups.get_mut(group) {
            Some(group) => group.push(index),
            None => groups.push(vec![index]),
        }
    }
    groups
}

/// What is proved of a goal with the same text, which took no time.
fn of_twin(goal: &Goal, proved: &Claim) -> Claim {
    Claim {
        name: goal.name.clone(),
        claim: goal.claim.clone(),
        seconds: 0.0,
        ..proved.clone()
    }
}

fn decide(goal: &Goal, solver: &Solver, limit: Duration, interrupt: &AtomicBool) -> Claim {
    let start = Instant::now();
    let verdict = match interrupt.load(Ordering::Relaxed) {
        true => Verdict::NotRun("interrupted".into()),
        false => verdict(goal, solver, limit, interrupt),
    };
    Claim {
        name: goal.name.clone(),
        claim: goal.claim.clone(),
        verdict,
        seconds: start.elapsed().as_secs_f64(),
        solver: solver.title(),
    }
}

fn verdict(goal: &Goal, solver: &Solver, limit: Duration, interrupt: &AtomicBool) -> Verdict {
    let answer = match solver.ask(&goal.text, limit, interrupt) {
        Ok(answer) => answer,
        Err(Silence::TimeOut) => return Verdict::Unknown(format!("no answer within {} s", limit.as_secs_f64())),
        Err(Silence::Interrupted) => return Verdict::NotRun("interrupted".into()),
        Err(Silence::Failed(why)) => return Verdict::Unknown(format!("the solver failed: {why}")),
    };
    match answer.split_whitespace().next() {
        Some("unsat") => Verdict::Proved,
        Some("sat") => Verdict::Refuted(model(goal, solver, limit, interrupt)),
        Some("unknown") => Verdict::Unknown(match solver.work() {
            Some(work) => format!("no answer within the limit of work: {work}"),
            None => "the solver says: unknown".into(),
        }),
        _ => Verdict::Unknown(format!("the solver says: {}", answer.trim())),
    }
}

/// A second run with a question behind it: a pipe that is not answered line by line suits every solver.
fn model(goal: &Goal, solver: &Solver, limit: Duration, interrupt: &AtomicBool) -> Vec<String> {
    let mut text = goal.text.clone();
    for shown in &goal.shown {
        text.push_str(&format!("(get-value ({}))\n", shown.term));
    }
    let Ok(answer) = solver.ask(&text, limit, interrupt) else {
        return vec!["the solver gave no model".into()];
    };
    let values = answer.lines().skip(1).filter_map(value);
    goal.shown
        .iter()
        .zip(values)
        .map(|(shown, bits)| in_words(shown, bits))
        .collect()
}

/// The value in `((name #x3f800000))`.
fn value(line: &str) -> Option<u64> {
    let text = line.trim().trim_end_matches(')');
    let text = text.rsplit([' ', '(']).next()?;
    match text {
        "true" => Some(1),
        "false" => Some(0),
        _ => match text.split_at_checked(2)? {
            ("#x", digits) => u64::from_str_radix(digits, 16).ok(),
            ("#b", digits) => u64::from_str_radix(digits, 2).ok(),
            _ => None,
        },
    }
}

fn in_words(shown: &Shown, bits: u64) -> String {
    let label = &shown.label;
    match shown.kind {
        Kind::Float(Scalar::F32) => format!("{label} = {:?} (0x{bits:08X})", f32::from_bits(bits as u32)),
        Kind::Float(Scalar::F64) => format!("{label} = {:?} (0x{bits:016X})", f64::from_bits(bits)),
        Kind::Integer { bits: 32, signed: true } => format!("{label} = {}", bits as u32 as i32),
        _ => format!("{label} = {bits}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_of_one_text_are_one_group() {
        let goal = |name: &str, text: &str| Goal {
            name: name.into(),
            claim: String::new(),
            assumptions: Vec::new(),
            text: text.into(),
            shown: Vec::new(),
        };
        let goals = [goal("c.duty", "x"), goal("c.step", "y"), goal("rust.duty", "x")];
        assert_eq!(alike(&goals), [vec![0, 2], vec![1]]);
    }
}

//! The contract against the emitted C and Rust by SMT: the crate `equivalence` makes the goals, a solver that is here answers them.

use std::collections::BTreeMap;

use codegen::Output;
use equivalence::{Goal, Options, Reading, Solver, Source, Sources};

use crate::claim::{Claim, Verdict};
use crate::program::Stopped;
use crate::{Next, Prover, Task, Watch};

/// Every function of a step, in both languages, does what the contract says; so do the helpers that Frama-C reads in the place of masks.
#[derive(Debug, Clone, Copy)]
pub struct Smt;

const NAME: &str = "smt";
const INSTALL: &str = "pip install bitwuzla";
const SUBJECT: &str = "C and Rust against the contract, every state, measurement and answer of the network";

impl Prover for Smt {
    fn prove(&self, task: Task<'_>, watch: &Watch<'_>) -> Result<Vec<Claim>, Stopped> {
        (watch.say)(Next::first("looking for a solver of SMT-LIB 2"));
        let Some(solver) = Solver::find().into_iter().next() else {
            let why = format!("neither bitwuzla, cvc5 nor z3 is here; install one: {INSTALL}");
            // the goals are known without a solver: so is how many claims wait for one
            let goals = goals(task).unwrap_or_default();
            let waits = |goal: Goal| Claim {
                name: goal.name,
                text: goal.claim,
                ..not_run(task, &why)
            };
            return Ok(match goals.is_empty() {
                true => vec![not_run(task, &why)],
                false => goals.into_iter().map(waits).collect(),
            });
        };
        let goals = match goals(task) {
            Ok(goals) => goals,
            Err(why) => return Ok(vec![not_run(task, &why)]),
        };
        let total = goals.len();
        let mut done = 0;
        let answers = equivalence::run(&goals, &solver, Options::default(), watch.stop, |claim| {
            done += 1;
            let policy = task.policy;
            let format = policy.numeric_format.name();
            let what = format!("{} in {format}: {} ({done} of {total})", policy.name, claim.name);
            (watch.say)(Next {
                what: &what,
                done,
                all: total,
            });
        });
        if watch.stop.load(std::sync::atomic::Ordering::Relaxed) {
            return Err(Stopped);
        }
        Ok(answers.into_iter().map(|answer| claim(task, answer)).collect())
    }
}

/// The goals about a policy's generated C and Rust, as SMT-LIB 2.
///
/// # Errors
/// Why there are none: what cannot be generated, or a place in the code that is not read.
pub fn goals(task: Task<'_>) -> Result<Vec<Goal>, String> {
    let files = codegen::sources(task.policy, task.target, &[Output::C, Output::Rust], None);
    let files = files.map_err(|error| error.to_string())?.files;
    let sources = sources(&files).ok_or("the generated files have other names than a header, C and Rust")?;
    equivalence::goals(task.policy, &sources).map_err(|refusal| refusal.to_string())
}

fn sources(files: &BTreeMap<String, String>) -> Option<Sources<'_>> {
    let named = |end: &str| {
        let (name, text) = files.iter().find(|(name, _)| name.ends_with(end))?;
        Some(Source { name, text })
    };
    Some(Sources {
        c: Some((named(".h")?, named(".c")?)),
        readings: &[Reading::Compiler, Reading::FramaC],
        rust: Some(named(".rs")?),
    })
}

fn not_run(task: Task<'_>, why: &str) -> Claim {
    Claim {
        prover: NAME,
        name: NAME.to_owned(),
        text: "The emitted C and Rust do what the contract says.".to_owned(),
        subject: SUBJECT.to_owned(),
        format: task.policy.numeric_format,
        settings: Vec::new(),
        verdict: Verdict::NotRun,
        reason: why.to_owned(),
        seconds: 0.0,
        tool: String::new(),
        details: Vec::new(),
    }
}

fn claim(task: Task<'_>, answer: equivalence::Claim) -> Claim {
    let (verdict, reason, details) = match answer.verdict {
        equivalence::Verdict::Proved => (Verdict::Proved, String::new(), Vec::new()),
        equivalence::Verdict::Refuted(values) => (Verdict::Refuted, String::new(), values),
        equivalence::Verdict::Unknown(why) => (Verdict::Unproven, why, Vec::new()),
        equivalence::Verdict::NotRun(why) => (Verdict::NotRun, why, Vec::new()),
    };
    Claim {
        name: answer.name,
        text: answer.claim,
        verdict,
        reason,
        seconds: answer.seconds,
        tool: answer.solver,
        details,
        ..not_run(task, "")
    }
}

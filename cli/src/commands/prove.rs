//! `policyc prove`

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::Ordering;

use prove::{Answer, Next, Task, Watch, page, provers};

use super::progress_line::{Pace, ProgressLine};
use crate::arguments::Prove;
use crate::failure::Failure;
use crate::interruption;
use crate::made;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

/// A line whose time left is that of the prover at hand: how many pieces the next one has is not known before it begins.
struct Stages {
    line: ProgressLine,
    pace: Pace,
    /// Pieces of the stage at hand.
    all: usize,
}

impl Stages {
    fn new() -> Self {
        Self {
            line: ProgressLine::new(),
            pace: Pace::new(),
            all: 0,
        }
    }

    fn show(&mut self, next: Next<'_>) {
        if next.all != self.all || next.done == 0 {
            (self.pace, self.all) = (Pace::new(), next.all);
        }
        let pace = self.pace;
        self.line
            .show(|| format!("{}{}", next.what, pace.left(next.done as u64, next.all as u64)));
    }
}

/// Proves, draws, writes.
pub fn run(options: &Prove) -> Result<Outcome, Failure> {
    let stop = interruption::stop_on_signal();
    let target = codegen::target(&options.target)?;
    let policy = super::load_several_as(&options.policy, options.outside, None)?;
    let policies = match options.format.as_slice() {
        [] => vec![policy],
        formats => formats
            .iter()
            .map(|format| policy.clone().with_format(*format))
            .collect(),
    };
    for policy in &policies {
        // what cannot be generated is bad input here, and nothing was proved of it
        codegen::sources(policy, target, &[codegen::Output::C], None)?;
    }
    let tasks: Vec<Task<'_>> = policies.iter().map(|policy| Task { policy, target }).collect();
    let line = Mutex::new(Stages::new());
    let say = |next: Next<'_>| {
        let mut line = line.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        line.show(next);
    };
    let watch = Watch { say: &say, stop: &stop };
    let claims = prove::run(&tasks, &provers(options.exhaustive), &watch);
    line.lock()
        .unwrap_or_else(std::sync::PoisonError::into_inner)
        .line
        .clear();
    let (Ok(claims), false) = (claims, stop.load(Ordering::Relaxed)) else {
        talk::interrupted("nothing written");
        return Ok(Outcome::Interrupted);
    };
    let answer = Answer::new(&tasks, claims);
    let mut json = serde_json::to_string_pretty(&answer)?;
    json.push('\n');
    let mut files = BTreeMap::from([
        ("proof.json".to_owned(), json),
        ("proof.html".to_owned(), page::page(&answer)?),
    ]);
    let read = [("policy", options.policy.display().to_string())];
    made::signed(&mut files, &[("--out", "proof")], &read)?;
    for task in tasks.iter().filter(|_| options.goals) {
        // where the code is not read there are none, and the claims say so
        for goal in prove::smt::goals(*task).unwrap_or_default() {
            let name = format!("{}-{}.smt2", task.policy.numeric_format.name(), goal.name);
            files.insert(name, goal.text);
        }
    }
    output::replace_own_texts(&options.out, &files, options.replacing)?;
    output::say(&page::summary(&answer))?;
    output::say(&format!("to look at: {}", options.out.join("proof.html").display()))?;
    Ok(if answer.clears() {
        Outcome::Done
    } else {
        Outcome::Different
    })
}

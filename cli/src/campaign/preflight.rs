//! What can be known to be wrong before anything runs.

use std::collections::BTreeSet;
use std::ffi::OsString;

use campaign::{Plan, Task};
use toml_input::{Fault, Message, Sink};

use super::perform::parsed;
use crate::arguments::Command;
use crate::commands::{self, diagnose, simulate, train, verify};
use crate::failure::Failure;

/// Options whose numbers the plan has read already: a task for each of them is no other command line.
const COUNTED: [&str; 4] = ["--seeds", "--seed", "--steps", "--shard"];

/// Reads the command lines of tasks and every file that they name, each combination once: a slip that would fail after hours is said
/// now.
///
/// # Errors
/// All faults.
pub fn check(plan: &Plan, pending: &[usize]) -> Result<(), Failure> {
    let mut faults = Sink::new();
    let mut known: Vec<Fault> = Vec::new();
    let mut lines = BTreeSet::new();
    for index in pending.iter().copied() {
        let Some(task) = plan.tasks.get(index) else { continue };
        let line = here(task);
        if !lines.insert(shape(&line)) {
            continue;
        }
        match parsed(&line) {
            Ok(arguments) => {
                if let Err(Failure(found)) = read(&arguments.command) {
                    // several lines name one file, and what is wrong with it is said once
                    let mut list = found.list;
                    list.retain(|fault| !known.contains(fault));
                    known.extend(list.iter().cloned());
                    faults.extend(list);
                }
            }
            Err(Failure(found)) => {
                for fault in &found {
                    let message = Message::new(fault.problem.replace('\n', " "));
                    faults.push(plan.fault(index, message));
                }
            }
        }
    }
    Ok(faults.propagate()?)
}

/// The command line of a task with its files where they are here.
fn here(task: &Task) -> Vec<OsString> {
    let mut named = task.named.iter();
    let word = |word: &String| match task.inputs.contains_key(word) {
        true => named.next().map_or(OsString::new(), |file| file.path.clone().into()),
        false => word.into(),
    };
    task.arguments.iter().map(word).collect()
}

fn shape(line: &[OsString]) -> Vec<OsString> {
    let counted = |at: usize| at.checked_sub(1).and_then(|before| line.get(before));
    let is_counted = |at: usize| counted(at).is_some_and(|before| COUNTED.iter().any(|option| before == option));
    let words = line.iter().enumerate();
    words
        .filter(|(at, _)| !is_counted(*at))
        .map(|(_, word)| word.clone())
        .collect()
}

fn read(command: &Command) -> Result<(), Failure> {
    match command {
        Command::Train(options) => train::check(options),
        Command::Simulate(options) => simulate::check(options),
        Command::Diagnose(options) => diagnose::check(options),
        Command::Verify(options) => verify::check(options),
        Command::Certify(options) => {
            commands::load_several_as(&options.policy, options.outside, options.format).map(|_| ())
        }
        Command::Prove(options) => {
            let format = options.format.first().copied();
            commands::load_several_as(&options.policy, options.outside, format).map(|_| ())
        }
        // no task is one of the others
        _ => Ok(()),
    }
}

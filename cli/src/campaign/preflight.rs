//! What can be known to be wrong before anything runs.

use std::collections::BTreeSet;
use std::path::Path;

use campaign::{Kind, Plan, Task};
use closed_loop::Scenario;
use plant::Parameters;
use toml_input::{FileName, Sink};
use train::{Contract, Converter, Settings};

use super::perform::parsed;
use crate::arguments::Outside;
use crate::commands;
use crate::failure::Failure;

/// Reads the command lines of tasks, and the files that they name, each once: a slip that would fail after hours is said now.
///
/// # Errors
/// All faults.
pub fn check(plan: &Plan, pending: &[usize]) -> Result<(), Failure> {
    let mut faults = Sink::new();
    let mut lines: BTreeSet<Vec<&str>> = BTreeSet::new();
    let mut files = BTreeSet::new();
    for index in pending.iter().copied() {
        let Some(task) = plan.tasks.get(index) else { continue };
        // seeds and shards are numbers already
        let words: Vec<&str> = task.arguments.iter().map(|word| shape(word)).collect();
        if lines.insert(words)
            && let Err(Failure(found)) = parsed(&task.arguments)
        {
            for fault in &found {
                let message = toml_input::Message::new(fault.problem.replace('\n', " "));
                faults.push(plan.fault(index, message));
            }
        }
        let paths: Vec<&Path> = task.named.iter().map(|file| file.path.as_path()).collect();
        if files.insert((task.kind, paths))
            && let Err(Failure(found)) = read(task)
        {
            faults.extend(found.list);
        }
    }
    Ok(faults.propagate()?)
}

fn shape(word: &str) -> &str {
    match word.bytes().all(|byte| byte.is_ascii_digit() || byte == b'/') {
        true => "0",
        false => word,
    }
}

fn read(task: &Task) -> Result<(), Failure> {
    let allow_outside = task.arguments.iter().any(|word| word == "--allow-outside");
    let policy = |file: &FileName| commands::load_as(&file.path, Outside { allow_outside }, None).map(|_| ());
    match (task.kind, task.named.as_slice()) {
        (Kind::Train, [settings, ..]) => {
            let settings = Settings::load(&settings.path)?;
            Contract::load(&settings.contract, &settings.hidden)?;
            Converter::load(FileName::named_by_a_file(&settings.plant), &settings.set)?;
            Ok(())
        }
        (Kind::Simulate, [scenario, own, ..]) => {
            Scenario::load(&scenario.path)?;
            policy(own)
        }
        (Kind::Diagnose, [model, ..]) => {
            Parameters::buck_from_file(&model.path, "`diagnose`")?;
            Ok(())
        }
        (Kind::Verify | Kind::Certify | Kind::Prove, [own, ..]) => policy(own),
        // what lacks a file was refused with the plan
        _ => Ok(()),
    }
}

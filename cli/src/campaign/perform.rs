//! One task, in the process that calls.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use campaign::{BUILD, Kind};
use clap::Parser;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use toml_input::Message;

use super::folders;
use crate::arguments::{Arguments, Command};
use crate::failure::Failure;
use crate::interruption;
use crate::made;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

/// How a command ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Performed {
    /// Its exit code.
    pub exit: u8,
    /// What it said.
    pub answer: String,
    /// Why it could not be done; with exit code 2 alone.
    pub reason: Option<String>,
}

impl Performed {
    /// Of a task that another build has named.
    pub fn refused(build: &str) -> Self {
        let message = Message::new("the worker is of another build than the campaign");
        let message = message.found(BUILD).expected(build);
        let Failure(faults) = Failure::from(message.hint("run it again: policyc was replaced in the meantime"));
        Self {
            exit: 2,
            answer: String::new(),
            reason: Some(faults.to_string().trim_end().to_owned()),
        }
    }

    /// Whether there is a result, be it a no.
    pub fn is_done(&self) -> bool {
        self.exit == Outcome::Done as u8 || self.exit == Outcome::Different as u8
    }
}

/// Runs a command line in a folder. Changes the process's working folder: paths in results and faults are to be those of the task, and
/// not of the machine.
pub fn perform_in(folder: &Path, arguments: &[String]) -> Performed {
    let mut is_alone = false;
    let line = arguments.iter().map(std::ffi::OsString::from).collect::<Vec<_>>();
    let performed = std::env::set_current_dir(folder)
        .map_err(|error| folders::cannot("work in", folder, &error))
        .and_then(|()| parsed(arguments))
        .map(|arguments| {
            is_alone = starts_no_program(&arguments.command);
            talk::set(arguments.loudness);
            made::heed(line);
            output::keep_answers(|| crate::dispatch(&arguments.command))
        });
    let (result, answer) = match performed {
        Ok((result, answer)) => (result, answer),
        Err(failure) => (Err(failure), String::new()),
    };
    let (exit, reason) = match result {
        // whatever else it says may have come of the signal, which compilers and provers got, too
        Ok(outcome) if is_alone => (outcome as u8, None),
        _ if interruption::is_stopped() => (Outcome::Interrupted as u8, None),
        Ok(outcome) => (outcome as u8, None),
        Err(Failure(faults)) => (2, Some(faults.to_string().trim_end().to_owned())),
    };
    Performed { exit, answer, reason }
}

/// Commands that end on their own or with an error when a signal comes: what they have answered is true.
fn starts_no_program(command: &Command) -> bool {
    matches!(command, Command::Train(_) | Command::Certify(_) | Command::Diagnose(_))
}

/// The working folder and the kept answers are the process's: tasks of two threads would mix theirs.
static ALONE: Mutex<()> = Mutex::new(());

/// Goes back to the folder in which the process was, whatever happens in the other.
struct WorkingFolder(PathBuf);

impl Drop for WorkingFolder {
    fn drop(&mut self) {
        // it is where it was a moment ago, or gone
        let _ = std::env::set_current_dir(&self.0);
    }
}

/// A task that came from another machine with its inputs, in a folder that goes again: how it ended, and its files.
///
/// # Errors
/// If the folder cannot be made, or a file not be read.
pub fn perform(
    kind: Kind,
    arguments: &[String],
    inputs: &BTreeMap<String, Vec<u8>>,
) -> Result<(Performed, BTreeMap<String, Vec<u8>>), Failure> {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = tempfile::Builder::new().prefix("policyc-task-").tempdir()?;
    folders::write(folder.path(), inputs)?;
    let before = WorkingFolder(std::env::current_dir()?);
    let performed = perform_in(folder.path(), arguments);
    drop(before);
    let files = match performed.is_done() {
        true => collect(folder.path(), kind, &performed)?,
        false => BTreeMap::new(),
    };
    Ok((performed, files))
}

/// A command line behind `policyc`.
pub fn parsed<S: AsRef<OsStr>>(arguments: &[S]) -> Result<Arguments, Failure> {
    let line = std::iter::once(OsStr::new("policyc")).chain(arguments.iter().map(S::as_ref));
    Arguments::try_parse_from(line).map_err(|error| {
        let text = error.to_string();
        // the rest is how to call the command
        let first = text.split("\n\n").next().unwrap_or_default();
        Message::new(first.trim_start_matches("error: ").trim_end()).into()
    })
}

/// Keys of answers that say where or when, and not what.
const OF_THE_RUN: [&str; 4] = ["out", "files", "seconds", "resume"];

/// The files of a task that was performed in `folder`, without what another run would write otherwise.
///
/// # Errors
/// If a file cannot be read.
pub fn collect(folder: &Path, kind: Kind, performed: &Performed) -> Result<BTreeMap<String, Vec<u8>>, Failure> {
    let mut files = folders::read(&folder.join("out"))?;
    match kind {
        // the best of one seed is that seed
        Kind::Train => files.retain(|name, _| !name.starts_with("seeds/")),
        Kind::Prove => {
            // its page has the seconds of each prover, which `proof.json` can do without
            files.remove("proof.html");
            if let Some(proof) = files.get_mut("proof.json") {
                let mut value: Value = serde_json::from_slice(proof)?;
                without(&mut value, &["seconds"]);
                *proof = text(&value)?;
            }
        }
        _ => {}
    }
    match serde_json::from_str::<Value>(&performed.answer) {
        Ok(mut value @ Value::Object(_)) => {
            without(&mut value, &OF_THE_RUN);
            files.insert("answer.json".to_owned(), text(&value)?);
        }
        _ => {
            let lines = performed.answer.lines().filter(|line| !line.contains("to look at: "));
            let said = lines.collect::<Vec<_>>().join("\n").trim_end().to_owned();
            if !said.is_empty() {
                files.insert("answer.txt".to_owned(), (said + "\n").into_bytes());
            }
        }
    }
    Ok(files)
}

fn text(value: &Value) -> Result<Vec<u8>, Failure> {
    Ok((serde_json::to_string_pretty(value)? + "\n").into_bytes())
}

/// Takes keys out of a value, however deep they lie.
fn without(value: &mut Value, keys: &[&str]) {
    match value {
        Value::Object(map) => {
            map.retain(|key, _| !keys.contains(&key.as_str()));
            map.values_mut().for_each(|value| without(value, keys));
        }
        Value::Array(items) => items.iter_mut().for_each(|value| without(value, keys)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_another_run_would_say_otherwise_is_left_out() {
        let mut value: Value = serde_json::json!({ "seconds": 1.5, "claims": [{ "seconds": 2, "verdict": "proved" }] });
        without(&mut value, &OF_THE_RUN);
        assert_eq!(value, serde_json::json!({ "claims": [{ "verdict": "proved" }] }));
    }

    #[test]
    fn a_line_that_is_none_is_a_message_of_one_paragraph() {
        let Err(Failure(faults)) = parsed(&["certify", "a", "--format", "f61"]) else {
            panic!("must fail")
        };
        let text = faults.to_string();
        assert!(text.contains("f61") && !text.contains("Usage"), "{text}");
    }
}

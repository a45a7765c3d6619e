//! The test programs of the workspace, two at a time: several end with one long test, and a program alone leaves the other
//! core idle then. Most of the time goes to compilers and emulators, so two lanes are quicker by that alone.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::process::{self, Output};

/// Programs that run at the same time.
const LANES: usize = 2;

/// Those that take minutes start first, so that none of them is left running alone at the end. Measured, longest first.
const LONG: [&str; 5] = ["on_target", "differential", "book", "integrations", "cli"];

/// A program that takes longer is worth a line at the end.
const LONG_SECONDS: f64 = 30.0;

/// One call of `cargo test`.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    name: String,
    selection: Vec<String>,
}

impl Program {
    fn new(name: &str, selection: &[&str]) -> Self {
        Self {
            name: name.into(),
            selection: selection.iter().map(ToString::to_string).collect(),
        }
    }
}

/// A call for each name of an integration test (two crates may share one), one for all unit tests, one for the
/// examples in the documentation.
pub fn all<'a>(tests: impl Iterator<Item = &'a str>) -> Vec<Program> {
    let mut names: Vec<&str> = tests.collect();
    names.sort_unstable();
    names.dedup();
    names.sort_by_key(|name| LONG.iter().position(|long| long == name).unwrap_or(LONG.len()));
    let at = names.iter().filter(|name| LONG.contains(name)).count();
    let mut programs: Vec<Program> = names.iter().map(|name| Program::new(name, &["--test", name])).collect();
    programs.insert(at, Program::new("documentation", &["--doc"]));
    programs.insert(at, Program::new("units", &["--lib", "--bins"]));
    programs
}

/// How one call ended.
struct Ended {
    name: String,
    seconds: f64,
    log: String,
    fault: Option<String>,
}

/// Runs all programs, also after a failing one, each into a log of its own beside `log`; appends each log to `log`
/// when its program has ended. Returns what is worth showing.
///
/// # Errors
/// The telling lines of every program that failed or was stopped after `limit`, which counts from the first start.
pub fn run(
    programs: Vec<Program>,
    command: impl Fn(&[String]) -> Command + Sync,
    log: &Path,
    limit: Duration,
) -> Result<Vec<String>, String> {
    let started = Instant::now();
    let waiting = Mutex::new(VecDeque::from(programs));
    let ended = Mutex::new(Vec::new());
    // a call of its own: in the head of the loop the guard would live as long as the turn
    let next = || locked(&waiting).pop_front();
    std::thread::scope(|scope| {
        for _ in 0..LANES {
            scope.spawn(|| {
                while let Some(program) = next() {
                    let left = limit.saturating_sub(started.elapsed());
                    let result = run_one(&program, &command, log, left);
                    append(log, &result);
                    locked(&ended).push(result);
                }
            });
        }
    });
    let ended = ended.into_inner().unwrap_or_else(PoisonError::into_inner);
    let faults: Vec<&str> = ended.iter().filter_map(|one| one.fault.as_deref()).collect();
    match faults.is_empty() {
        true => Ok(notes(&ended)),
        false => Err(faults.join("\n\n")),
    }
}

fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn run_one(program: &Program, command: impl Fn(&[String]) -> Command, log: &Path, limit: Duration) -> Ended {
    let started = Instant::now();
    let own = own_log(log, &program.name);
    let fault = match std::fs::write(&own, "") {
        Ok(()) => process::run_within(&mut command(&program.selection), &Output::Log(own.clone()), limit).err(),
        Err(e) => Some(format!("cannot write the log {}: {e}", own.display())),
    };
    Ended {
        name: program.name.clone(),
        seconds: started.elapsed().as_secs_f64(),
        log: process::read_lossy(&own),
        fault,
    }
}

fn own_log(log: &Path, name: &str) -> PathBuf {
    log.with_file_name(format!("test-{name}.log"))
}

/// The last line is what the heartbeat shows.
fn append(log: &Path, ended: &Ended) {
    use std::io::Write;
    let word = if ended.fault.is_some() { "FAILED" } else { "ok" };
    let line = format!("{}: {word} {:.0} s", ended.name, ended.seconds);
    if let Ok(mut file) = std::fs::OpenOptions::new().append(true).open(log) {
        // the program's own log has it all; this one is for reading on
        let _ = writeln!(file, "{}\n{line}", ended.log);
    }
}

fn notes(ended: &[Ended]) -> Vec<String> {
    let mut notes = vec![test_count(ended.iter().map(|one| one.log.as_str()))];
    let mut long: Vec<&Ended> = ended.iter().filter(|one| one.seconds > LONG_SECONDS).collect();
    long.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    notes.extend(long.iter().map(|one| format!("{:6.0} s {}", one.seconds, one.name)));
    notes
}

/// Sums the `test result:` lines of libtest.
pub fn test_count<'a>(logs: impl Iterator<Item = &'a str>) -> String {
    let (mut passed, mut ignored) = (0, 0);
    for line in logs.flat_map(str::lines).filter(|l| l.starts_with("test result:")) {
        for part in line.split(['.', ';']) {
            let mut words = part.split_whitespace();
            let count = words.next().and_then(|word| word.parse::<usize>().ok());
            match (count, words.next()) {
                (Some(count), Some("passed")) => passed += count,
                (Some(count), Some("ignored")) => ignored += count,
                _ => {}
            }
        }
    }
    format!("{passed} tests passed, {ignored} ignored")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libtest_results_are_summed() {
        let log = "\
test result: ok. 12 passed; 0 failed; 1 ignored; 0 measured; 0 filtered out; finished in 0.00s
test result: FAILED. 3 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.1s
";
        assert_eq!(test_count([log, log].into_iter()), "30 tests passed, 2 ignored");
    }

    #[test]
    fn every_program_is_called_once_and_the_long_ones_first() {
        let programs = all(["ui", "book", "ui", "on_target"].into_iter());
        let names: Vec<&str> = programs.iter().map(|program| program.name.as_str()).collect();
        assert_eq!(names, ["on_target", "book", "units", "documentation", "ui"]);
        assert_eq!(programs[4].selection, ["--test", "ui"]);
    }

    fn run_in_shell(script: &str, names: [&str; 3]) -> (Result<Vec<String>, String>, String) {
        let folder = std::env::temp_dir().join(format!("xtask-programs-{}-{}", std::process::id(), names[0]));
        std::fs::create_dir_all(&folder).unwrap();
        let log = folder.join("test.log");
        std::fs::write(&log, "").unwrap();
        let programs = names.map(|name| Program::new(name, &[name])).to_vec();
        let shell = |arguments: &[String]| {
            let mut command = Command::new("sh");
            command.args(["-c", script, &arguments[0]]).current_dir(&folder);
            command
        };
        let result = run(programs, shell, &log, Duration::from_secs(60));
        let text = process::read_lossy(&log);
        std::fs::remove_dir_all(&folder).unwrap();
        (result, text)
    }

    #[test]
    fn every_program_runs_and_what_failed_is_told() {
        let (result, text) = run_in_shell("echo $0 speaks; test $0 != b", ["a", "b", "c"]);
        let fault = result.unwrap_err();
        assert!(fault.contains("b speaks") && !fault.contains("a speaks"), "{fault}");
        assert!(text.contains("c speaks") && text.contains("b: FAILED"), "{text}");
    }

    #[test]
    fn two_programs_run_at_the_same_time() {
        // the first ends when the second has begun
        let wait =
            "touch $0.here; test $0 != first || timeout 20 sh -c 'until [ -e second.here ]; do sleep 0.05; done'";
        let (result, _) = run_in_shell(wait, ["first", "second", "third"]);
        assert_eq!(result.unwrap(), ["0 tests passed, 0 ignored"]);
    }
}

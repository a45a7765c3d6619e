//! Running a test under a mutant, with a limit of what it computes and of memory.

use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::programs::Test;

/// A test under a mutant that takes more memory than this grows without bound: the greatest takes .4 GB.
const MEMORY: u64 = 3 << 30;

/// A test that takes so many times its limit by the clock, and did not compute that long, stands still.
const STILL: u32 = 20;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// Every test passed.
    Passed,
    /// A test failed, or the program died.
    Failed,
    /// It was stopped: it computed too long. How long it waited for a busy machine does not count.
    Looped,
    /// It was stopped: it neither ended nor computed. A mutant may be the reason or not.
    Stuck,
    /// It was stopped: it took too much memory.
    Grew,
}

/// What a run needs to know of the mutant.
#[derive(Clone, Copy, Debug)]
pub enum Switched<'a> {
    /// None is on; the numbers of those that were asked are appended to this file.
    Asked(&'a Path),
    /// This one.
    On(usize),
    /// None is on.
    Off,
}

/// Runs it; also says how long it took.
///
/// # Errors
/// The program cannot be started.
pub fn run(test: &Test, switched: Switched, limit: Duration) -> Result<(End, Duration), String> {
    let mut command = Command::new(&test.path);
    command
        .args([&test.name, "--exact"])
        .current_dir(&test.folder)
        // one core: the machine has others to serve
        .env("RUST_TEST_THREADS", "1")
        .env("RUST_BACKTRACE", "0")
        .env("CARGO_TARGET_DIR", &test.target)
        .env_remove("POLICYC_BLESS")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        // a group of its own, so that compilers and what they built end with it
        .process_group(0);
    match switched {
        Switched::Asked(file) => command.env("MUTANTS_ASKED", file),
        Switched::On(number) => command.env("MUTANT", number.to_string()),
        Switched::Off => &mut command,
    };
    let started = Instant::now();
    let mut child = command
        .spawn()
        .map_err(|error| format!("{}: {error}", test.path.display()))?;
    let end = wait(&mut child, limit).map_err(|error| format!("{}: {error}", test.label()))?;
    Ok((end, started.elapsed()))
}

fn wait(child: &mut Child, limit: Duration) -> std::io::Result<End> {
    let started = Instant::now();
    let mut pause = Duration::from_millis(2);
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(if status.success() { End::Passed } else { End::Failed });
        }
        let waited = started.elapsed();
        let stopped = if waited > limit && computed(child.id()) > limit {
            Some(End::Looped)
        } else if waited > limit * STILL {
            Some(End::Stuck)
        } else if resident(child.id()) > MEMORY {
            Some(End::Grew)
        } else {
            None
        };
        if let Some(end) = stopped {
            let group = format!("-{}", child.id());
            Command::new("kill").args(["-KILL", "--", &group]).status()?;
            child.wait()?;
            return Ok(end);
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(200));
    }
}

/// What the processes of a group, and those that they waited for, have computed.
fn computed(group: u32) -> Duration {
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let texts = entries.filter_map(|entry| std::fs::read_to_string(entry.path().join("stat")).ok());
    let ticks: u64 = texts.filter_map(|text| ticks(&text, group)).sum();
    // Linux counts in hundredths for every program
    Duration::from_millis(10 * ticks)
}

/// Hundredths of a second of a process and of those that it waited for, if it is of this group; proc_pid_stat(5).
fn ticks(stat: &str, group: u32) -> Option<u64> {
    // the name before it may hold anything
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    if fields.get(2)?.parse() != Ok(group) {
        return None;
    }
    fields.get(11..15)?.iter().map(|field| field.parse::<u64>().ok()).sum()
}

/// Bytes in memory; 0 where the system does not tell.
fn resident(id: u32) -> u64 {
    let text = std::fs::read_to_string(format!("/proc/{id}/statm")).unwrap_or_default();
    let pages = text.split(' ').nth(1).and_then(|pages| pages.parse::<u64>().ok());
    pages.unwrap_or(0) * 4096
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a script that is called with the name of a test, as the program of a test is.
    fn shell(script: &str, limit: Duration) -> End {
        static NUMBER: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("mutants-run-{}-{number}", std::process::id()));
        std::fs::write(&path, script).unwrap();
        let test = Test {
            program: "sh".into(),
            name: path.to_str().unwrap().into(),
            path: "/bin/sh".into(),
            folder: "/".into(),
            target: "/".into(),
        };
        let end = run(&test, Switched::On(7), limit).unwrap().0;
        std::fs::remove_file(path).unwrap();
        end
    }

    #[test]
    fn a_run_passes_or_fails_and_sees_its_mutant() {
        assert_eq!(shell("[ $MUTANT = 7 ]", Duration::from_secs(20)), End::Passed);
        assert_eq!(shell("[ $MUTANT = 8 ]", Duration::from_secs(20)), End::Failed);
    }

    /// The loop is in a child, as in generated code that a test runs.
    #[test]
    fn what_computes_too_long_loops_and_what_waits_too_long_is_stuck() {
        assert_eq!(
            shell("sh -c 'while :; do :; done'; :", Duration::from_millis(300)),
            End::Looped
        );
        assert_eq!(shell("sleep 100", Duration::from_millis(50)), End::Stuck);
    }

    #[test]
    fn a_process_counts_for_its_group_with_those_that_it_waited_for() {
        let stat = "12 (a b) c) S 1 34 34 0 -1 4194560 9 9 9 9 5 6 70 800 20 0 1 0 99";
        assert_eq!(ticks(stat, 34), Some(881));
        assert_eq!(ticks(stat, 12), None);
    }
}

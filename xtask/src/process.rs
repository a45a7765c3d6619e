//! Child processes: on the terminal, or into a log whose telling part is shown on failure.

use std::fs::{File, OpenOptions};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Time that a command may take. All tests together take some forty minutes on two cores, and more where others work; what takes this
/// long hangs.
pub const LIMIT: Duration = Duration::from_secs(70 * 60);
const POLL: Duration = Duration::from_millis(50);
const TAIL_LINES: usize = 60;
const TELLING_LINES: usize = 40;
const PANIC_LINES: usize = 3;

/// Where a child's output goes.
pub enum Output {
    Terminal,
    /// Appended to this file.
    Log(PathBuf),
}

/// Runs a command to its end, no longer than [`LIMIT`].
///
/// # Errors
/// The command, how it ended and, with a log, the telling lines of it.
pub fn run(command: &mut Command, output: &Output) -> Result<(), String> {
    run_within(command, output, LIMIT)
}

/// [`run`] with another limit of time.
///
/// # Errors
/// As [`run`].
pub fn run_within(command: &mut Command, output: &Output, limit: Duration) -> Result<(), String> {
    let shown = shown(command);
    let start = match output {
        Output::Terminal => 0,
        Output::Log(path) => redirect(command, path)?,
    };
    match wait(command, limit) {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(failure(&format!("`{shown}`: {status}"), output, start)),
        Err(message) => Err(failure(&format!("`{shown}`: {message}"), output, start)),
    }
}

/// The command as one would type it.
pub fn shown(command: &Command) -> String {
    let program = Path::new(command.get_program());
    let program = program.file_name().unwrap_or(command.get_program());
    std::iter::once(program)
        .chain(command.get_args())
        .map(|word| word.to_string_lossy())
        .collect::<Vec<_>>()
        .join(" ")
}

/// The last line of a log that is not blank.
pub fn last_line(log: &Path) -> Option<String> {
    let text = read_lossy(log);
    let line = text.lines().rev().find(|line| !line.trim().is_empty())?;
    Some(line.trim().chars().take(100).collect())
}

/// A log's text; empty when there is none.
pub fn read_lossy(log: &Path) -> String {
    std::fs::read(log)
        .map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
        .unwrap_or_default()
}

/// Sends both streams to the log and returns its length so far, in bytes.
fn redirect(command: &mut Command, log: &Path) -> Result<usize, String> {
    let open = || -> std::io::Result<(File, File, usize)> {
        let out = OpenOptions::new().create(true).append(true).open(log)?;
        let err = out.try_clone()?;
        let length = out.metadata()?.len();
        Ok((out, err, usize::try_from(length).unwrap_or(0)))
    };
    let (out, err, start) = open().map_err(|e| format!("cannot write the log {}: {e}", log.display()))?;
    command.stdout(out).stderr(err);
    Ok(start)
}

fn wait(command: &mut Command, limit: Duration) -> Result<ExitStatus, String> {
    let mut child = command
        .stdin(Stdio::null())
        .spawn()
        .map_err(|e| format!("cannot start it: {e}"))?;
    let started = Instant::now();
    loop {
        if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
            return Ok(status);
        }
        if started.elapsed() > limit {
            child.kill().map_err(|e| e.to_string())?;
            child.wait().map_err(|e| e.to_string())?;
            return Err(format!("stopped after {} minutes", limit.as_secs() / 60));
        }
        std::thread::sleep(POLL);
    }
}

fn failure(message: &str, output: &Output, start: usize) -> String {
    let Output::Log(path) = output else {
        return message.into();
    };
    let log = read_lossy(path);
    let shown = excerpt(log.get(start..).unwrap_or(&log));
    format!("{message}\nlog: {}\n{shown}", path.display())
}

/// The end of a log, and before it the lines further up that name an error.
fn excerpt(log: &str) -> String {
    let lines: Vec<&str> = log.lines().collect();
    let (before, tail) = lines.split_at(lines.len().saturating_sub(TAIL_LINES));
    let telling = (0..before.len()).filter(|at| tells(before, *at));
    let mut shown: Vec<&str> = telling.take(TELLING_LINES).map(|at| before[at]).collect();
    if !before.is_empty() {
        shown.push("[...]");
    }
    shown.extend(tail);
    shown.join("\n")
}

/// A line that names an error, and what a panicking test says below its place.
fn tells(lines: &[&str], at: usize) -> bool {
    let panics = |line: &&str| line.contains(" panicked at ");
    let line = lines[at];
    let below_panic = lines[at.saturating_sub(PANIC_LINES)..=at].iter().any(panics);
    below_panic || line.starts_with("error") || line.ends_with("... FAILED")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn failure_shows_status_and_both_streams() {
        let log = std::env::temp_dir().join(format!("xtask-log-{}", std::process::id()));
        std::fs::write(&log, "an earlier command\n").unwrap();
        let script = "echo out; echo err >&2; exit 3";
        let message = run(&mut shell(script), &Output::Log(log.clone())).unwrap_err();
        std::fs::remove_file(&log).unwrap();
        assert!(message.contains("exit status: 3"), "{message}");
        assert!(message.ends_with("\nout\nerr"), "{message}");
        assert!(!message.contains("earlier"), "{message}");
    }

    #[test]
    fn a_missing_program_is_named() {
        let mut command = Command::new("no-such-program-here");
        let message = run(&mut command, &Output::Terminal).unwrap_err();
        assert!(message.contains("`no-such-program-here`"), "{message}");
    }

    #[test]
    fn excerpt_keeps_errors_above_the_tail() {
        let filler = "noise\n".repeat(100);
        let log = format!("error[E0308]: mismatched types\n{filler}the end");
        let shown = excerpt(&log);
        assert!(shown.starts_with("error[E0308]"));
        assert!(shown.ends_with("the end"));
        assert_eq!(shown.lines().count(), TAIL_LINES + 2);
        assert_eq!(excerpt("short"), "short");
    }

    #[test]
    fn excerpt_keeps_what_a_failed_assertion_compared() {
        let panic = "thread 'a' panicked at src/lib.rs:4:5:\nassertion failed\n  left: 1\n right: 2\n";
        let filler = "noise\n".repeat(100);
        assert!(excerpt(&format!("{filler}{panic}{filler}")).starts_with(panic));
    }
}

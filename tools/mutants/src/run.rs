//! Running a test program under a mutant, with a limit of time and of memory.

use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::programs::Program;

/// A program under a mutant that takes more memory than this grows without bound: the greatest takes .4 GB.
const MEMORY: u64 = 3 << 30;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// Every test passed.
    Passed,
    /// A test failed, or the program died.
    Failed,
    /// It was stopped: it took too long.
    Hung,
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
}

/// Runs it; also says how long it took.
///
/// # Errors
/// The program cannot be started.
pub fn run(program: &Program, switched: Switched, limit: Duration) -> Result<(End, Duration), String> {
    let mut command = Command::new(&program.path);
    command
        .args(&program.arguments)
        .current_dir(&program.folder)
        // one core: the machine has others to serve
        .env("RUST_TEST_THREADS", "1")
        .env("RUST_BACKTRACE", "0")
        .env_remove("POLICYC_BLESS")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        // a group of its own, so that compilers and what they built end with it
        .process_group(0);
    match switched {
        Switched::Asked(file) => command.env("MUTANTS_ASKED", file),
        Switched::On(number) => command.env("MUTANT", number.to_string()),
    };
    let started = Instant::now();
    let mut child = command
        .spawn()
        .map_err(|error| format!("{}: {error}", program.path.display()))?;
    let end = wait(&mut child, limit).map_err(|error| format!("{}: {error}", program.name))?;
    Ok((end, started.elapsed()))
}

fn wait(child: &mut Child, limit: Duration) -> std::io::Result<End> {
    let started = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(if status.success() { End::Passed } else { End::Failed });
        }
        let stopped = match (started.elapsed() > limit, resident(child.id()) > MEMORY) {
            (true, _) => Some(End::Hung),
            (_, true) => Some(End::Grew),
            _ => None,
        };
        if let Some(end) = stopped {
            let group = format!("-{}", child.id());
            Command::new("kill").args(["-KILL", "--", &group]).status()?;
            child.wait()?;
            return Ok(end);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
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

    fn shell(script: &str, seconds: u64) -> End {
        let program = Program {
            name: "sh".into(),
            path: "/bin/sh".into(),
            folder: "/".into(),
            arguments: vec!["-c".into(), script.into()],
        };
        run(&program, Switched::On(7), Duration::from_secs(seconds)).unwrap().0
    }

    #[test]
    fn a_run_passes_fails_or_hangs_and_sees_its_mutant() {
        assert_eq!(shell("[ $MUTANT = 7 ]", 20), End::Passed);
        assert_eq!(shell("[ $MUTANT = 8 ]", 20), End::Failed);
        assert_eq!(shell("sleep 100", 1), End::Hung);
    }
}

//! The campaign's end of a worker: its pipes, and what it said before it died.

use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use toml_input::Message;

use super::perform::Performed;
use super::session::Claim;
use super::worker::{ANSWER, Job, WORKER};
use crate::failure::Failure;

/// Workers that have been told to stop remove their temporary files within this time.
const PATIENCE: Duration = Duration::from_secs(12);

/// Text of a worker's standard error that is kept for the reason of its death.
const KEPT_BYTES: usize = 2000;

static PROGRAM: OnceLock<Vec<OsString>> = OnceLock::new();

/// How this program is started from the outside: for Python, whose executable is not `policyc`. The first call counts; without words
/// it is none.
pub fn set_program(words: Vec<OsString>) {
    if !words.is_empty() {
        let _ = PROGRAM.set(words);
    }
}

/// A worker at the other end of two pipes.
pub struct Hand {
    stdout: BufReader<ChildStdout>,
    child: Child,
    said: std::thread::JoinHandle<String>,
}

/// Where a thread's worker is found by whoever stops it.
pub type Seat = Mutex<Option<ChildStdin>>;

impl Hand {
    pub fn start(seat: &Seat) -> Result<Self, Failure> {
        let words = match PROGRAM.get() {
            Some(words) => words.clone(),
            None => vec![std::env::current_exe()?.into_os_string()],
        };
        let Some((program, arguments)) = words.split_first() else {
            return Err(Message::new("no program to start a worker with").into());
        };
        let mut command = Command::new(program);
        command.args(arguments).arg(WORKER);
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|error| {
            let shown = program.to_string_lossy();
            Failure::from(Message::new(format!("cannot start a worker, {shown}: {error}")))
        })?;
        let (Some(stdin), Some(stdout), Some(stderr)) = (child.stdin.take(), child.stdout.take(), child.stderr.take())
        else {
            return Err(Message::new("a worker was started without its pipes").into());
        };
        *locked(seat) = Some(stdin);
        Ok(Self {
            stdout: BufReader::new(stdout),
            child,
            said: std::thread::Builder::new().spawn(move || last_of(stderr))?,
        })
    }

    /// The answer; nothing if the worker died.
    pub fn perform(&mut self, claim: &Claim, arguments: &[String], seat: &Seat) -> Option<Performed> {
        let job = Job {
            build: campaign::BUILD.to_owned(),
            folder: claim.folder.clone(),
            arguments: arguments.to_vec(),
        };
        let line = serde_json::to_string(&job).ok()? + "\n";
        locked(seat).as_mut()?.write_all(line.as_bytes()).ok()?;
        loop {
            let mut line = Vec::new();
            if self.stdout.read_until(b'\n', &mut line).ok()? == 0 {
                return None;
            }
            if let Some(answer) = line.strip_prefix(ANSWER.as_bytes()) {
                return serde_json::from_slice(answer).ok();
            }
        }
    }

    /// Waits for the end of a worker whose standard input has ended; what it said last, behind a colon.
    pub fn end(mut self) -> String {
        let begun = Instant::now();
        let mut ended = self.child.try_wait();
        while matches!(ended, Ok(None)) && begun.elapsed() < PATIENCE {
            std::thread::sleep(Duration::from_millis(2));
            ended = self.child.try_wait();
        }
        if matches!(ended, Ok(None)) {
            let _ = self.child.kill();
        }
        let status = self.child.wait().map(|status| status.to_string()).unwrap_or_default();
        let said = self.said.join().unwrap_or_default();
        match said.trim() {
            "" => format!(" ({status})"),
            said => format!(" ({status}): {said}"),
        }
    }
}

fn last_of(mut stream: impl Read) -> String {
    let mut kept = Vec::new();
    let mut some = [0; 1024];
    while let Ok(count @ 1..) = stream.read(&mut some) {
        kept.extend_from_slice(&some[..count]);
        let beyond = kept.len().saturating_sub(KEPT_BYTES);
        kept.drain(..beyond);
    }
    String::from_utf8_lossy(&kept).into_owned()
}

pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

//! The local engine: some workers, each fed by a thread of its own.

use std::collections::VecDeque;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use campaign::{Done, Kind, Task};
use toml_input::Message;

use super::folders;
use super::perform::{Performed, collect};
use super::session::{Claim, Session};
use super::worker::{ANSWER, Job, WORKER};
use crate::failure::Failure;
use crate::outcome::Outcome;

/// Workers that die with a task before the task is blamed: a machine out of memory may kill one, and seldom three.
const ATTEMPTS: usize = 3;

/// Workers that have been told to stop remove their temporary files within this time.
const PATIENCE: Duration = Duration::from_secs(12);

/// How often the engine looks whether it is to stop. Nobody waits for it otherwise: threads are joined as they end.
const LOOK: Duration = Duration::from_millis(50);

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

/// What a campaign tells on its way.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// The task that has ended.
    pub task: &'a Task,
    /// Why it failed.
    pub reason: Option<&'a str>,
}

/// Runs tasks on this machine.
pub struct Local<'a> {
    /// Workers; 0: one a core.
    pub jobs: usize,
    /// Set by whoever has had enough.
    pub stop: &'a AtomicBool,
    /// Hears of each task that has ended.
    pub tell: &'a (dyn Fn(Progress<'_>) + Sync),
}

/// A worker at the other end of two pipes.
struct Hand {
    stdout: BufReader<ChildStdout>,
    child: Child,
    said: std::thread::JoinHandle<String>,
}

/// Where a thread's worker is found by whoever stops it.
type Seat = Mutex<Option<ChildStdin>>;

impl Local<'_> {
    /// Runs the tasks with these indices; the session holds what came of them.
    ///
    /// # Errors
    /// If a worker cannot be started, or a result not be written.
    pub fn run(&self, session: &Session, pending: Vec<usize>) -> Result<(), Failure> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let jobs = if self.jobs == 0 { cores } else { self.jobs }.min(pending.len());
        let queue = Mutex::new(VecDeque::from(pending));
        let failure: Mutex<Option<Failure>> = Mutex::new(None);
        let seats: Vec<Seat> = (0..jobs).map(|_| Mutex::new(None)).collect();
        let ended = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let work = |seat| {
                if let Err(found) = self.work(session, &queue, seat) {
                    locked(&failure).get_or_insert(found);
                    // what one cannot write, the others cannot either
                    locked(&queue).clear();
                }
            };
            let hands: Vec<_> = seats.iter().map(|seat| scope.spawn(move || work(seat))).collect();
            let (seats, ended, stop) = (&seats, &ended, self.stop);
            scope.spawn(move || {
                while !ended.load(Ordering::Relaxed) {
                    if stop.load(Ordering::Relaxed) {
                        // a worker whose standard input ends clears up and goes
                        seats.iter().for_each(|seat| drop(locked(seat).take()));
                    }
                    std::thread::sleep(LOOK);
                }
            });
            for hand in hands {
                let _ = hand.join();
            }
            ended.store(true, Ordering::Relaxed);
        });
        failure
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
            .map_or(Ok(()), Err)
    }

    /// One thread: tasks until there are no more.
    fn work(&self, session: &Session, queue: &Mutex<VecDeque<usize>>, seat: &Seat) -> Result<(), Failure> {
        let mut hand = None;
        loop {
            if self.stop.load(Ordering::Relaxed) {
                break;
            }
            let Some(index) = locked(queue).pop_front() else { break };
            let Some(task) = session.plan.tasks.get(index) else {
                continue;
            };
            let Some(claim) = session.claim(task)? else { continue };
            self.one(session, task, &claim, &mut hand, seat)?;
        }
        locked(seat).take();
        if let Some(hand) = hand {
            hand.end();
        }
        Ok(())
    }

    fn one(
        &self,
        session: &Session,
        task: &Task,
        claim: &Claim,
        hand: &mut Option<Hand>,
        seat: &Seat,
    ) -> Result<(), Failure> {
        let mut reason = String::new();
        for _ in 0..ATTEMPTS {
            if self.stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            let arguments = stage(task, claim)?;
            let worker = match hand {
                Some(worker) => worker,
                None => hand.insert(Hand::start(seat)?),
            };
            let performed = worker.perform(claim, &arguments, seat);
            if self.stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            match performed {
                Some(performed) if performed.is_done() => {
                    let files = collect(&claim.folder, task.kind, &performed)?;
                    session.store(&Done::new(task, performed.exit, files))?;
                    (self.tell)(Progress { task, reason: None });
                    return Ok(());
                }
                // a signal to the worker alone: as if it had died
                Some(performed) if performed.exit == Outcome::Interrupted as u8 => {
                    reason = "the worker was interrupted".to_owned();
                    locked(seat).take();
                    hand.take().map(Hand::end);
                }
                Some(_) if arguments.len() > task.arguments.len() => {
                    // what another version left cannot be gone on with
                    let _ = folders::remove(&claim.folder.join("out"));
                }
                Some(performed) => {
                    reason = performed
                        .reason
                        .unwrap_or_else(|| format!("exit code {}", performed.exit));
                    break;
                }
                None => {
                    locked(seat).take();
                    let said = hand.take().map(Hand::end).unwrap_or_default();
                    reason = format!("the worker ended in the midst of the task, {ATTEMPTS} times{said}");
                }
            }
        }
        session.fail(task, &reason)?;
        (self.tell)(Progress {
            task,
            reason: Some(&reason),
        });
        Ok(())
    }
}

/// Puts the inputs of a task into its folder; the command line, which goes on with a training that was interrupted there.
fn stage(task: &Task, claim: &Claim) -> Result<Vec<String>, Failure> {
    let folder = &claim.folder;
    let inputs = task.inputs.iter().map(|(path, content)| {
        // the folder of all inputs is the first part of their paths
        (
            path.strip_prefix("in/").unwrap_or(path).to_owned(),
            content.bytes.as_slice(),
        )
    });
    let inputs: Vec<(String, &[u8])> = inputs.collect();
    folders::write(&folder.join("in"), inputs.iter().map(|(path, bytes)| (path, *bytes)))?;
    let checkpoints = folder.join("out/checkpoints");
    let goes_on =
        task.kind == Kind::Train && std::fs::read_dir(checkpoints).is_ok_and(|mut entries| entries.any(is_checkpoint));
    let mut arguments = task.arguments.clone();
    match goes_on {
        true => arguments.push("--resume".to_owned()),
        false => {
            let out = folder.join("out");
            folders::remove(&out).map_err(|error| folders::cannot("remove", &out, &error))?;
        }
    }
    Ok(arguments)
}

fn is_checkpoint(entry: std::io::Result<std::fs::DirEntry>) -> bool {
    entry.is_ok_and(|entry| {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        name.starts_with("seed-") && name.ends_with(".bin")
    })
}

impl Hand {
    fn start(seat: &Seat) -> Result<Self, Failure> {
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
            said: std::thread::spawn(move || last_of(stderr)),
        })
    }

    /// The answer; nothing if the worker died.
    fn perform(&mut self, claim: &Claim, arguments: &[String], seat: &Seat) -> Option<Performed> {
        let job = Job {
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
    fn end(mut self) -> String {
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

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

//! The local engine: some workers, each fed by a thread of its own.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use campaign::{Done, Task};
use toml_input::{Message, messages};

use super::folders;
use super::hand::{Hand, Seat, locked};
use super::perform::{Performed, collect};
use super::session::{Asked, Claim, Session};
use super::stage::{is_refused, stage};
use crate::failure::Failure;
use crate::outcome::Outcome;

/// Workers that die with a task before the task is blamed: a machine out of memory may kill one, and seldom three.
const ATTEMPTS: usize = 3;

/// How often the engine looks whether it is to stop, and whether another process has ended a task. Nobody waits for it otherwise:
/// threads are joined as they end.
const LOOK: Duration = Duration::from_millis(50);

/// Most workers at a time: each has three pipes and two threads here.
pub const MOST_JOBS: usize = 1024;

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

/// Tasks by index, and whether another process was at work on one when it was asked for.
type Queue = Mutex<VecDeque<(usize, bool)>>;

impl Local<'_> {
    /// Runs the tasks with these indices, and waits for those on which another process is at work; the session holds what came of them.
    ///
    /// # Errors
    /// If a worker cannot be started, or a result not be written.
    pub fn run(&self, session: &Session, pending: Vec<usize>) -> Result<(), Failure> {
        if self.jobs > MOST_JOBS {
            return Err(messages::count("jobs at a time", self.jobs, 0, MOST_JOBS).into());
        }
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let jobs = if self.jobs == 0 { cores } else { self.jobs }.min(pending.len());
        let queue: Queue = Mutex::new(pending.into_iter().map(|index| (index, false)).collect());
        let failure: Mutex<Option<Failure>> = Mutex::new(None);
        let give_up = |found: Failure| {
            locked(&failure).get_or_insert(found);
            // what one cannot do, the others cannot either
            locked(&queue).clear();
        };
        let seats: Vec<Seat> = (0..jobs).map(|_| Mutex::new(None)).collect();
        let ended = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let work = |seat| self.work(session, &queue, seat).unwrap_or_else(give_up);
            let (seats, ended) = (&seats, &ended);
            let watcher = std::thread::Builder::new().spawn_scoped(scope, move || self.watch(seats, ended));
            let mut hands = Vec::new();
            match watcher {
                Ok(_) => {
                    for seat in seats {
                        match std::thread::Builder::new().spawn_scoped(scope, move || work(seat)) {
                            Ok(hand) => hands.push(hand),
                            Err(error) => give_up(no_thread(&error)),
                        }
                    }
                }
                Err(error) => give_up(no_thread(&error)),
            }
            for hand in hands {
                if hand.join().is_err() {
                    give_up(Message::new("a thread of the engine broke").into());
                }
            }
            ended.store(true, Ordering::Relaxed);
        });
        failure
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner)
            .map_or(Ok(()), Err)
    }

    /// Takes the standard input from the workers once it is to stop.
    fn watch(&self, seats: &[Seat], ended: &AtomicBool) {
        while !ended.load(Ordering::Relaxed) {
            if self.stop.load(Ordering::Relaxed) {
                // a worker whose standard input ends clears up and goes
                seats.iter().for_each(|seat| drop(locked(seat).take()));
            }
            std::thread::sleep(LOOK);
        }
    }

    /// One thread: tasks until there are no more.
    fn work(&self, session: &Session, queue: &Queue, seat: &Seat) -> Result<(), Failure> {
        let mut hand = None;
        let mut result = Ok(());
        while result.is_ok() && !self.stop.load(Ordering::Relaxed) {
            let Some((index, again)) = locked(queue).pop_front() else {
                break;
            };
            if again {
                std::thread::sleep(LOOK);
            }
            let Some(task) = session.plan.tasks.get(index) else {
                continue;
            };
            result = match session.claim(task, again) {
                Ok(Asked::Claimed(claim)) => self.one(session, task, &claim, &mut hand, seat),
                Ok(Asked::Busy) => {
                    locked(queue).push_back((index, true));
                    Ok(())
                }
                Ok(Asked::Ended) => {
                    let reason = session.reason(task);
                    let reason = reason.as_deref();
                    (self.tell)(Progress { task, reason });
                    Ok(())
                }
                Err(failure) => Err(failure),
            };
        }
        locked(seat).take();
        if let Some(hand) = hand {
            hand.end();
        }
        result
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
            let staged = stage(task, claim)?;
            let worker = match hand {
                Some(worker) => worker,
                None => hand.insert(Hand::start(seat)?),
            };
            let performed = worker.perform(claim, &staged.arguments, seat);
            // what is done is kept, however soon it is to stop
            if let Some(performed) = performed.as_ref().filter(|performed| performed.is_done()) {
                let files = collect(&claim.folder, task.kind, performed)?;
                session.store(&Done::new(task, performed.exit, files))?;
                (self.tell)(Progress { task, reason: None });
                return Ok(());
            }
            if self.stop.load(Ordering::Relaxed) {
                return Ok(());
            }
            match performed {
                // a signal to the worker alone: as if it had died
                Some(performed) if performed.exit == Outcome::Interrupted as u8 => {
                    reason = "the worker was interrupted".to_owned();
                    locked(seat).take();
                    hand.take().map(Hand::end);
                }
                Some(performed) => {
                    reason = told(performed);
                    if !staged.goes_on || !is_refused(&reason) {
                        break;
                    }
                    // damaged, or of others
                    let _ = folders::remove(&claim.folder.join("out"));
                }
                None => {
                    locked(seat).take();
                    let said = hand.take().map(Hand::end).unwrap_or_default();
                    reason = format!("the worker ended in the midst of the task, {ATTEMPTS} times{said}");
                }
            }
        }
        session.fail(task, &reason)?;
        let reason = Some(reason.as_str());
        (self.tell)(Progress { task, reason });
        Ok(())
    }
}

fn told(performed: Performed) -> String {
    let code = performed.exit;
    performed.reason.unwrap_or_else(|| format!("exit code {code}"))
}

fn no_thread(error: &std::io::Error) -> Failure {
    let message = Message::new(format!("cannot start a thread: {error}"));
    message.hint("--jobs with a smaller number").into()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::campaign::{set_program, tests::session};

    /// A worker that answers a moment after it is to stop.
    #[test]
    fn what_is_done_when_it_is_to_stop_is_kept() {
        let answer = r#"policyc-task {"exit":0,"answer":"{}","reason":null}"#;
        let script = format!("read line; sleep 1; echo '{answer}'");
        set_program(["sh", "-c", &script].map(Into::into).into());
        let (_folder, session) = session("[[simulate]]\nscenarios = \"a.toml\"\npolicies = \"a.toml\"\n");
        session.begin().unwrap();
        let stop = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(300));
                stop.store(true, Ordering::Relaxed);
            });
            let (stop, tell) = (&stop, &|_: Progress<'_>| {});
            let local = Local { jobs: 1, stop, tell };
            local.run(&session, vec![0]).unwrap();
        });
        assert!(session.is_done(&session.plan.tasks[0]));
    }
}

//! A plan and the folder of its results.

use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use campaign::{Done, Plan, State, Task};
use toml_input::Message;

use super::finish::{Finished, finish};
use super::folders;
use super::stage::{is_gone_on_with, keep_for_resuming};
use super::store::{Store, WORK};
use crate::failure::Failure;
use crate::ownership::Replacing;

/// A plan and the folder of its results.
pub struct Session {
    /// What is to be done.
    pub plan: Plan,
    store: Store,
    states: Mutex<BTreeMap<String, State>>,
}

/// What became of asking for a task.
pub enum Asked {
    /// Nobody else works on it while this is held.
    Claimed(Claim),
    /// Another process works on it.
    Busy,
    /// Another process has ended it by now.
    Ended,
}

/// A task that nobody else works on while this is held.
pub struct Claim {
    /// Where it runs; an absolute path.
    pub folder: PathBuf,
    _lock: Option<File>,
}

impl Session {
    /// Reads what the folder holds; writes nothing.
    ///
    /// # Errors
    /// If the folder holds something else than a campaign, or cannot be read.
    pub fn open(plan: Plan, out: &Path, replacing: Replacing) -> Result<Self, Failure> {
        let store = Store::open(out, replacing)?;
        let mut states = BTreeMap::new();
        for task in &plan.tasks {
            // what was edited or torn is no result: the task runs again
            if let Some(Ok(done)) = store.stored(&task.id)? {
                states.insert(task.id.clone(), state(&done));
            }
        }
        Ok(Self {
            plan,
            store,
            states: Mutex::new(states),
        })
    }

    /// Makes the folder and writes which tasks it is for.
    ///
    /// # Errors
    /// If it cannot be written, or somebody has files of their own where results are to be replaced.
    pub fn begin(&self) -> Result<(), Failure> {
        // now, and not after hours
        for index in self.pending() {
            if let Some(task) = self.plan.tasks.get(index) {
                self.store.check_task(&task.id)?;
            }
        }
        self.store.check_best()?;
        self.store.write_plan(&self.plan.schedule())
    }

    fn states(&self) -> MutexGuard<'_, BTreeMap<String, State>> {
        self.states.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a task has its result.
    #[must_use]
    pub fn is_done(&self, task: &Task) -> bool {
        matches!(self.states().get(&task.id), Some(State::Done { .. }))
    }

    /// Whether a task has its result for good.
    #[must_use]
    pub fn is_settled(&self, task: &Task) -> bool {
        self.states().get(&task.id).is_some_and(State::is_settled)
    }

    /// Indices of the tasks that have no result for good.
    #[must_use]
    pub fn pending(&self) -> Vec<usize> {
        let tasks = self.plan.tasks.iter().enumerate();
        tasks
            .filter(|(_, task)| !self.is_settled(task))
            .map(|(index, _)| index)
            .collect()
    }

    /// The task of that number, from 1, or name.
    ///
    /// # Errors
    /// If there is none.
    pub fn find(&self, text: &str) -> Result<usize, Failure> {
        let count = self.plan.tasks.len();
        let by_number = text.parse().ok().and_then(|number: usize| number.checked_sub(1));
        let found = by_number.filter(|index| *index < count);
        let found = found.or_else(|| self.plan.tasks.iter().position(|task| task.id == text));
        found.ok_or_else(|| {
            let message = Message::new("the plan has no such task").found(text);
            let message = message.expected(format!("1 to {count}, or a name"));
            message.hint("--list prints numbers and names").into()
        })
    }

    /// Takes a task. `again`: another process was at work on it before, and may have ended it.
    ///
    /// # Errors
    /// If the folders cannot be made.
    pub fn claim(&self, task: &Task, again: bool) -> Result<Asked, Failure> {
        let folder = self.store.out.join(WORK).join(&task.id);
        fs::create_dir_all(&folder).map_err(|error| folders::cannot("make the folder", &folder, &error))?;
        let lock = File::open(&folder).ok();
        match lock.as_ref().map(File::try_lock) {
            Some(Err(TryLockError::WouldBlock)) => return Ok(Asked::Busy),
            // where folders cannot be locked, the rename alone keeps results whole
            Some(Ok(()) | Err(TryLockError::Error(_))) | None => {}
        }
        if !folder.is_dir() {
            // it went with the process that held it, and the lock is of nothing
            return Ok(Asked::Busy);
        }
        if let Some(Ok(done)) = self.store.stored(&task.id)? {
            let state = state(&done);
            if state.is_settled() || again {
                self.states().insert(task.id.clone(), state);
                let _ = folders::remove(&folder);
                return Ok(Asked::Ended);
            }
        }
        match self.store.reason(&task.id) {
            Some(reason) if again => {
                self.states().insert(task.id.clone(), State::Failed(reason));
                return Ok(Asked::Ended);
            }
            // of an earlier run: whoever waits for this one must not take it for its outcome
            _ => self.store.forget_reason(&task.id),
        }
        Ok(Asked::Claimed(Claim { folder, _lock: lock }))
    }

    /// Keeps the result of a task.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn store(&self, done: &Done) -> Result<(), Failure> {
        let id = &done.record.id;
        self.store.keep(done)?;
        let _ = folders::remove(&self.store.out.join(WORK).join(id));
        self.store.forget_reason(id);
        self.states().insert(id.clone(), state(done));
        Ok(())
    }

    /// Keeps why a task has no result, and what it can be gone on with.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn fail(&self, task: &Task, reason: &str) -> Result<(), Failure> {
        let folder = self.store.out.join(WORK).join(&task.id);
        self.store.write_reason(&task.id, reason)?;
        match is_gone_on_with(task, &folder) {
            true => keep_for_resuming(&folder),
            false => {
                let _ = folders::remove(&folder);
            }
        }
        self.states().insert(task.id.clone(), State::Failed(reason.to_owned()));
        Ok(())
    }

    /// Why a task failed in this run.
    #[must_use]
    pub fn reason(&self, task: &Task) -> Option<String> {
        match self.states().get(&task.id) {
            Some(State::Failed(reason)) => Some(reason.clone()),
            _ => None,
        }
    }

    /// Merges: results, page, best policies.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn finish(&self) -> Result<Finished, Failure> {
        finish(&self.store, &self.plan.schedule(), self.states().clone())
    }
}

pub fn state(done: &Done) -> State {
    State::Done {
        exit: done.record.exit,
        figures: done.figures(),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use campaign::Done;
    use serde_json::json;

    use super::*;
    use crate::campaign::tests::session;

    const VERIFY: &str = "[[verify]]\npolicies = \"a.toml\"\n";

    fn skipped(session: &Session, program: &str) -> Done {
        let outcome = json!({ "result": "skipped", "missing": [{ "reason": format!("{program} is not on PATH") }] });
        let answer = json!({ "equal": true, "report": { "builds": [{ "outcome": outcome }] } });
        let files = BTreeMap::from([("answer.json".to_owned(), answer.to_string().into_bytes())]);
        Done::new(&session.plan.tasks[0], 0, files)
    }

    #[test]
    fn what_was_made_without_a_program_is_a_result_and_is_tried_again() {
        let (folder, first) = session(VERIFY);
        first.begin().unwrap();
        first.store(&skipped(&first, "clang")).unwrap();
        let plan = Plan::open(&folder.path().join("plan.toml")).unwrap();
        let second = Session::open(plan, &folder.path().join("out"), Replacing { force: false }).unwrap();
        let task = &second.plan.tasks[0];
        assert!(second.is_done(task) && second.pending() == [0]);
        assert!(matches!(second.claim(task, false).unwrap(), Asked::Claimed(_)));
        // another process that worked on it has made what it can
        assert!(matches!(second.claim(task, true).unwrap(), Asked::Ended));
        second.begin().unwrap();
        let whole = Done::new(task, 0, BTreeMap::new());
        second.store(&whole).unwrap();
        assert!(second.is_settled(task) && second.finish().unwrap().results.counts() == [1, 0, 0]);
        assert!(!folder.path().join("out/work").exists());
    }

    /// Of two machines the one that had more programs, in whatever order their folders come.
    #[test]
    fn of_two_results_the_one_that_lacks_less_is_merged() {
        let made = |programs: &[&str]| {
            let (folder, session) = session(VERIFY);
            session.begin().unwrap();
            let done = match programs {
                [] => Done::new(&session.plan.tasks[0], 0, BTreeMap::new()),
                [program, ..] => skipped(&session, program),
            };
            session.store(&done).unwrap();
            (folder.path().join("out"), done, folder)
        };
        let (clang, whole, gcc) = (made(&["clang"]), made(&[]), made(&["gcc"]));
        let merged = |folders: [&(PathBuf, Done, tempfile::TempDir); 3]| {
            let out = tempfile::tempdir().unwrap();
            let from = folders.map(|(out, ..)| out.clone());
            let merged = crate::campaign::merge(&from, out.path(), Replacing { force: false }).unwrap();
            assert!(merged.is_some());
            let id = &whole.1.record.id;
            crate::campaign::store::stored(out.path(), id)
                .unwrap()
                .unwrap()
                .unwrap()
        };
        assert_eq!(merged([&clang, &whole, &gcc]), whole.1);
        assert_eq!(merged([&gcc, &clang, &whole]), whole.1);
        let first = merged([&gcc, &clang, &clang]);
        assert!(first == merged([&clang, &gcc, &gcc]) && first.lacks().len() == 1);
    }

    #[test]
    fn two_drivers_that_have_the_same_result_both_keep_it() {
        let (folder, first) = session(VERIFY);
        let plan = Plan::open(&folder.path().join("plan.toml")).unwrap();
        let second = Session::open(plan, &folder.path().join("out"), Replacing { force: false }).unwrap();
        let done = Done::new(
            &first.plan.tasks[0],
            0,
            BTreeMap::from([("a".to_owned(), vec![0; 100_000])]),
        );
        std::thread::scope(|scope| {
            for session in [&first, &second] {
                let done = &done;
                scope.spawn(move || {
                    for _ in 0..50 {
                        session.store(done).unwrap();
                    }
                });
            }
        });
        assert_eq!(first.store.stored(&done.record.id).unwrap(), Some(Ok(done)));
    }
}

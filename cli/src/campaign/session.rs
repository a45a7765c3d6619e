//! The folder of a campaign.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use campaign::{Done, Listed, Plan, RECORD, Results, Schedule, State, Task};
use toml_input::Message;

use super::folders;
use crate::failure::Failure;
use crate::output;
use crate::ownership::Replacing;

const PLAN: &str = "plan.json";
/// A folder for each task that is done.
const TASKS: &str = "tasks";
/// Tasks under way. What an interrupted training left there is gone on with.
const WORK: &str = "work";
/// A text for each task that failed: why.
const FAILED: &str = "failed";
/// The policy of the best seed of each training file.
const BEST: &str = "best";

/// A plan and the folder of its results.
pub struct Session {
    /// What is to be done.
    pub plan: Plan,
    out: PathBuf,
    replacing: Replacing,
    states: Mutex<BTreeMap<String, State>>,
}

/// What a campaign came to.
pub struct Finished {
    /// All tasks.
    pub results: Results,
    /// Files that were written, from the folder of the campaign.
    pub files: Vec<String>,
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
        if !out.join(PLAN).is_file() {
            output::check_new_folder(out)?;
        }
        let out = std::path::absolute(out)?;
        let mut states = BTreeMap::new();
        for task in &plan.tasks {
            // what was edited or torn is no result: the task runs again
            if let Some(Ok(done)) = stored(&out, &task.id)? {
                states.insert(task.id.clone(), state(&done));
            }
        }
        Ok(Self {
            plan,
            out,
            replacing,
            states: Mutex::new(states),
        })
    }

    /// Makes the folder and writes which tasks it is for.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn begin(&self) -> Result<(), Failure> {
        let files = BTreeMap::from([(PLAN.to_owned(), self.plan.schedule().json())]);
        output::replace_own_texts(&self.out, &files, self.replacing)
    }

    fn states(&self) -> MutexGuard<'_, BTreeMap<String, State>> {
        self.states.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a task has its result.
    #[must_use]
    pub fn is_done(&self, task: &Task) -> bool {
        matches!(self.states().get(&task.id), Some(State::Done { .. }))
    }

    /// Indices of the tasks without a result.
    #[must_use]
    pub fn pending(&self) -> Vec<usize> {
        let tasks = self.plan.tasks.iter().enumerate();
        tasks
            .filter(|(_, task)| !self.is_done(task))
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

    /// Takes a task, unless another process works on it, or has done it by now.
    ///
    /// # Errors
    /// If the folders cannot be made.
    pub fn claim(&self, task: &Task) -> Result<Option<Claim>, Failure> {
        let folder = self.out.join(WORK).join(&task.id);
        fs::create_dir_all(&folder).map_err(|error| folders::cannot("make the folder", &folder, &error))?;
        let lock = File::open(&folder).ok();
        match lock.as_ref().map(File::try_lock) {
            Some(Err(TryLockError::WouldBlock)) => return Ok(None),
            // where folders cannot be locked, the rename alone keeps results whole
            Some(Ok(()) | Err(TryLockError::Error(_))) | None => {}
        }
        if let Some(Ok(done)) = stored(&self.out, &task.id)? {
            self.states().insert(task.id.clone(), state(&done));
            let _ = folders::remove(&folder);
            return Ok(None);
        }
        Ok(Some(Claim { folder, _lock: lock }))
    }

    /// Keeps the result of a task.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn store(&self, done: &Done) -> Result<(), Failure> {
        let id = &done.record.id;
        keep(&self.out, done)?;
        let _ = folders::remove(&self.out.join(WORK).join(id));
        let _ = fs::remove_file(self.reason_of(id));
        self.states().insert(id.clone(), state(done));
        Ok(())
    }

    /// Keeps why a task has no result.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn fail(&self, task: &Task, reason: &str) -> Result<(), Failure> {
        let _ = folders::remove(&self.out.join(WORK).join(&task.id));
        output::write_one(&self.reason_of(&task.id), &format!("{reason}\n"))?;
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

    fn reason_of(&self, id: &str) -> PathBuf {
        self.out.join(FAILED).join(format!("{id}.txt"))
    }

    /// Merges: results, page, best policies.
    ///
    /// # Errors
    /// If they cannot be written.
    pub fn finish(&self) -> Result<Finished, Failure> {
        finish(&self.out, &self.plan.schedule(), self.states().clone(), self.replacing)
    }
}

/// Puts the folders of campaigns together.
///
/// # Errors
/// If one is none, or two have different results for one task.
pub fn merge(from: &[PathBuf], out: &Path, replacing: Replacing) -> Result<Finished, Failure> {
    let mut schedule: Option<Schedule> = None;
    for folder in from {
        let read = schedule_of(folder)?;
        match &mut schedule {
            Some(schedule) => schedule.merge(read),
            None => schedule = Some(read),
        }
    }
    let Some(schedule) = schedule else {
        return Err(Message::new("no folder to merge").into());
    };
    if !out.join(PLAN).is_file() {
        output::check_new_folder(out)?;
    }
    let ids: BTreeSet<&String> = schedule.tasks.iter().map(|listed| &listed.id).collect();
    let mut states = BTreeMap::new();
    // the destination first: what it holds is not written again
    let out = std::path::absolute(out)?;
    let folders = std::iter::once(&out).chain(from);
    let folders: Vec<&PathBuf> = folders.collect();
    let mut kept: BTreeMap<&String, &Path> = BTreeMap::new();
    for folder in folders {
        for id in &ids {
            let Some(done) = stored(folder, id)? else { continue };
            let done = done.map_err(|message| message.found(folder.display().to_string()))?;
            match kept.get(id) {
                None => {
                    if folder != &out {
                        keep(&out, &done)?;
                    }
                    kept.insert(id, folder);
                    states.insert((*id).clone(), state(&done));
                }
                Some(first) => same(id, first, folder, &done)?,
            }
        }
    }
    for folder in from {
        for id in &ids {
            let reason = fs::read_to_string(folder.join(FAILED).join(format!("{id}.txt")));
            if let Ok(reason) = reason {
                let failed = State::Failed(reason.trim_end().to_owned());
                states.entry((*id).clone()).or_insert(failed);
            }
        }
    }
    let files = BTreeMap::from([(PLAN.to_owned(), schedule.json())]);
    output::replace_own_texts(&out, &files, replacing)?;
    finish(&out, &schedule, states, replacing)
}

/// Refuses two results of one task: one of the machines, or the version, is not what the other is.
fn same(id: &str, first: &Path, second: &Path, done: &Done) -> Result<(), Failure> {
    let Some(Ok(other)) = stored(first, id)? else {
        return Ok(());
    };
    if other.record == done.record {
        return Ok(());
    }
    let files = done.record.files.keys().chain(other.record.files.keys());
    let differs = |name: &&String| other.record.files.get(*name) != done.record.files.get(*name);
    let file = files.clone().find(differs).map_or(RECORD, String::as_str);
    let message = Message::new(format!("two folders have different results for {id}"));
    let message = message.found(format!("{file} in {} and in {}", first.display(), second.display()));
    Err(message
        .expected("the same bytes: version, arguments and files are the same")
        .hint("the machines differ: their compilers, or their processors in a training; leave one folder out")
        .into())
}

fn schedule_of(folder: &Path) -> Result<Schedule, Failure> {
    let path = folder.join(PLAN);
    let shown = folder.display();
    let text = fs::read(&path).map_err(|error| {
        let message = Message::new(format!(
            "{shown} is no folder of a campaign: cannot read {PLAN}: {error}"
        ));
        Failure::from(message.hint("name the folder that was --out of policyc campaign"))
    })?;
    serde_json::from_slice(&text).map_err(|error| {
        let message = Message::new(format!("{PLAN} of {shown} is none: {error}"));
        message.into()
    })
}

/// The result of a task in a folder, if there is one, or why it is none.
fn stored(out: &Path, id: &str) -> Result<Option<Result<Done, Message>>, Failure> {
    let folder = out.join(TASKS).join(id);
    if !folder.join(RECORD).is_file() {
        return Ok(None);
    }
    Ok(Some(Done::read(id, folders::read(&folder)?)))
}

fn keep(out: &Path, done: &Done) -> Result<(), Failure> {
    let id = &done.record.id;
    // beside its place, so that one rename puts it there
    let new = out.join(WORK).join(format!("{id}.new"));
    let files = done.folder();
    folders::write(&new, files.iter().map(|(name, bytes)| (name, bytes.as_slice())))?;
    folders::replace(&new, &out.join(TASKS).join(id))
}

fn state(done: &Done) -> State {
    State::Done {
        exit: done.record.exit,
        figures: done.figures(),
    }
}

fn finish(
    out: &Path,
    schedule: &Schedule,
    states: BTreeMap<String, State>,
    replacing: Replacing,
) -> Result<Finished, Failure> {
    let results = Results::new(schedule, states);
    let files = BTreeMap::from([
        ("results.json".to_owned(), results.json()),
        ("results.csv".to_owned(), results.csv()),
        ("report.html".to_owned(), results.page()?),
    ]);
    output::replace_own_texts(out, &files, replacing)?;
    let mut written: Vec<String> = files.into_keys().collect();
    let best = out.join(BEST);
    // a seed that was best once would leave its files under another's
    folders::remove(&best).map_err(|error| folders::cannot("replace", &best, &error))?;
    let mut taken = BTreeSet::new();
    for (listed, _) in results.best() {
        let Some(Ok(done)) = stored(out, &listed.id)? else {
            continue;
        };
        let name = unused(&folder_name(listed), &mut taken);
        let files = done.files.iter().filter(|(name, _)| name.as_str() != "answer.json");
        folders::write(&best.join(&name), files.map(|(name, bytes)| (name, bytes.as_slice())))?;
        written.push(format!("{BEST}/{name}"));
    }
    // empty once nothing is under way
    let _ = fs::remove_dir(out.join(WORK));
    let _ = fs::remove_dir(out.join(FAILED));
    Ok(Finished {
        results,
        files: written,
    })
}

/// The training file's path as the name of a folder: `train/paper12.toml` is `train-paper12`.
fn folder_name(listed: &Listed) -> String {
    let settings = listed.axis("settings").map(ToString::to_string).unwrap_or_default();
    let stem = settings.strip_suffix(".toml").unwrap_or(&settings);
    let letters = stem.chars().map(|c| {
        if c.is_ascii_alphanumeric() || "_-".contains(c) {
            c
        } else {
            '-'
        }
    });
    letters.collect::<String>().trim_matches('-').to_owned()
}

fn unused(name: &str, taken: &mut BTreeSet<String>) -> String {
    let numbered = (2..).map(|number| format!("{name}-{number}"));
    let mut names = std::iter::once(name.to_owned()).chain(numbered);
    let free = names.find(|name| taken.insert(name.clone()));
    free.unwrap_or_else(|| name.to_owned())
}

//! The folder of a campaign on the disk.
//!
//! ```text
//! OUT/plan.json   which tasks there are                    OUT/work/ID      a task under way; locked by who runs it
//! OUT/tasks/ID    a task that is done                      OUT/work/.new-*  what is about to be put into its place
//! OUT/failed/ID.txt   why a task has no result             OUT/best/NAME    the best policy of each training file
//! ```
//!
//! A folder comes into its place whole, by a rename. What a user put into one, or edited there, is replaced with `--force` alone.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::Duration;

use campaign::{Done, RECORD, Record, Schedule, sha256};
use tempfile::TempDir;
use toml_input::Message;

use super::folders::{self, Files};
use crate::failure::Failure;
use crate::output;
use crate::ownership::Replacing;
use crate::staging;

pub const PLAN: &str = "plan.json";
/// A folder for each task that is done.
pub const TASKS: &str = "tasks";
/// Tasks under way. What an interrupted training left there is gone on with.
pub const WORK: &str = "work";
/// A text for each task that failed: why.
pub const FAILED: &str = "failed";
/// The policy of the best seed of each training file.
pub const BEST: &str = "best";

/// Start of the names of folders that are about to be put into their place.
const NEW: &str = ".new-";

/// A folder that nobody holds is left by a killed run once it is as old as this; a younger one may be about to be locked.
const LEFT_AFTER: Duration = Duration::from_secs(60);

/// How often a folder is put into its place where others do the same at the same time.
const ATTEMPTS: usize = 5;

/// The folder of a campaign.
pub struct Store {
    /// An absolute path.
    pub out: PathBuf,
    pub replacing: Replacing,
}

impl Store {
    /// A folder that holds a campaign, or nothing yet. Writes nothing.
    pub fn open(out: &Path, replacing: Replacing) -> Result<Self, Failure> {
        check_place(out)?;
        let out = std::path::absolute(out)?;
        if out.to_str().is_none() {
            // a worker is told its folder in a line of text, and so is a queue
            let message = Message::new("the name of the folder of a campaign is no UTF-8");
            let message = message.found(out.to_string_lossy());
            return Err(message.hint("choose another --out").into());
        }
        Ok(Self { out, replacing })
    }

    /// Writes which tasks the folder is for. Bytes that stand there already stay: the jobs of an array all begin with this.
    pub fn write_plan(&self, schedule: &Schedule) -> Result<(), Failure> {
        let text = schedule.json();
        if fs::read(self.out.join(PLAN)).is_ok_and(|there| there == text.as_bytes()) {
            return Ok(());
        }
        let files = [(PLAN.to_owned(), text)].into();
        output::replace_own_texts(&self.out, &files, self.replacing)
    }

    pub fn stored(&self, id: &str) -> Result<Option<Result<Done, Message>>, Failure> {
        stored(&self.out, id)
    }

    /// Puts the result of a task into its place, unless it stands there already.
    pub fn keep(&self, done: &Done) -> Result<(), Failure> {
        let id = &done.record.id;
        let place = self.out.join(TASKS).join(id);
        let files = done.folder();
        let is_there = || Ok(matches!(self.stored(id)?, Some(Ok(there)) if there == *done));
        self.publish(&files, &place, is_there, || self.check_task(id))
    }

    /// Puts the best policies into their place.
    pub fn keep_best(&self, files: &Files) -> Result<(), Failure> {
        let best = self.out.join(BEST);
        let is_there = || Ok(folders::read(&best)? == *files);
        self.publish(files, &best, is_there, || self.check_best())
    }

    fn publish(
        &self,
        files: &Files,
        place: &Path,
        is_there: impl Fn() -> Result<bool, Failure>,
        check: impl Fn() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        if is_there()? {
            return Ok(());
        }
        let scratch = self.scratch()?;
        let new = scratch.folder.path().join("new");
        folders::write(&new, files)?;
        let mut result = Ok(());
        for _ in 0..ATTEMPTS {
            check()?;
            result = folders::exchange(&new, place, &scratch.folder.path().join("old"));
            // another process that has the same result may have been the first
            if result.is_ok() || is_there()? {
                return Ok(());
            }
        }
        result.map_err(|error| folders::cannot("replace", place, &error))
    }

    /// A folder that no other process has, on this machine or another, beside all places.
    fn scratch(&self) -> Result<Scratch, Failure> {
        let work = self.out.join(WORK);
        let make = || {
            fs::create_dir_all(&work)?;
            tempfile::Builder::new().prefix(NEW).tempdir_in(&work)
        };
        let folder = make().map_err(|error| folders::cannot("make a folder in", &work, &error))?;
        let lock = File::open(folder.path()).ok();
        let lock = lock.filter(|file| file.try_lock().is_ok());
        Ok(Scratch { folder, _lock: lock })
    }

    /// Refuses to replace the folder of a task in which somebody has files of their own.
    pub fn check_task(&self, id: &str) -> Result<(), Failure> {
        let folder = self.out.join(TASKS).join(id);
        if self.replacing.force || !folder.exists() {
            return Ok(());
        }
        let files = folders::read(&folder)?;
        let record = files.get(RECORD).and_then(|text| record_of(text));
        let record = record.filter(|record| record.id == id);
        let is_own = |name: &str, bytes: &[u8]| match &record {
            Some(record) => name == RECORD || record.files.get(name).is_some_and(|digest| *digest == sha256(bytes)),
            None => false,
        };
        let strange = files.iter().find(|(name, bytes)| !is_own(name, bytes));
        strange.map_or(Ok(()), |(name, _)| Err(not_own(&folder.join(name))))
    }

    /// Refuses to replace the best policies if somebody has files of their own among them.
    pub fn check_best(&self) -> Result<(), Failure> {
        let best = self.out.join(BEST);
        if self.replacing.force || !best.exists() {
            return Ok(());
        }
        let mut own: BTreeSet<(String, String)> = BTreeSet::new();
        let tasks = fs::read_dir(self.out.join(TASKS)).into_iter().flatten().flatten();
        for task in tasks {
            let record = fs::read(task.path().join(RECORD)).ok();
            if let Some(record) = record.as_deref().and_then(record_of) {
                own.extend(record.files);
            }
        }
        let strange = folders::read(&best)?.into_iter().find(|(path, bytes)| {
            let file = path.split_once('/').map(|(_, file)| file.to_owned());
            !file.is_some_and(|file| own.contains(&(file, sha256(bytes))))
        });
        strange.map_or(Ok(()), |(name, _)| Err(not_own(&best.join(name))))
    }

    pub fn reason(&self, id: &str) -> Option<String> {
        reason(&self.out, id)
    }

    pub fn write_reason(&self, id: &str, reason: &str) -> Result<(), Failure> {
        output::write_one(&reason_of(&self.out, id), &format!("{reason}\n"))
    }

    pub fn forget_reason(&self, id: &str) {
        let _ = fs::remove_file(reason_of(&self.out, id));
    }

    /// Removes what killed runs left: folders that were about to be put into their place, and those of tasks that are `done`.
    pub fn clear_up<'a>(&self, done: impl IntoIterator<Item = &'a String>) {
        let work = self.out.join(WORK);
        let entries = fs::read_dir(&work).into_iter().flatten().flatten();
        let is_new = |entry: &fs::DirEntry| entry.file_name().to_string_lossy().starts_with(NEW);
        let is_old = |entry: &fs::DirEntry| {
            let changed = entry.metadata().and_then(|data| data.modified());
            changed.is_ok_and(|changed| changed.elapsed().is_ok_and(|age| age > LEFT_AFTER))
        };
        let left = entries
            .filter(|entry| is_new(entry) && is_old(entry))
            .map(|entry| entry.path());
        let done = done
            .into_iter()
            .map(|id| work.join(id))
            .filter(|folder| folder.exists());
        for folder in left.chain(done) {
            let lock = File::open(&folder);
            // who holds it is at work
            if lock.is_ok_and(|file| file.try_lock().is_ok()) {
                let _ = folders::remove(&folder);
            }
        }
        // empty once nothing is under way
        let _ = fs::remove_dir(&work);
        let _ = fs::remove_dir(self.out.join(FAILED));
    }
}

struct Scratch {
    folder: TempDir,
    _lock: Option<File>,
}

fn record_of(text: &[u8]) -> Option<Record> {
    serde_json::from_slice(text).ok()
}

fn not_own(path: &Path) -> Failure {
    let message = Message::new(format!(
        "{} is not what policyc wrote there, and its folder is to be replaced",
        path.display()
    ));
    message.hint("move it away, or give it up with --force").into()
}

/// Refuses a folder of others. One of empty folders holds nothing: Snakemake makes the folder of a task before the task.
fn check_place(out: &Path) -> Result<(), Failure> {
    if out.join(PLAN).is_file() {
        return Ok(());
    }
    let Err(refused) = output::check_new_folder(out) else {
        return Ok(());
    };
    // another job of an array may have begun the campaign since
    let is_ours = out.join(PLAN).is_file() || folders::holds_a_file(out).is_ok_and(|holds| !holds);
    if is_ours { Ok(()) } else { Err(refused) }
}

/// Why a task has no result in a folder, as far as one knows.
pub fn reason(out: &Path, id: &str) -> Option<String> {
    let text = fs::read_to_string(reason_of(out, id)).ok()?;
    Some(text.trim_end().to_owned())
}

fn reason_of(out: &Path, id: &str) -> PathBuf {
    out.join(FAILED).join(format!("{id}.txt"))
}

/// The result of a task in a folder, if there is one, or why it is none.
pub fn stored(out: &Path, id: &str) -> Result<Option<Result<Done, Message>>, Failure> {
    let folder = out.join(TASKS).join(id);
    if !folder.join(RECORD).is_file() {
        return Ok(None);
    }
    Ok(Some(Done::read(id, folders::read(&folder)?)))
}

/// What is to be done in the folder of a campaign.
pub fn schedule_of(folder: &Path) -> Result<Schedule, Failure> {
    let path = folder.join(PLAN);
    let shown = folder.display();
    let text = fs::read(&path).map_err(|error| {
        let message = Message::new(format!(
            "{shown} is no folder of a campaign: cannot read {PLAN}: {error}"
        ));
        Failure::from(message.hint("name the folder that was --out of policyc campaign"))
    })?;
    Schedule::read(&text).map_err(|message| toml_input::Fault::in_file(&path, message).into())
}

/// Keeps two campaigns of one folder apart while one of them writes its results.
pub fn lock(store: &Store) -> Result<Option<File>, Failure> {
    let tasks = store.out.join(TASKS);
    fs::create_dir_all(&tasks).map_err(|error| folders::cannot("make the folder", &tasks, &error))?;
    // not OUT itself: whoever writes a file there locks it
    Ok(staging::lock(&tasks))
}

//! Several folders of campaigns as one.
//!
//! First everything is looked at, then something is written: `plan.json`, the tasks one by one, the results. A merge that ends in
//! between leaves a campaign of which some tasks are done, and the same merge again goes on with it.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use campaign::{Done, RECORD, Record, Schedule, State};
use toml_input::Message;

use super::finish::{Finished, finish};
use super::session::state;
use super::store::{self, PLAN, Store};
use crate::failure::Failure;
use crate::interruption;
use crate::ownership::Replacing;

/// The result of a task that is to stand in the merged folder.
struct Chosen<'a> {
    folder: &'a Path,
    record: Record,
    /// Programs that it was made without.
    lacks: usize,
    state: State,
}

/// Puts the folders of campaigns together; what `out` holds of a campaign stays in it. Nothing if the user had enough of it.
///
/// # Errors
/// If a folder is none, or two have different results for one task.
pub fn merge(from: &[PathBuf], out: &Path, replacing: Replacing) -> Result<Option<Finished>, Failure> {
    let store = Store::open(out, replacing)?;
    // the destination first: what it holds is not written again
    let own = store.out.join(PLAN).is_file().then_some(&store.out);
    let folders: Vec<&PathBuf> = own.into_iter().chain(from).collect();
    let mut schedule: Option<Schedule> = None;
    for folder in &folders {
        let read = store::schedule_of(folder)?;
        schedule = Some(match schedule {
            Some(schedule) => schedule.merge(read),
            None => read,
        });
    }
    let Some(schedule) = schedule else {
        return Err(Message::new("no folder to merge").into());
    };
    let chosen = chosen(&store, &schedule, &folders)?;
    for (id, chosen) in &chosen {
        if chosen.folder != store.out {
            store.check_task(id)?;
        }
    }
    store.check_best()?;
    let reasons = reasons(&schedule, &folders, &chosen);
    store.write_plan(&schedule)?;
    for (id, chosen) in &chosen {
        if interruption::is_stopped() {
            return Ok(None);
        }
        store.forget_reason(id);
        if chosen.folder != store.out {
            store.keep(&whole(id, chosen.folder)?)?;
        }
    }
    let mut states: BTreeMap<String, State> = chosen.into_iter().map(|(id, chosen)| (id, chosen.state)).collect();
    for (id, reason) in reasons {
        store.write_reason(&id, &reason)?;
        states.insert(id, State::Failed(reason));
    }
    finish(&store, &schedule, states).map(Some)
}

/// The results that are to stand there.
fn chosen<'a>(
    store: &Store,
    schedule: &Schedule,
    folders: &[&'a PathBuf],
) -> Result<BTreeMap<String, Chosen<'a>>, Failure> {
    let mut all: BTreeMap<String, Chosen<'a>> = BTreeMap::new();
    for folder in folders {
        for listed in &schedule.tasks {
            let id = &listed.id;
            let done = match store::stored(folder, id)? {
                None => continue,
                // it is given up
                Some(Err(_)) if **folder == store.out && store.replacing.force => continue,
                Some(done) => done.map_err(|message| message.found(folder.display().to_string()))?,
            };
            let new = Chosen {
                folder,
                lacks: done.lacks().len(),
                state: state(&done),
                record: done.record,
            };
            let is_better = match all.get(id) {
                None => true,
                Some(old) => compared(id, &new, old)?.is_lt(),
            };
            if is_better {
                all.insert(id.clone(), new);
            }
        }
    }
    Ok(all)
}

/// Which of two results of a task is to stand: the one that lacks less. Two that lack nothing are the same, or one of the machines is not
/// what the other is.
fn compared(id: &str, new: &Chosen<'_>, old: &Chosen<'_>) -> Result<Ordering, Failure> {
    if new.record == old.record {
        return Ok(Ordering::Equal);
    }
    if new.lacks + old.lacks > 0 {
        let text = |record: &Record| serde_json::to_string(record).unwrap_or_default();
        // by something that does not hang on the order of the folders
        let by_text = || text(&new.record).cmp(&text(&old.record));
        return Ok(new.lacks.cmp(&old.lacks).then_with(by_text));
    }
    let files = new.record.files.keys().chain(old.record.files.keys());
    let differs = |name: &&String| old.record.files.get(*name) != new.record.files.get(*name);
    let file = files.clone().find(differs).map_or(RECORD, String::as_str);
    let message = Message::new(format!("two folders have different results for {id}"));
    let message = message.found(format!(
        "{file} in {} and in {}",
        old.folder.display(),
        new.folder.display()
    ));
    Err(message
        .expected("the same bytes: version, arguments and files are the same")
        .hint("the machines differ: their compilers, or their processors in a training; leave one folder out")
        .into())
}

/// Why tasks without a result have none: of two reasons the first in the alphabet.
fn reasons(
    schedule: &Schedule,
    folders: &[&PathBuf],
    chosen: &BTreeMap<String, Chosen<'_>>,
) -> BTreeMap<String, String> {
    let failed = schedule.tasks.iter().filter(|listed| !chosen.contains_key(&listed.id));
    let reason = |id: &String| folders.iter().filter_map(|folder| store::reason(folder, id)).min();
    failed
        .filter_map(|listed| Some((listed.id.clone(), reason(&listed.id)?)))
        .collect()
}

fn whole(id: &str, folder: &Path) -> Result<Done, Failure> {
    match store::stored(folder, id)? {
        Some(done) => Ok(done.map_err(|message| message.found(folder.display().to_string()))?),
        None => {
            let message = Message::new(format!("{id} is gone from {}", folder.display()));
            Err(message.hint("merge again").into())
        }
    }
}

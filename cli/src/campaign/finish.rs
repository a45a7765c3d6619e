//! The results of all tasks, and the best policies.

use std::collections::{BTreeMap, BTreeSet};

use campaign::{Listed, Results, Schedule, State};
use report::CommandLine;

use super::folders::Files;
use super::session::state;
use super::store::{self, BEST, Store};
use crate::failure::Failure;
use crate::output;

/// What a campaign came to.
pub struct Finished {
    /// All tasks.
    pub results: Results,
    /// Files that were written, from the folder of the campaign.
    pub files: Vec<String>,
}

/// Writes the results. One process at a time; what others have done since `states` were read counts.
pub fn finish(store: &Store, schedule: &Schedule, mut states: BTreeMap<String, State>) -> Result<Finished, Failure> {
    let _lock = store::lock(store)?;
    for listed in &schedule.tasks {
        let id = &listed.id;
        if matches!(states.get(id), Some(State::Done { .. })) {
            continue;
        }
        if let Some(Ok(done)) = store.stored(id)? {
            states.insert(id.clone(), state(&done));
        } else if let (None, Some(reason)) = (states.get(id), store.reason(id)) {
            states.insert(id.clone(), State::Failed(reason));
        }
    }
    let done = states.iter().filter(|(_, state)| matches!(state, State::Done { .. }));
    let done: Vec<String> = done.map(|(id, _)| id.clone()).collect();
    let results = Results::new(schedule, states);
    let files = BTreeMap::from([
        ("results.json".to_owned(), results.json()),
        ("results.csv".to_owned(), results.csv()),
        ("report.html".to_owned(), signed(&results.page()?)?),
    ]);
    store.check_best()?;
    output::replace_own_texts(&store.out, &files, store.replacing)?;
    let mut written: Vec<String> = files.into_keys().collect();
    let mut best = Files::new();
    let mut taken = BTreeSet::new();
    for (listed, _) in results.best() {
        let Some(Ok(done)) = store.stored(&listed.id)? else {
            continue;
        };
        let name = unused(&folder_name(listed), &mut taken);
        let files = done.files.into_iter().filter(|(name, _)| name != "answer.json");
        best.extend(files.map(|(file, bytes)| (format!("{name}/{file}"), bytes)));
        written.push(format!("{BEST}/{name}"));
    }
    // with each other, because a seed that was best once would leave its files under another's
    if !best.is_empty() || store.out.join(BEST).exists() {
        store.keep_best(&best)?;
    }
    store.clear_up(&done);
    Ok(Finished {
        results,
        files: written,
    })
}

/// The page with what makes it. It names no plan and no folder, because the same results give the same page, whoever made them.
fn signed(page: &str) -> Result<String, Failure> {
    let command = CommandLine::new("policyc campaign PLAN.toml --out campaign");
    let read = [
        ("tasks", "plan.json, beside this page"),
        ("from their results alone", "policyc merge campaign --out again"),
    ];
    Ok(report::made(page, &command, read)?)
}

/// The training file's path as the name of a folder: `train/paper12.toml` is `train-paper12`. Never empty.
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
    let name = letters.collect::<String>();
    match name.trim_matches('-') {
        "" => "policy".to_owned(),
        name => name.to_owned(),
    }
}

/// A name that no other has, even where `A` and `a` are one file.
fn unused(name: &str, taken: &mut BTreeSet<String>) -> String {
    let numbered = (2..).map(|number| format!("{name}-{number}"));
    let mut names = std::iter::once(name.to_owned()).chain(numbered);
    let free = names.find(|name| taken.insert(name.to_ascii_lowercase()));
    free.unwrap_or_else(|| name.to_owned())
}

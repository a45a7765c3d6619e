//! `plan.toml`: which commands are to be run on what.

use std::collections::BTreeSet;
use std::path::Path;

use toml_input::{Document, Faults, FileName, Message, Place, Sink, Table, messages};

use crate::inputs::Inputs;
use crate::kind::Kind;
use crate::results::Schedule;
use crate::sections::{self, Draft, Word};
use crate::task::Task;

/// More tasks than a folder can be listed with in a second; a plan with more is mostly a slip in a range.
pub(crate) const MOST_TASKS: usize = 100_000;

/// A checked plan: its tasks with everything that they read.
#[derive(Debug)]
pub struct Plan {
    /// Title of the page of results.
    pub name: String,
    /// Each once, in the order of the plan.
    pub tasks: Vec<Task>,
    /// Where the section of each task begins, in the order of `tasks`.
    places: Vec<(FileName, Place)>,
}

impl Plan {
    /// Reads a plan and every file that its tasks read. Paths in it start from its folder.
    ///
    /// # Errors
    /// All faults of the plan; those of files that are named.
    pub fn open(file: &Path) -> Result<Self, Faults> {
        Self::of(&Document::open(file)?)
    }

    /// [`Plan::open`] for a text; `file` names it in faults, and its folder is where paths start.
    ///
    /// # Errors
    /// As [`Plan::open`].
    pub fn from_text(file: &Path, text: &str) -> Result<Self, Faults> {
        Self::of(&Document::from_text(file, text)?)
    }

    fn of(document: &Document) -> Result<Self, Faults> {
        let file = &document.source().name;
        let (name, drafts) = document.read(|root, faults| read(root, file, faults))?;
        let mut inputs = Inputs::default();
        let mut faults = Sink::new();
        let mut plan = Self {
            name,
            tasks: Vec::new(),
            places: Vec::new(),
        };
        let mut known = BTreeSet::new();
        for draft in drafts {
            let place = (file.clone(), draft.place.clone());
            // a broken file is named by each of its tasks, and told once
            let Some(task) = faults.keep(finished(draft, &mut inputs)) else {
                continue;
            };
            // what two sections ask for is done once
            if known.insert(task.id.clone()) {
                plan.tasks.push(task);
                plan.places.push(place);
            }
        }
        faults.propagate()?;
        Ok(plan)
    }

    /// What is wrong with a task, at its section.
    #[must_use]
    pub fn fault(&self, task: usize, message: Message) -> toml_input::Fault {
        match self.places.get(task) {
            Some((file, place)) => toml_input::Fault::new(&file.shown, place.clone(), message),
            None => message.into(),
        }
    }

    /// The tasks by name, for whoever merges their results.
    #[must_use]
    pub fn schedule(&self) -> Schedule {
        Schedule::new(&self.name, &self.tasks)
    }
}

fn read(root: &mut Table<'_>, file: &FileName, faults: &mut Sink) -> Option<(String, Vec<Draft>)> {
    let name = root.with_default("name", "campaign".to_owned(), faults, |value, faults| {
        value.text(faults).map(str::to_owned)
    });
    let mut drafts = Vec::new();
    for kind in Kind::ALL {
        let of_kind = root.sections(kind.name(), faults, |table, faults| {
            sections::read(kind, table, file, faults)
        });
        drafts.extend(of_kind.into_iter().flatten());
    }
    // a section under a wrong name is a fault already
    if drafts.is_empty() && faults.is_empty() && root.count() <= usize::from(root.optional("name").is_some()) {
        let known = Kind::ALL.map(|kind| format!("[[{}]]", kind.name())).join(", ");
        let message = Message::new("the plan has no task").expected(format!("at least one of {known}"));
        faults.push(root.fault(message));
    }
    if drafts.len() > MOST_TASKS {
        faults.push(root.fault(messages::count("tasks", drafts.len(), 1, MOST_TASKS)));
    }
    Some((name, drafts))
}

/// Reads what a draft names.
fn finished(draft: Draft, inputs: &mut Inputs) -> Result<Task, Faults> {
    let files: Vec<FileName> = draft.words.iter().filter_map(Word::file).cloned().collect();
    let gathered = inputs.gather(&files)?;
    let mut named = gathered.named.into_iter();
    let arguments = draft.words.into_iter().map(|word| match word {
        Word::Text(text) => text,
        // as many as there are files
        Word::File(_) => named.next().unwrap_or_default(),
    });
    let arguments = arguments.collect();
    Ok(Task::new(draft.kind, draft.axes, arguments, gathered.files, files))
}

//! A diagnosis as files and as lines to say.

use std::collections::BTreeMap;
use std::path::Path;

use measured::ColumnMap;
use report::CommandLine;
use serde::Serialize;
use toml_input::{Faults, Message};

use crate::capture::estimates::Estimates;
use crate::diagnosis::Diagnosis;
use crate::empirical::Empirical;
use crate::extend::{extended_toml, partial_toml};
use crate::findings::Findings;
use crate::gain::Regime;
use crate::next;
use crate::page::comparison::{Compared, compared};
use crate::page::page;
use crate::played;
use crate::words::si;
use crate::worth::Worth;

/// `diagnosis.json`.
#[derive(Serialize)]
struct Written<'a> {
    #[serde(flatten)]
    findings: &'a Findings,
    fits: Vec<Compared>,
}

/// What was asked of a diagnosis, for its page; paths as the user gave them.
#[derive(Debug, Clone, Default)]
pub struct Asked {
    /// The plant's file.
    pub model: String,
    /// Records that are fitted.
    pub train: Vec<String>,
    /// Records that judge.
    pub heldout: Vec<String>,
    /// Column maps of the command line.
    pub map: Vec<String>,
    /// Other options by name and value; those without a value have an empty one.
    pub others: Vec<(&'static str, String)>,
}

impl Asked {
    fn command(&self) -> CommandLine {
        let command = CommandLine::new("policyc diagnose")
            .option("--model", &self.model)
            .options("--train", &self.train)
            .options("--heldout", &self.heldout);
        let command = self
            .map
            .iter()
            .fold(command, |command, map| command.option("--map", map));
        let others = self
            .others
            .iter()
            .fold(command, |command, (name, value)| match value.is_empty() {
                true => command.flag(name, true),
                false => command.option(name, value),
            });
        // not the folder itself: the same input makes the same page, wherever it lies
        others.option("--out", "DIR")
    }

    fn read(&self) -> Vec<(&'static str, String)> {
        let mut read = vec![
            ("model", self.model.clone()),
            ("training records", self.train.join(", ")),
        ];
        if !self.heldout.is_empty() {
            read.push(("held-out records", self.heldout.join(", ")));
        }
        let files = self
            .others
            .iter()
            .filter(|(name, _)| *name == "--columns")
            .map(|(_, file)| file.clone());
        let maps: Vec<String> = files.chain(self.map.iter().cloned()).collect();
        if !maps.is_empty() {
            read.push(("column map", maps.join(", ")));
        }
        read
    }
}

/// [`files`], whose page says what was asked.
///
/// # Errors
/// If a page cannot be drawn.
pub fn files_of(diagnosis: &Diagnosis, asked: &Asked) -> Result<BTreeMap<String, String>, Faults> {
    let mut files = files(diagnosis)?;
    if let Some(page) = files.get_mut(PAGE) {
        *page = report::made(page, &asked.command(), asked.read()).map_err(told)?;
    }
    Ok(files)
}

/// Name of the page among the files.
const PAGE: &str = "report.html";

/// Name and text of every file of a diagnosis.
///
/// # Errors
/// If a page cannot be drawn.
pub fn files(diagnosis: &Diagnosis) -> Result<BTreeMap<String, String>, Faults> {
    let written = Written {
        findings: &diagnosis.findings,
        fits: compared(diagnosis),
    };
    let mut json = serde_json::to_string_pretty(&written).map_err(told)?;
    json.push('\n');
    let mut files = BTreeMap::from([
        ("diagnosis.json".to_owned(), json),
        ("plant.extended.toml".to_owned(), extended_toml(diagnosis)),
        (PAGE.to_owned(), page(diagnosis).map_err(told)?),
    ]);
    if let Some(partial) = partial_toml(diagnosis) {
        files.insert("plant.partial.toml".to_owned(), partial);
    }
    if let Some(control) = &diagnosis.control {
        files.insert("drm.toml".to_owned(), control.mapping.clone());
    }
    files.extend(played::files(&diagnosis.findings.next_experiments));
    Ok(files)
}

fn told(error: impl ToString) -> Message {
    Message::new(error.to_string())
}

/// Where the causes that come nearest leave far less of a held-out record than the description does, and which file has them.
fn nearer(term: &Empirical, partial: &[Worth]) -> Option<String> {
    let described = term.errors.iter().find(|worth| worth.heldout && term.written)?;
    let is_it =
        |worth: &&Worth| worth.heldout && (&worth.record, worth.channel) == (&described.record, described.channel);
    let causes = partial.iter().find(is_it)?;
    (causes.rmse_after < 0.5 * described.rmse_after).then(|| {
        format!(
            " The causes that come nearest leave {} there: plant.partial.toml has them, for a look and not for training.",
            si(causes.rmse_after, causes.unit)
        )
    })
}

/// What the command says: the verdict, then what was noticed. `files` are those of the records.
#[must_use]
pub fn answer(columns: &ColumnMap, files: &[&Path], findings: &Findings) -> Vec<String> {
    let (word, sentence) = (findings.headline(), &findings.sentence);
    let mut lines = vec![format!("verdict: {word}\n{sentence}\n")];
    for name in columns.sections_without(files) {
        lines.push(format!(
            "note: no record is called `{name}`: its section of the column map is not used"
        ));
    }
    for worth in &findings.partial_gain {
        lines.push(format!("partial: {}", worth.words()));
    }
    // with a part the figures of the model as given stand in its lines
    let unsaid = findings
        .gain
        .heldout
        .iter()
        .filter(|_| findings.partial_gain.is_empty());
    for held in unsaid.filter(|held| held.regime == Regime::All) {
        lines.push(held.words());
    }
    lines.extend(findings.captures.iter().map(Estimates::words));
    if let Some(term) = &findings.empirical {
        let nearer = nearer(term, &findings.partial_gain).unwrap_or_default();
        lines.push(format!("described, not explained: {}{nearer}", term.sentence));
    }
    lines.extend(next::advice(findings));
    lines.extend(findings.noise.repairs.iter().map(|repair| format!("note: {repair}")));
    if let Some(reason) = &findings.gain.closed_loop_missing {
        lines.push(format!(
            "note: no mapping and no closed loop on the extended model: {reason}"
        ));
    }
    lines
}

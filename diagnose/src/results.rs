//! A diagnosis as files and as lines to say.

use std::collections::BTreeMap;
use std::path::Path;

use measured::ColumnMap;
use toml_input::{Faults, Message};

use crate::capture::estimates::Estimates;
use crate::diagnosis::Diagnosis;
use crate::extend::{extended_toml, partial_toml};
use crate::findings::Findings;
use crate::gain::Regime;
use crate::page::page;

/// Name and text of every file of a diagnosis.
///
/// # Errors
/// If a page cannot be drawn.
pub fn files(diagnosis: &Diagnosis) -> Result<BTreeMap<String, String>, Faults> {
    let mut json = serde_json::to_string_pretty(&diagnosis.findings).map_err(told)?;
    json.push('\n');
    let mut files = BTreeMap::from([
        ("diagnosis.json".to_owned(), json),
        ("plant.extended.toml".to_owned(), extended_toml(diagnosis)),
        ("report.html".to_owned(), page(diagnosis).map_err(told)?),
    ]);
    if let Some(partial) = partial_toml(diagnosis) {
        files.insert("plant.partial.toml".to_owned(), partial);
    }
    if let Some(control) = &diagnosis.control {
        files.insert("drm.toml".to_owned(), control.mapping.clone());
    }
    Ok(files)
}

fn told(error: impl ToString) -> Message {
    Message::new(error.to_string())
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
        lines.push(format!("described, not explained: {}", term.sentence));
    }
    lines.extend(findings.noise.repairs.iter().map(|repair| format!("note: {repair}")));
    if let Some(reason) = &findings.gain.closed_loop_missing {
        lines.push(format!(
            "note: no mapping and no closed loop on the extended model: {reason}"
        ));
    }
    lines
}

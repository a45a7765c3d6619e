//! The test programs: built once, with all mutants in them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::copy::Placed;
use crate::draw::CRATES;

/// A test program of the crate `tests`, and which of its tests: those that end in seconds.
// the others build for minutes, with emulators or solvers, and would find no other kind of fault
const ACROSS: &[(&str, &[&str])] = &[
    (
        "golden",
        &[
            "every_case_yields_its_golden_files",
            "the_example_yields_its_golden_manifest",
            "the_integrations_yield_their_golden_files",
            "every_status_bit_says",
            "determinism",
        ],
    ),
    (
        "differential",
        &[
            "random_policies_reach_every_status_bit_and_every_kind",
            "the_integer_networks_stay_near_the_real_one",
            "neurons_of_very_different_sizes_are_no_worse",
            "a_neuron_of_bias_alone_does_no_harm",
            "binary64_gives_other_q_values_than_binary32",
            "no_flipped_bit_of_the_state",
            "a_damaged_state_is_left",
        ],
    ),
    (
        "differential",
        &[
            "recorded_closed_loops_are_replayed",
            "the_macro_is_equal",
            "slices_of_any_size",
            "interpreter_c_and_rust_agree",
        ],
    ),
    ("differential", &["random_policies_with_several_outputs_are_equal"]),
    ("certificate", &["--skip", "marabou"]),
];

/// One program with what is asked of it.
#[derive(Clone, Debug)]
pub struct Program {
    /// Crate and program, for results.
    pub name: String,
    /// What cargo built.
    pub path: PathBuf,
    /// Where it runs.
    pub folder: PathBuf,
    /// For the harness.
    pub arguments: Vec<String>,
}

/// Where cargo builds the copy.
pub struct Build<'a> {
    /// Of the copy.
    pub root: &'a Path,
    /// Cargo's, apart from that of the workspace.
    pub target: &'a Path,
}

/// What came of a build.
pub enum Built {
    /// All of them.
    Programs(Vec<Program>),
    /// These mutants do not compile.
    Without(BTreeSet<usize>),
}

impl Build<'_> {
    /// Builds all programs, or says which mutants to take out.
    ///
    /// # Errors
    /// Cargo cannot be started, or an error is in no mutant.
    pub fn programs(&self, placed: &Placed) -> Result<Built, String> {
        let mut across: Vec<String> = vec!["test".into(), "--workspace".into()];
        let own: Vec<String> = CRATES
            .iter()
            .flat_map(|krate| tests_of(&self.root.join(krate)))
            .collect();
        for name in own
            .iter()
            .map(String::as_str)
            .chain(ACROSS.iter().map(|(name, _)| *name))
        {
            across.extend(["--test".to_owned(), name.to_owned()]);
        }
        let mut units: Vec<String> = vec!["test".into(), "--lib".into()];
        units.extend(
            CRATES
                .iter()
                .flat_map(|krate| ["-p".to_owned(), format!("policyc-{krate}")]),
        );
        let mut programs = Vec::new();
        for arguments in [units, across] {
            let messages = self.cargo(&arguments)?;
            let bad = failing(&messages, placed)?;
            if !bad.is_empty() {
                return Ok(Built::Without(bad));
            }
            programs.extend(self.built(&messages));
        }
        Ok(Built::Programs(programs))
    }

    fn cargo(&self, arguments: &[String]) -> Result<Vec<Value>, String> {
        let output = Command::new("cargo")
            .args(arguments)
            .args(["--no-run", "--message-format=json"])
            .current_dir(self.root)
            .env("CARGO_TARGET_DIR", self.target)
            .stderr(std::process::Stdio::inherit())
            .output()
            .map_err(|error| format!("cargo: {error}"))?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let messages: Vec<Value> = text
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok())
            .collect();
        let has_errors = messages.iter().any(is_error);
        match output.status.success() || has_errors {
            true => Ok(messages),
            false => Err(format!("cargo {} failed", arguments.join(" "))),
        }
    }

    /// The programs among what cargo built, each as often as it is asked something else.
    fn built(&self, messages: &[Value]) -> Vec<Program> {
        let mut programs = Vec::new();
        for message in messages {
            let (Some(path), Some(manifest)) = (message["executable"].as_str(), message["manifest_path"].as_str())
            else {
                continue;
            };
            let folder = Path::new(manifest).parent().unwrap_or(self.root).to_owned();
            let krate = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let target = message["target"]["name"].as_str().unwrap_or_default();
            let is_lib = message["target"]["kind"][0] == "lib";
            if message["profile"]["test"] != true {
                continue;
            }
            let one = |number: usize, arguments: &[&str]| Program {
                name: match (is_lib, number) {
                    (true, _) => format!("{krate} (units)"),
                    (false, 0) => format!("{krate}/{target}"),
                    _ => format!("{krate}/{target} {number}"),
                },
                path: path.into(),
                folder: folder.clone(),
                arguments: arguments.iter().map(|text| (*text).to_owned()).collect(),
            };
            if CRATES.contains(&krate.as_str()) {
                programs.push(one(0, &[]));
            } else if krate == "tests" && !is_lib {
                let asked = ACROSS.iter().filter(|(name, _)| *name == target).enumerate();
                programs.extend(asked.map(|(number, (_, arguments))| one(number + 1, arguments)));
            }
        }
        programs
    }
}

/// Names of the integration tests of a crate.
fn tests_of(krate: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(krate.join("tests")).into_iter().flatten().flatten();
    let paths = entries.map(|entry| entry.path());
    let sources = paths.filter(|path| path.extension().is_some_and(|extension| extension == "rs"));
    sources
        .filter_map(|path| Some(path.file_stem()?.to_string_lossy().into_owned()))
        .collect()
}

fn is_error(message: &Value) -> bool {
    message["reason"] == "compiler-message" && message["message"]["level"] == "error"
}

/// The mutants that the compiler's errors are in.
fn failing(messages: &[Value], placed: &Placed) -> Result<BTreeSet<usize>, String> {
    let mut bad = BTreeSet::new();
    for message in messages
        .iter()
        .filter(|message| is_error(message))
        .map(|message| &message["message"])
    {
        let spans = message["spans"].as_array().cloned().unwrap_or_default();
        if spans.is_empty() {
            // "aborting due to 3 previous errors"
            continue;
        }
        let found: BTreeSet<usize> = spans.iter().flat_map(|span| blamed(span, placed)).collect();
        if found.is_empty() {
            return Err(message["rendered"].as_str().unwrap_or("an error").to_owned());
        }
        bad.extend(found);
    }
    Ok(bad)
}

/// The innermost mutant around a span; if there is none, those within it; nobody for an error that lies beside all of them.
fn blamed(span: &Value, placed: &Placed) -> Vec<usize> {
    let name = span["file_name"].as_str().unwrap_or_default();
    let number = |key: &str| span[key].as_u64().unwrap_or(0) as usize;
    let (start, end) = (number("byte_start"), number("byte_end"));
    let Some((_, ranges)) = placed.iter().find(|(file, _)| Path::new(name).ends_with(file)) else {
        return Vec::new();
    };
    if span["is_primary"] != true {
        return Vec::new();
    }
    let around = ranges
        .iter()
        .filter(|(_, range)| range.start <= start && end <= range.end);
    if let Some((innermost, _)) = around.min_by_key(|(_, range)| range.len()) {
        return vec![*innermost];
    }
    let within = ranges
        .iter()
        .filter(|(_, range)| start <= range.start && range.end <= end);
    within.map(|(number, _)| *number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(start: usize, end: usize) -> Value {
        serde_json::json!({ "file_name": "interp/src/a.rs", "byte_start": start, "byte_end": end, "is_primary": true })
    }

    #[test]
    fn the_innermost_mutant_around_an_error_is_blamed_or_those_within_it() {
        let ranges = vec![(4, 10..50), (5, 20..30), (6, 60..70)];
        let placed = Placed::from([("interp/src/a.rs".into(), ranges)]);
        assert_eq!(blamed(&span(22, 25), &placed), [5]);
        assert_eq!(blamed(&span(35, 40), &placed), [4]);
        assert_eq!(blamed(&span(55, 75), &placed), [6]);
        assert!(blamed(&span(80, 81), &placed).is_empty());
    }

    #[test]
    fn an_error_in_no_mutant_is_no_result() {
        let error = serde_json::json!({
            "reason": "compiler-message",
            "message": { "level": "error", "rendered": "no such thing", "spans": [span(1, 2)] }
        });
        assert_eq!(failing(&[error], &Placed::new()).unwrap_err(), "no such thing");
    }
}

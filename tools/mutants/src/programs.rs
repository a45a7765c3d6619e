//! The test programs: built once, with all mutants in them; and the tests in them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::copy::Placed;
use crate::draw::CRATES;

/// A test program of the crate `tests`, and which of its tests: those that end in seconds.
// the others build for minutes or have solvers, and would find no other kind of fault
const ACROSS: &[(&str, &[&str])] = &[
    (
        "golden",
        &[
            "every_case_yields_its_golden_files",
            "the_example_yields_its_golden_manifest",
            "the_integrations_yield_their_golden_files",
            "every_status_bit_says",
        ],
    ),
    (
        "differential",
        &[
            "a_damaged_state_is_left",
            "a_neuron_of_bias_alone_does_no_harm",
            "a_zero_keeps_its_sign",
            "binary64_gives_other_q_values_than_binary32",
            "dead_neurons_are_left_out",
            "every_combination_of_codes_is_equal",
            "interpreter_c_and_rust_agree",
            "neurons_of_very_different_sizes_are_no_worse",
            "no_flipped_bit_of_the_state",
            "random_gain_schedules",
            "random_policies",
            "recorded_closed_loops_are_replayed",
            "slices_of_any_size",
            "the_integer_networks_stay_near_the_real_one",
            "the_macro_is_equal",
        ],
    ),
    ("certificate", &["--skip", "marabou"]),
    // what the library counts and judges is told by the command line alone
    (
        "cli",
        &[
            "actor::",
            "codes::",
            "commands::",
            "decisions::",
            "faults::",
            "files::",
            "gains::",
            "json::",
            "loudness::",
            "replay",
            "several::",
            "tables::",
            "traces::",
        ],
    ),
    // assembly is in no file that a host builds
    (
        "on_target",
        &[
            "the_loops_in_assembly_are_equal",
            "so_are_those_of_random_policies",
            "i16_has_one_checksum",
            "i8_has_one_checksum",
        ],
    ),
];

/// One test of a program. Alone, it stops at the first failure, and it is known which switches it asks.
#[derive(Clone, Debug)]
pub struct Test {
    /// Crate and program.
    pub program: String,
    /// What the harness calls it.
    pub name: String,
    /// What cargo built.
    pub path: PathBuf,
    /// Where it runs.
    pub folder: PathBuf,
    /// Where cargo builds what it starts.
    pub target: PathBuf,
}

impl Test {
    /// For results.
    pub fn label(&self) -> String {
        format!("{}: {}", self.program, self.name)
    }
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
    /// All tests.
    Tests(Vec<Test>),
    /// These mutants do not compile.
    Without(BTreeSet<usize>),
}

impl Build<'_> {
    /// Builds all programs, or says which mutants to take out. The programs are moved to `kept`: another build takes nothing
    /// away from a run that takes an hour.
    ///
    /// # Errors
    /// Cargo cannot be started, or an error is in no mutant.
    pub fn tests(&self, placed: &Placed, kept: &Path) -> Result<Built, String> {
        // one command: another choice of crates has other features, and builds most of them anew
        let mut arguments: Vec<String> = ["test", "--lib", "-p", "tests"].map(str::to_owned).to_vec();
        for krate in CRATES {
            arguments.extend(["-p".to_owned(), format!("policyc-{krate}")]);
        }
        let own = CRATES.iter().flat_map(|krate| tests_of(&self.root.join(krate)));
        let across: BTreeSet<String> = ACROSS.iter().map(|(name, _)| (*name).to_owned()).collect();
        for name in own.chain(across) {
            arguments.extend(["--test".to_owned(), name]);
        }
        let messages = self.cargo(&arguments)?;
        let bad = failing(&messages, placed)?;
        if !bad.is_empty() {
            return Ok(Built::Without(bad));
        }
        Ok(Built::Tests(self.built(&messages, kept)?))
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

    /// The tests of the programs among what cargo built.
    fn built(&self, messages: &[Value], kept: &Path) -> Result<Vec<Test>, String> {
        let at = |path: &Path, error: std::io::Error| format!("{}: {error}", path.display());
        std::fs::create_dir_all(kept).map_err(|error| at(kept, error))?;
        let mut tests = Vec::new();
        for message in messages {
            let (Some(built), Some(manifest)) = (message["executable"].as_str(), message["manifest_path"].as_str())
            else {
                continue;
            };
            let folder = Path::new(manifest).parent().unwrap_or(self.root).to_owned();
            let krate = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let target = message["target"]["name"].as_str().unwrap_or_default();
            let is_lib = message["target"]["kind"][0] == "lib";
            let filters = match ACROSS.iter().find(|(name, _)| *name == target) {
                _ if CRATES.contains(&krate.as_str()) => &[],
                Some((_, filters)) if krate == "tests" && !is_lib => *filters,
                _ => continue,
            };
            if message["profile"]["test"] != true {
                continue;
            }
            let path = kept.join(Path::new(built).file_name().unwrap_or_default());
            // a run beside this one may have it open: that one keeps what it began with
            let _ = std::fs::remove_file(&path);
            std::fs::copy(built, &path).map_err(|error| at(&path, error))?;
            let program = match is_lib {
                true => format!("{krate} (units)"),
                false => format!("{krate}/{target}"),
            };
            tests.extend(listed(&path, &folder, filters)?.into_iter().map(|name| Test {
                program: program.clone(),
                name,
                path: path.clone(),
                folder: folder.clone(),
                target: self.target.to_owned(),
            }));
        }
        Ok(tests)
    }
}

/// Names of the tests in a program that its filters let through.
fn listed(program: &Path, folder: &Path, filters: &[&str]) -> Result<Vec<String>, String> {
    let output = Command::new(program)
        .args(filters)
        .args(["--list", "--format", "terse"])
        .current_dir(folder)
        .output()
        .map_err(|error| format!("{}: {error}", program.display()))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let names = text.lines().filter_map(|line| line.strip_suffix(": test"));
    Ok(names.map(str::to_owned).collect())
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

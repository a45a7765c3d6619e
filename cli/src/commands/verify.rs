//! `policyc verify`

use std::path::Path;

use codegen::{Door, Language, manifest};
use policy::{NumericFormat, Policy};
use serde::{Deserialize, Serialize};
use targets::TargetSpec;
use verify::drift::Drift;
use verify::traces::Recorded;
use verify::{Files, Options, Progress, Report, Selection};

use super::grouped;
use super::progress_line::ProgressLine;
use crate::arguments::Verify;
use crate::{Failure, Outcome, output};

mod show;

pub use show::{golden_text, missing_text};

/// What `--json` prints.
#[derive(Serialize)]
struct Answer {
    equal: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    drift: Option<Drift>,
    report: Report,
}

/// Compares and reports.
pub fn run(options: &Verify) -> Result<Outcome, Failure> {
    let written = match (options.format, &options.generated) {
        (Some(format), _) => Some(format.into()),
        (None, Some(folder)) => written_format(folder),
        (None, None) => None,
    };
    let policy = super::load_as(&options.policy, written)?;
    let recorded = options
        .trace
        .iter()
        .map(|path| recording(&policy, path))
        .collect::<Result<Vec<_>, _>>()?;
    let on_disk = options
        .generated
        .as_deref()
        .map(|folder| checked_in(&policy, folder))
        .transpose()?;
    let target = target(options, on_disk.as_ref().map(|folder| folder.target))?;
    let mut progress = ProgressLine::new();
    let mut tell = |news| {
        progress.show(|| match news {
            Progress::Compiling { builds } => format!("compiling {builds} builds"),
            Progress::Running { steps, of } => format!("{} of {} steps", grouped(steps), grouped(of)),
        });
    };
    let report = verify::run(
        &policy,
        Options {
            steps: options.steps,
            seed: options.seed,
            target,
            generated: on_disk.as_ref().map(|folder| &folder.files),
            recorded,
            progress: Some(&mut tell),
            ..Options::default()
        },
    )?;
    progress.clear();
    if !report.compared() {
        return Err(Failure(show::nothing_compared(&report)?));
    }
    let drift = on_disk.map(|folder| folder.drift);
    let equal = report.passed() && drift.as_ref().is_none_or(Drift::is_empty);
    if options.json {
        output::say(&serde_json::to_string_pretty(&Answer { equal, drift, report })?)?;
    } else {
        output::say(show::report(&report, drift.as_ref(), equal)?.trim_end())?;
    }
    Ok(if equal { Outcome::Done } else { Outcome::Different })
}

/// The numeric format that the folder's manifest names; a manifest that cannot be read is reported later.
fn written_format(folder: &Path) -> Option<NumericFormat> {
    #[derive(Deserialize)]
    struct Written {
        numeric_format: String,
    }
    let text = verify::read_text(&folder.join(manifest::FILE)).ok()?;
    let written: Written = serde_json::from_str(&text).ok()?;
    NumericFormat::find(&written.numeric_format)
}

fn recording(policy: &Policy, path: &Path) -> Result<Recorded, Failure> {
    let place = |error: &dyn std::fmt::Display| Failure(format!("{}: {error}", path.display()));
    let text = verify::read_text(path).map_err(|error| place(&error))?;
    if text.contains(char::REPLACEMENT_CHARACTER) {
        return Err(place(&"is not UTF-8 text"));
    }
    Recorded::from_csv(policy, &text).map_err(|error| place(&error))
}

/// The target that was asked for; generated code is verified as what it was generated for.
fn target(options: &Verify, generated_for: Option<&'static TargetSpec>) -> Result<&'static TargetSpec, Failure> {
    let asked = options.target.as_deref().map(super::target).transpose()?;
    match (asked, generated_for) {
        (Some(asked), Some(found)) if asked != found => Err(Failure(format!(
            "the generated folder is for another target\n   = found: {}\n   = expected: {}\n   \
             = hint: leave --target out, or compile again for {}",
            found.name, asked.name, asked.name
        ))),
        (Some(target), _) | (None, Some(target)) => Ok(target),
        (None, None) => Ok(::targets::host()),
    }
}

/// The parts of a manifest that say how the folder was generated.
#[derive(Deserialize)]
struct Origin {
    target: String,
    languages: Vec<String>,
    #[serde(default)]
    doors: Vec<String>,
    #[serde(default)]
    kit_steps: Option<u32>,
}

/// A folder that compile wrote.
struct Folder {
    files: Files,
    /// How they differ from what the policy yields today.
    drift: Drift,
    target: &'static TargetSpec,
}

fn checked_in(policy: &Policy, folder: &Path) -> Result<Folder, Failure> {
    let path = folder.join(manifest::FILE);
    let shown = path.display();
    let hint = format!(
        "make the folder with `policyc compile POLICY --out {}`",
        folder.display()
    );
    let text = verify::read_text(&path).map_err(|error| {
        Failure(format!(
            "{shown}: {error}\n   = expected: the manifest that compile wrote\n   = hint: {hint}"
        ))
    })?;
    let origin: Origin = serde_json::from_str(&text).map_err(|error| {
        Failure(format!(
            "{shown}: not a manifest of policyc: {error}\n   = hint: {hint}"
        ))
    })?;
    let target = super::target(&origin.target)?;
    let languages: Vec<Language> = Language::ALL
        .into_iter()
        .filter(|language| origin.languages.iter().any(|name| name == language.name()))
        .collect();
    if languages.is_empty() || languages.len() != origin.languages.len() {
        let known = Language::ALL.map(Language::name).join(", ");
        return Err(Failure(format!(
            "{shown}: unknown language\n   = found: {:?}\n   = expected: {known}",
            origin.languages
        )));
    }
    let doors: Option<Vec<Door>> = origin.doors.iter().map(|name| Door::find(name)).collect();
    let Some(doors) = doors else {
        let known = Door::ALL.map(Door::name).join(", ");
        return Err(Failure(format!(
            "{shown}: unknown door\n   = found: {:?}\n   = expected: {known}",
            origin.doors
        )));
    };
    let selection = Selection {
        doors,
        kit_steps: origin.kit_steps.unwrap_or(verify::kit::DEFAULT_STEPS),
        ..Selection::core(&languages)
    };
    let drift = verify::drift(policy, target, &selection, folder)?;
    let mut files = Files::new();
    for name in codegen::generate(policy, target, &languages)?.files.into_keys() {
        // a missing file is already part of the drift
        if let Ok(text) = verify::read_text(&folder.join(&name)) {
            files.insert(name, text);
        }
    }
    Ok(Folder { files, drift, target })
}

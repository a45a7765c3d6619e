//! `policyc verify`

use std::path::Path;

use codegen::{Output, manifest};
use policy::{NumericFormat, Policy};
use serde::{Deserialize, Serialize};
use targets::TargetSpec;
use toml_input::{Fault, Message, messages};
use verify::drift::Drift;
use verify::traces::Recorded;
use verify::{Files, Options, Progress, Report, text};

use super::progress_line::ProgressLine;
use crate::arguments::Verify;
use crate::{Failure, Outcome, output};
use report::grouped;

/// What `--json` prints.
#[derive(Serialize)]
struct Answer {
    equal: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    drift: Option<Drift>,
    /// Missing where nothing was built.
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<Report>,
}

/// Compares and reports.
pub fn run(options: &Verify) -> Result<Outcome, Failure> {
    let written = match (options.format, &options.generated) {
        (Some(format), _) => Some(format),
        (None, Some(folder)) => written_format(folder),
        (None, None) => None,
    };
    let policy = super::load_as(&options.policy, written)?;
    let recorded = options
        .trace
        .iter()
        .map(|path| Recorded::open(&policy, path))
        .collect::<Result<Vec<_>, _>>()?;
    for (path, recording) in options.trace.iter().zip(&recorded) {
        let note = |note: &String| eprintln!("note: {}: {note}", path.display());
        recording.notes.iter().for_each(note);
    }
    let on_disk = options
        .generated
        .as_deref()
        .map(|folder| checked_in(&policy, folder))
        .transpose()?;
    let target = target(options, on_disk.as_ref().map(|folder| folder.target))?;
    if let Some(folder) = &on_disk
        && (options.drift_only || !folder.drift.is_empty())
    {
        // a build of files that differ says the same once more, in every compiler's words
        return files_alone(options, &policy.name, folder.drift.clone());
    }
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
            assembly: true,
            golden_decisions: options.golden_decisions,
            recorded,
            progress: Some(&mut tell),
            ..Options::default()
        },
    )?;
    progress.clear();
    if !report.compared() {
        return Err(text::nothing_compared(&report).into());
    }
    let drift = on_disk.map(|folder| folder.drift);
    let equal = report.passed() && drift.as_ref().is_none_or(Drift::is_empty);
    if options.json {
        let report = Some(report);
        output::say(&serde_json::to_string_pretty(&Answer { equal, drift, report })?)?;
    } else {
        output::say(text::report(&policy, &report, drift.as_ref())?.trim_end())?;
    }
    Ok(if equal { Outcome::Done } else { Outcome::Different })
}

/// The answer of a comparison that ends with the files.
fn files_alone(options: &Verify, policy: &str, drift: Drift) -> Result<Outcome, Failure> {
    let equal = drift.is_empty();
    if options.json {
        let (drift, report) = (Some(drift), None);
        output::say(&serde_json::to_string_pretty(&Answer { equal, drift, report })?)?;
    } else {
        output::say(text::files_alone(policy, &drift)?.trim_end())?;
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

/// The target that was asked for; generated code is verified as what it was generated for.
fn target(options: &Verify, generated_for: Option<&'static TargetSpec>) -> Result<&'static TargetSpec, Failure> {
    let asked = options.target.as_deref().map(super::target).transpose()?;
    match (asked, generated_for) {
        (Some(asked), Some(found)) if asked != found => {
            let message = Message::new("the generated folder is for another target");
            let hint = format!("leave --target out, or compile again for {}", asked.name);
            Err(message.found(found.name).expected(asked.name).hint(hint).into())
        }
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
    let hint = format!(
        "make the folder with `policyc compile POLICY --out {}`",
        folder.display()
    );
    let fault = |message: Message| Fault::in_file(&path, message);
    let text = verify::read_text(&path).map_err(|error| {
        let message = Message::new(error.to_string()).expected("the manifest that compile wrote");
        fault(message.hint(&hint))
    })?;
    let origin: Origin = serde_json::from_str(&text)
        .map_err(|error| fault(Message::new(format!("not a manifest of policyc: {error}")).hint(&hint)))?;
    let target = super::target(&origin.target)?;
    let outputs = outputs(&origin).map_err(fault)?;
    let steps = origin.kit_steps.unwrap_or(verify::kit::DEFAULT_STEPS);
    let expected = verify::kit::expected(policy, target, &outputs, steps)?;
    let yielded = codegen::generate(policy, target, &outputs, expected.as_ref())?.files;
    let drift = verify::drift(policy, &yielded, folder)?;
    let cores: Vec<Output> = outputs.into_iter().filter(|output| output.is_core()).collect();
    let mut files = Files::new();
    for name in codegen::sources(policy, target, &cores, None)?.files.into_keys() {
        // a missing file is already part of the drift
        if let Ok(text) = verify::read_text(&folder.join(&name)) {
            files.insert(name, text);
        }
    }
    Ok(Folder { files, drift, target })
}

/// What the folder was made of.
fn outputs(origin: &Origin) -> Result<Vec<Output>, Message> {
    let known: Vec<&str> = Output::ALL.iter().map(|output| output.name()).collect();
    let names = origin.languages.iter().chain(&origin.doors);
    let found = names.map(|name| Output::find(name).ok_or_else(|| messages::unknown("output", name, &known)));
    let outputs = found.collect::<Result<Vec<_>, _>>()?;
    if outputs.iter().any(|output| output.is_core()) {
        Ok(outputs)
    } else {
        Err(Message::new("no language").expected("`languages` with c, rust or both"))
    }
}

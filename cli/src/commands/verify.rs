//! `policyc verify`

use serde::Serialize;
use targets::TargetSpec;
use toml_input::Message;
use verify::drift::Drift;
use verify::traces::Recorded;
use verify::{Folder, Options, Progress, Report, folder, text};

use super::progress_line::ProgressLine;
use crate::arguments::Verify;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;
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
        (None, Some(folder)) => folder::numeric_format(folder),
        (None, None) => None,
    };
    let policy = super::load_as(&options.policy, options.outside, written)?;
    super::no_choices(&policy, options.golden_decisions)?;
    let map = options.map.join(",");
    let recorded = options
        .trace
        .iter()
        .map(|path| Recorded::open(&policy, path, &map))
        .collect::<Result<Vec<_>, _>>()?;
    for (path, recording) in options.trace.iter().zip(&recorded) {
        let note = |note: &String| eprintln!("note: {}: {note}", path.display());
        recording.notes.iter().for_each(note);
    }
    let on_disk = options
        .generated
        .as_deref()
        .map(|folder| Folder::open(&policy, folder))
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

/// The target that was asked for; generated code is verified as what it was generated for.
fn target(options: &Verify, generated_for: Option<&'static TargetSpec>) -> Result<&'static TargetSpec, Failure> {
    let asked = options.target.as_deref().map(codegen::target).transpose()?;
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

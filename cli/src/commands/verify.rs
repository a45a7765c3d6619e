//! `policyc verify`

use std::path::Path;

use policy::Policy;
use serde::Serialize;
use targets::TargetSpec;
use toml_input::Message;
use verify::cases::{self, Case};
use verify::drift::Drift;
use verify::exchange::{Sheet, github};
use verify::traces::Recorded;
use verify::{Folder, Options, Progress, Report, folder, text};

use super::progress_line::{Pace, ProgressLine};
use super::verify_codes;
use crate::arguments::Verify;
use crate::arguments::verify::{Asked, Service};
use crate::failure::Failure;
use crate::made;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;
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
    let answered = compare(options);
    if let (Err(Failure(faults)), Some(Service::Github)) = (&answered, options.annotations) {
        for fault in faults {
            let line = fault.line_column().map_or(1, |(line, _)| line);
            let file = fault.file.display().to_string();
            output::print(&(github::error(&file, line, &fault.problem) + "\n"))?;
        }
    }
    answered
}

/// Reads every file that is named, and builds nothing.
///
/// # Errors
/// Their faults.
pub fn check(options: &Verify) -> Result<(), Failure> {
    let policy = super::load_several_as(&options.policy, options.outside, options.format)?;
    traces(options, &policy).map(|_| ())
}

fn traces(options: &Verify, policy: &Policy) -> Result<Vec<Recorded>, Failure> {
    let map = options.map.join(",");
    let opened = options.trace.iter().map(|path| Recorded::open(policy, path, &map));
    Ok(opened.collect::<Result<_, _>>()?)
}

fn compare(options: &Verify) -> Result<Outcome, Failure> {
    let written = match (options.format, &options.generated) {
        (Some(format), _) => Some(format),
        (None, Some(folder)) => folder::numeric_format(folder),
        (None, None) => None,
    };
    let policy = super::load_several_as(&options.policy, options.outside, written)?;
    super::no_choices(&policy, options.golden_decisions)?;
    let recorded = traces(options, &policy)?;
    for (path, recording) in options.trace.iter().zip(&recorded) {
        let note = |note: &String| talk::note(&format!("{}: {note}", path.display()));
        recording.notes.iter().for_each(note);
        note(&format!(
            "its {} rows are replayed in every build; whether the contract chooses what was chosen there, `policyc replay` says",
            grouped(recording.steps().len() as u64)
        ));
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
        return answer(options, &policy, Some(folder.drift.clone()), None);
    }
    if let (true, Some(out)) = (options.every.codes, &options.every.out) {
        let files = on_disk.as_ref().map(|folder| &folder.files);
        return verify_codes::run(options, out, &policy, target, files);
    }
    let mut progress = ProgressLine::new();
    let mut pace = None;
    let mut tell = |news| {
        let left = match news {
            // builds take their own time: the pace is that of the steps
            Progress::Running { steps, of } => pace.get_or_insert_with(Pace::new).left(steps, of),
            Progress::Compiling { .. } => String::new(),
        };
        progress.show(|| told(news) + &left);
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
    answer(options, &policy, on_disk.map(|folder| folder.drift), Some(report))
}

/// How far a comparison is, in words.
pub fn told(news: Progress) -> String {
    match news {
        Progress::Compiling { builds } => format!("compiling {builds} builds"),
        Progress::Running { steps, of } => format!("{} of {} steps", grouped(steps), grouped(of)),
    }
}

/// For the page.
fn read(options: &Verify) -> Vec<(&'static str, String)> {
    let mut read = vec![("policy", options.policy.display().to_string())];
    let generated = options.generated.iter();
    read.extend(generated.map(|folder| ("generated files", folder.display().to_string())));
    read
}

/// Writes and says what was found; without a report of builds it is what the files alone tell.
fn answer(options: &Verify, policy: &Policy, drift: Option<Drift>, report: Option<Report>) -> Result<Outcome, Failure> {
    let equal = report.as_ref().is_none_or(Report::passed) && drift.as_ref().is_none_or(Drift::is_empty);
    let cases = cases(options, policy, drift.as_ref(), report.as_ref());
    for Asked { sheet, file } in &options.report {
        let text = sheet.text(&policy.name, &cases)?;
        let text = match sheet {
            Sheet::Html => made::signed_page(&text, &[("--report", "html=verified.html")], &read(options))?,
            _ => text,
        };
        output::replace_own_one(file, &text, options.replacing)?;
    }
    if options.json {
        output::say_json(&Answer { equal, drift, report })?;
    } else {
        let text = match (&report, &drift) {
            (Some(report), drift) => text::report(policy, report, drift.as_ref())?,
            (None, drift) => text::files_alone(&policy.name, &drift.clone().unwrap_or_default())?,
        };
        output::say(text.trim_end())?;
    }
    if options.annotations == Some(Service::Github) {
        for line in github::annotations(&cases) {
            output::print(&(line + "\n"))?;
        }
    }
    Ok(if equal { Outcome::Done } else { Outcome::Different })
}

fn cases(options: &Verify, policy: &Policy, drift: Option<&Drift>, report: Option<&Report>) -> Vec<Case> {
    let folder = options.generated.as_deref().unwrap_or(Path::new("."));
    let files = drift.map(|drift| cases::of_drift(folder, drift));
    let contract = super::contract_path(&options.policy);
    let builds = report.map(|report| cases::of_report(&contract, policy, report));
    files.into_iter().chain(builds).flatten().collect()
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

//! `policyc diagnose`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

use ::diagnose::control::Request;
use ::diagnose::diagnosis::{Diagnosis, diagnose};
use ::diagnose::progress::Progress;
use ::diagnose::record::{Record, open_all};
use ::diagnose::results::{self, Asked};
use closed_loop::Scenario;
use closed_loop::scenario::Task;
use drm::formula::Losses;
use measured::ColumnMap;
use plant::{Faults, Parameters};
use toml_input::FileName;

use super::progress_line::{Pace, ProgressLine};
use super::simulate;
use crate::arguments::Diagnose;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

/// Reads the records, diagnoses, writes the three files.
pub fn run(options: &Diagnose) -> Result<Outcome, Failure> {
    let columns = columns(options)?;
    let shown = Mutex::new(Shown::new(Instant::now()));
    let say = |what: Progress<'_>| {
        if let Ok(mut shown) = shown.lock() {
            shown.hear(what);
        }
    };
    let diagnosis = found(options, &columns, &say)?;
    if let Ok(mut shown) = shown.lock() {
        shown.line.clear();
    }
    output::replace_own_texts(
        &options.out,
        &results::files_of(&diagnosis, &asked(options))?,
        options.replacing,
    )?;
    let named: Vec<&Path> = options
        .train
        .iter()
        .chain(&options.heldout)
        .map(PathBuf::as_path)
        .collect();
    let mut lines = results::answer(&columns, &named, &diagnosis.findings);
    if lines.len() > 1 {
        lines.push(String::new());
    }
    lines.push(format!("to look at: {}/report.html", options.out.display()));
    output::say(&lines.join("\n"))?;
    Ok(match diagnosis.findings.compared.leaves_out() {
        true => Outcome::Different,
        false => Outcome::Done,
    })
}

/// Name and text of every file of a diagnosis; nothing is written or said.
///
/// # Errors
/// As [`run`].
pub fn files(options: &Diagnose) -> Result<BTreeMap<String, String>, Failure> {
    let found = found(options, &columns(options)?, &|_| {})?;
    Ok(results::files_of(&found, &asked(options))?)
}

/// Reads every file that is named, and diagnoses nothing.
///
/// # Errors
/// Their faults.
pub fn check(options: &Diagnose) -> Result<(), Failure> {
    let model = model(options)?;
    if let Some(policy) = &options.policy {
        request(options, policy, &model)?;
    }
    records(options, &columns(options)?, &model)?;
    Ok(())
}

/// The model; a mapping is refitted for the buck alone.
fn model(options: &Diagnose) -> Result<Parameters, Faults> {
    match options.policy {
        Some(_) => Parameters::buck_from_file(&options.model, "`diagnose --policy`"),
        None => Parameters::from_file(&options.model),
    }
}

/// For the page: what was asked, but where the answer goes.
fn asked(options: &Diagnose) -> Asked {
    let path = |path: &PathBuf| path.display().to_string();
    let files = [
        ("--columns", &options.columns.columns),
        ("--policy", &options.policy),
        ("--scenario", &options.scenario),
        ("--trained-on", &options.trained_on),
    ];
    let given = files
        .into_iter()
        .filter_map(|(name, file)| Some((name, path(file.as_ref()?))));
    let settled = options.settled.then(|| ("--settled", String::new()));
    Asked {
        model: path(&options.model),
        train: options.train.iter().map(path).collect(),
        heldout: options.heldout.iter().map(path).collect(),
        map: options.columns.map.clone(),
        others: given.chain(settled).collect(),
    }
}

fn records(options: &Diagnose, columns: &ColumnMap, model: &Parameters) -> Result<(Vec<Record>, Vec<Record>), Faults> {
    let named = |files: &[PathBuf]| files.iter().map(FileName::from).collect::<Vec<_>>();
    open_all(&named(&options.train), &named(&options.heldout), columns, model)
}

fn columns(options: &Diagnose) -> Result<ColumnMap, Failure> {
    let mut columns = options.columns.read()?;
    if options.settled {
        columns.settled = Some(true);
    }
    Ok(columns)
}

fn found(options: &Diagnose, columns: &ColumnMap, say: &(dyn Fn(Progress<'_>) + Sync)) -> Result<Diagnosis, Failure> {
    let model = model(options)?;
    let closed_loop = options
        .policy
        .as_deref()
        .map(|policy| request(options, policy, &model))
        .transpose()?;
    say(Progress::Stage("reading the records"));
    let (train, heldout) = records(options, columns, &model)?;
    let mut diagnosis = diagnose(&model, train, &heldout, say);
    diagnosis.keep_text(&FileName::from(&options.model));
    if let Some(request) = closed_loop {
        say(Progress::Stage("closed loop"));
        diagnosis.close_the_loop(request);
    }
    Ok(diagnosis)
}

/// Progress on standard error: a line for each stage, and how much of it is done.
struct Shown {
    begun: Instant,
    stage: String,
    pace: Pace,
    line: ProgressLine,
}

impl Shown {
    fn new(begun: Instant) -> Self {
        Shown {
            begun,
            stage: String::new(),
            pace: Pace::new(),
            line: ProgressLine::new(),
        }
    }

    fn hear(&mut self, what: Progress<'_>) {
        match what {
            Progress::Stage(stage) => {
                self.line.clear();
                talk::tell(&format!("{:6.1} s  {stage}", self.begun.elapsed().as_secs_f64()));
                (self.stage, self.pace) = (stage.to_owned(), Pace::new());
            }
            Progress::Done { done, total } => {
                let (now, stage, pace) = (self.begun.elapsed().as_secs_f64(), &self.stage, self.pace);
                let left = || pace.left(done as u64, total as u64);
                self.line
                    .show(|| format!("{now:6.1} s  {stage}: {done} of {total}{}", left()));
            }
        }
    }
}

/// The policy and what is asked of it.
fn request(options: &Diagnose, path: &Path, model: &Parameters) -> Result<Request, Failure> {
    let policy = super::load(path, options.outside)?;
    super::drm::needs_mapping(&policy)?;
    let (trained_on, file) = match &options.trained_on {
        Some(path) => (Parameters::buck_from_file(path, "`diagnose --policy`")?, path),
        None => (model.clone(), &options.model),
    };
    let scenario = options.scenario.as_deref().map(Scenario::load).transpose()?;
    let given = scenario.as_ref().and_then(|scenario| scenario.v_ref);
    let v_ref = simulate::v_ref(given, &policy, options.scenario.as_ref().unwrap_or(&options.model))?;
    for (converter, file) in [(&trained_on, file), (model, &options.model)] {
        simulate::suits(&policy, converter, v_ref, file)?;
    }
    Ok(Request {
        losses: Losses::of(&trained_on)?,
        policy,
        trained_on,
        v_ref,
        load_steps: scenario
            .as_ref()
            .map_or_else(Vec::new, |scenario| scenario.load_steps.clone()),
        task: scenario.map_or_else(short_task, |scenario| scenario.task),
    })
}

/// Eight instants are enough to compare two mappings.
fn short_task() -> Task {
    Task {
        instants: 6,
        sampling_instants: 3,
        ..Task::default()
    }
}

#[cfg(test)]
mod tests {
    use super::remaining;

    #[test]
    fn a_few_seconds_left_are_not_worth_a_word() {
        assert_eq!(remaining(0.4), "");
        assert_eq!(remaining(35.2), ", about 35 s left");
    }
}

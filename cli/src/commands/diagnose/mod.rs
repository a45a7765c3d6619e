//! `policyc diagnose`

mod retrain;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

use ::diagnose::control::Request;
use ::diagnose::diagnosis::{Diagnosis, diagnose_knowing};
use ::diagnose::played;
use ::diagnose::progress::Progress;
use ::diagnose::record::{Record, open_all};
use ::diagnose::results::{self, Asked};
use ::diagnose::retrain::Refusal;
use ::diagnose::retrain::judged::Advice;
use closed_loop::Scenario;
use closed_loop::scenario::Task;
use drm::formula::Losses;
use measured::ColumnMap;
use plant::{Faults, Parameters, Topology};
use toml_input::{FileName, Message};

use super::progress_line::{Pace, ProgressLine, Working};
use super::simulate;
use crate::arguments::Diagnose;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

/// Reads the records, diagnoses, writes the three files.
pub fn run(options: &Diagnose) -> Result<Outcome, Failure> {
    let columns = columns(options)?;
    let training = retrain::prepare(options)?;
    let shown = Mutex::new(Shown::new(Instant::now()));
    let say = |what: Progress<'_>| {
        if let Ok(mut shown) = shown.lock() {
            shown.hear(what);
        }
    };
    let mut diagnosis = found(options, &columns, &say)?;
    if let Ok(mut shown) = shown.lock() {
        shown.line.clear();
    }
    write(options, &diagnosis)?;
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
    if !diagnosis.findings.next_experiments.is_empty() {
        let out = options.out.display();
        lines.push(format!(
            "next experiments, as files for the bench: {out}/{}",
            played::FOLDER
        ));
    }
    lines.push(format!("to look at: {}/report.html", options.out.display()));
    output::say(&lines.join("\n"))?;
    let own = match diagnosis.findings.compared.leaves_out() {
        true => Outcome::Different,
        false => Outcome::Done,
    };
    match training {
        Some(prepared) => retrained(options, &prepared, &mut diagnosis, own),
        None => Ok(own),
    }
}

/// Writes all files of the diagnosis.
fn write(options: &Diagnose, diagnosis: &Diagnosis) -> Result<(), Failure> {
    let files = results::files_of(diagnosis, &asked(options))?;
    output::replace_own_texts(&options.out, &files, options.replacing)
}

/// Trains anew, writes page and JSON again with what came of it, and says so. Without a policy to take the answer is no.
fn retrained(
    options: &Diagnose,
    prepared: &retrain::Prepared,
    diagnosis: &mut Diagnosis,
    own: Outcome,
) -> Result<Outcome, Failure> {
    let (ended, text) = match retrain::run(options, prepared, diagnosis)? {
        retrain::Ended::Interrupted => {
            output::say("\nor the same `policyc diagnose` with --resume, which compares the policies at the end")?;
            return Ok(Outcome::Interrupted);
        }
        retrain::Ended::Refused(refusal) => {
            let words = format!("Not trained anew. {}", refusal.words());
            diagnosis.findings.gain.retrained_missing = Some(words.clone());
            let is_right = refusal == Refusal::Nothing;
            (if is_right { own } else { Outcome::Different }, words)
        }
        retrain::Ended::Judged(judged, missed) => {
            let found = judged.findings.clone();
            let worse = missed || found.advice == Advice::Old;
            let text = format!("trained anew: {}", found.sentence);
            diagnosis.findings.gain.retrained = Some(found);
            diagnosis.retrained = Some(*judged);
            (if worse { Outcome::Different } else { own }, text)
        }
    };
    write(options, diagnosis)?;
    output::say(&format!("\n{text}\nreport: {}/report.html", options.out.display()))?;
    Ok(ended)
}

/// Name and text of every file of a diagnosis; nothing is written or said.
///
/// # Errors
/// As [`run`].
pub fn files(options: &Diagnose) -> Result<BTreeMap<String, String>, Failure> {
    if options.retrain.is_some() {
        let message = Message::new("a training writes its files itself, and none are handed over");
        return Err(message
            .hint("leave --retrain out, and train on plant.extended.toml")
            .into());
    }
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
    known_keys(&options.certain)?;
    retrain::prepare(options)?;
    records(options, &columns(options)?, &model)?;
    Ok(())
}

/// Keys of `--certain` are those of a plant file.
fn known_keys(certain: &[String]) -> Result<(), Faults> {
    let keys: Vec<&str> = plant::parameters().map(|parameter| parameter.key).collect();
    let unknown = certain.iter().find(|key| !keys.contains(&key.as_str()));
    unknown.map_or(Ok(()), |key| {
        let expected = "keys of a plant file with their tables, such as inductor.dcr";
        let message = Message::new(format!("unknown key `{}` in --certain", key.escape_debug()));
        Err(message
            .expected(expected)
            .did_you_mean(key, keys.iter().copied())
            .into())
    })
}

/// The model; a mapping is refitted for the buck alone.
fn model(options: &Diagnose) -> Result<Parameters, Faults> {
    match options.policy {
        // a policy may be there to be trained anew and to be compared, with a mapping or without one
        Some(_) if options.retrain.is_some() => Parameters::from_file(&options.model),
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
        ("--retrain", &options.retrain),
        ("--scenario", &options.scenario),
        ("--trained-on", &options.trained_on),
    ];
    let given = files
        .into_iter()
        .filter_map(|(name, file)| Some((name, path(file.as_ref()?))));
    let settled = options.settled.then(|| ("--settled", String::new()));
    let certain = (!options.certain.is_empty()).then(|| ("--certain", options.certain.join(",")));
    Asked {
        model: path(&options.model),
        train: options.train.iter().map(path).collect(),
        heldout: options.heldout.iter().map(path).collect(),
        map: options.columns.map.clone(),
        others: given.chain(settled).chain(certain).collect(),
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
    known_keys(&options.certain)?;
    let closed_loop = options
        .policy
        .as_deref()
        .map(|policy| request(options, policy, &model))
        .transpose()?
        .flatten();
    let reading = Working::new("reading the records");
    let (train, heldout) = records(options, columns, &model)?;
    drop(reading);
    let mut diagnosis = diagnose_knowing(&model, &options.certain, train, &heldout, say);
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
            Progress::Noticed(words) => {
                self.line.clear();
                talk::tell(&format!("{:6.1} s  note: {words}", self.begun.elapsed().as_secs_f64()));
            }
        }
    }
}

/// The policy and what is asked of it; nothing of one without a mapping that is there to be trained anew.
fn request(options: &Diagnose, path: &Path, model: &Parameters) -> Result<Option<Request>, Failure> {
    // a training has one duty, and so has the policy that it is compared with
    let policy = match options.retrain {
        Some(_) => super::load(path, options.outside)?,
        None => super::load_several_as(path, options.outside, None)?,
    };
    let is_buck = model.converter.topology == Topology::Buck;
    if options.retrain.is_some() && (policy.mapping.is_none() || !is_buck) {
        return Ok(None);
    }
    let (trained_on, file) = match &options.trained_on {
        Some(path) => (Parameters::buck_from_file(path, "`diagnose --policy`")?, path),
        None => (model.clone(), &options.model),
    };
    let scenario = options.scenario.as_deref().map(Scenario::load).transpose()?;
    let named = options.output.as_deref();
    let named = named.or(scenario.as_ref().and_then(|scenario| scenario.output.as_deref()));
    let output = closed_loop::driving(named, &policy, options.scenario.as_deref().unwrap_or(path))?;
    super::drm::needs_mapping(&policy, output)?;
    let given = scenario.as_ref().and_then(|scenario| scenario.v_ref);
    let v_ref = simulate::v_ref(given, &policy, options.scenario.as_ref().unwrap_or(&options.model))?;
    for (converter, file) in [(&trained_on, file), (model, &options.model)] {
        simulate::suits(&policy, converter, v_ref, file)?;
    }
    Ok(Some(Request {
        losses: Losses::of(&trained_on)?,
        policy,
        output,
        trained_on,
        v_ref,
        load_steps: scenario
            .as_ref()
            .map_or_else(Vec::new, |scenario| scenario.load_steps.clone()),
        task: scenario.map_or_else(short_task, |scenario| scenario.task),
    }))
}

/// Eight instants are enough to compare two mappings.
fn short_task() -> Task {
    Task {
        instants: 6,
        sampling_instants: 3,
        ..Task::default()
    }
}

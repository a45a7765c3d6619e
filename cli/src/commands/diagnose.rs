//! `policyc diagnose`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

use ::diagnose::capture::estimates::Estimates;
use ::diagnose::control::Request;
use ::diagnose::diagnosis::{Diagnosis, diagnose};
use ::diagnose::extend::{extended_toml, partial_toml};
use ::diagnose::findings::Findings;
use ::diagnose::gain::Regime;
use ::diagnose::page::page;
use ::diagnose::preflight;
use ::diagnose::progress::Progress;
use ::diagnose::record::Record;
use closed_loop::Scenario;
use closed_loop::scenario::Task;
use drm::formula::Losses;
use measured::ColumnMap;
use plant::{Faults, Parameters};
use toml_input::{Fault, Message, Sink};

use super::progress_line::ProgressLine;
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
    output::replace_own_texts(&options.out, &texts(&diagnosis)?, options.replacing)?;
    answer(options, &columns, &diagnosis.findings)?;
    Ok(Outcome::Done)
}

/// Name and text of every file of a diagnosis; nothing is written or said.
///
/// # Errors
/// As [`run`].
pub fn files(options: &Diagnose) -> Result<BTreeMap<String, String>, Failure> {
    texts(&found(options, &columns(options)?, &|_| {})?)
}

/// Reads every file that is named, and diagnoses nothing.
///
/// # Errors
/// Their faults.
pub fn check(options: &Diagnose) -> Result<(), Failure> {
    let model = Parameters::buck_from_file(&options.model, "`diagnose`")?;
    if let Some(policy) = &options.policy {
        request(options, policy, &model)?;
    }
    records(options, &columns(options)?, &model)?;
    Ok(())
}

fn columns(options: &Diagnose) -> Result<ColumnMap, Failure> {
    let mut columns = options.columns.read()?;
    if options.settled {
        columns.settled = Some(true);
    }
    Ok(columns)
}

fn found(options: &Diagnose, columns: &ColumnMap, say: &(dyn Fn(Progress<'_>) + Sync)) -> Result<Diagnosis, Failure> {
    let model = Parameters::buck_from_file(&options.model, "`diagnose`")?;
    let closed_loop = options
        .policy
        .as_deref()
        .map(|policy| request(options, policy, &model))
        .transpose()?;
    let (train, heldout) = records(options, columns, &model)?;
    let mut diagnosis = diagnose(&model, train, &heldout, say);
    if let Some(request) = closed_loop {
        say(Progress::Stage("closed loop"));
        diagnosis.close_the_loop(request);
    }
    Ok(diagnosis)
}

fn texts(diagnosis: &Diagnosis) -> Result<BTreeMap<String, String>, Failure> {
    let mut json = serde_json::to_string_pretty(&diagnosis.findings)?;
    json.push('\n');
    let mut files = BTreeMap::from([
        ("diagnosis.json".to_owned(), json),
        ("plant.extended.toml".to_owned(), extended_toml(diagnosis)),
        ("report.html".to_owned(), page(diagnosis)?),
    ]);
    if let Some(partial) = partial_toml(diagnosis) {
        files.insert("plant.partial.toml".to_owned(), partial);
    }
    if let Some(control) = &diagnosis.control {
        files.insert("drm.toml".to_owned(), control.mapping.clone());
    }
    Ok(files)
}

/// The verdict, then what was noticed, then where the rest stands.
fn answer(options: &Diagnose, columns: &ColumnMap, findings: &Findings) -> Result<(), Failure> {
    let (word, sentence) = (findings.verdict.word(), &findings.sentence);
    let mut lines = vec![format!("verdict: {word}\n{sentence}\n")];
    let files = options.train.iter().chain(&options.heldout);
    for name in columns.sections_without(&files.map(PathBuf::as_path).collect::<Vec<_>>()) {
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
    if lines.len() > 1 {
        lines.push(String::new());
    }
    lines.push(format!("report: {}/report.html", options.out.display()));
    output::say(&lines.join("\n"))?;
    Ok(())
}

/// Progress on standard error: a line for each stage, and how much of it is done.
struct Shown {
    begun: Instant,
    stage: String,
    stage_begun: Instant,
    line: ProgressLine,
}

impl Shown {
    fn new(begun: Instant) -> Self {
        Shown {
            begun,
            stage: String::new(),
            stage_begun: begun,
            line: ProgressLine::new(),
        }
    }

    fn hear(&mut self, what: Progress<'_>) {
        match what {
            Progress::Stage(stage) => {
                self.line.clear();
                talk::tell(&format!("{:6.1} s  {stage}", self.begun.elapsed().as_secs_f64()));
                (self.stage, self.stage_begun) = (stage.to_owned(), Instant::now());
            }
            Progress::Done { done, total } => {
                let spent = self.stage_begun.elapsed().as_secs_f64();
                let left = spent / done.max(1) as f64 * total.saturating_sub(done) as f64;
                let (now, stage) = (self.begun.elapsed().as_secs_f64(), &self.stage);
                self.line
                    .show(|| format!("{now:6.1} s  {stage}: {done} of {total}{}", remaining(left)));
            }
        }
    }
}

/// Least time left that is worth a word, s: the pieces of a stage differ by more, and one that takes longer than those before it would
/// be "about 0 s left" for long.
const WORTH_SAYING: f64 = 5.0;

/// What is said of the time that is left.
fn remaining(seconds: f64) -> String {
    match seconds >= WORTH_SAYING {
        true => format!(", about {seconds:.0} s left"),
        false => String::new(),
    }
}

/// The policy and what is asked of it.
fn request(options: &Diagnose, path: &Path, model: &Parameters) -> Result<Request, Failure> {
    let policy = super::load(path, options.outside)?;
    super::drm::needs_mapping(&policy)?;
    let (trained_on, file) = match &options.trained_on {
        Some(path) => (Parameters::buck_from_file(path, "`diagnose`")?, path),
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

/// All records, or all their faults.
fn records(options: &Diagnose, columns: &ColumnMap, model: &Parameters) -> Result<(Vec<Record>, Vec<Record>), Faults> {
    let mut faults = Sink::new();
    let mut read = |files: &[PathBuf]| {
        let one = |file: &PathBuf| faults.keep(Record::open(file, columns, model));
        files.iter().filter_map(one).collect::<Vec<_>>()
    };
    let (train, heldout) = (read(&options.train), read(&options.heldout));
    faults.propagate().map_err(said_once)?;
    let again = preflight::repeated(&train, &heldout);
    let message = |(held, train): (&str, &str)| {
        Message::new(format!(
            "the held-out record `{held}` is the training record `{train}` again"
        ))
        .expected("a record that no fit has seen")
        .hint("it would judge a fit by what was fitted: leave it out, or cut the record in two")
    };
    let file = options.heldout.first().map_or(Path::new(""), PathBuf::as_path);
    let again = again.into_iter().map(|pair| Fault::in_file(file, message(pair)));
    again.collect::<Sink>().propagate()?;
    Ok((train, heldout))
}

/// The same fault of several files once, with the names of the others: records of one logger share their header.
fn said_once(mut faults: Faults) -> Faults {
    let mut list: Vec<(Fault, Vec<String>)> = Vec::new();
    for fault in faults.list {
        let is_same = |known: &Fault| {
            let mut other = known.clone();
            other.file.clone_from(&fault.file);
            known.file != fault.file && other == fault
        };
        match list.iter_mut().find(|(known, _)| is_same(known)) {
            Some((_, others)) => others.push(format!("`{}`", fault.file.display())),
            None => list.push((fault, Vec::new())),
        }
    }
    let told = |(mut fault, others): (Fault, Vec<String>)| {
        if !others.is_empty() {
            fault.problem = format!("{}; the same in {}", fault.problem, others.join(", "));
        }
        fault
    };
    faults.list = list.into_iter().map(told).collect();
    faults
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use toml_input::{Fault, Faults, Message};

    use super::{remaining, said_once};

    #[test]
    fn a_fault_of_three_files_is_said_once() {
        let fault = |file: &str, problem: &str| Fault::in_file(Path::new(file), Message::new(problem));
        let mut all = Faults::from(fault("a.csv", "no load"));
        all.list.extend([
            fault("b.csv", "no load"),
            fault("b.csv", "no duty"),
            fault("c.csv", "no load"),
        ]);
        let said: Vec<String> = said_once(all).iter().map(|fault| fault.problem.clone()).collect();
        assert_eq!(said, ["no load; the same in `b.csv`, `c.csv`", "no duty"]);
    }

    #[test]
    fn a_few_seconds_left_are_not_worth_a_word() {
        assert_eq!(remaining(0.4), "");
        assert_eq!(remaining(35.2), ", about 35 s left");
    }
}

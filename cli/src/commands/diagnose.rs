//! `policyc diagnose`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use ::diagnose::control::Request;
use ::diagnose::diagnosis::diagnose;
use ::diagnose::extend::extended_toml;
use ::diagnose::page::page;
use ::diagnose::record::Record;
use closed_loop::Scenario;
use closed_loop::scenario::Task;
use drm::formula::Losses;
use measured::ColumnMap;
use plant::{Faults, Parameters};
use toml_input::Sink;

use super::simulate;
use crate::arguments::Diagnose;
use crate::{Failure, Outcome, output};

/// Reads the records, diagnoses, writes the three files.
pub fn run(options: &Diagnose) -> Result<Outcome, Failure> {
    let model = Parameters::from_file(&options.model)?;
    let mut columns = options.columns.read()?;
    if options.settled {
        columns.settled = Some(true);
    }
    let closed_loop = options
        .policy
        .as_deref()
        .map(|policy| request(options, policy, &model))
        .transpose()?;
    let (train, heldout) = records(options, &columns, &model)?;
    let start = Instant::now();
    let say = |what: &str| eprintln!("{:6.1} s  {what}", start.elapsed().as_secs_f64());
    let mut diagnosis = diagnose(&model, train, &heldout, &say);
    if let Some(request) = closed_loop {
        say("closed loop");
        diagnosis.close_the_loop(request);
    }
    let mut json = serde_json::to_string_pretty(&diagnosis.findings)?;
    json.push('\n');
    let mut files = BTreeMap::from([
        ("diagnosis.json".to_owned(), json),
        ("plant.extended.toml".to_owned(), extended_toml(&diagnosis)),
        ("report.html".to_owned(), page(&diagnosis)?),
    ]);
    if let Some(control) = &diagnosis.control {
        files.insert("drm.toml".to_owned(), control.mapping.clone());
    }
    output::replace_own_texts(&options.out, &files, options.replacing)?;
    let out = options.out.display();
    let files = options.train.iter().chain(&options.heldout);
    for name in columns.sections_without(&files.map(PathBuf::as_path).collect::<Vec<_>>()) {
        output::say(&format!(
            "note: no record is called `{name}`: its section of the column map is not used"
        ))?;
    }
    for repair in &diagnosis.findings.noise.repairs {
        output::say(&format!("note: {repair}"))?;
    }
    if let Some(reason) = &diagnosis.findings.gain.closed_loop_missing {
        output::say(&format!(
            "note: no mapping and no closed loop on the extended model: {reason}"
        ))?;
    }
    let findings = &diagnosis.findings;
    let (word, sentence) = (findings.verdict.word(), &findings.sentence);
    output::say(&format!("verdict: {word}\n{sentence}\n\nreport: {out}/report.html"))?;
    Ok(Outcome::Done)
}

/// The policy and what is asked of it.
fn request(options: &Diagnose, path: &Path, model: &Parameters) -> Result<Request, Failure> {
    let policy = super::load(path)?;
    super::drm::needs_mapping(&policy)?;
    let (trained_on, file) = match &options.trained_on {
        Some(path) => (Parameters::from_file(path)?, path),
        None => (model.clone(), &options.model),
    };
    let scenario = options.scenario.as_deref().map(Scenario::load).transpose()?;
    let given = scenario.as_ref().and_then(|scenario| scenario.v_ref);
    let v_ref = simulate::v_ref(given, &policy, options.scenario.as_ref().unwrap_or(&options.model))?;
    for (converter, file) in [(&trained_on, file), (model, &options.model)] {
        simulate::suits(&policy, converter, v_ref, file)?;
    }
    Ok(Request {
        losses: Losses::of(&trained_on),
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
    faults.propagate()?;
    Ok((train, heldout))
}

//! `policyc simulate`

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::Ordering;

use closed_loop::Scenario;
use closed_loop::simulation::{Draws, Findings, PAGE, Setting, Spread, simulate};
use serde::Serialize;
use toml_input::FileName;

use super::controllers;
use super::foreign::opener;
use super::progress_line::{Pace, ProgressLine};
use crate::arguments::Simulate;
use crate::failure::Failure;
use crate::interruption;
use crate::made;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

// `diagnose` asks the same of a policy
pub use closed_loop::{suits, v_ref};

/// What `--json` prints.
#[derive(Serialize)]
struct Answer<'a, T: Serialize> {
    out: &'a Path,
    files: Vec<&'a String>,
    /// The keys of `metrics.json`.
    #[serde(flatten)]
    metrics: T,
}

/// Simulates, writes, reports.
pub fn run(options: &Simulate) -> Result<Outcome, Failure> {
    let stop = interruption::stop_on_signal();
    output::check_new_folder(&options.out)?;
    let found = all(options, setting(options)?);
    if stop.load(Ordering::Relaxed) {
        // what failed, failed because of the signal
        talk::interrupted("nothing written");
        return Ok(Outcome::Interrupted);
    }
    let found = found?;
    let files = signed(options, &found)?;
    output::write_results(&options.out, &files)?;
    if options.json {
        found.notes().iter().for_each(|note| talk::note(note));
        output::say_json(&Answer {
            out: &options.out,
            files: files.keys().collect(),
            metrics: found.metrics(),
        })?;
    } else {
        output::say_results(&options.out, &files, &found.summary(), PAGE)?;
    }
    let equal = found.check.is_none_or(|check| check.differences.is_empty());
    Ok(if equal { Outcome::Done } else { Outcome::Different })
}

/// Reads every file that is named, and simulates nothing.
///
/// # Errors
/// Their faults.
pub fn check(options: &Simulate) -> Result<(), Failure> {
    setting(options).map(|_| ())
}

/// What is simulated.
fn setting(options: &Simulate) -> Result<Setting, Failure> {
    let mut scenario = Scenario::load(&options.scenario)?;
    if options.output.is_some() {
        scenario.output.clone_from(&options.output);
    }
    let policy = super::load_several_as(&options.policy, options.outside, options.format)?;
    let plant = options.plant.as_deref().map(FileName::new);
    let setting = Setting::open(&options.scenario, scenario, policy, plant, &opener(options.foreign))?;
    let spread = options
        .spread
        .iter()
        .map(|text| Spread::parse(text))
        .collect::<Result<_, _>>()?;
    let draws = options.spread_draws.zip(options.spread_seed);
    let setting = setting.spread(spread, draws.map(|(count, seed)| Draws { count, seed }))?;
    Ok(match &options.designed_on {
        None => setting,
        Some(file) => setting.designed_on(file)?,
    })
}

/// Name and text of every file of a simulation; nothing is written.
///
/// # Errors
/// As [`run`].
pub fn files(options: &Simulate) -> Result<BTreeMap<String, String>, Failure> {
    signed(options, &all(options, setting(options)?)?)
}

fn signed(options: &Simulate, found: &Findings) -> Result<BTreeMap<String, String>, Failure> {
    let mut files = found.files()?;
    let path = |path: &Path| path.display().to_string();
    let mut read = vec![("scenario", path(&options.scenario)), ("policy", path(&options.policy))];
    read.extend(options.plant.iter().map(|plant| ("plant", path(plant))));
    made::signed(&mut files, &[("--out", "simulation")], &read)?;
    Ok(files)
}

/// Starts the controllers and simulates.
fn all(options: &Simulate, setting: Setting) -> Result<Findings, Failure> {
    let named = controllers::start_all(&setting.policy, setting.output, options.controller, options.check)?;
    let (mut line, pace) = (ProgressLine::new(), Pace::new());
    let found = simulate(setting, named, &mut |next| line.next(next, pace))?;
    line.clear();
    Ok(found)
}

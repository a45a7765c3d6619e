//! `policyc simulate`

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use closed_loop::limit::{Limit, left_out};
use closed_loop::scenario::Finding;
use closed_loop::{Converter, LoadStep, Scenario, Trajectory};
use plant::Parameters;
use policy::Policy;
use toml_input::{Fault, FileName, Message};

use crate::arguments::Simulate;
use crate::{Failure, Outcome, interruption, output};

pub mod controllers;
mod files;
mod page;
mod pictures;
mod runs;

/// Name of the policy among the controllers.
const POLICY: &str = "policy";

/// A scenario with everything it needs, all of it sound.
struct Setting {
    scenario: Scenario,
    policy: Policy,
    plant: PathBuf,
    converter: Converter,
    v_ref: f64,
    notes: Vec<String>,
}

/// One controller on one load step.
struct Course {
    name: String,
    finding: Finding,
    /// At the first sampling instant.
    shown: Trajectory,
}

/// Everything found on one load step; the policy comes first.
struct Step {
    step: LoadStep,
    courses: Vec<Course>,
    /// By name.
    limits: Vec<(String, Limit)>,
}

/// The comparison of the controllers that should be one.
struct Check {
    /// Each of them.
    names: Vec<String>,
    /// Control periods of each, over all load steps and instants.
    periods: usize,
    /// The first difference of each that has one, in words.
    differences: Vec<String>,
}

/// What a simulation found.
struct Findings {
    setting: Setting,
    /// What ran the policy.
    controller: String,
    steps: Vec<Step>,
    check: Option<Check>,
}

/// Simulates, writes, reports.
pub fn run(options: &Simulate) -> Result<Outcome, Failure> {
    let stop = interruption::stop_on_signal();
    output::check_new_folder(&options.out)?;
    let setting = prepare(options)?;
    let found = runs::all(options, setting, &stop);
    if stop.load(Ordering::Relaxed) {
        // what failed, failed because of the signal
        output::say("Interrupted; nothing written")?;
        return Ok(Outcome::Interrupted);
    }
    let found = found?;
    let files = files::all(&found)?;
    output::write_results(&options.out, &files, &files::summary(&found), files::PAGE)?;
    let equal = found.check.is_none_or(|check| check.differences.is_empty());
    Ok(if equal { Outcome::Done } else { Outcome::Different })
}

/// An error where the user has had enough.
pub fn go_on(stop: &AtomicBool) -> Result<(), Failure> {
    if stop.load(Ordering::Relaxed) {
        return Err(Message::new("interrupted").into());
    }
    Ok(())
}

fn prepare(options: &Simulate) -> Result<Setting, Failure> {
    let scenario = Scenario::load(&options.scenario)?;
    let policy = super::load(&options.policy)?;
    let file = &options.scenario;
    let Some(plant) = options.plant.clone().or(scenario.plant.clone()) else {
        let message = Message::new("no plant").hint("plant = \"../plants/paper-model.toml\", or --plant PLANT");
        return Err(Fault::in_file(file, message).into());
    };
    let name = match &options.plant {
        Some(path) => FileName::new(path),
        None => FileName::named_by_a_file(&plant),
    };
    let converter = Converter::load(name, &scenario.set)?;
    let v_ref = v_ref(scenario.v_ref, &policy, file)?;
    suits(&policy, converter.parameters(), v_ref, file)?;
    let mut notes = Vec::new();
    if scenario.default_steps {
        notes.push(
            "the scenario names no load step: those of the paper's 100 V converter are taken; give load_steps (W), current_steps (A) \
             or resistance_steps (ohm) for yours"
                .to_owned(),
        );
    }
    if let Some(theirs) = held_by(&policy).filter(|theirs| *theirs != v_ref) {
        notes.push(format!(
            "the policy holds {theirs} V, but errors are counted from {v_ref} V"
        ));
    }
    let left_out = left_out(converter.parameters());
    if !scenario.limits.is_empty() && !left_out.is_empty() {
        notes.push(format!(
            "the limit is that of the plain circuit; it leaves out {}",
            left_out.join(", ")
        ));
    }
    Ok(Setting {
        scenario,
        policy,
        plant,
        converter,
        v_ref,
        notes,
    })
}

/// The voltage that the policy says it holds, V.
fn held_by(policy: &Policy) -> Option<f64> {
    policy.parameters.get("v_ref").copied()
}

/// The voltage to hold, V: `given` by a scenario, whose `file` it is, or by the policy.
///
/// # Errors
/// If neither scenario nor policy names one.
pub fn v_ref(given: Option<f64>, policy: &Policy, file: &Path) -> Result<f64, Failure> {
    given.or(held_by(policy)).ok_or_else(|| {
        let message = Message::new("no voltage to hold");
        let message = message.hint("v_ref = 100.0, as the policy has no parameter `v_ref`");
        Fault::in_file(file, message).into()
    })
}

/// Whether a policy can control a converter; `file` is where the converter was named.
///
/// # Errors
/// If the voltage is out of reach or the control periods differ.
pub fn suits(policy: &Policy, converter: &Parameters, v_ref: f64, file: &Path) -> Result<(), Failure> {
    let v_in = converter.converter.v_in;
    if v_ref >= v_in {
        let message = Message::new("a buck converter cannot hold this voltage")
            .found(format!("v_ref = {v_ref} V, v_in = {v_in} V at the plant"));
        return Err(Fault::in_file(file, message).into());
    }
    let (ours, theirs) = (policy.sample_period, converter.t_sw());
    if (ours - theirs).abs() > 1e-9 * theirs {
        let message = Message::new("policy and plant have different control periods")
            .found(format!(
                "sample_period = {ours} s in the policy, {theirs} s at the plant"
            ))
            .hint("f_sw of the plant is 1 / sample_period");
        return Err(Fault::in_file(file, message).into());
    }
    Ok(())
}

//! What is simulated, and what was found.

use std::path::{Path, PathBuf};

use policy::Policy;
use toml_input::{Fault, FileName, Message};

use crate::converter::Converter;
use crate::course::Course;
use crate::faults::Error;
use crate::limit::{Limit, left_out};
use crate::load_step::{LoadKind, LoadStep};
use crate::scenario_file::Scenario;
use crate::suits::{draws, held_by, holds_power, suits, v_ref};

/// Name of the policy among the controllers.
pub const POLICY: &str = "policy";
/// Name of the law that a policy adds to, on its own.
pub(super) const LAW: &str = "law alone";

/// A scenario with everything it needs, all of it sound.
#[derive(Debug, Clone)]
pub struct Setting {
    /// What the file says.
    pub scenario: Scenario,
    /// The policy.
    pub policy: Policy,
    /// The plant's file.
    pub plant: PathBuf,
    /// The plant, with the scenario's numbers in it.
    pub converter: Converter,
    /// Voltage to hold, V.
    pub v_ref: f64,
    /// What the user should know of the scenario, one sentence each.
    pub notes: Vec<String>,
}

/// Everything found on one load step.
#[derive(Debug, Clone)]
pub struct Step {
    /// The load step.
    pub step: LoadStep,
    /// Controllers by name: [`POLICY`], then the classical ones.
    pub courses: Vec<(String, Course)>,
    /// What no controller can beat, by name.
    pub limits: Vec<(String, Limit)>,
}

/// The comparison of controllers that should be one.
#[derive(Debug, Clone)]
pub struct Check {
    /// Each of them; the others are compared with the first.
    pub names: Vec<String>,
    /// Control periods of each, over all load steps and instants.
    pub periods: usize,
    /// The first difference of each that has one, on each load step, in words.
    pub differences: Vec<String>,
}

/// What a simulation found; the files and the summary of it are methods.
#[derive(Debug, Clone)]
pub struct Findings {
    /// What was simulated, with notes that came up on the way.
    pub setting: Setting,
    /// What ran the policy.
    pub controller: String,
    /// In the order of the scenario.
    pub steps: Vec<Step>,
    /// If there was more than one controller of the policy.
    pub check: Option<Check>,
}

impl Setting {
    /// Puts a scenario, which was read from `file`, and a policy together; `plant` is a plant's file in the place of the
    /// scenario's.
    ///
    /// # Errors
    /// If no plant or no voltage to hold is named, the plant's file is none, or policy and plant do not suit each other.
    pub fn new(file: &Path, scenario: Scenario, policy: Policy, plant: Option<&Path>) -> Result<Self, Error> {
        let named = |plant: PathBuf| (FileName::named_by_a_file(&plant), plant);
        let given = plant.map(|path| (FileName::new(path), path.to_owned()));
        let Some((name, plant)) = given.or_else(|| scenario.plant.clone().map(named)) else {
            let message = Message::new("no plant").hint("plant = \"../plants/paper-model.toml\", or --plant PLANT");
            return Err(Fault::in_file(file, message).into());
        };
        let converter = Converter::load(name, &scenario.set)?;
        let v_ref = v_ref(scenario.v_ref, &policy, file)?;
        suits(&policy, converter.parameters(), v_ref, file)?;
        draws(converter.parameters(), &scenario.load_steps, file)?;
        if scenario.load_steps.iter().any(|step| step.kind == LoadKind::Power) {
            holds_power(converter.parameters(), v_ref, &plant)?;
        }
        Ok(Self {
            notes: notes(&scenario, &policy, &converter, v_ref),
            scenario,
            policy,
            plant,
            converter,
            v_ref,
        })
    }
}

fn notes(scenario: &Scenario, policy: &Policy, converter: &Converter, v_ref: f64) -> Vec<String> {
    let mut notes = Vec::new();
    if scenario.default_steps {
        notes.push(
            "the scenario names no load step: those of the paper's 100 V converter are taken; give load_steps (W), current_steps (A) \
             or resistance_steps (ohm) for yours"
                .to_owned(),
        );
    }
    if let Some(theirs) = held_by(policy).filter(|theirs| *theirs != v_ref) {
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
    notes
}

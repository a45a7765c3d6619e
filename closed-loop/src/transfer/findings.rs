//! What is transferred, with what, and what was found.

use std::path::Path;

use drm::formula::Losses;
use plant::Parameters;
use policy::Policy;
use toml_input::{Fault, Message};

use crate::course::{Course, Named, Tell};
use crate::environment::varied;
use crate::faults::Error;
use crate::refit::{Refit, needs_mapping};
use crate::scenario_file::Scenario;
use crate::suits::{draws, driving, suits, v_ref};

/// Names of the runs.
pub(super) const SIMULATION: &str = "simulation";
pub(super) const UNMAPPED: &str = "no mapping";
pub(super) const MAPPED: &str = "mapped";
pub(super) const EXACT: &str = "exact mapping";

/// A transfer with what it is of, all of it sound.
#[derive(Debug, Clone)]
pub struct Setting {
    /// Load steps and instants; its plant is the converter that the policy was trained on.
    pub scenario: Scenario,
    /// The policy, with a mapping.
    pub policy: Policy,
    /// Index of the output that drives the converters, and whose mapping is fitted; 0 of a policy with one.
    pub output: usize,
    /// What the policy was trained on.
    pub nominal: Parameters,
    /// Its steady state.
    pub trained_on: Losses,
    /// Voltage to hold, V.
    pub v_ref: f64,
}

/// With what a transfer is done.
pub struct Means<'a, E> {
    /// What simulates the real converters, as in "simulated by ngspice".
    pub simulator: &'static str,
    /// The real converter of a plant's file with these numbers.
    pub simulate: &'a dyn Fn(&Path, &Parameters) -> Result<E, Error>,
    /// The controller of a policy, started.
    pub start: &'a dyn Fn(&Policy) -> Result<Named, Error>,
    /// Run the exact mapping of a converter as well, from the formula of its losses.
    pub ideal: bool,
    /// Called before each run and each point.
    pub tell: &'a mut Tell<'a>,
}

/// A controller on all load steps at one converter.
#[derive(Debug, Clone)]
pub struct Run {
    /// Such as `no mapping`.
    pub name: &'static str,
    /// In the order of the scenario.
    pub courses: Vec<Course>,
}

/// What was found at one real converter.
#[derive(Debug, Clone)]
pub struct Real {
    /// Name of its file without ending.
    pub name: String,
    /// Settled points as CSV.
    pub points: String,
    /// The mapping that was fitted to them.
    pub report: drm::Report,
    /// Without a mapping, with the fitted one, with the exact one if asked for.
    pub runs: Vec<Run>,
    /// What no mapping repairs.
    pub remarks: Vec<String>,
    /// What the user should know, one sentence each.
    pub notes: Vec<String>,
}

/// Everything found; the files and the summary of it are methods.
#[derive(Debug, Clone)]
pub struct Findings {
    /// What was transferred.
    pub setting: Setting,
    /// What simulated the real converters.
    pub simulator: &'static str,
    /// What ran the policy.
    pub controller: String,
    /// The policy on the converter of its training.
    pub simulation: Run,
    /// Each real converter.
    pub real: Vec<Real>,
}

impl Setting {
    /// Puts a scenario, which was read from `file`, and a policy together.
    ///
    /// # Errors
    /// If the policy has no mapping, no plant or no voltage to hold is named, the plant's file is none, or policy and plant do
    /// not suit each other.
    pub fn new(file: &Path, scenario: Scenario, policy: Policy) -> Result<Self, Error> {
        let output = driving(scenario.output.as_deref(), &policy, file)?;
        needs_mapping(&policy, output)?;
        let Some(trained_on) = &scenario.plant else {
            let message = Message::new("no plant").expected("the converter that the policy was trained on");
            let message = message.hint("plant = \"../plants/paper-model.toml\"");
            return Err(Fault::in_file(file, message).into());
        };
        let set: Vec<(&str, f64)> = scenario.set.iter().map(|(key, value)| (key.as_str(), *value)).collect();
        let nominal = varied(&Parameters::buck_from_file(trained_on.clone(), "a transfer")?, &set);
        // `[set]` may name another
        nominal.require_buck("a transfer")?;
        let v_ref = v_ref(scenario.v_ref, &policy, file)?;
        suits(&policy, &nominal, v_ref, &trained_on.path)?;
        draws(&nominal, &scenario.load_steps, file)?;
        if let Some(step) = scenario.load_steps.iter().find(|step| step.keeps_load()) {
            let message =
                Message::new("a transfer has no steps of the source or the reference").found(step.to_string());
            let message = message.hint("both converters have source voltages of their own: `simulate` each of them");
            return Err(Fault::in_file(file, message).into());
        }
        Ok(Self {
            trained_on: Losses::of(&nominal)?,
            scenario,
            policy,
            output,
            nominal,
            v_ref,
        })
    }

    /// What the policy is to do where.
    pub(super) fn refit(&self) -> Refit<'_> {
        Refit {
            policy: &self.policy,
            output: self.output,
            nominal: &self.nominal,
            trained_on: self.trained_on,
            v_ref: self.v_ref,
            load_steps: &self.scenario.load_steps,
        }
    }
}

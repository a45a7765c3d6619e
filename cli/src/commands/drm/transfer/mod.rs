//! `policyc drm transfer`: the paper's procedure, from the simulation to converters that are not the simulated one

mod files;
mod ideal;
mod pictures;
mod runs;

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::Args;
use closed_loop::refit::Refit;
use closed_loop::scenario::Finding;
use closed_loop::{LoadStep, Scenario, Trajectory};
use drm::formula::Losses;
use plant::Parameters;
use policy::Policy;
use toml_input::{Fault, Message};

use super::bench::Simulator;
use crate::arguments::ControllerKind;
use crate::commands::simulate;
use crate::{Failure, Outcome, interruption, output};

#[derive(Debug, Args)]
pub struct Transfer {
    /// Scenario file, as for `simulate`: load steps, instants; its plant is the converter that the policy was trained on
    pub scenario: PathBuf,
    /// policy.toml with a mapping, or the folder that holds it
    #[arg(long, value_name = "POLICY")]
    pub policy: PathBuf,
    /// "Real" converters; several separated by commas
    #[arg(long, value_name = "FILE", required = true, value_delimiter = ',')]
    pub real: Vec<PathBuf>,
    /// What simulates the real converters
    #[arg(long, value_enum, default_value_t = Simulator::Plant)]
    pub simulator: Simulator,
    /// What controls them
    #[arg(long, value_enum, default_value_t = ControllerKind::C)]
    pub controller: ControllerKind,
    /// Beside the fitted mapping, run the exact one: the formula of the real converter's losses
    #[arg(long)]
    pub ideal: bool,
    /// Folder to write; must be empty or not exist yet
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// A transfer with everything it needs.
struct Setting {
    scenario: Scenario,
    policy: Policy,
    /// What the policy was trained on.
    nominal: Parameters,
    /// Its steady state.
    trained_on: Losses,
    v_ref: f64,
    simulator: Simulator,
    controller: ControllerKind,
    ideal: bool,
}

/// A controller on one load step at one converter.
struct Course {
    step: LoadStep,
    finding: Finding,
    /// At the first sampling instant.
    shown: Trajectory,
}

/// A controller on all load steps at one converter.
struct Run {
    name: &'static str,
    courses: Vec<Course>,
}

/// What was found at one real converter.
struct Real {
    /// Name of its file without ending.
    name: String,
    /// Settled points as CSV.
    points: String,
    report: drm::Report,
    /// Without a mapping, with the fitted one, with the exact one if asked for.
    runs: Vec<Run>,
    /// What no mapping repairs.
    remarks: Vec<String>,
    notes: Vec<String>,
}

/// Everything found.
struct Findings {
    setting: Setting,
    /// What ran the policy.
    controller: String,
    /// The policy on the converter of its training.
    simulation: Run,
    real: Vec<Real>,
}

/// Transfers, writes, reports.
pub fn run(options: &Transfer) -> Result<Outcome, Failure> {
    output::check_new_folder(&options.out)?;
    let setting = prepare(options)?;
    let stop = interruption::stop_on_signal();
    let found = runs::all(options, setting, &stop);
    if stop.load(Ordering::Relaxed) {
        output::say("Interrupted; nothing written")?;
        return Ok(Outcome::Interrupted);
    }
    let found = found?;
    let files = files::all(&found)?;
    output::write_results(&options.out, &files, &files::said(&found), files::PAGE)?;
    Ok(Outcome::Done)
}

fn prepare(options: &Transfer) -> Result<Setting, Failure> {
    let scenario = Scenario::load(&options.scenario)?;
    let policy = crate::commands::load(&options.policy)?;
    let file = &options.scenario;
    super::needs_mapping(&policy)?;
    let Some(trained_on) = &scenario.plant else {
        let message = Message::new("no plant").expected("the converter that the policy was trained on");
        let message = message.hint("plant = \"../plants/paper-model.toml\"");
        return Err(Fault::in_file(file, message).into());
    };
    let mut nominal = super::plant_parameters(trained_on)?;
    for (key, value) in &scenario.set {
        if let Some(parameter) = plant::parameter(key) {
            parameter.set(&mut nominal, *value);
        }
    }
    let v_ref = simulate::v_ref(scenario.v_ref, &policy, file)?;
    simulate::suits(&policy, &nominal, v_ref, trained_on)?;
    Ok(Setting {
        trained_on: Losses::of(&nominal),
        scenario,
        policy,
        nominal,
        v_ref,
        simulator: options.simulator,
        controller: options.controller,
        ideal: options.ideal,
    })
}

impl Setting {
    /// What the policy is to do where.
    fn refit(&self) -> Refit<'_> {
        Refit {
            policy: &self.policy,
            nominal: &self.nominal,
            trained_on: self.trained_on,
            v_ref: self.v_ref,
            load_steps: &self.scenario.load_steps,
        }
    }
}

//! `policyc drm`: the duty ratio mapping

mod acquire;
mod bench;
mod fit;
mod judge;
mod transfer;

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use drm::acquire::LoadSetting;
use drm::formula::Losses;
use drm::{Table, TableOptions};
use plant::Parameters;
use policy::Interval;
use toml_input::messages;

use crate::arguments::Columns;
use crate::{Failure, Outcome};

#[derive(Debug, Subcommand)]
pub enum Drm {
    /// Measure settled points: by itself on a simulated converter, or as a plan to fill in at the bench
    Acquire(acquire::Acquire),
    /// Fit drm.toml to a table of settled points and say how far it can be trusted
    Fit(fit::Fit),
    /// Apply a mapping to a table or a converter, and say what no mapping repairs
    Judge(judge::Judge),
    /// The paper's procedure: control real converters without a mapping, acquire, fit, control them with it
    Transfer(transfer::Transfer),
}

/// Runs one of the commands.
pub fn run(command: &Drm) -> Result<Outcome, Failure> {
    match command {
        Drm::Acquire(options) => acquire::run(options),
        Drm::Fit(options) => fit::run(options),
        Drm::Judge(options) => judge::run(options),
        Drm::Transfer(options) => transfer::run(options),
    }
}

/// How a table is read.
#[derive(Debug, Args)]
pub struct Reading {
    #[command(flatten)]
    columns: Columns,
    /// Leave unsettled points out instead of refusing the table
    #[arg(long)]
    skip_unsettled: bool,
    /// Input voltage of the simulation that the policy was trained on, in V: d_sim = v_out over this; without it v_in of
    /// each point
    #[arg(long, value_name = "V")]
    v_in_sim: Option<f64>,
    /// The converter that the policy was trained on, if it has losses: d_sim is the duty that it needs for v_out
    #[arg(long, value_name = "FILE", conflicts_with = "v_in_sim")]
    trained_on: Option<PathBuf>,
}

impl Reading {
    fn simulation(&self) -> Result<Option<Losses>, Failure> {
        match &self.trained_on {
            None => Ok(self.v_in_sim.map(Losses::none)),
            Some(path) => Ok(Some(Losses::of(&plant_parameters(path)?))),
        }
    }

    /// The table; without a simulation on the command line `known` is that of the points.
    fn table(&self, path: &Path, known: Option<Losses>) -> Result<Table, Failure> {
        if let Some(v) = self.v_in_sim.filter(|v| !(v.is_finite() && *v > 0.0)) {
            return Err(not_positive("--v-in-sim", v));
        }
        let options = TableOptions {
            columns: self.columns.read()?,
            skip_unsettled: self.skip_unsettled,
            simulation: self.simulation()?.or(known),
            partial: false,
        };
        Ok(Table::open(path, &options)?)
    }
}

/// The loads on the command line.
#[derive(Debug, Args)]
pub struct Loads {
    /// Constant power loads, W
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    powers: Vec<f64>,
    /// Current loads, A
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    currents: Vec<f64>,
    /// Resistors, ohm
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    resistors: Vec<f64>,
}

impl Loads {
    fn settings(&self) -> Vec<LoadSetting> {
        let resistors = self.resistors.iter().copied().map(LoadSetting::Resistor);
        let currents = self.currents.iter().copied().map(LoadSetting::Current);
        resistors
            .chain(currents)
            .chain(self.powers.iter().copied().map(LoadSetting::Power))
            .collect()
    }
}

/// An option that must be a number above 0.
fn not_positive(option: &str, found: f64) -> Failure {
    messages::not_positive(option, found).into()
}

fn plant_parameters(path: &Path) -> Result<Parameters, Failure> {
    Ok(Parameters::from_file(path)?)
}

// `diagnose` asks the same of a policy
pub use closed_loop::refit::needs_mapping;

/// `low,high` of duty ratios.
fn duty_limits(text: &str) -> Result<Interval, String> {
    let (low, high) = text.split_once(',').ok_or("expected LOW,HIGH, for example 0.05,0.95")?;
    let number = |text: &str| {
        text.trim()
            .parse::<f64>()
            .map_err(|_| format!("`{text}` is not a number"))
    };
    let interval = Interval {
        low: number(low)?,
        high: number(high)?,
    };
    if 0.0 <= interval.low && interval.low < interval.high && interval.high <= 1.0 {
        Ok(interval)
    } else {
        Err("expected 0 <= LOW < HIGH <= 1".to_owned())
    }
}

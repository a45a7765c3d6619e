//! The command line of `policyc drm`.

use std::path::{Path, PathBuf};

use ::drm::acquire::LoadSetting;
use ::drm::formula::Losses;
use ::drm::{Table, TableOptions};
use clap::{Args, Subcommand, ValueEnum};
use plant::Parameters;
use policy::Interval;
use toml_input::{Faults, messages};

use super::shared::{Columns, ControllerKind, Foreign, Outside};
use crate::ownership::Replacing;

#[derive(Debug, Subcommand)]
pub enum Drm {
    /// Measure settled points: by itself on a simulated converter, or as a plan to fill in at the bench
    Acquire(Acquire),
    /// Fit drm.toml to a table of settled points and say how far it can be trusted
    Fit(Fit),
    /// Apply a mapping to a table or a converter, and say what no mapping repairs
    Judge(Judge),
    /// The paper's procedure: control real converters without a mapping, acquire, fit, control them with it
    Transfer(Transfer),
}

#[derive(Debug, Args)]
pub struct Acquire {
    #[command(flatten)]
    pub foreign: Foreign,
    /// The converter to measure, simulated; without it a plan for the bench is written
    #[arg(long, value_name = "FILE")]
    pub plant: Option<PathBuf>,
    /// What simulates it
    #[arg(long, value_enum, default_value_t = Simulator::Plant, requires = "plant")]
    pub simulator: Simulator,
    /// Nominal input voltage in V; with --plant the plant's unless given
    #[arg(long, value_name = "V", required_unless_present = "plant")]
    pub v_in: Option<f64>,
    /// Duty ratios: a list 0.4,0.5,0.6 or FROM:STEP:TO
    #[arg(long, value_name = "LIST", value_parser = duties)]
    pub duties: Duties,
    #[command(flatten)]
    pub loads: Loads,
    /// Table to write
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Take measured points over from this table and go on with the others
    #[arg(long, value_name = "TABLE")]
    pub resume: Option<PathBuf>,
    /// Pause after each point at the bench, in s; a simulated converter has no temperature and is not waited for
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    pub cool_down: f64,
    /// Periods whose mean is one figure
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    pub window: u32,
    /// After so many windows a point counts as unsettled
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u32).range(3..=100_000))]
    pub most_windows: u32,
}

/// Duty ratios on the command line.
#[derive(Debug, Clone)]
pub struct Duties(pub Vec<f64>);

fn duties(text: &str) -> Result<Duties, String> {
    let number = |text: &str| {
        let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| format!("`{text}` is not a number"))
    };
    let parts: Vec<&str> = text.split(':').collect();
    let [from, step, to] = parts[..] else {
        return Ok(Duties(text.split(',').map(number).collect::<Result<_, _>>()?));
    };
    let (from, step, to) = (number(from)?, number(step)?, number(to)?);
    // the end belongs to it although 0.1 does not divide 0.3; at two loads a thousand are all that a table may have
    let count = ((to - from) / step + 1e-9).floor();
    if !(step > 0.0 && (0.0..1000.0).contains(&count)) {
        return Err("expected FROM:STEP:TO with STEP > 0, FROM below TO and at most 1000 duties".to_owned());
    }
    // in steps of 1e-9, so that 0.1 + 0.2 is written 0.3
    let tidy = |duty: f64| (duty * 1e9).round() / 1e9;
    Ok(Duties(
        (0..=count as u32).map(|k| tidy(from + f64::from(k) * step)).collect(),
    ))
}

#[derive(Debug, Args)]
pub struct Fit {
    /// Settled points as CSV with the columns duty (or d_real), v_out, i_out, v_in
    pub table: PathBuf,
    /// Mapping to write; an older one of policyc is replaced
    #[arg(long, value_name = "FILE", default_value = "drm.toml")]
    pub out: PathBuf,
    #[command(flatten)]
    pub reading: Reading,
    /// Form of the mapping
    #[arg(long, value_enum, default_value_t = Terms::Auto)]
    pub terms: Terms,
    /// Components of the partial least squares, instead of cross-validation
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=3))]
    pub components: Option<u8>,
    /// The converter, for its boundary of discontinuous conduction
    #[arg(long, value_name = "FILE", conflicts_with_all = ["inductance", "f_sw", "v_f"])]
    pub plant: Option<PathBuf>,
    /// Inductance in H, for the boundary of discontinuous conduction (diode rectifier)
    #[arg(long, value_name = "H", requires = "f_sw")]
    pub inductance: Option<f64>,
    /// Switching frequency in Hz
    #[arg(long, value_name = "HZ", requires = "inductance")]
    pub f_sw: Option<f64>,
    /// Forward voltage of the diode in V
    #[arg(long, value_name = "V", default_value_t = 0.0)]
    pub v_f: f64,
    /// Name outliers, but leave them in the fit
    #[arg(long)]
    pub keep_outliers: bool,
    /// Take a as given, for a table whose voltage does not vary
    #[arg(long, value_name = "A")]
    pub assume_a: Option<f64>,
    /// Write a page with pictures as well: errors, surface, leave-one-out
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    #[command(flatten)]
    pub replacing: Replacing,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

/// Form on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Terms {
    /// The four-term form where it foretells clearly better
    Auto,
    /// a d_sim + b i_out + c
    #[value(name = "3")]
    Three,
    /// With the product r i_out d_sim
    #[value(name = "4")]
    Four,
}

#[derive(Debug, Args)]
pub struct Judge {
    /// Settled points as CSV with the columns duty (or d_real), v_out, i_out, v_in
    #[arg(required_unless_present = "plant")]
    pub table: Option<PathBuf>,
    /// The mapping
    #[arg(long, value_name = "FILE", default_value = "drm.toml")]
    pub mapping: PathBuf,
    #[command(flatten)]
    pub reading: Reading,
    /// Duty limits of the controller
    #[arg(long, value_name = "LOW,HIGH", value_parser = duty_limits)]
    pub duty_limits: Option<Interval>,
    /// The real converter, simulated
    #[arg(long, value_name = "FILE", requires_all = ["nominal", "v_ref"])]
    pub plant: Option<PathBuf>,
    /// The converter that the policy was trained on
    #[arg(long, value_name = "FILE", requires = "plant")]
    pub nominal: Option<PathBuf>,
    /// Wanted voltage in V
    #[arg(long, value_name = "V", requires = "plant")]
    pub v_ref: Option<f64>,
    #[command(flatten)]
    pub loads: Loads,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Transfer {
    #[command(flatten)]
    pub outside: Outside,
    #[command(flatten)]
    pub foreign: Foreign,
    /// Scenario file, as for `simulate`: load steps, instants; its plant is the converter that the policy was trained on
    pub scenario: PathBuf,
    /// policy.toml with a mapping, or the folder that holds it
    #[arg(long, value_name = "POLICY")]
    pub policy: PathBuf,
    /// Which of several outputs of the policy drives the converters, in the place of the scenario's `output`
    #[arg(long, value_name = "NAME")]
    pub output: Option<String>,
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

/// What simulates the converter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Simulator {
    /// The plant of this program
    Plant,
    /// ngspice's shared library: shares no code with the plant, 1 ms and more for each control period
    Ngspice,
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
    /// The simulation that the points are compared with, if the command line names one.
    pub fn simulation(&self) -> Result<Option<Losses>, Faults> {
        match &self.trained_on {
            None => Ok(self.v_in_sim.map(Losses::none)),
            Some(path) => Ok(Some(Losses::of(&Parameters::buck_from_file(
                path.as_path(),
                "the simulation of a mapping",
            )?)?)),
        }
    }

    /// The table; without a simulation on the command line `known` is that of the points.
    pub fn table(&self, path: &Path, known: Option<Losses>) -> Result<Table, Faults> {
        if let Some(v) = self.v_in_sim.filter(|v| !(v.is_finite() && *v > 0.0)) {
            return Err(messages::not_positive("--v-in-sim", v).into());
        }
        let options = TableOptions {
            columns: self.columns.read()?,
            skip_unsettled: self.skip_unsettled,
            simulation: self.simulation()?.or(known),
            partial: false,
        };
        Table::open(path, &options)
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
    /// All of them: resistors, currents, powers.
    pub fn settings(&self) -> Vec<LoadSetting> {
        let resistors = self.resistors.iter().copied().map(LoadSetting::Resistor);
        let currents = self.currents.iter().copied().map(LoadSetting::Current);
        resistors
            .chain(currents)
            .chain(self.powers.iter().copied().map(LoadSetting::Power))
            .collect()
    }
}

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

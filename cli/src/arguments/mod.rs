//! The command line.

mod campaign;
pub mod drm;
mod plants;
mod shared;
mod shell;
pub mod verify;

use std::path::PathBuf;

use ::verify::budget::Clock;
use clap::{Args, Parser, Subcommand};
use codegen::Output;
use policy::NumericFormat;

use crate::one_of::OneOf;
use crate::ownership::Replacing;

pub use campaign::{Campaign, Engine, Merge, Script};
use drm::Drm;
pub use plants::{Design, Limit, New};
pub use shared::{Color, Columns, ControllerKind, Foreign, Loudness, Outside};
pub use shell::{Completions, Manpages, Studio};
pub use verify::Verify;

/// From a trained policy to verified controller code.
///
/// A policy is a folder with `policy.toml` (signals, features, actions, limits), the network's weights as safetensors
/// and, if you map duties, `drm.toml`. Exit code 0: done or equal, 1: verify found a difference or a
/// training misses its specification, 2: bad input or an output that cannot be written; then nothing was written, 130:
/// interrupted.
#[derive(Debug, Parser)]
#[command(name = "policyc", version, max_term_width = 100)]
pub struct Arguments {
    #[command(flatten)]
    pub loudness: Loudness,
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write a commented contract for a trained network, to be filled in; or for a converter contract, training and scenario
    New(New),
    /// Show what a policy means: signals, features, network, actions, mapping, limits, sizes
    Inspect(Inspect),
    /// Generate C, Rust, blocks and units of simulation tools, and manifest.json
    Compile(Compile),
    /// Put a log of the trainer's environment through the contract: are the features what the network was trained on?
    Replay(Replay),
    /// Compile the generated code and compare it with the interpreter, bit by bit
    Verify(Verify),
    /// Prove what holds of the generated code for every input, with the provers that this machine has
    Prove(Prove),
    /// Bound what the numeric format does to the Q values, and map where it can change an action
    Certify(Certify),
    /// List the deployment targets: processor, compilers, where verify runs them
    Targets(Targets),
    /// Close a policy's loop on a simulated converter: load steps, classical controllers and the limit beside it
    Simulate(Simulate),
    /// What no controller can beat on a plant: the smallest deviation and the shortest settling time after a load step
    Limit(Limit),
    /// Gains of an observer and a law of control for a plant, as lines of a contract
    Design(Design),
    /// Train a policy on a simulated converter and write its folder
    Train(Train),
    /// Compare a plant file with measured records, name what it gets wrong, and write a better one
    Diagnose(Diagnose),
    /// Run many tasks as one: trainings, simulations, verifications, certificates, diagnoses, proofs, on all cores or a cluster
    Campaign(Campaign),
    /// Put the folders of a campaign that ran on several machines together
    Merge(Merge),
    /// Inspect, compile and verify the built-in example
    Demo(Demo),
    /// Contract, code, decisions, closed loop and diagnosis in a page of this machine's browser; files stay in it
    Studio(Studio),
    /// Duty ratio mapping: acquire settled points, fit drm.toml, judge it
    #[command(subcommand)]
    Drm(Drm),
    /// Print what a shell needs to complete commands and options
    Completions(Completions),
    /// Write a manual page for each command
    Manpages(Manpages),
}

impl Command {
    /// Whether it keeps or tells what it has done so far when a signal comes.
    pub fn ends_by_itself(&self) -> bool {
        matches!(
            self,
            Command::Campaign(_)
                | Command::Merge(_)
                | Command::Prove(_)
                | Command::Simulate(_)
                | Command::Train(_)
                | Command::Drm(Drm::Transfer(_))
        )
    }
}

#[derive(Debug, Args)]
pub struct Inspect {
    #[command(flatten)]
    pub outside: Outside,
    /// policy.toml or the folder that holds it
    pub policy: PathBuf,
    /// Numeric format in the place of the contract's
    #[arg(long, value_parser = format())]
    pub format: Option<NumericFormat>,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

/// Reads the name of a numeric format.
fn format() -> OneOf<NumericFormat> {
    let meaning = |format| match format {
        NumericFormat::F32 => "binary32, exact order",
        NumericFormat::F32Fma => "binary32 with fused multiply-add in the network",
        NumericFormat::F64 => "binary64, exact order",
        NumericFormat::I16 => "16-bit integer network",
        NumericFormat::I8 => "8-bit weights, 16-bit activations",
    };
    let row = |format: NumericFormat| (format.name(), meaning(format), format);
    OneOf::new("numeric format", NumericFormat::ALL.map(row))
}

/// Reads the name of an output.
fn output() -> OneOf<Output> {
    let row = |output: &Output| (output.name(), output.meaning(), *output);
    OneOf::new("output", Output::ALL.iter().map(row))
}

#[derive(Debug, Args)]
pub struct Replay {
    #[command(flatten)]
    pub outside: Outside,
    /// policy.toml or the folder that holds it
    pub policy: PathBuf,
    /// Table with a row for each control period. A column for each signal; to compare: `obs_0`, `obs_1`, ... (or `obs_NAME`) and
    /// `action`. Also read: `duty` or `previous_duty`, `episode`, `t`
    pub log: PathBuf,
    /// Where a column has another name: signal=column, obs_0=column or signal=column*factor, separated by commas or given
    /// several times
    #[arg(long, value_name = "MAP")]
    pub map: Vec<String>,
    /// Logged actions are of a trainer who explores: they are applied, and not compared
    #[arg(long)]
    pub exploring: bool,
    /// Rows at the start of each episode that are not compared, where the environment begins with another memory
    #[arg(long, value_name = "ROWS", default_value_t = 0, hide_default_value = true)]
    pub skip: usize,
    /// Numeric format in the place of the contract's
    #[arg(long, value_parser = format())]
    pub format: Option<NumericFormat>,
    /// If the log is equal, write it as golden answers, a safetensors file that does not exist yet: its observations, or where it does not have
    /// all of them the contract's, with its actions or duties, those of gains where the observations tell their law. Rows that the controller
    /// never answers are left out. Not of a log whose actions or first rows are not compared
    #[arg(long, value_name = "FILE", conflicts_with_all = ["exploring", "skip"])]
    pub golden: Option<PathBuf>,
    /// Largest difference that is equal, as a share of the largest logged magnitude of the feature, of a duty that is no choice
    /// as a share of its range, with gains of the range of the limits. What binary32 leaves of a difference of large numbers is equal as well
    #[arg(long, value_name = "SHARE", default_value_t = ::verify::replay::TOLERANCE, value_parser = share)]
    pub tolerance: f64,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Compile {
    #[command(flatten)]
    pub outside: Outside,
    #[command(flatten)]
    pub replacing: Replacing,
    /// policy.toml or the folder that holds it
    pub policy: PathBuf,
    /// What to make, separated by commas or given several times. All but the two cores call one and bring it along
    // `--lang` and `--door` are what this flag was before it was one
    #[arg(long, aliases = ["lang", "door"], value_name = "OUTPUT", value_delimiter = ',', default_value = "c", value_parser = output())]
    pub emit: Vec<Output>,
    /// Deployment target; `policyc targets` lists them
    #[arg(long, default_value = "host")]
    pub target: String,
    /// Do not build and run the code under the target's emulator to report memory, stack and instructions of a step
    #[arg(long)]
    pub no_costs: bool,
    /// Clock of the processor, such as 168MHz: says whether a control step fits into its period (a model, never measured),
    /// and which numeric format would
    #[arg(long, value_name = "FREQUENCY", value_parser = Clock::parse, conflicts_with = "no_costs")]
    pub clock: Option<Clock>,
    /// Plant file of the training: where it samples inside of the period (`pwm.sampling_phase`), a step has what is left of that
    #[arg(long, value_name = "FILE", requires = "clock")]
    pub plant: Option<PathBuf>,
    /// Control steps in the kit; those that lead to the places where an edit would hide, some hundred, are made in any case
    #[arg(long, value_name = "N", default_value_t = ::verify::kit::DEFAULT_STEPS, value_parser = clap::value_parser!(u32).range(1..=i64::from(::verify::kit::MOST_STEPS)))]
    pub kit_steps: u32,
    /// Numeric format in the place of the contract's
    #[arg(long, value_parser = format())]
    pub format: Option<NumericFormat>,
    /// Share of the golden decisions that the numeric format may change, 0 to 1, in the place of the contract's
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub golden_decisions: Option<f64>,
    /// Folder for the generated files; made if missing
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Write a page as well: sizes, budget, layers, and the line of the code that a line of the contract became
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

/// A share, 0..1.
fn share(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "expected a number from 0 to 1".to_owned())?;
    match (0.0..=1.0).contains(&number) {
        true => Ok(number),
        false => Err("expected a number from 0 to 1, such as 0.02 for 2 %".to_owned()),
    }
}

#[derive(Debug, Args)]
pub struct Prove {
    #[command(flatten)]
    pub replacing: Replacing,
    #[command(flatten)]
    pub outside: Outside,
    /// policy.toml or the folder that holds it
    pub policy: PathBuf,
    /// Numeric formats in the place of the contract's, separated by commas or given several times
    #[arg(long, value_delimiter = ',', value_parser = format())]
    pub format: Vec<NumericFormat>,
    /// Deployment target whose C is proved
    #[arg(long, default_value = "host")]
    pub target: String,
    /// Also try the conversions of integer formats with each of the 2^32 numbers: a quarter of a minute each
    #[arg(long)]
    pub exhaustive: bool,
    /// Also write the goals about C and Rust as SMT-LIB 2, a file each, for a solver of your own
    #[arg(long)]
    pub goals: bool,
    /// Folder for proof.json and proof.html; made if missing
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
pub struct Certify {
    #[command(flatten)]
    pub outside: Outside,
    #[command(flatten)]
    pub replacing: Replacing,
    /// policy.toml or the folder that holds it
    pub policy: PathBuf,
    /// Numeric format in the place of the contract's
    #[arg(long, value_parser = format())]
    pub format: Option<NumericFormat>,
    /// Axis of the map, twice: a signal, or a feature with a memory of its own. Without a range: where the action
    /// changes. Without axes: the first two signals
    #[arg(long, value_name = "NAME[=LOW:HIGH]")]
    pub axis: Vec<String>,
    /// Value of another coordinate of the map; without it the middle of its range
    #[arg(long, value_name = "NAME=VALUE")]
    pub at: Vec<String>,
    /// States drawn for the shares
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub samples: u32,
    /// Boxes into which the states are split for the bound
    #[arg(long, value_name = "N", default_value_t = 2000, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub boxes: u32,
    /// Seed of the draws
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Folder for certificate.json, certificate.html and map.svg; made if missing
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Simulate {
    #[command(flatten)]
    pub outside: Outside,
    #[command(flatten)]
    pub foreign: Foreign,
    /// Scenario file: plant, load steps, instants, classical controllers
    pub scenario: PathBuf,
    /// policy.toml or the folder that holds it
    #[arg(long, value_name = "POLICY")]
    pub policy: PathBuf,
    /// Numeric format in the place of the contract's
    #[arg(long, value_parser = format())]
    pub format: Option<NumericFormat>,
    /// Plant file in the place of the scenario's
    #[arg(long, value_name = "PLANT")]
    pub plant: Option<PathBuf>,
    /// Which of several outputs of the policy drives the plant, in the place of the scenario's `output`
    #[arg(long, value_name = "NAME")]
    pub output: Option<String>,
    /// Design the classical controllers on this plant file, not on the plant they run on
    #[arg(long, value_name = "PLANT")]
    pub designed_on: Option<PathBuf>,
    /// Judge all controllers on converters with other values of a number of the plant, too; the classical ones keep their design.
    /// Given twice, every value meets every other, and the page has a map. N is 5 unless given
    #[arg(long, value_name = "KEY=LOW,HIGH[,N]")]
    pub spread: Vec<String>,
    /// Draw this many converters from between the ends of every --spread, of which there may be any number then, and compare the
    /// controllers by median and worst
    #[arg(long, value_name = "N", requires_all = ["spread", "spread_seed"])]
    pub spread_draws: Option<usize>,
    /// Seed of the draws: the same seed, the same converters
    #[arg(long, value_name = "SEED", requires = "spread_draws")]
    pub spread_seed: Option<u64>,
    /// Folder for metrics, trajectories and pictures; made if missing
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// What runs the policy
    #[arg(long, value_enum, default_value = "interpreter")]
    pub controller: ControllerKind,
    /// Also close the loop with the interpreter, the generated Rust and the generated C, and compare all trajectories
    /// bit by bit
    #[arg(long)]
    pub check: bool,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Targets {
    /// One target, or the number of a part whose target it is: all that the compiler knows of it
    #[arg(value_name = "TARGET")]
    pub name: Option<String>,
    /// Machine-readable, with everything the compiler knows of a target
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Train {
    #[command(flatten)]
    pub foreign: Foreign,
    /// Training file: plant, contract, network, reward, scenarios, specification, seeds
    pub settings: PathBuf,
    /// Folder for the best seed's policy; those of all seeds go to `seeds` in it. Must not hold a policy yet
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Seeds in the place of the file's, separated by commas
    #[arg(long, value_delimiter = ',', value_name = "N")]
    pub seeds: Vec<u64>,
    /// Cores used at most; all unless given
    #[arg(long, default_value_t = 0, hide_default_value = true, value_name = "N")]
    pub threads: usize,
    /// Folder for event files of TensorBoard, one folder in it for each seed; written while the training runs
    #[arg(long, value_name = "DIR")]
    pub tensorboard: Option<PathBuf>,
    /// Go on from the checkpoints that an interrupted training left in DIR, bit for bit
    #[arg(long)]
    pub resume: bool,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Diagnose {
    #[command(flatten)]
    pub outside: Outside,
    #[command(flatten)]
    pub replacing: Replacing,
    /// The model: plant.toml
    #[arg(long, value_name = "PLANT")]
    pub model: PathBuf,
    /// Measured records to find causes in: CSV with the columns t,duty,v_out,i_l,i_out,v_in,r_load,i_load,p_load, as far
    /// as there are any; without time: settled points
    #[arg(long, value_name = "CSV", num_args = 1.., required = true)]
    pub train: Vec<PathBuf>,
    /// Measured records that only judge the extended model
    #[arg(long, value_name = "CSV", num_args = 1..)]
    pub heldout: Vec<PathBuf>,
    #[command(flatten)]
    pub columns: Columns,
    /// Each row is a settled operating point, whatever else the records hold
    #[arg(long)]
    pub settled: bool,
    /// Numbers of the plant file that you know to be right, by key: `inductor.dcr,source.resistance`. No cause changes them
    #[arg(long, value_name = "KEY,KEY", value_delimiter = ',')]
    pub certain: Vec<String>,
    /// policy.toml with a mapping, or the folder that holds it: its mapping is refitted from the extended model, and the
    /// loop closed on that model with both. With --retrain one without a mapping will do
    #[arg(long, value_name = "POLICY")]
    pub policy: Option<PathBuf>,
    /// Load steps of the closed loop, as for `simulate`; without it from the records' loads
    #[arg(long, value_name = "FILE", requires = "policy")]
    pub scenario: Option<PathBuf>,
    /// Which of several outputs of the policy drives the converter, in the place of the scenario's `output`
    #[arg(long, value_name = "NAME", requires = "policy")]
    pub output: Option<String>,
    /// The converter that the policy was trained on; without it the model
    #[arg(long, value_name = "PLANT", requires = "policy")]
    pub trained_on: Option<PathBuf>,
    /// Training file: where causes are named, a policy is trained anew on the extended model, with the errors of sensors taken
    /// out by its contract, and compared with that of --policy. Everything of it goes to `retrain` in DIR
    #[arg(long, value_name = "FILE")]
    pub retrain: Option<PathBuf>,
    /// Go on with the training that an interrupted `--retrain` left in DIR, bit for bit
    #[arg(long, requires = "retrain")]
    pub resume: bool,
    /// Folder for diagnosis.json, plant.extended.toml, report.html, experiments and, with a policy, drm.toml
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
pub struct Demo {
    #[command(flatten)]
    pub replacing: Replacing,
    /// Folder for the example and the generated files
    #[arg(long, value_name = "DIR", default_value = "policyc-demo")]
    pub out: PathBuf,
    /// Control steps to compare per build
    #[arg(long, default_value_t = 20_000, value_parser = clap::value_parser!(u64).range(1..))]
    pub steps: u64,
}

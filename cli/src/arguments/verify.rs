//! The command line of `policyc verify`.

use std::path::PathBuf;

use ::verify::exchange::Sheet;
use ::verify::shards::Shard;
use clap::{Args, ValueEnum};
use policy::NumericFormat;

use super::shared::Outside;
use super::{format, share};
use crate::ownership::Replacing;

#[derive(Debug, Args)]
pub struct Verify {
    #[command(flatten)]
    pub outside: Outside,
    #[command(flatten)]
    pub replacing: Replacing,
    /// policy.toml or the folder that holds it
    pub policy: PathBuf,
    /// Numeric format in the place of the contract's; with --generated, of the code in that folder unless given
    #[arg(long, value_parser = format())]
    pub format: Option<NumericFormat>,
    /// Control steps to compare per build
    #[arg(long, default_value_t = 20_000, value_parser = clap::value_parser!(u64).range(1..))]
    pub steps: u64,
    /// Seed of the generated measurements
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Deployment target: its compilers and, where it is not this machine, its emulator. Unless given: the target of the
    /// generated folder, else host
    #[arg(long)]
    pub target: Option<String>,
    /// Verify the generated code in this folder, if it is what the policy yields today; files that differ are named, and
    /// nothing is built
    #[arg(long, value_name = "DIR")]
    pub generated: Option<PathBuf>,
    /// Share of the golden decisions that the numeric format may change, 0 to 1, in the place of the contract's
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub golden_decisions: Option<f64>,
    /// Only compare the files of --generated with what the policy yields today; needs no compiler
    #[arg(long, requires = "generated", conflicts_with_all = ["steps", "seed", "trace"])]
    pub drift_only: bool,
    /// Recorded measurements to replay first: CSV with one column per signal, in the signal's unit (ADC signals take
    /// the nearest code)
    #[arg(long, value_name = "CSV")]
    pub trace: Vec<PathBuf>,
    /// Where a column of the recorded measurements has another name than its signal: signal=column or signal=column*factor,
    /// separated by commas or given several times
    #[arg(long, value_name = "MAP", requires = "trace")]
    pub map: Vec<String>,
    /// Also write what was found for another program, as FORM=FILE: sarif (code scanning), junit (test reports), markdown (a
    /// summary to read) or html (a page). May be given several times
    #[arg(long, value_name = "FORM=FILE", value_parser = sheet)]
    pub report: Vec<Asked>,
    /// Also print what was found, and faults of the input, as a service shows them beside the lines of a change
    #[arg(long, value_name = "SERVICE", value_enum, conflicts_with = "json")]
    pub annotations: Option<Service>,
    #[command(flatten)]
    pub every: EveryCode,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

/// Whether every combination of ADC codes is compared in the place of the stream.
#[derive(Debug, Default, Args)]
pub struct EveryCode {
    /// Compare the first step of a fresh controller for every combination of ADC codes, in parts of 2^20 that are kept in --out: a
    /// run that was stopped goes on there
    #[arg(long, requires = "out", conflicts_with_all = ["steps", "seed", "trace", "drift_only", "report", "annotations"])]
    pub codes: bool,
    /// Of --codes, which parts: 2/4 takes every fourth, from the second on. Shards of other machines that are copied into the
    /// folder of --out are merged
    #[arg(long, value_name = "I/N", requires = "codes", default_value = "1/1")]
    pub shard: Shard,
    /// Folder of the results of --codes
    #[arg(long, value_name = "DIR", requires = "codes")]
    pub out: Option<PathBuf>,
}

/// A report to write.
#[derive(Debug, Clone)]
pub struct Asked {
    /// How it is written.
    pub sheet: Sheet,
    /// Where to.
    pub file: PathBuf,
}

/// Who shows annotations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Service {
    /// Workflow commands of GitHub Actions
    Github,
}

fn sheet(text: &str) -> Result<Asked, String> {
    let known = Sheet::ALL.map(Sheet::name).join(", ");
    let expected = || format!("expected FORM=FILE, FORM being one of {known}");
    let (form, file) = text.split_once('=').ok_or_else(expected)?;
    let sheet = Sheet::ALL.into_iter().find(|sheet| sheet.name() == form);
    match (sheet, file) {
        (Some(sheet), file) if !file.is_empty() => Ok(Asked {
            sheet,
            file: file.into(),
        }),
        _ => Err(expected()),
    }
}

//! The command lines of campaigns.

use std::path::PathBuf;

use clap::builder::RangedU64ValueParser;
use clap::{Args, ValueEnum};

use crate::campaign::MOST_JOBS;
use crate::ownership::Replacing;

#[derive(Debug, Clone, Args)]
pub struct Campaign {
    #[command(flatten)]
    pub replacing: Replacing,
    /// Plan: which commands are to be run on what
    pub plan: PathBuf,
    /// Folder for the results; made if missing. Tasks whose results it holds are skipped
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Where tasks run
    #[arg(long, value_enum, default_value = "local")]
    pub engine: Engine,
    /// With --engine ray: the cluster, such as ray://head:10001 or auto; unless given, one is started on this machine
    #[arg(long, value_name = "ADDRESS")]
    pub address: Option<String>,
    /// Tasks at a time; as many as there are cores unless given
    #[arg(short, long, value_name = "N", default_value_t = 0, hide_default_value = true, value_parser = jobs())]
    pub jobs: usize,
    /// Only one task, by its number from 1 or its name, and nothing merged
    #[arg(long, value_name = "TASK", conflicts_with_all = ["jobs", "engine", "address"])]
    pub task: Option<String>,
    /// Print the tasks and whether they are done, and run nothing
    #[arg(long, conflicts_with_all = ["task", "write"])]
    pub list: bool,
    /// Write a script for a queue and run nothing, as FORM=FILE: slurm (an array of jobs) or snakemake (rules)
    #[arg(long, value_name = "FORM=FILE", value_parser = script)]
    pub write: Option<Script>,
    /// What is done anyway, for scripts that say so
    #[arg(long, hide = true)]
    pub skip_existing: bool,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct Merge {
    #[command(flatten)]
    pub replacing: Replacing,
    /// Folders of results
    #[arg(required = true, value_name = "DIR")]
    pub folders: Vec<PathBuf>,
    /// Folder for the results of all; made if missing. May be one of them
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Machine-readable
    #[arg(long)]
    pub json: bool,
}

/// Where tasks run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// Processes on this machine
    Local,
    /// A cluster of Ray; with the Python package
    Ray,
}

/// A script to write.
#[derive(Debug, Clone)]
pub enum Script {
    /// An array of jobs.
    Slurm(PathBuf),
    /// Rules.
    Snakemake(PathBuf),
}

fn jobs() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(0..=MOST_JOBS as u64)
}

fn script(text: &str) -> Result<Script, String> {
    match text.split_once('=') {
        Some(("slurm", file)) if !file.is_empty() => Ok(Script::Slurm(file.into())),
        Some(("snakemake", file)) if !file.is_empty() => Ok(Script::Snakemake(file.into())),
        _ => Err("expected FORM=FILE, FORM being slurm or snakemake".to_owned()),
    }
}

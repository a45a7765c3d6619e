//! Campaigns: many runs of `policyc` as one. Reads a plan, writes nothing, starts nothing.
//!
//! ```text
//! plan.toml ─► Plan ─► tasks: arguments + every file that they read, named by the digest of both
//!                        │ an engine runs each in a folder that holds these files alone
//!                        ▼
//!              files of each task ─► Done ─► Results ─► results.json, results.csv, report.html, best/
//! ```
//!
//! The one invariant: a task's files are a function of its [`Task::id`]. So a task that is done need not run again, it does not matter
//! where it ran, and the results of several folders merge to the bytes of one run.

mod digest;
mod done;
mod figures;
mod inputs;
mod kind;
mod lacks;
mod page;
mod plan;
mod results;
mod scripts;
mod sections;
mod seeds;
mod task;

pub use digest::sha256;
pub use done::{Done, RECORD, Record};
pub use inputs::{Content, Inputs, MAX_INPUT_BYTES};
pub use kind::Kind;
pub use plan::Plan;
pub use results::{Listed, Results, Schedule, State};
pub use scripts::{Call, slurm, snakemake};
pub use task::{Axis, Task, kind_of};

/// Who wrote a file.
pub const TOOL: &str = concat!("policyc ", env!("CARGO_PKG_VERSION"));

/// The version and the digest of the sources, as part of every digest: another build may compute something else. The command and the
/// wheel of the same sources are one build; see `build.rs`.
pub const BUILD: &str = concat!(env!("CARGO_PKG_VERSION"), env!("POLICYC_SOURCES"));

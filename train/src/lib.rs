//! DQN on a simulated converter: what is trained is what is compiled.
//!
//! ```text
//! train.toml ──► Settings::load ──┐
//! policy.toml ─► Contract::load ──┼─► Trainer::new ─► run ─► Outcome: policy folder, curve, report, checkpoint (data)
//! plant.toml ──► Converter::load ─┘      ▲   │
//!                                        └───┘ checkpoint / resume, bit for bit
//! ```
//!
//! Observations come from [`interp`] running the contract's own features; the network is the only thing of the
//! controller that a training has for itself. Nothing here writes files (a contract is checked in a temporary folder).
//! docs/reference/training-file.md describes the training file.

mod checkpoint;
pub mod contract;
mod episode;
pub mod episodes;
mod faults;
mod judge;
pub mod learner;
pub mod network;
pub mod optimiser;
pub mod outcome;
pub mod page;
mod product;
mod progress;
mod quick;
pub mod replay;
mod rest_page;
mod resume;
pub mod score;
pub mod seeds;
pub mod settings;
pub mod start;
pub mod summary;
pub mod tensorboard;
pub mod trainer;
mod trials;
pub mod verdict;
mod waiting;

pub use closed_loop::scenario::Metrics;
pub use closed_loop::{Converter, Environment};
pub use contract::{Contract, Files};
pub use faults::Error;
pub use judge::Judged;
pub use outcome::{Outcome, tables};
pub use seeds::{Course, SeedRun, Unwatched, Watch, train_all, train_converter};
pub use settings::Settings;
pub use toml_input::{Fault, Faults, Place};
pub use trainer::{Ended, Progress, Trainer};

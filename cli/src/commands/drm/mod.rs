//! `policyc drm`: the duty ratio mapping

mod acquire;
pub mod fit;
mod judge;
mod transfer;

use crate::arguments::drm::Drm;
use crate::failure::Failure;
use crate::outcome::Outcome;

// `diagnose` asks the same of a policy
pub use closed_loop::refit::needs_mapping;

/// Runs one of the commands.
pub fn run(command: &Drm) -> Result<Outcome, Failure> {
    match command {
        Drm::Acquire(options) => acquire::run(options),
        Drm::Fit(options) => fit::run(options),
        Drm::Judge(options) => judge::run(options),
        Drm::Transfer(options) => transfer::run(options),
    }
}

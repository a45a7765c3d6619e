//! `policyc targets`

use ::targets::{TARGETS, overview};

use crate::arguments::Targets;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

/// Lists the table.
pub fn run(options: &Targets) -> Result<Outcome, Failure> {
    let text = match options.json {
        true => serde_json::to_string_pretty(TARGETS)?,
        false => overview(TARGETS),
    };
    output::say(&text)?;
    Ok(Outcome::Done)
}

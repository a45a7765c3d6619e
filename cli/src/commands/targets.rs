//! `policyc targets`

use ::targets::{TARGETS, overview, parts};

use crate::arguments::Targets;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

/// Lists the table.
pub fn run(options: &Targets) -> Result<Outcome, Failure> {
    let text = match options.json {
        true => serde_json::to_string_pretty(TARGETS)?,
        false => format!(
            "{}\n\nparts by their target; the maker's data sheet names the core\n{}",
            overview(TARGETS),
            parts()
        ),
    };
    output::say(&text)?;
    Ok(Outcome::Done)
}

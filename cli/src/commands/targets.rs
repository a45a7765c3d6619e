//! `policyc targets`

use ::targets::{TARGETS, details, find, of_part, overview, parts};

use crate::arguments::Targets;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

/// Lists the table, or one entry of it.
///
/// # Errors
/// If there is no target of that name, or nothing can be written.
pub fn run(options: &Targets) -> Result<Outcome, Failure> {
    if let Some(name) = &options.name {
        // a part leads to its target here, where nothing is compiled for a wrong one
        let target = match find(name) {
            Some(target) => target,
            None => codegen::target(of_part(name).unwrap_or(name))?,
        };
        let text = match options.json {
            true => serde_json::to_string_pretty(target)?,
            false => details(target),
        };
        output::say(&text)?;
        return Ok(Outcome::Done);
    }
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

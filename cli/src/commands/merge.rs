//! `policyc merge`

use crate::arguments::Merge;
use crate::campaign::merge;
use crate::commands::campaign::answer;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::talk;

/// Puts folders together.
pub fn run(options: &Merge) -> Result<Outcome, Failure> {
    let Some(finished) = merge(&options.folders, &options.out, options.replacing)? else {
        talk::interrupted("to go on, type the same again");
        return Ok(Outcome::Interrupted);
    };
    answer(options.json, &options.out.display().to_string(), &finished, None)
}

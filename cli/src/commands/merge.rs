//! `policyc merge`

use crate::arguments::Merge;
use crate::campaign::merge;
use crate::commands::campaign::answer;
use crate::failure::Failure;
use crate::outcome::Outcome;

/// Puts folders together.
pub fn run(options: &Merge) -> Result<Outcome, Failure> {
    let finished = merge(&options.folders, &options.out, options.replacing)?;
    answer(options.json, &options.out.display().to_string(), &finished, None)
}

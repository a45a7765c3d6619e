//! `policyc new`

use crate::arguments::New;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

/// Writes a contract skeleton next to the weights' shapes.
pub fn run(options: &New) -> Result<Outcome, Failure> {
    let text = policy::new_contract(&options.weights, &options.out)?;
    output::write_new(&options.out, &text)?;
    let path = options.out.display();
    output::say(&format!(
        "wrote {path}: fill in what says TODO, then\n  policyc inspect {path}"
    ))?;
    Ok(Outcome::Done)
}

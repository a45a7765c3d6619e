//! `policyc new`

use crate::arguments::New;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

/// Writes a contract skeleton for what a trainer saved, and weights beside it where they had to be changed.
pub fn run(options: &New) -> Result<Outcome, Failure> {
    let known = import::Options {
        actions: options.actions,
        inside: options.inside.clone(),
        vecnormalize: options.vecnormalize.clone(),
    };
    let new = import::new_policy(&options.weights, &options.out, &known)?;
    output::write_new_all(&options.out, &new.contract, &new.beside)?;
    for line in &new.said {
        output::say(line)?;
    }
    for name in new.beside.keys() {
        output::say(&format!("wrote {}", options.out.with_file_name(name).display()))?;
    }
    let path = options.out.display();
    output::say(&format!(
        "wrote {path}: fill in what says TODO, look at what says check, then\n  policyc inspect {path}"
    ))?;
    Ok(Outcome::Done)
}

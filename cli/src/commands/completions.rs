//! `policyc completions`

use clap::CommandFactory;

use crate::arguments::{Arguments, Completions};
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

/// Prints the script of a shell.
pub fn run(options: &Completions) -> Result<Outcome, Failure> {
    let mut script = Vec::new();
    // the name that is completed, not that of a link through which this program was called
    clap_complete::generate(options.shell, &mut Arguments::command(), "policyc", &mut script);
    output::print(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}

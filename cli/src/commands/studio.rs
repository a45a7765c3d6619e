//! `policyc studio`

use crate::arguments::Studio;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;
use crate::studio::{Site, open};

/// Serves the page until the program is ended, or writes it.
pub fn run(options: &Studio) -> Result<Outcome, Failure> {
    let site = match &options.from {
        Some(folder) => Site::from(folder)?,
        None => Site::embedded()?,
    };
    if let Some(out) = &options.out {
        output::replace_own(out, site.into_files(), options.replacing)?;
        output::say(&format!(
            "wrote {}: a page for any server of files, under https or on this machine",
            out.join("index.html").display()
        ))?;
        return Ok(Outcome::Done);
    }
    let server = open(options.port)?;
    output::say(&format!("studio: {}   (Ctrl-C ends it)", server.address()))?;
    server.run(site);
    Ok(Outcome::Done)
}

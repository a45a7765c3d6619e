//! The readers, one target each: its seeds, its form, its words, and what is done with bytes that it takes.
//!
//! To add one: a row in a file of this folder, seeds from files of the repository, and the words that its reader knows.

mod converters;
mod folders;
mod imports;
mod measurements;
mod planted;
mod policies;
mod seeds;
mod steps;
mod tools;
mod units;

pub(crate) use folders::folder;

use crate::forms::Form;
use crate::guard::{Limits, Reader};

/// A reader and what is made for it.
pub struct Target {
    /// Name on the command line and of its folder of regressions.
    pub name: &'static str,
    /// What is read, for `--list`.
    pub about: &'static str,
    /// How the bytes hold together.
    pub form: Form,
    /// Words that the reader knows.
    pub words: &'static [&'static str],
    /// What one input may cost.
    pub limits: Limits,
    /// Inputs that are sound, or nearly so.
    pub seeds: fn() -> Result<Vec<Vec<u8>>, String>,
    /// The reader, with all that it needs beside the bytes.
    pub reader: fn() -> Result<Box<Reader>, String>,
}

impl std::fmt::Debug for Target {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

/// All targets but those with planted faults.
pub fn all() -> impl Iterator<Item = &'static Target> {
    let lists: [&'static [Target]; 7] = [
        policies::TARGETS,
        imports::TARGETS,
        measurements::TARGETS,
        converters::TARGETS,
        tools::TARGETS,
        steps::TARGETS,
        units::TARGETS,
    ];
    lists.into_iter().flatten()
}

/// The target of that name, those with planted faults among them.
#[must_use]
pub fn find(name: &str) -> Option<&'static Target> {
    all().chain(planted::TARGETS).find(|target| target.name == name)
}

/// Where the regressions of a target lie.
#[must_use]
pub fn regressions(target: &Target) -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("regressions")
        .join(target.name)
}

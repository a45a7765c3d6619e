//! The contract of a trained policy: `policy.toml`, its weights, its duty ratio mapping, its golden vectors.
//!
//! ```text
//! read(path) -> RawPolicy      the files as they are, every value with its place
//! check(raw) -> Policy         shapes, finiteness, ranges and names hold from here on
//! ```
//!
//! [`load`] does both. What is wrong comes back as [`Faults`], all of them at once, each with file, place, what was
//! found, what was expected and what to do.

use std::path::Path;

pub mod activation;
mod bounds;
mod catalogue;
mod check;
mod contract;
pub mod describe;
mod digests;
mod expression;
mod faults;
mod filter;
mod head;
mod interval;
mod known_answers;
pub mod limits;
mod memory;
pub mod model;
mod names;
mod notes;
mod observer;
mod output;
mod raw;
mod resized;
pub mod rounding;
mod scaffold;
pub mod scales;
mod weights;

pub use activation::{Activation, Shape};
pub use check::check;
pub use digests::sha256;
pub use faults::{Faults, Skeleton};
pub use memory::memory_bounds;
pub use model::*;
pub use raw::{RawPolicy, ReadOptions, read};
pub use scaffold::{Draft, DraftFeature, DraftOutput, draft, new_contract, seen_from};
pub use toml_input::{Fault, Place};
pub use weights::{NamedTensor, OutputShape, chains, golden_file, golden_fits, law_told, named_tensors};

/// Reads and checks the contract at `path`.
///
/// # Errors
/// All faults of the files; see [`read`] and [`check`].
pub fn load(path: &Path) -> Result<Policy, Faults> {
    load_with(path, &ReadOptions::default())
}

/// [`load`] with options.
///
/// # Errors
/// As [`load`], and for files that the options refuse.
pub fn load_with(path: &Path, options: &ReadOptions) -> Result<Policy, Faults> {
    check(read(path, options)?)
}

/// Reads a `drm.toml` alone; [`Mapping::load_current`] is 0, for no signals are known.
///
/// # Errors
/// All faults of the file.
pub fn load_mapping(path: &Path) -> Result<Mapping, toml_input::Faults> {
    mapping(&toml_input::Document::open(path)?)
}

/// [`load_mapping`] of a text; `file` only names it in messages.
///
/// # Errors
/// All faults of the text.
pub fn read_mapping(file: &Path, text: &str) -> Result<Mapping, toml_input::Faults> {
    mapping(&toml_input::Document::from_text(file, text)?)
}

fn mapping(document: &toml_input::Document) -> Result<Mapping, toml_input::Faults> {
    let mut faults = toml_input::Sink::new();
    let mapping = contract::mapping::read(document, 0, &mut faults);
    document.conclude(mapping, faults)
}

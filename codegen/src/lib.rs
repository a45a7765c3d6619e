//! The compiler: `lower` turns a checked [`Policy`](policy::Policy) into a [`Program`], a module of [`backend`] turns that into files;
//! [`generate`] does both for a list of [`Output`]s.
//!
//! Nothing here writes to disk; the order of operations is the one of `docs/reference/numeric-contract.md`.

// the macro takes tokens alone: what writes C is there and not called, and a firmware crate would be warned of it
#![cfg_attr(not(feature = "c"), allow(dead_code))]

pub mod activation;
mod assembly;
pub mod backend;
pub mod crc;
mod files;
#[cfg(feature = "c")]
mod generate;
pub mod lower;
#[cfg(feature = "c")]
pub mod manifest;
#[cfg(feature = "c")]
mod notes;
pub mod output;
pub mod program;
#[cfg(feature = "c")]
mod stamp;

pub use files::{CodegenError, GeneratedFiles, TOOL};
#[cfg(feature = "c")]
pub use generate::{generate, sources};
pub use lower::lower;
#[cfg(feature = "c")]
pub use notes::notes;
pub use output::{Language, Output};
pub use program::Program;

use targets::TargetSpec;
use toml_input::{Message, messages};

/// The deployment target of that name, or the one that has the core of a part by its number, `stm32g474`.
///
/// # Errors
/// If there is none: the names that there are, and the core of a compiler's triple whose name it is.
pub fn target(name: &str) -> Result<&'static TargetSpec, Message> {
    targets::find_or_part(name).ok_or_else(|| {
        let core = targets::of_part(name).map(|core| format!("its core is that of `{core}`"));
        messages::unknown("target", name, &targets::names()).maybe_hint(core)
    })
}

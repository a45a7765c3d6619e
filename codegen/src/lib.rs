//! The compiler: `lower` turns a checked [`Policy`](policy::Policy) into a [`Program`], a module of [`backend`] turns that into files;
//! [`generate`] does both for a list of [`Output`]s.
//!
//! Nothing here writes to disk; the order of operations is the one of `docs/reference/numeric-contract.md`.

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
pub mod output;
pub mod program;
#[cfg(feature = "c")]
mod stamp;

pub use files::{CodegenError, GeneratedFiles, TOOL};
#[cfg(feature = "c")]
pub use generate::{generate, sources};
pub use lower::lower;
pub use output::{Language, Output};
pub use program::Program;

//! Why a training could not start, go on or be saved.

use std::path::Path;

use toml_input::{Fault, Message};

/// Faults of the training file, the contract, the plant or a checkpoint, or a contract and a plant that do not fit together.
pub type Error = toml_input::Faults;

/// A file that could not be read or written.
pub(crate) fn of_file(path: &Path, error: &std::io::Error) -> Error {
    Fault::in_file(path, Message::new(error.to_string())).into()
}

/// The error of a library that knows nothing of input files.
pub(crate) fn told(error: impl std::fmt::Display) -> Error {
    Message::new(error.to_string()).into()
}

//! Why a training could not start, go on or be saved.

use std::fmt;
use std::path::PathBuf;

use toml_input::{Faults, Message};

/// Why a training could not start, go on or be saved.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// The training file.
    Settings(Faults),
    /// The contract, or the policy made from it.
    Policy(policy::Faults),
    /// The plant, or what is made of it.
    Loop(closed_loop::Error),
    /// A checkpoint that does not fit, is damaged or of another version.
    Checkpoint(String),
    /// The contract and the plant or the training do not fit together.
    Mismatch(String),
    /// A file could not be read, or the temporary folder not written.
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        error: std::io::Error,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Settings(faults) => faults.fmt(f),
            Self::Policy(faults) => faults.fmt(f),
            Self::Loop(error) => error.fmt(f),
            Self::Checkpoint(text) => write!(f, "checkpoint: {text}"),
            Self::Mismatch(text) => f.write_str(text),
            Self::File { path, error } => write!(f, "{}: {error}", path.display()),
        }
    }
}

impl std::error::Error for Error {}

impl From<Faults> for Error {
    fn from(faults: Faults) -> Self {
        Self::Settings(faults)
    }
}

impl From<Error> for Faults {
    fn from(error: Error) -> Self {
        match error {
            Error::Settings(faults) => faults,
            Error::Policy(faults) => faults.into(),
            Error::Loop(error) => error.into(),
            Error::Checkpoint(_) | Error::Mismatch(_) | Error::File { .. } => Message::new(error.to_string()).into(),
        }
    }
}

impl From<policy::Faults> for Error {
    fn from(faults: policy::Faults) -> Self {
        Self::Policy(faults)
    }
}

impl From<closed_loop::Error> for Error {
    fn from(error: closed_loop::Error) -> Self {
        Self::Loop(error)
    }
}

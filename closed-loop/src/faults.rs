//! Why a loop could not be closed.

use std::fmt;

use toml_input::{Faults, Message};

/// Why a loop could not be closed or saved.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// The plant.
    Plant(Faults),
    /// A saved plant that is damaged or of another version.
    Saved(String),
    /// Controller and plant do not fit together.
    Mismatch(String),
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plant(faults) => faults.fmt(f),
            Self::Saved(text) | Self::Mismatch(text) => f.write_str(text),
        }
    }
}

impl std::error::Error for Error {}

impl From<Faults> for Error {
    fn from(faults: Faults) -> Self {
        Self::Plant(faults)
    }
}

impl From<Error> for Faults {
    fn from(error: Error) -> Self {
        match error {
            Error::Plant(faults) => faults,
            Error::Saved(text) | Error::Mismatch(text) => Message::new(text).into(),
        }
    }
}

impl From<interp::InputError> for Error {
    fn from(error: interp::InputError) -> Self {
        Self::Mismatch(error.to_string())
    }
}

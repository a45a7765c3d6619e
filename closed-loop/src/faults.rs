//! Why a loop could not be closed.

use std::fmt;

/// Why a loop could not be closed or saved.
#[derive(Debug)]
#[non_exhaustive]
pub enum Error {
    /// The plant.
    Plant(plant::Faults),
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

impl From<plant::Faults> for Error {
    fn from(faults: plant::Faults) -> Self {
        Self::Plant(faults)
    }
}

impl From<interp::InputError> for Error {
    fn from(error: interp::InputError) -> Self {
        Self::Mismatch(error.to_string())
    }
}

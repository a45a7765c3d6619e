//! All faults of a policy's files, and what a caller needs beside them.

use std::fmt;
use std::path::PathBuf;

/// All faults found, and what a caller needs beside them.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Faults {
    /// The faults, in the order of the files.
    pub faults: toml_input::Faults,
    /// Every file that was opened or should have been, for rebuild tracking.
    pub files: Vec<PathBuf>,
    /// What the contract says all the same.
    pub skeleton: Box<Skeleton>,
}

/// What could be read of a contract with faults: enough for a stand-in of the controller.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Skeleton {
    /// Name of the policy, if it could be read and is a fit name.
    pub name: Option<String>,
    /// Signals with fit names, as far as they could be read, and whether each arrives as an ADC code.
    pub signals: Vec<(String, bool)>,
    /// How many features the contract lists, faulty ones included, if that can be told.
    pub features: Option<usize>,
    /// How many actions it lists.
    pub actions: Option<usize>,
}

/// The faults alone.
impl From<Faults> for toml_input::Faults {
    fn from(faults: Faults) -> Self {
        faults.faults
    }
}

impl std::error::Error for Faults {}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.faults.fmt(f)
    }
}

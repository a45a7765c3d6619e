//! All faults of a policy's files, and what a caller needs beside them.

use std::fmt;
use std::path::PathBuf;

use toml_input::Fault;

/// All faults found, in the order of the files; never empty.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Faults {
    /// The faults.
    pub list: Vec<Fault>,
    /// Every file that was opened or should have been, for rebuild tracking.
    pub files: Vec<PathBuf>,
    /// Name of the policy, if it could be read and is a fit name.
    pub name: Option<String>,
    /// Signals with fit names, as far as they could be read, and whether each arrives as an ADC code.
    pub signals: Vec<(String, bool)>,
}

impl Faults {
    /// The faults, in order.
    pub fn iter(&self) -> std::slice::Iter<'_, Fault> {
        self.list.iter()
    }
}

impl<'a> IntoIterator for &'a Faults {
    type Item = &'a Fault;
    type IntoIter = std::slice::Iter<'a, Fault>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl std::error::Error for Faults {}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        toml_input::write_list(&self.list, f)
    }
}

//! Why a text cannot be judged.

use std::fmt;

/// Emitted code that is outside of the subset which is read here, or that a step cannot be walked through: nothing is claimed of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// Name of the file.
    pub file: String,
    /// Line, from 1; 0 if it is the file as a whole.
    pub line: usize,
    /// What was found there.
    pub message: String,
}

impl Refusal {
    pub(crate) fn at(file: &str, line: usize, message: String) -> Self {
        Refusal {
            file: file.to_owned(),
            line,
            message,
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}: {}", self.file, self.message),
            line => write!(f, "{}:{line}: {}", self.file, self.message),
        }
    }
}

impl std::error::Error for Refusal {}

//! What is wrong with a training file, where, and what to do about it.

use std::fmt;
use std::path::PathBuf;

/// One fault of a training file. All texts are lower case and without a full stop.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Fault {
    /// The file, as the user named it.
    pub file: PathBuf,
    /// Where in the file; nothing for the file as a whole.
    pub place: Option<Place>,
    /// What is wrong, in one line.
    pub problem: String,
    /// What stands there.
    pub found: Option<String>,
    /// What should stand there.
    pub expected: Option<String>,
    /// What to do.
    pub hint: Option<String>,
}

/// A stretch of one line.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Place {
    /// From 1.
    pub line: usize,
    /// In characters, from 1.
    pub column: usize,
    /// Number of characters, at least 1.
    pub length: usize,
    /// The line, without its end.
    pub text: String,
}

impl Fault {
    pub(crate) fn new(problem: impl Into<String>) -> Self {
        Self {
            file: PathBuf::new(),
            place: None,
            problem: problem.into(),
            found: None,
            expected: None,
            hint: None,
        }
    }

    pub(crate) fn found(mut self, text: impl Into<String>) -> Self {
        self.found = Some(text.into());
        self
    }

    pub(crate) fn expected(mut self, text: impl Into<String>) -> Self {
        self.expected = Some(text.into());
        self
    }

    pub(crate) fn hint(mut self, text: impl Into<String>) -> Self {
        self.hint = Some(text.into());
        self
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "error: {}", self.problem)?;
        let file = self.file.display();
        let mut margin = String::from("  ");
        match &self.place {
            None => writeln!(f, "  --> {file}")?,
            Some(Place {
                line,
                column,
                length,
                text,
            }) => {
                margin = " ".repeat(line.to_string().len() + 1);
                writeln!(f, "{}--> {file}:{line}:{column}", &margin[1..])?;
                writeln!(f, "{margin}|")?;
                writeln!(f, "{line} | {text}")?;
                writeln!(f, "{margin}| {}{}", " ".repeat(column - 1), "^".repeat(*length))?;
            }
        }
        let texts = [
            ("found", &self.found),
            ("expected", &self.expected),
            ("hint", &self.hint),
        ];
        for (label, text) in texts {
            if let Some(text) = text {
                writeln!(f, "{margin}= {label}: {text}")?;
            }
        }
        Ok(())
    }
}

/// All faults of a training file, at least one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Faults(pub Vec<Fault>);

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, fault) in self.0.iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            write!(f, "{fault}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Faults {}

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

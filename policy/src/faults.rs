//! What is wrong with the input, where, and what to do about it.

use std::fmt;
use std::path::{Path, PathBuf};

/// Where in a file a fault lies.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// The file as a whole.
    File,
    /// A stretch of text on one line.
    Span {
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// The line, without its end.
        text: String,
        /// Number of characters, at least 1.
        length: usize,
    },
    /// A tensor of a safetensors file, by name.
    Tensor(String),
}

/// One fault of the input. All texts are lower case and without a full stop.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Fault {
    /// The file, as the user named it.
    pub file: PathBuf,
    /// Where in the file.
    pub place: Place,
    /// What is wrong, in one line.
    pub problem: String,
    /// What stands there.
    pub found: Option<String>,
    /// What should stand there.
    pub expected: Option<String>,
    /// What to do.
    pub hint: Option<String>,
}

impl Fault {
    pub(crate) fn new(file: &Path, place: Place, message: Message) -> Self {
        let Message {
            problem,
            found,
            expected,
            hint,
        } = message;
        Fault {
            file: file.to_path_buf(),
            place,
            problem,
            found,
            expected,
            hint,
        }
    }

    /// Line and column, both from 1, if the fault lies in text.
    #[must_use]
    pub fn line_column(&self) -> Option<(usize, usize)> {
        match self.place {
            Place::Span { line, column, .. } => Some((line, column)),
            _ => None,
        }
    }
}

/// A fault without its place; made by [`crate::catalogue`] only.
#[derive(Debug, Clone)]
pub(crate) struct Message {
    pub problem: String,
    pub found: Option<String>,
    pub expected: Option<String>,
    pub hint: Option<String>,
}

impl Message {
    pub fn new(problem: impl Into<String>) -> Self {
        Message {
            problem: problem.into(),
            found: None,
            expected: None,
            hint: None,
        }
    }

    pub fn found(mut self, text: impl Into<String>) -> Self {
        self.found = Some(text.into());
        self
    }

    pub fn expected(mut self, text: impl Into<String>) -> Self {
        self.expected = Some(text.into());
        self
    }

    pub fn hint(mut self, text: impl Into<String>) -> Self {
        self.hint = Some(text.into());
        self
    }

    pub fn maybe_hint(mut self, text: Option<String>) -> Self {
        self.hint = text.or(self.hint);
        self
    }
}

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
        for (index, fault) in self.list.iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            write!(f, "{fault}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "error: {}", printable(&self.problem))?;
        let file = printable(&self.file.display().to_string());
        let mut margin = String::from("  ");
        match &self.place {
            Place::File => writeln!(f, "  --> {file}")?,
            Place::Tensor(name) => writeln!(f, "  --> {file}: tensor `{}`", name.escape_debug())?,
            Place::Span {
                line,
                column,
                text,
                length,
            } => {
                margin = " ".repeat(line.to_string().len() + 1);
                let (text, start) = window(text, *column);
                let carets = "^".repeat((*length).clamp(1, text.chars().count().saturating_sub(start - 1).max(1)));
                writeln!(f, "{}--> {file}:{line}:{column}", &margin[1..])?;
                writeln!(f, "{margin}|")?;
                writeln!(f, "{line} | {text}")?;
                writeln!(f, "{margin}| {}{carets}", " ".repeat(start - 1))?;
            }
        }
        for (label, text) in [
            ("found", &self.found),
            ("expected", &self.expected),
            ("hint", &self.hint),
        ] {
            if let Some(text) = text {
                writeln!(f, "{margin}= {label}: {}", printable(text))?;
            }
        }
        Ok(())
    }
}

/// The part of a long line around `column`, and the column inside it; control characters become blanks.
fn window(text: &str, column: usize) -> (String, usize) {
    const WIDTH: usize = 120;
    let column = column.max(1);
    let skip = if column > WIDTH { column - WIDTH / 2 } else { 0 };
    let part = text
        .chars()
        .skip(skip)
        .take(WIDTH)
        .map(|c| if c.is_control() { ' ' } else { c });
    (part.collect(), column - skip)
}

fn printable(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .collect()
}

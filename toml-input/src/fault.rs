//! What is wrong with the input, where, and what to do about it.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::nearest::did_you_mean;

/// Where a fault lies.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// In no file: values that a program gave.
    Nowhere,
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
    /// The file, as the user named it; empty at [`Place::Nowhere`].
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
    /// Whether it is only something that is still to be filled in.
    pub is_gap: bool,
}

impl Fault {
    /// `message` at `place` of `file`.
    #[must_use]
    pub fn new(file: &Path, place: Place, message: Message) -> Self {
        let Message {
            problem,
            found,
            expected,
            hint,
            is_gap,
        } = message;
        Fault {
            file: file.to_path_buf(),
            place,
            problem,
            found,
            expected,
            hint,
            is_gap,
        }
    }

    /// `message` about a file as a whole.
    #[must_use]
    pub fn in_file(file: &Path, message: Message) -> Self {
        Fault::new(file, Place::File, message)
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

/// A fault of values that came from no file.
impl From<Message> for Fault {
    fn from(message: Message) -> Self {
        Fault::new(Path::new(""), Place::Nowhere, message)
    }
}

/// A fault without its place. The usual ones stand in [`crate::messages`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    problem: String,
    found: Option<String>,
    expected: Option<String>,
    hint: Option<String>,
    is_gap: bool,
}

impl Message {
    /// What is wrong, in one line.
    #[must_use]
    pub fn new(problem: impl Into<String>) -> Self {
        Message {
            problem: problem.into(),
            found: None,
            expected: None,
            hint: None,
            is_gap: false,
        }
    }

    /// Nothing is wrong, but something is still to be filled in.
    #[must_use]
    pub(crate) fn gap(mut self) -> Self {
        self.is_gap = true;
        self
    }

    /// What stands there.
    #[must_use]
    pub fn found(mut self, text: impl Into<String>) -> Self {
        self.found = Some(text.into());
        self
    }

    /// What should stand there.
    #[must_use]
    pub fn expected(mut self, text: impl Into<String>) -> Self {
        self.expected = Some(text.into());
        self
    }

    /// What to do.
    #[must_use]
    pub fn hint(mut self, text: impl Into<String>) -> Self {
        self.hint = Some(text.into());
        self
    }

    /// The nearest of `candidates` to `name` as the hint, if one is near.
    #[must_use]
    pub fn did_you_mean<'a>(self, name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Self {
        self.maybe_hint(did_you_mean(name, candidates))
    }

    /// What to do, if anything is known; an earlier hint stays otherwise.
    #[must_use]
    pub fn maybe_hint(mut self, text: Option<String>) -> Self {
        self.hint = text.or(self.hint);
        self
    }
}

/// All faults found; never empty.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Faults {
    /// The faults, in the order of the files.
    pub list: Vec<Fault>,
}

impl Faults {
    /// The faults, in order.
    pub fn iter(&self) -> std::slice::Iter<'_, Fault> {
        self.list.iter()
    }

    /// The same, of `file` where they are of none.
    #[must_use]
    pub fn in_file(mut self, file: &Path) -> Self {
        for fault in self.list.iter_mut().filter(|fault| fault.place == Place::Nowhere) {
            (fault.place, fault.file) = (Place::File, file.to_path_buf());
        }
        self
    }
}

/// A single fault.
impl From<Fault> for Faults {
    fn from(fault: Fault) -> Self {
        Faults { list: vec![fault] }
    }
}

/// A single fault that lies in no file.
impl From<Message> for Faults {
    fn from(message: Message) -> Self {
        Fault::from(message).into()
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

/// Sorts by file as first mentioned, then by line and column; each fault is kept once.
pub(crate) fn in_file_order(faults: &mut Vec<Fault>) {
    // by first mention and not by name: the contract comes before the files that it names
    let mut files = Vec::new();
    for fault in faults.iter() {
        if !files.contains(&fault.file) {
            files.push(fault.file.clone());
        }
    }
    let order = |fault: &Fault| (files.iter().position(|file| *file == fault.file), fault.line_column());
    faults.sort_by_key(order);
    faults.dedup();
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "error: {}", printable(&self.problem, "       "))?;
        let file = printable(&self.file.display().to_string(), "");
        let mut margin = String::from("  ");
        match &self.place {
            Place::Nowhere => {}
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
                // a span may reach beyond the part of the line that is shown
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
                let indent = " ".repeat(margin.len() + label.len() + 4);
                writeln!(f, "{margin}= {label}: {}", printable(text.trim_end(), &indent))?;
            }
        }
        Ok(())
    }
}

/// The part of a long line around `column`, and the column inside it; control characters become blanks.
fn window(text: &str, column: usize) -> (String, usize) {
    // a convention; a line may be as long as the file, which is up to 1 MiB
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

/// `text` without control characters; lines behind the first, such as a compiler's, begin with `indent`.
fn printable(text: &str, indent: &str) -> String {
    let visible = |line: &str| -> String {
        line.chars()
            // a file may hold escape sequences, which would move the cursor or colour the terminal
            .map(|c| if c.is_control() { '\u{fffd}' } else { c })
            .collect()
    };
    let lines: Vec<String> = text.lines().map(visible).collect();
    lines.join(&format!("\n{indent}"))
}

//! What is wrong with a plant file or with parameters, where, and what to do about it.

use std::fmt;
use std::path::PathBuf;

/// One fault. All texts are lower case and without a full stop.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Fault {
    /// The file, as the user named it; nothing when the parameters did not come from a file.
    pub file: Option<PathBuf>,
    /// Line and column from 1, and the line's text.
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

/// Where in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
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
        Fault {
            file: None,
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
        write!(f, "error: {}", self.problem)?;
        let mut margin = "  ".to_owned();
        if let Some(file) = &self.file {
            let file = file.display();
            match &self.place {
                None => write!(f, "\n  --> {file}")?,
                Some(place) => {
                    margin = " ".repeat(place.line.to_string().len() + 1);
                    write!(f, "\n{}--> {file}:{}:{}", &margin[1..], place.line, place.column)?;
                    write!(f, "\n{margin}|\n{} | {}", place.line, place.text)?;
                    let (indent, carets) = (" ".repeat(place.column - 1), "^".repeat(place.length));
                    write!(f, "\n{margin}| {indent}{carets}")?;
                }
            }
        }
        let lines = [
            ("found", &self.found),
            ("expected", &self.expected),
            ("hint", &self.hint),
        ];
        for (title, text) in lines {
            if let Some(text) = text {
                write!(f, "\n{margin}= {title}: {text}")?;
            }
        }
        Ok(())
    }
}

/// All faults of the input, at least one.
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

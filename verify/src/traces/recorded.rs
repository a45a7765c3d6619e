//! Recorded measurements as part of the stream: CSV with one column per signal, by name.

use std::fmt;

use interp::Sample;
use policy::Policy;

use super::sample_of;

/// A recording, one sample per signal and step.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    steps: Vec<Vec<Sample>>,
}

/// What is wrong with a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RecordedError {
    /// No column has the name of this signal.
    MissingColumn {
        /// Name of the signal.
        signal: String,
    },
    /// Two columns have the same name.
    DuplicateColumn {
        /// Name of the column.
        name: String,
    },
    /// A cell is missing or no number.
    Cell {
        /// Line in the file, the header is 1.
        line: usize,
        /// Name of the signal.
        signal: String,
        /// What was found.
        found: String,
    },
    /// More cells than the header has: perhaps decimal commas.
    TooManyCells {
        /// Line in the file, the header is 1.
        line: usize,
        /// Number of cells.
        found: usize,
        /// Cells in the header.
        expected: usize,
    },
}

impl fmt::Display for RecordedError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MissingColumn { signal } => {
                write!(
                    f,
                    "no column for the signal `{signal}`; columns are separated by commas and named as the signals"
                )
            }
            Self::DuplicateColumn { name } => write!(f, "two columns are called `{name}`"),
            Self::Cell { line, signal, found } => {
                write!(f, "line {line}, column `{signal}`: expected a number, found `{found}`")
            }
            Self::TooManyCells { line, found, expected } => write!(
                f,
                "line {line}: found {found} cells, expected {expected} as in the header (numbers take a decimal point)"
            ),
        }
    }
}

impl std::error::Error for RecordedError {}

impl Recorded {
    /// Reads CSV text: commas, decimal points, a header line. Columns are found by the signals' names, others are
    /// ignored; lines that are empty or start with `#` are skipped. Values are in the unit of the signal, for ADC
    /// signals too, where the nearest code is taken. `nan` and `inf` are numbers here.
    pub fn from_csv(policy: &Policy, text: &str) -> Result<Self, RecordedError> {
        let scalar = policy.numeric_format.scalar();
        let mut lines = text
            .trim_start_matches('\u{feff}')
            .lines()
            .enumerate()
            .filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
        let header: Vec<&str> = lines.next().map(|(_, line)| cells(line)).unwrap_or_default();
        let columns = policy
            .signals
            .iter()
            .map(|signal| {
                let mut found = header.iter().enumerate().filter(|(_, name)| **name == signal.name);
                match (found.next(), found.next()) {
                    (Some((column, _)), None) => Ok(column),
                    (None, _) => Err(RecordedError::MissingColumn {
                        signal: signal.name.clone(),
                    }),
                    (Some(_), Some(_)) => Err(RecordedError::DuplicateColumn {
                        name: signal.name.clone(),
                    }),
                }
            })
            .collect::<Result<Vec<_>, _>>()?;
        let steps = lines
            .map(|(line, text)| {
                let cells = cells(text);
                if cells.len() > header.len() {
                    return Err(RecordedError::TooManyCells {
                        line: line + 1,
                        found: cells.len(),
                        expected: header.len(),
                    });
                }
                let sample = |(signal, &column): (&policy::Signal, &usize)| {
                    let cell = cells.get(column).copied().unwrap_or_default();
                    let bad = || RecordedError::Cell {
                        line: line + 1,
                        signal: signal.name.clone(),
                        found: cell.to_owned(),
                    };
                    cell.parse()
                        .map(|x: f64| sample_of(scalar, signal, x))
                        .map_err(|_| bad())
                };
                policy.signals.iter().zip(&columns).map(sample).collect()
            })
            .collect::<Result<_, _>>()?;
        Ok(Self { steps })
    }

    /// The steps, one sample per signal.
    pub fn steps(&self) -> &[Vec<Sample>] {
        &self.steps
    }
}

fn cells(line: &str) -> Vec<&str> {
    line.split(',').map(|cell| cell.trim().trim_matches('"')).collect()
}

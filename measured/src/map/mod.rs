//! Where the quantities stand in a table that names them otherwise: `--map` on the command line, or a file in TOML.

mod file;
mod line;

use std::borrow::Cow;
use std::path::Path;

use toml_input::{Faults, Message};

use crate::quantity::Quantity;

/// What the duty of a record is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DutyIs {
    /// Commanded; or applied, if the record's sampling chain is another one and the data say so.
    #[default]
    Unknown,
    /// What the controller asked for.
    Commanded,
    /// What the modulator did: delays and rounding of the duty lie before it.
    Applied,
    /// The same, and the sensors show at once what is true: another measuring chain, or a simulator's.
    Direct,
}

/// What a number of a slow record holds: rows many switching periods apart, or settled points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampled {
    /// The mean since the row before, or over a settled point.
    Mean,
    /// What was there at one instant of a switching period.
    Instant,
}

/// Which column of a table holds which quantity, or what it was throughout; and how the table was recorded.
///
/// What is not mapped is found by its name ([`crate::VOCABULARY`]).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ColumnMap {
    entries: Vec<(String, Wish)>,
    /// Sampling instant as a fraction of the PWM period; from the time column if not given.
    pub phase: Option<f64>,
    /// What the duty column holds.
    pub duty: DutyIs,
    /// What the rows of a slow record hold; what fits better, if not given.
    pub sampled: Option<Sampled>,
    /// Rows are settled operating points (true) or steps in time (false); from the columns if not given.
    pub settled: Option<bool>,
    /// What is different in single records.
    records: Vec<OfRecord>,
}

/// What a map says of one record only.
#[derive(Debug, Clone, PartialEq)]
struct OfRecord {
    /// Its file without folder and extension.
    name: String,
    map: ColumnMap,
}

/// Where a quantity shall be taken from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Wish {
    Column {
        name: String,
        /// SI value over value in the file, where the user says so.
        scale: Option<f64>,
        /// Added after scaling.
        offset: f64,
    },
    Constant(f64),
    /// The record has none, whatever its columns are called.
    Nothing,
}

impl ColumnMap {
    /// What is wished for a quantity.
    pub(crate) fn wish(&self, quantity: &str) -> Option<&Wish> {
        let found = self.entries.iter().find(|(name, _)| name == quantity);
        found.map(|(_, wish)| wish)
    }

    /// Whether the map says that the record has none of a quantity, whatever its columns are called.
    #[must_use]
    pub fn says_none(&self, quantity: &str) -> bool {
        self.wish(quantity) == Some(&Wish::Nothing)
    }

    /// The quantities that are mapped.
    pub(crate) fn mapped(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().map(|(name, _)| name.as_str())
    }

    /// The columns that are named.
    pub(crate) fn columns(&self) -> impl Iterator<Item = &str> {
        self.entries.iter().filter_map(|(_, wish)| match wish {
            Wish::Column { name, .. } => Some(name.as_str()),
            Wish::Constant(_) | Wish::Nothing => None,
        })
    }

    /// The value of a quantity that holds for the whole table.
    #[must_use]
    pub fn constant(&self, quantity: &str) -> Option<f64> {
        match self.wish(quantity)? {
            Wish::Constant(value) => Some(*value),
            Wish::Column { .. } | Wish::Nothing => None,
        }
    }

    /// Adds the entries of another map, such as those of the command line to those of a file.
    ///
    /// # Errors
    /// If both name a quantity.
    pub fn and(mut self, other: ColumnMap) -> Result<Self, Faults> {
        for (name, wish) in other.entries {
            // the section of a record counts before the others: an entry of the command line would silently not hold
            // for it
            if self.records.iter().any(|record| record.map.wish(&name).is_some()) {
                return Err(mapped_twice(&name).into());
            }
            self.add(name, wish)?;
        }
        self.phase = other.phase.or(self.phase);
        self.settled = other.settled.or(self.settled);
        self.sampled = other.sampled.or(self.sampled);
        // the command line cannot say `unknown`: it is what was left out
        if other.duty != DutyIs::Unknown {
            self.duty = other.duty;
        }
        Ok(self)
    }

    /// The map of the record in `file`: what is said of it alone counts before what is said of all.
    #[must_use]
    pub fn of(&self, file: &Path) -> Cow<'_, ColumnMap> {
        let Some(own) = self.records.iter().find(|record| is_called(file, &record.name)) else {
            return Cow::Borrowed(self);
        };
        let own = &own.map;
        let others = self.entries.iter().filter(|(name, _)| own.wish(name).is_none());
        Cow::Owned(ColumnMap {
            entries: others.chain(&own.entries).cloned().collect(),
            phase: own.phase.or(self.phase),
            duty: if own.duty == DutyIs::Unknown {
                self.duty
            } else {
                own.duty
            },
            sampled: own.sampled.or(self.sampled),
            settled: own.settled.or(self.settled),
            // a section holds for one record and has none of its own
            records: Vec::new(),
        })
    }

    /// Sections of records that are none of `files`: a map may describe more records than a command reads.
    #[must_use]
    pub fn sections_without(&self, files: &[&Path]) -> Vec<&str> {
        let missing = |record: &&OfRecord| !files.iter().any(|file| is_called(file, &record.name));
        let sections = self.records.iter().filter(missing);
        sections.map(|record| record.name.as_str()).collect()
    }

    fn add(&mut self, name: String, wish: Wish) -> Result<(), Message> {
        if self.wish(&name).is_some() {
            return Err(mapped_twice(&name));
        }
        self.entries.push((name, wish));
        Ok(())
    }
}

fn is_called(file: &Path, name: &str) -> bool {
    file.file_stem().is_some_and(|stem| stem.to_string_lossy() == name)
}

fn mapped_twice(name: &str) -> Message {
    Message::new(format!("`{name}` is mapped twice")).hint("a quantity stands in one place")
}

/// The name of the quantity that a map calls `text`, of those that a command reads.
fn quantity(text: &str, known: &[Quantity<'_>]) -> Result<String, Message> {
    let found = known.iter().find(|quantity| quantity.is_called(text));
    found.map(|quantity| quantity.name.to_owned()).ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|quantity| quantity.name).collect();
        Message::new(format!("no quantity `{text}`"))
            .expected(format!("one of {}", names.join(", ")))
            .did_you_mean(text, known.iter().flat_map(Quantity::names))
    })
}

#[cfg(test)]
mod tests;

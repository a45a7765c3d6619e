//! A quantity of a table: its column and the way from there to SI.

use toml_input::{Fault, Message, Sink};

use crate::sheet::{Cell, Sheet};

/// A quantity that was found: in a column, or as a constant of the map.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    /// What to call it in front of the user: its name in the file as far as that is one of the quantity's names.
    pub label: String,
    pub(crate) source: Source,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Source {
    Column {
        index: usize,
        scale: f64,
        offset: f64,
        stated: bool,
    },
    Constant(f64),
}

impl Signal {
    /// The index of its column; none for a constant.
    #[must_use]
    pub fn column(&self) -> Option<usize> {
        match self.source {
            Source::Column { index, .. } => Some(index),
            Source::Constant(_) => None,
        }
    }

    /// Whether the user gave a factor (or a constant) in the map: then the unit is known, however odd the numbers.
    #[must_use]
    pub fn is_stated(&self) -> bool {
        match self.source {
            Source::Column { stated, .. } => stated,
            Source::Constant(_) => true,
        }
    }

    /// Wanted units over units of the file.
    #[must_use]
    pub fn scale(&self) -> f64 {
        match self.source {
            Source::Column { scale, .. } => scale,
            Source::Constant(_) => 1.0,
        }
    }

    /// A number of the file in the wanted unit.
    #[must_use]
    pub fn scaled(&self, value: f64) -> f64 {
        match self.source {
            // -0 + 0 would lose its sign, and recorded traces are replayed bit by bit
            Source::Column { scale, offset: 0.0, .. } => value * scale,
            Source::Column { scale, offset, .. } => value * scale + offset,
            Source::Constant(value) => value,
        }
    }

    /// What stands in a row, a number in the wanted unit.
    #[must_use]
    pub fn cell<'a>(&self, sheet: &'a Sheet, row: usize) -> Cell<'a> {
        match self.source {
            Source::Constant(value) => Cell::Number(value),
            Source::Column { index, .. } => {
                let column = sheet.columns().get(index);
                match column.map_or(Cell::Empty, |column| column.cell(row)) {
                    Cell::Number(value) => Cell::Number(self.scaled(value)),
                    other => other,
                }
            }
        }
    }

    /// The number in a row, in the wanted unit, if there is one.
    #[must_use]
    pub fn number(&self, sheet: &Sheet, row: usize) -> Option<f64> {
        match self.cell(sheet, row) {
            Cell::Number(value) => Some(value),
            Cell::Empty | Cell::Word(_) => None,
        }
    }

    /// All rows in the wanted unit; NaN where nothing was measured: an empty cell, or `nan`, `na`, `n/a`, `null`, `-`.
    /// Any other word is a fault.
    pub fn values(&self, sheet: &Sheet, faults: &mut Sink) -> Vec<f64> {
        let value = |row| match self.cell(sheet, row) {
            Cell::Number(value) => value,
            cell => {
                if !cell.is_missing() {
                    faults.push(self.not_a_number(sheet, row));
                }
                f64::NAN
            }
        };
        (0..sheet.rows()).map(value).collect()
    }

    /// The fault of a cell that should hold a number.
    #[must_use]
    pub fn not_a_number(&self, sheet: &Sheet, row: usize) -> Fault {
        let label = &self.label;
        let message = match self.cell(sheet, row) {
            Cell::Word(word) => {
                let message = Message::new(format!("`{label}` is not a number here")).found(word);
                message.hint(hint(word, label))
            }
            Cell::Empty | Cell::Number(_) => {
                Message::new(format!("a cell of `{label}` is empty")).hint("measure the point again or remove its row")
            }
        };
        self.fault(sheet, row, message.expected("a finite number"))
    }

    /// A fault of this quantity in a row.
    #[must_use]
    pub fn fault(&self, sheet: &Sheet, row: usize, message: Message) -> Fault {
        match self.source {
            Source::Column { index, .. } => sheet.cell_fault(row, index, message),
            Source::Constant(_) => sheet.row_fault(row, message),
        }
    }
}

/// What to do about a word in the place of a number.
fn hint(word: &str, label: &str) -> String {
    let digits = word.starts_with(|c: char| c.is_ascii_digit() || c == '-');
    if word.ends_with('%') {
        "write 0.5 instead of 50 %, or put the unit behind the name: `duty (%)`".to_owned()
    } else if word.contains(',') && word.contains('.') {
        "write 1000.5 instead of 1,000.5".to_owned()
    } else if digits && word.contains([':', '/']) {
        "a date or a time of day? write seconds from the first row on".to_owned()
    } else if digits && word.ends_with(|c: char| c.is_alphabetic()) {
        format!("put the unit behind the name of the column: `{label} [mV]`")
    } else {
        "remove the row or measure the point again; leave the cell empty where nothing was measured".to_owned()
    }
}

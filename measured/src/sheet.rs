//! What every file format is read into: columns of values with places.

use std::path::Path;

use toml_input::{Fault, FileName, Message, Sink};

use crate::csv::TextPlaces;

/// A screen of faults; a table in which every row is wrong has one reason, which the first ones show.
const MOST_FAULTS: usize = 12;

/// For the faults of a table: of very many the first are kept, the others counted.
#[must_use]
pub fn table_faults() -> Sink {
    Sink::at_most(MOST_FAULTS)
}

/// A column of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Column {
    /// As in the header, without blanks around it.
    pub name: String,
    /// One for each row; NaN where there is no finite number.
    pub values: Vec<f64>,
    /// Digits after the point of the most precise number, in the unit of the file.
    pub decimals: u32,
    /// Cells that hold something else than a finite number, by row, as they stand there.
    pub(crate) words: Vec<(usize, String)>,
}

/// What stands in one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cell<'a> {
    /// A finite number.
    Number(f64),
    /// Nothing.
    Empty,
    /// Anything else: `nan`, `inf`, a word.
    Word(&'a str),
}

/// Columns of one length, in the order of the file.
#[derive(Debug, Clone)]
pub struct Sheet {
    /// The file.
    name: FileName,
    columns: Vec<Column>,
    rows: usize,
    /// What was not as it should be but could be read, in plain words.
    pub repairs: Vec<String>,
    places: Places,
}

/// How a row is found in the file again.
#[derive(Debug, Clone)]
enum Places {
    /// Line and column of a text.
    Text(TextPlaces),
    /// Rows from 1, in a format that has no lines.
    Numbered,
}

impl Column {
    /// A column of finite numbers and NaN.
    #[must_use]
    pub fn new(name: &str, values: Vec<f64>) -> Self {
        Column {
            name: name.trim().to_owned(),
            values,
            ..Column::default()
        }
    }

    /// Takes the marks of instruments for missing values; how many there were.
    fn leave_out_marks(&mut self) -> usize {
        let marks = self.values.iter_mut().enumerate().filter(|(_, value)| is_mark(**value));
        let marks: Vec<(usize, String)> = marks
            .map(|(row, value)| (row, format!("{:e}", std::mem::replace(value, f64::NAN))))
            .collect();
        let count = marks.len();
        self.words.extend(marks);
        self.words.sort_by_key(|(row, _)| *row);
        count
    }

    /// What stands in a row.
    #[must_use]
    pub fn cell(&self, row: usize) -> Cell<'_> {
        match self.values.get(row) {
            Some(value) if value.is_finite() => Cell::Number(*value),
            // rows are read in order, so the words are sorted by theirs
            _ => match self.words.binary_search_by_key(&row, |(row, _)| *row) {
                Ok(index) => Cell::Word(&self.words[index].1),
                Err(_) => Cell::Empty,
            },
        }
    }
}

/// From here on a number is a mark.
// SCPI, volume 1, 7.2.1: 9.9E+37 is infinity, 9.91E+37 no number; nothing on a bench is as large
const MARK: f64 = 9e37;

fn is_mark(value: f64) -> bool {
    value.is_finite() && value.abs() >= MARK
}

/// Takes the marks of instruments out of columns and says so.
fn leave_out_marks(columns: &mut [Column], repairs: &mut Vec<String>) {
    for column in columns {
        let (count, name) = (column.leave_out_marks(), &column.name);
        let (values, are_marks) = if count == 1 {
            ("value", "is a mark")
        } else {
            ("values", "are marks")
        };
        if count > 0 {
            repairs.push(format!(
                "{count} {values} of `{name}` {are_marks} of an instrument for none or out of range (9.9e37): not measured"
            ));
        }
    }
}

impl Cell<'_> {
    /// Nothing, or a word that says so: `nan`, `na`, `n/a`, `null`, `-`, 9.9e37 of an instrument.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        const WORDS: [&str; 5] = ["nan", "na", "n/a", "null", "-"];
        match self {
            Cell::Number(_) => false,
            Cell::Empty => true,
            Cell::Word(word) => {
                WORDS.iter().any(|missing| word.eq_ignore_ascii_case(missing)) || word.parse().is_ok_and(is_mark)
            }
        }
    }
}

impl Sheet {
    /// A sheet of a format without lines: its rows are counted from 1. All columns have the length of the first.
    #[must_use]
    pub fn numbered(name: FileName, mut columns: Vec<Column>) -> Self {
        let mut repairs = Vec::new();
        leave_out_marks(&mut columns, &mut repairs);
        Sheet {
            name,
            rows: columns.first().map_or(0, |column| column.values.len()),
            columns,
            repairs,
            places: Places::Numbered,
        }
    }

    pub(crate) fn of_text(
        name: FileName,
        mut columns: Vec<Column>,
        mut repairs: Vec<String>,
        places: TextPlaces,
    ) -> Self {
        leave_out_marks(&mut columns, &mut repairs);
        Sheet {
            name,
            columns,
            rows: places.rows(),
            repairs,
            places: Places::Text(places),
        }
    }

    /// The file, as the user named it.
    #[must_use]
    pub fn file(&self) -> &Path {
        &self.name.shown
    }

    /// Number of rows below the header.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The columns.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The names of the columns.
    pub fn headers(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|column| column.name.as_str())
    }

    /// The column with this very name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// Line of a row in the file, from 1; the number of the row from 1 in a format without lines.
    #[must_use]
    pub fn line(&self, row: usize) -> usize {
        match &self.places {
            Places::Text(places) => places.line(row),
            Places::Numbered => row + 1,
        }
    }

    /// A fault of one cell.
    #[must_use]
    pub fn cell_fault(&self, row: usize, column: usize, message: Message) -> Fault {
        match &self.places {
            Places::Text(places) => places.cell(row, column, message),
            Places::Numbered => {
                let name = self.columns.get(column).map_or("", |column| column.name.as_str());
                self.numbered_fault(message, &format!("row {} of `{name}`", row + 1))
            }
        }
    }

    /// A fault of a whole row.
    #[must_use]
    pub fn row_fault(&self, row: usize, message: Message) -> Fault {
        match &self.places {
            Places::Text(places) => places.row(row, message),
            Places::Numbered => self.numbered_fault(message, &format!("row {}", row + 1)),
        }
    }

    fn numbered_fault(&self, message: Message, place: &str) -> Fault {
        let mut fault = self.name.fault(message);
        fault.problem = format!("{} ({place})", fault.problem);
        fault
    }

    /// A fault of a column's name.
    #[must_use]
    pub fn name_fault(&self, column: usize, message: Message) -> Fault {
        match &self.places {
            Places::Text(places) => places.header(Some(column), message),
            Places::Numbered => self.name.fault(message),
        }
    }

    /// A fault of the names of the columns.
    #[must_use]
    pub fn header_fault(&self, message: Message) -> Fault {
        match &self.places {
            Places::Text(places) => places.header(None, message),
            Places::Numbered => self.name.fault(message),
        }
    }

    /// A fault of the table as a whole.
    #[must_use]
    pub fn fault(&self, message: Message) -> Fault {
        self.name.fault(message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_of_instruments_are_no_numbers_in_any_format() {
        let columns = vec![Column::new("v_out", vec![1.5, -9.91e37])];
        let sheet = Sheet::numbered(FileName::new(Path::new("run.mat")), columns);
        assert!(sheet.columns()[0].cell(1).is_missing() && sheet.repairs.len() == 1);
    }

    /// Another file format needs no more than this.
    #[test]
    fn a_format_without_lines_places_its_faults_by_row_and_channel() {
        let columns = vec![
            Column::new("t", vec![0.0, 1.0]),
            Column::new("v_out", vec![1.5, f64::NAN]),
        ];
        let sheet = Sheet::numbered(FileName::new(Path::new("run.mat")), columns);
        assert_eq!((sheet.rows(), sheet.line(1)), (2, 2));
        assert_eq!(sheet.columns()[1].cell(1), Cell::Empty);
        let fault = sheet.cell_fault(1, 1, Message::new("a hole"));
        assert_eq!(
            (fault.problem.as_str(), fault.line_column()),
            ("a hole (row 2 of `v_out`)", None)
        );
    }
}

//! Tables as instruments and scripts write them: separators, decimal commas, byte order marks, cut last lines.

use std::path::{Path, PathBuf};

use toml_input::{Fault, Faults, Message, Place};

/// Longest file that is read, bytes.
const LONGEST: u64 = 200_000_000;
/// Faults shown of one file.
const MOST_FAULTS: usize = 8;

/// A column of numbers.
#[derive(Debug, Clone)]
pub struct Column {
    /// As in the header, trimmed.
    pub name: String,
    /// NaN where the cell is empty or says so.
    pub values: Vec<f64>,
    /// Digits after the point of the most precise cell.
    pub decimals: u32,
}

/// A file of numbers with a header.
#[derive(Debug, Clone)]
pub struct Table {
    /// The file, as the user named it.
    pub file: PathBuf,
    /// The columns.
    pub columns: Vec<Column>,
    /// Line of each row, from 1.
    pub lines: Vec<usize>,
    /// What was repaired on the way, in plain words.
    pub repairs: Vec<String>,
}

impl Table {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read, and the faults of [`Table::parse`].
    pub fn open(file: &Path) -> Result<Self, Faults> {
        let bytes = toml_input::FileName::new(file)
            .read(LONGEST)
            .map_err(|message| Fault::new(file, Place::File, message))?;
        Self::parse(file, &bytes)
    }

    /// Reads text; `file` only names it in messages.
    ///
    /// # Errors
    /// No header, a cell that is no number, a line with too many or too few cells.
    pub fn parse(file: &Path, bytes: &[u8]) -> Result<Self, Faults> {
        let Ok(text) = std::str::from_utf8(bytes) else {
            let message = Message::new("the file is not UTF-8 text").hint("save it as CSV in UTF-8");
            return Err(Fault::new(file, Place::File, message).into());
        };
        let mut repairs = Vec::new();
        let unmarked = text.strip_prefix('\u{feff}').unwrap_or(text);
        let whole = unmarked.ends_with(['\n', '\r']);
        let unix;
        let unmarked = if unmarked.contains('\n') {
            unmarked
        } else {
            // line ends of old systems
            unix = unmarked.replace('\r', "\n");
            &unix
        };
        let mut lines = unmarked
            .lines()
            .enumerate()
            .map(|(n, line)| (n + 1, line.trim_end_matches('\r')))
            .filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
        let Some((_, header)) = lines.next() else {
            let message = Message::new("the table is empty").expected("a header such as t,d,v_o,i_l,i_o,v_in,r_load");
            return Err(Fault::new(file, Place::File, message).into());
        };
        let separator = [';', '\t', ','].into_iter().find(|mark| header.contains(*mark));
        let spaced = separator.is_none() && header.split_whitespace().count() > 1;
        let separator = separator.unwrap_or(if spaced { ' ' } else { ',' });
        let names: Vec<&str> = cells(header, separator).into_iter().map(clean).collect();
        let mut reader = Reader {
            file,
            separator,
            comma: false,
            table: names.iter().map(|name| new_column(name)).collect(),
            rows: Vec::new(),
            faults: Vec::new(),
        };
        let mut rows: Vec<(usize, &str)> = lines.collect();
        if let Some((line, units)) = rows.first().filter(|(_, row)| names_units(row, separator)) {
            check_units(file, *line, units, separator)?;
            repairs.push(format!("line {line} holds units: left out"));
            rows.remove(0);
        }
        reader.comma = separator != ',' && rows.iter().take(20).any(|(_, row)| row.contains(','));
        for (index, (line, row)) in rows.iter().enumerate() {
            let last = index + 1 == rows.len();
            if last && !whole && cells(row, separator).len() < names.len() {
                repairs.push(format!("line {line} is cut off: left out"));
            } else {
                reader.row(*line, row);
            }
        }
        if reader.comma {
            repairs.push("decimal commas read as points".to_owned());
        }
        Faults::unless_empty(reader.faults)?;
        Ok(Table {
            file: file.to_owned(),
            columns: reader.table,
            lines: reader.rows,
            repairs,
        })
    }
}

/// The cells of a line; several blanks are one.
fn cells(line: &str, separator: char) -> Vec<&str> {
    match separator {
        ' ' => line.split_whitespace().collect(),
        _ => line.split(separator).collect(),
    }
}

/// Whether a line holds words throughout: units, as oscilloscopes write them below the names.
fn names_units(line: &str, separator: char) -> bool {
    let words = cells(line, separator);
    words.iter().all(|cell| {
        let cell = clean(cell);
        cell.chars().all(|c| c.is_alphabetic() || "%/[]()Ωµ".contains(c)) && !cell.eq_ignore_ascii_case("nan")
    }) && words.iter().any(|cell| !clean(cell).is_empty())
}

/// Units below the names are SI; others belong to the names, where they are heeded.
fn check_units(file: &Path, line: usize, text: &str, separator: char) -> Result<(), Faults> {
    const SI: [&str; 13] = [
        "", "s", "second", "seconds", "v", "volt", "volts", "a", "ampere", "amperes", "ohm", "w", "watt",
    ];
    let other = cells(text, separator)
        .into_iter()
        .map(|cell| clean(cell).trim_matches(|c| "[]()".contains(c)))
        .find(|unit| !SI.contains(&unit.to_ascii_lowercase().as_str()));
    let Some(unit) = other else { return Ok(()) };
    let message = Message::new("a line of units that are not SI")
        .found(unit.to_owned())
        .expected("s, V, A, ohm, W")
        .hint("put the unit behind the name, `v_o [mV]`, and remove this line");
    let place = Place::Span {
        line,
        column: 1,
        text: text.to_owned(),
        length: 1,
    };
    Err(Fault::new(file, place, message).into())
}

fn clean(cell: &str) -> &str {
    cell.trim().trim_matches('"').trim()
}

fn new_column(name: &str) -> Column {
    Column {
        name: name.to_owned(),
        values: Vec::new(),
        decimals: 0,
    }
}

struct Reader<'a> {
    file: &'a Path,
    separator: char,
    comma: bool,
    table: Vec<Column>,
    rows: Vec<usize>,
    faults: Vec<Fault>,
}

impl Reader<'_> {
    fn row(&mut self, line: usize, text: &str) {
        let cells = cells(text, self.separator);
        let expected = self.table.len();
        if cells.len() != expected {
            let message = Message::new("a line with another number of cells than the header")
                .found(cells.len().to_string())
                .expected(expected.to_string())
                .hint("a decimal comma needs `;` between the cells");
            return self.fault(line, 1, text, message);
        }
        let mut column = 1;
        for (n, cell) in cells.iter().enumerate() {
            let (value, decimals) = number(clean(cell), self.comma);
            match value {
                Some(value) => {
                    self.table[n].values.push(value);
                    self.table[n].decimals = self.table[n].decimals.max(decimals);
                }
                None => {
                    let message = Message::new(format!("column `{}` holds no number", self.table[n].name))
                        .found(clean(cell).to_owned())
                        .expected("a number; an empty cell or NaN where nothing was measured");
                    self.fault(line, column, text, message);
                    self.table[n].values.push(f64::NAN);
                }
            }
            column += cell.chars().count() + 1;
        }
        self.rows.push(line);
    }

    fn fault(&mut self, line: usize, column: usize, text: &str, message: Message) {
        if self.faults.len() < MOST_FAULTS {
            let place = Place::Span {
                line,
                column,
                text: text.to_owned(),
                length: 1,
            };
            self.faults.push(Fault::new(self.file, place, message));
        }
    }
}

/// A cell and its digits after the point; NaN for an empty one, nothing for one that is no number.
fn number(cell: &str, comma: bool) -> (Option<f64>, u32) {
    let missing = ["", "nan", "na", "n/a", "null", "-"];
    if missing.contains(&cell.to_ascii_lowercase().as_str()) {
        return (Some(f64::NAN), 0);
    }
    let text = if comma { cell.replace(',', ".") } else { cell.to_owned() };
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
    let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((&text, "0"));
    let digits = mantissa
        .split_once('.')
        .map_or(0, |(_, fraction)| fraction.len() as i64);
    let shifted = digits - exponent.parse::<i64>().unwrap_or(0);
    (value, u32::try_from(shifted).unwrap_or(0).min(12))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Table, Faults> {
        Table::parse(Path::new("a.csv"), text.as_bytes())
    }

    #[test]
    fn a_mark_carriage_returns_semicolons_and_decimal_commas_are_read() {
        let table = parse("\u{feff}t;v_o\r\n0,1;1,5\r\n0,2;NaN\r\n").unwrap();
        assert_eq!(table.columns[0].values, [0.1, 0.2]);
        assert_eq!((table.columns[1].values[0], table.columns[1].decimals), (1.5, 1));
        assert!(table.columns[1].values[1].is_nan());
        assert_eq!(table.repairs.len(), 1, "the decimal comma is reported");
    }

    #[test]
    fn a_cut_last_line_is_left_out_and_reported() {
        let table = parse("t,v\n0,1\n1,2\n2").unwrap();
        assert_eq!(table.lines, [2, 3]);
        assert!(table.repairs[0].contains("line 4 is cut off"));
    }

    #[test]
    fn a_word_in_a_cell_is_placed_by_line_and_column() {
        let faults = parse("t,v\n0,1\n0.5,overflow\n").unwrap_err();
        assert_eq!(faults.list[0].line_column(), Some((3, 5)));
        assert!(parse("t,v\n0\n1,2\n").is_err(), "a short line in the middle");
        assert!(parse("").is_err());
    }
}

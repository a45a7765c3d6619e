//! Which column holds which quantity.

use toml_input::{Fault, Faults, Message, nearest};

use crate::table::cells::{Row, Sheet};

/// Where the quantities stand: a column of that name unless said otherwise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Columns {
    entries: Vec<(String, Wish)>,
}

#[derive(Debug, Clone, PartialEq)]
enum Wish {
    Column { name: String, factor: f64, stated: bool },
    Constant(f64),
}

const QUANTITIES: [&str; 6] = ["d_real", "v_out", "i_out", "v_in", "v_std", "settled"];

/// Where one quantity is found in a sheet.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Source {
    Column {
        index: usize,
        factor: f64,
        /// The factor was given: the user knows the unit.
        stated: bool,
    },
    Constant(f64),
}

/// Where all of them are found.
#[derive(Debug, Clone)]
pub(crate) struct Located {
    pub d_real: Source,
    pub v_out: Source,
    pub i_out: Source,
    pub v_in: Source,
    pub v_std: Option<Source>,
    pub settled: Option<Source>,
}

impl Columns {
    /// Reads `quantity=column`, `quantity=column*factor` or `quantity=number`, several separated by commas.
    ///
    /// Quantities are `d_real`, `v_out`, `i_out`, `v_in`, `v_std` and `settled`.
    ///
    /// # Errors
    /// If an entry is none of these.
    pub fn parse(text: &str) -> Result<Self, Faults> {
        let mut columns = Columns::default();
        let mut faults = Vec::new();
        for entry in text.split(',').map(str::trim).filter(|entry| !entry.is_empty()) {
            match wish(entry) {
                Ok((quantity, _)) if columns.get(&quantity).is_some() => {
                    faults.push(
                        Message::new(format!("`{quantity}` is mapped twice"))
                            .found(entry)
                            .into(),
                    );
                }
                Ok(found) => columns.entries.push(found),
                Err(message) => faults.push(message.found(entry).into()),
            }
        }
        Faults::unless_empty(faults).map(|()| columns)
    }

    fn get(&self, quantity: &str) -> Option<&Wish> {
        self.entries
            .iter()
            .find(|(name, _)| name == quantity)
            .map(|(_, wish)| wish)
    }

    pub(crate) fn locate(&self, sheet: &Sheet<'_>) -> Result<Located, Vec<Fault>> {
        let mut faults = Vec::new();
        let mut find = |quantity: &str, needed: bool| -> Option<Source> {
            let plain = Wish::Column {
                name: quantity.to_owned(),
                factor: 1.0,
                stated: false,
            };
            let wish = self.get(quantity);
            let (name, factor, stated) = match wish.unwrap_or(&plain) {
                Wish::Constant(value) => return Some(Source::Constant(*value)),
                Wish::Column { name, factor, stated } => (name, *factor, *stated),
            };
            let index = sheet.header().position(|column| column == name);
            if index.is_none() && (needed || wish.is_some()) {
                faults.push(missing(quantity, name, sheet));
            }
            index.map(|index| Source::Column { index, factor, stated })
        };
        let needed = ["d_real", "v_out", "i_out", "v_in"].map(|quantity| find(quantity, true));
        let [v_std, settled] = ["v_std", "settled"].map(|quantity| find(quantity, false));
        let [Some(d_real), Some(v_out), Some(i_out), Some(v_in)] = needed else {
            return Err(faults);
        };
        if !faults.is_empty() {
            return Err(faults);
        }
        Ok(Located {
            d_real,
            v_out,
            i_out,
            v_in,
            v_std,
            settled,
        })
    }
}

fn wish(entry: &str) -> Result<(String, Wish), Message> {
    let form = || {
        Message::new("the column map cannot be read")
            .expected("quantity=column, quantity=column*factor or quantity=number")
            .hint("for example --map d_real=duty_percent*0.01,v_in=24")
    };
    let (quantity, value) = entry.split_once('=').ok_or_else(form)?;
    let (quantity, value) = (quantity.trim(), value.trim());
    if !QUANTITIES.contains(&quantity) {
        let hint = nearest(quantity, QUANTITIES).map(|name| format!("did you mean `{name}`?"));
        let message = Message::new(format!("no quantity `{quantity}`")).maybe_hint(hint);
        return Err(message.expected(format!("one of {}", QUANTITIES.join(", "))));
    }
    if let Some(number) = finite(value) {
        return Ok((quantity.to_owned(), Wish::Constant(number)));
    }
    let (name, factor, stated) = match value.rsplit_once('*') {
        None => (value, 1.0, false),
        Some((name, factor)) => (name.trim(), finite(factor.trim()).ok_or_else(form)?, true),
    };
    if name.is_empty() {
        return Err(form());
    }
    let name = name.to_owned();
    Ok((quantity.to_owned(), Wish::Column { name, factor, stated }))
}

fn missing(quantity: &str, name: &str, sheet: &Sheet<'_>) -> Fault {
    let near = nearest(name, sheet.header()).unwrap_or("COLUMN");
    let hint = match quantity {
        "v_in" => format!("say where it stands, --map v_in={near}, or how high it was, --map v_in=24"),
        _ => format!("say where it stands: --map {quantity}={near}"),
    };
    let message = Message::new(format!("no column `{name}`")).expected("the columns d_real, v_out, i_out, v_in");
    sheet.header_fault(message.hint(hint))
}

fn finite(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|number| number.is_finite())
}

impl Source {
    pub fn is_empty(&self, row: &Row, sheet: &Sheet<'_>) -> bool {
        match self {
            Source::Constant(_) => false,
            Source::Column { index, .. } => sheet.cell(row, *index).is_empty(),
        }
    }

    /// The factor was given with the column.
    pub fn is_stated(&self) -> bool {
        match self {
            Source::Constant(_) => true,
            Source::Column { stated, .. } => *stated,
        }
    }

    /// The number in a row, in SI units.
    pub fn number(&self, row: &Row, sheet: &Sheet<'_>, faults: &mut Vec<Fault>) -> Option<f64> {
        let (index, factor) = match self {
            Source::Constant(value) => return Some(*value),
            Source::Column { index, factor, .. } => (*index, *factor),
        };
        let cell = sheet.cell(row, index);
        if let Some(number) = finite(cell) {
            return Some(number * factor);
        }
        let (problem, hint) = if cell.is_empty() {
            (
                "a cell is empty",
                "measure the point again or remove its row; a row of which nothing is measured yet may stay",
            )
        } else if cell.contains('%') {
            (
                "a cell is not a number",
                "duty ratios are fractions: write 0.5 instead of 50 %",
            )
        } else {
            ("a cell is not a number", "remove the row or measure the point again")
        };
        let message = Message::new(problem)
            .expected("a finite number with a decimal point")
            .hint(hint);
        faults.push(sheet.cell_fault(row, index, message));
        None
    }

    /// Yes or no in a row.
    pub fn yes_or_no(&self, row: &Row, sheet: &Sheet<'_>, faults: &mut Vec<Fault>) -> Option<bool> {
        let index = match self {
            Source::Constant(value) => return Some(*value != 0.0),
            Source::Column { index, .. } => *index,
        };
        match sheet.cell(row, index).to_ascii_lowercase().as_str() {
            "yes" | "true" | "1" => Some(true),
            "no" | "false" | "0" => Some(false),
            _ => {
                let message = Message::new("a cell is neither yes nor no").expected("yes or no");
                faults.push(sheet.cell_fault(row, index, message));
                None
            }
        }
    }
}

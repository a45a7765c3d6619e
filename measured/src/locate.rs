//! Where the quantities stand in a sheet, and which columns nobody asked for.
//!
//! ```text
//! quantity ─► in the map? ─ yes ─► the column that it names, or its constant
//!                         └ no ──► the columns whose header is one of its names, with a unit or without
//!                                    none: missing, if a reader needs it    one: found    two: a fault
//! ```
//!
//! A guess is never made between two columns: what is fitted to the wrong one looks plausible.

use toml_input::{Fault, Faults, Message, Sink, nearest};

use crate::guess::argument;
use crate::map::{ColumnMap, Wish};
use crate::quantity::{Quantity, split_unit};
use crate::sheet::{Cell, Sheet};
use crate::signal::{Signal, Source};
use crate::time_like;

/// Columns named in a note at most.
// a convention: a logger may record hundreds of channels
const MOST_NAMED: usize = 8;

/// The quantities of a sheet.
#[derive(Debug, Clone)]
pub struct Located {
    /// Name and signal of every quantity that was found.
    signals: Vec<(String, Signal)>,
    /// Columns that no quantity was found in.
    pub unused: Vec<usize>,
    /// Quantities of the map that nobody asked for.
    unasked: Vec<String>,
}

impl Sheet {
    /// Finds quantities: where the map says, or else by name.
    ///
    /// A quantity that is not there is no fault here: [`Sheet::missing`] makes one.
    ///
    /// # Errors
    /// A column that the map names and the file has not; two columns for one quantity.
    pub fn locate(&self, wanted: &[Quantity<'_>], map: &ColumnMap) -> Result<Located, Faults> {
        let map = &*map.of(self.file());
        let mut faults = Sink::new();
        let mut signals = Vec::new();
        for quantity in wanted {
            match self.signal(quantity, map) {
                Ok(Some(signal)) => signals.push((quantity.name.to_owned(), signal)),
                Ok(None) => {}
                Err(fault) => faults.push(*fault),
            }
        }
        // a quantity that is missing by a fault would be called unused or missing again
        faults.propagate()?;
        let used = |index: &usize| signals.iter().any(|(_, signal)| signal.column() == Some(*index));
        let is_empty = |index: &usize| {
            let column = &self.columns()[*index];
            // a separator at the end of each line makes such a column, and nobody has forgotten it
            column.name.is_empty() && (0..self.rows()).all(|row| column.cell(row) == Cell::Empty)
        };
        let asked = |name: &&str| wanted.iter().any(|quantity| quantity.name == *name);
        Ok(Located {
            unused: (0..self.columns().len())
                .filter(|index| !used(index) && !is_empty(index))
                .collect(),
            unasked: map.mapped().filter(|name| !asked(name)).map(str::to_owned).collect(),
            signals,
        })
    }

    fn signal(&self, quantity: &Quantity<'_>, map: &ColumnMap) -> Result<Option<Signal>, Box<Fault>> {
        let label = quantity.name.to_owned();
        match map.wish(quantity.name) {
            Some(Wish::Constant(value)) => Ok(Some(Signal {
                label,
                source: Source::Constant(*value),
            })),
            Some(Wish::Column { name, scale, offset }) => {
                let index = self
                    .named(name)
                    .ok_or_else(|| Box::new(self.no_column(quantity.name, name)))?;
                let header = &self.columns()[index].name;
                if let (None, Some(unit)) = (scale, quantity.foreign_unit(header)) {
                    return Err(Box::new(self.of_another_kind(quantity, name, index, unit)));
                }
                let source = Source::Column {
                    index,
                    // a factor of the map is the user's word: the unit behind the name then does not count
                    scale: scale.unwrap_or_else(|| quantity.scale_behind(header)),
                    offset: *offset,
                    stated: scale.is_some(),
                };
                let own = quantity.is_called(header);
                Ok(Some(Signal {
                    label: if own { header.clone() } else { label },
                    source,
                }))
            }
            Some(Wish::Nothing) => Ok(None),
            None => self.by_name(quantity, map),
        }
    }

    /// The column of this name, or of this name and a unit.
    fn named(&self, name: &str) -> Option<usize> {
        // exactly first: of `U` and `U [V]` the map can name either
        let exact = self.headers().position(|header| header == name);
        exact.or_else(|| self.headers().position(|header| split_unit(header).0 == name))
    }

    fn by_name(&self, quantity: &Quantity<'_>, map: &ColumnMap) -> Result<Option<Signal>, Box<Fault>> {
        // what the map says of a column counts before its name: a measured current called `i_load` is no load that was set
        let mapped: Vec<usize> = map.columns().filter_map(|name| self.named(name)).collect();
        let claims = self
            .headers()
            .enumerate()
            .filter(|(index, _)| !mapped.contains(index))
            .filter_map(|(index, header)| Some((index, quantity.scale_of(header)?)));
        let mut claims: Vec<(usize, f64)> = claims.collect();
        let name = |index: usize| self.columns()[index].name.as_str();
        // a plan of `drm acquire` that was filled in has both duties, and what was measured is what happened
        if claims.iter().any(|(index, _)| Quantity::is_measured_duty(name(*index))) {
            claims.retain(|(index, _)| Quantity::is_measured_duty(name(*index)));
        }
        match claims[..] {
            [] => Ok(None),
            [(index, scale)] => Ok(Some(Signal {
                label: quantity.called(name(index)).to_owned(),
                source: Source::Column {
                    index,
                    scale,
                    offset: 0.0,
                    stated: false,
                },
            })),
            [(first, _), (second, _), ..] => {
                let (first, wanted) = (name(first), quantity.name);
                let message = Message::new(format!("two columns are `{wanted}`: `{first}` and `{}`", name(second)));
                let map = argument(&format!("{wanted}={first}"));
                let message = message.hint(format!("say which one: {map}, or remove the other"));
                Err(Box::new(self.name_fault(second, message)))
            }
        }
    }

    /// What a current probe shows in volts is no current before somebody says how many amperes a volt is.
    fn of_another_kind(&self, quantity: &Quantity<'_>, name: &str, index: usize, unit: &str) -> Fault {
        let (wanted, own) = (quantity.name, quantity.unit);
        let message = Message::new(format!(
            "`{}` is mapped to `{wanted}`, which has another unit",
            self.columns()[index].name
        ));
        let hint = format!(
            "say how many {own} one {unit} is: {}, or scale = FACTOR in a map file; 10 for a probe of 100 mV/A. With *1 the numbers are \
             taken as {own}",
            argument(&format!("{wanted}={name}*FACTOR"))
        );
        self.name_fault(index, message.found(unit).expected(quantity.units()).hint(hint))
    }

    fn no_column(&self, quantity: &str, name: &str) -> Fault {
        let message = Message::new(format!("no column `{name}` for `{quantity}`")).found(self.listed());
        let message = match nearest(name, self.headers()) {
            Some(_) => message.did_you_mean(name, self.headers()),
            None => {
                let record = self.file().file_stem().unwrap_or_default().to_string_lossy();
                message.hint(format!(
                    "a map holds for every file. A map file (--columns) says under [records.{record}.columns] what is different in this one: \
                     another column, or {quantity} = false where it has none"
                ))
            }
        };
        self.header_fault(message)
    }

    /// The fault of a quantity that a reader needs and that is not there; `hint` follows the names it may have.
    #[must_use]
    pub fn missing(&self, quantity: &Quantity<'_>, hint: &str) -> Fault {
        let name = quantity.name;
        let slip = || quantity.names().find_map(|name| nearest(name, self.headers()));
        let near = self.resembling(name).or_else(slip).unwrap_or("COLUMN");
        let names: Vec<String> = quantity.names().map(|name| format!("`{name}`")).collect();
        let message = Message::new(format!("no column `{name}`"))
            .found(self.listed())
            .expected(format!("a column {}", names.join(" or ")))
            .hint(format!(
                "say where it stands, {}{hint}",
                argument(&format!("{name}={near}"))
            ));
        self.header_fault(message)
    }

    /// The columns of the file, for a fault.
    #[must_use]
    pub fn listed(&self) -> String {
        let names: Vec<&str> = self.headers().collect();
        names.join(", ")
    }
}

impl Located {
    /// The signal of a quantity.
    #[must_use]
    pub fn signal(&self, quantity: &str) -> Option<&Signal> {
        let found = self.signals.iter().find(|(name, _)| name == quantity);
        found.map(|(_, signal)| signal)
    }

    /// Takes what was found as one quantity for another: a load current that is called as one that was set, and was measured.
    pub fn take_as(&mut self, quantity: &str, other: &str) {
        let found = self.signals.iter_mut().find(|(name, _)| name == quantity);
        if let Some((name, _)) = found {
            other.clone_into(name);
        }
    }

    /// A column that nobody asked for and that looks like time, and why it does.
    #[must_use]
    pub fn time_like(&self, sheet: &Sheet) -> Option<(usize, String)> {
        let used: Vec<usize> = self.signals.iter().filter_map(|(_, signal)| signal.column()).collect();
        time_like::find(sheet, &self.unused, &used)
    }

    /// What a reader of the file should know: repairs, columns that were not used apart from `expected` ones, and
    /// entries of the map that were of no use.
    #[must_use]
    pub fn notes(&self, sheet: &Sheet, expected: &[&str]) -> Vec<String> {
        let mut notes = sheet.repairs.clone();
        let names = self.unused.iter().map(|index| sheet.columns()[*index].name.as_str());
        let mut names: Vec<String> = names
            .filter(|name| !expected.contains(name))
            .map(|name| format!("`{name}`"))
            .collect();
        let s = if names.len() == 1 { "" } else { "s" };
        if !names.is_empty() {
            let more = names.len().saturating_sub(MOST_NAMED);
            names.truncate(MOST_NAMED);
            let and = if more > 0 {
                format!(" and {more} more")
            } else {
                String::new()
            };
            notes.push(format!("column{s} not used: {}{and}", names.join(", ")));
        }
        for name in &self.unasked {
            notes.push(format!("`{name}` of the column map is not used here"));
        }
        notes
    }
}

#[cfg(test)]
mod tests;

//! Recorded measurements as part of the stream: a table with one column per signal, by name.

use std::path::Path;

use interp::Sample;
use measured::{Cell, ColumnMap, Located, Options, Quantity, Sheet, Signal, proposal, table_faults};
use policy::Policy;
use toml_input::{Faults, Message};

use super::sample_of;

/// A recording, one sample per signal and step.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    steps: Vec<Vec<Sample>>,
    /// What a reader of the table should know: columns that were not used, decimal commas.
    pub notes: Vec<String>,
}

impl Recorded {
    /// Reads a file; `map` says where a column has another name than its signal: `v_out=CH1,i_l=CH2`.
    ///
    /// # Errors
    /// A map or a file that cannot be read, and those of [`Recorded::read`].
    pub fn open(policy: &Policy, file: &Path, map: &str) -> Result<Self, Faults> {
        Self::read(policy, &Sheet::open(file, &Options::default())?, map)
    }

    /// Reads a table. Columns are found by the signals' names, or by other names of the same quantity; a unit behind
    /// the name is converted. Values are in the unit of the signal, for ADC signals too, where the nearest code is
    /// taken. `nan` and `inf` are numbers here: what a controller does with them is part of the comparison.
    ///
    /// # Errors
    /// A signal without column, two columns for one, cells that are no numbers.
    pub fn read(policy: &Policy, sheet: &Sheet, map: &str) -> Result<Self, Faults> {
        let signals = SignalColumns::new(policy);
        let quantities = signals.quantities();
        let located = sheet.locate(&quantities, &ColumnMap::parse_among(map, &quantities)?)?;
        let steps = signals.samples(sheet, &located)?;
        Ok(Self {
            steps,
            notes: located.notes(sheet, &[]),
        })
    }

    /// The steps, one sample per signal.
    pub fn steps(&self) -> &[Vec<Sample>] {
        &self.steps
    }
}

/// The columns of a policy's signals in a table.
#[derive(Debug, Clone)]
pub(crate) struct SignalColumns<'a> {
    policy: &'a Policy,
    /// Per signal, what else a table may call it.
    others: Vec<Vec<&'a str>>,
}

impl<'a> SignalColumns<'a> {
    pub fn new(policy: &'a Policy) -> Self {
        let others = policy.signals.iter().map(|signal| other_names(policy, signal));
        let others = others.collect();
        Self { policy, others }
    }

    /// What is looked for, a quantity per signal.
    pub fn quantities(&'a self) -> Vec<Quantity<'a>> {
        let quantity = |(signal, aliases)| quantity(signal, aliases);
        self.policy.signals.iter().zip(&self.others).map(quantity).collect()
    }

    /// One sample per signal for each row of a sheet in which [`SignalColumns::quantities`] were located.
    ///
    /// # Errors
    /// A signal without column, cells that are no numbers.
    pub fn samples(&self, sheet: &Sheet, located: &Located) -> Result<Vec<Vec<Sample>>, Faults> {
        let mut faults = table_faults();
        let mut columns = Vec::new();
        let quantities = self.quantities();
        let mut guesses: Vec<(&str, &str)> = sheet.guesses(located, &quantities);
        for quantity in &quantities {
            let is_open =
                located.signal(quantity.name).is_none() && guesses.iter().all(|(name, _)| *name != quantity.name);
            if is_open {
                guesses.push((quantity.name, sheet.nearly(located, quantity).unwrap_or("COLUMN")));
            }
        }
        let proposal = proposal(&guesses).unwrap_or_default();
        for (signal, quantity) in self.policy.signals.iter().zip(&quantities) {
            match located.signal(&signal.name) {
                Some(found) => columns.push((signal, found)),
                None => {
                    let names: Vec<String> = quantity.names().map(|name| format!("`{name}`")).collect();
                    let message = Message::new(format!("no column for the signal `{}`", signal.name))
                        .found(sheet.listed())
                        .expected(format!("a column {}", names.join(" or ")))
                        .hint(format!("say where it stands: {proposal}"));
                    faults.push(sheet.header_fault(message));
                }
            }
        }
        faults.propagate()?;
        let scalar = self.policy.numeric_format.scalar();
        let mut faults = table_faults();
        let mut steps = Vec::with_capacity(sheet.rows());
        for row in 0..sheet.rows() {
            let mut sample = |(signal, found): &(&policy::Signal, &Signal)| {
                let value = value(found, sheet, row);
                if value.is_none() {
                    faults.push(found.not_a_number(sheet, row));
                }
                sample_of(scalar, signal, value.unwrap_or(f64::NAN))
            };
            steps.push(columns.iter().map(&mut sample).collect());
        }
        faults.propagate()?;
        Ok(steps)
    }
}

/// What else a table may call a signal that has the name of a quantity; never the name of another signal.
fn other_names<'a>(policy: &Policy, signal: &policy::Signal) -> Vec<&'a str> {
    let names = Quantity::find(&signal.name).into_iter().flat_map(Quantity::names);
    let is_signal = |name: &&str| {
        policy
            .signals
            .iter()
            .any(|signal| signal.name.eq_ignore_ascii_case(name))
    };
    names.filter(|name| !is_signal(name)).collect()
}

fn quantity<'a>(signal: &'a policy::Signal, aliases: &'a Vec<&'a str>) -> Quantity<'a> {
    Quantity {
        name: &signal.name,
        aliases,
        unit: &signal.unit,
    }
}

/// A number, which may be none that is finite.
fn value(signal: &Signal, sheet: &Sheet, row: usize) -> Option<f64> {
    match signal.cell(sheet, row) {
        Cell::Number(value) => Some(value),
        Cell::Word(word) => word.parse().ok().map(|value| signal.scaled(value)),
        Cell::Empty => None,
    }
}

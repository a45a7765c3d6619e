//! Tables of settled points: CSV with the columns `d_real`, `v_out`, `i_out`, `v_in`.
//!
//! [`Table::parse`] reads strictly: all faults at once, each with file, line, what was found, what was expected and what
//! to do. What is read is in SI units and within the range of a buck converter.

mod cells;
mod columns;
mod suspicion;

use serde::Serialize;
use toml_input::{Fault, Faults, Message, Source as Text};

use crate::formula::Losses;
use cells::Sheet;
pub use columns::Columns;
use columns::{Located, Source};

/// One settled point of a converter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// Line of the file, from 1.
    pub line: usize,
    /// Commanded duty ratio, 0..1.
    pub d_real: f64,
    /// Output voltage, V.
    pub v_out: f64,
    /// Load current, A.
    pub i_out: f64,
    /// Input voltage, V.
    pub v_in: f64,
    /// The simulation that the policy was trained on.
    pub simulation: Losses,
    /// Whether the point had settled, as far as the table says so.
    pub settled: bool,
}

impl Point {
    /// The duty ratio with which the simulation has the same voltage at the same load current.
    #[must_use]
    pub fn d_sim(&self) -> f64 {
        self.simulation.d_real(self.v_out / self.simulation.v_in, self.i_out)
    }

    /// What a unit of d_sim is worth in the simulation at this load current, V.
    #[must_use]
    pub fn v_per_duty(&self) -> f64 {
        self.simulation.v_per_duty(self.i_out)
    }

    /// Measured voltage minus that of the simulation at the same duty ratio, V.
    #[must_use]
    pub fn without_v(&self) -> f64 {
        (self.d_sim() - self.d_real) * self.v_per_duty()
    }
}

/// The settled points of one converter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// At least one, in the order of the file.
    pub points: Vec<Point>,
    /// Lines whose measurement is still to come: `d_real`, `v_out`, `i_out` and `v_in` are all empty.
    pub open: Vec<usize>,
    /// What a reader of the table should know.
    pub notes: Vec<String>,
}

/// How a table is read.
#[derive(Debug, Clone, Default)]
pub struct TableOptions {
    /// Where the quantities stand.
    pub columns: Columns,
    /// Unsettled points are left out instead of refused.
    pub skip_unsettled: bool,
    /// The simulation that the policy was trained on; without it a loss-free one at the input voltage of each point, as in
    /// the paper.
    pub simulation: Option<Losses>,
    /// The table is still being filled in: too few points, or too equal ones, are no fault.
    pub partial: bool,
}

/// More points than this are a record over time, not a table of settled points.
const MOST_POINTS: usize = 2000;
/// More faults than this are counted, not listed.
const MOST_FAULTS: usize = 12;
/// A standard deviation above this share of the voltage means that the point had not settled.
const UNSETTLED: f64 = 0.005;

impl Table {
    /// Reads the text of a CSV file.
    ///
    /// Cells are separated by commas, numbers have a decimal point; empty lines and lines that start with `#` are
    /// skipped, columns that nobody asked for are ignored.
    ///
    /// # Errors
    /// All faults of the table; of very many the first.
    pub fn parse(text: &Text, options: &TableOptions) -> Result<Table, Faults> {
        read(text, options).map_err(|mut faults| {
            let more = faults.len().saturating_sub(MOST_FAULTS);
            faults.truncate(MOST_FAULTS);
            if more > 0 {
                faults.push(
                    text.name
                        .fault(Message::new(format!("{more} more faults of this kind"))),
                );
            }
            Faults::unless_empty(faults).err().unwrap_or_else(|| {
                // a reader that gives nothing has left a fault
                text.name.fault(Message::new("the table cannot be read")).into()
            })
        })
    }
}

fn read(text: &Text, options: &TableOptions) -> Result<Table, Vec<Fault>> {
    let sheet = Sheet::parse(text)?;
    let located = options.columns.locate(&sheet)?;
    let mut faults = Vec::new();
    let mut table = Table {
        points: Vec::new(),
        open: Vec::new(),
        notes: Vec::new(),
    };
    for row in &sheet.rows {
        match point(row, &located, options.simulation, &sheet, &mut faults) {
            Some(Reading::Point(point)) => table.points.push(point),
            Some(Reading::Open) => table.open.push(row.line),
            None => {}
        }
    }
    if faults.is_empty() {
        suspicion::check(&mut table, &located, &sheet, &mut faults);
    }
    if faults.is_empty() && !options.partial {
        suspicion::variety(&table.points, &sheet, &mut faults);
    }
    if faults.is_empty() {
        settled(&mut table, options, &sheet, &mut faults);
    }
    if table.points.len() > MOST_POINTS {
        let message = Message::new("too many rows for a table of settled points")
            .found(format!("{} rows", table.points.len()))
            .expected(format!("at most {MOST_POINTS}, one for each settled point"));
        let hint = "average a record over the time in which the converter had settled";
        faults.push(sheet.fault(message.hint(hint)));
    }
    if faults.is_empty() { Ok(table) } else { Err(faults) }
}

enum Reading {
    Point(Point),
    Open,
}

/// One row; `None` if it has faults.
fn point(
    row: &cells::Row,
    located: &Located,
    simulation: Option<Losses>,
    sheet: &Sheet<'_>,
    faults: &mut Vec<Fault>,
) -> Option<Reading> {
    let measured = [&located.d_real, &located.v_out, &located.i_out, &located.v_in];
    let in_table = |source: &&&Source| matches!(source, Source::Column { .. });
    if measured
        .iter()
        .filter(in_table)
        .all(|source| source.is_empty(row, sheet))
    {
        return Some(Reading::Open);
    }
    let before = faults.len();
    let mut number = |source: &Source| source.number(row, sheet, faults);
    let [d_real, v_out, i_out, v_in] = measured.map(&mut number);
    let v_std = located.v_std.as_ref().filter(|source| !source.is_empty(row, sheet));
    let v_std = v_std.and_then(&mut number);
    let settled = located.settled.as_ref().filter(|source| !source.is_empty(row, sheet));
    let settled = settled.and_then(|source| source.yes_or_no(row, sheet, faults));
    if faults.len() > before {
        return None;
    }
    let (v_out, v_in) = (v_out?, v_in?);
    Some(Reading::Point(Point {
        line: row.line,
        d_real: d_real?,
        v_out,
        i_out: i_out?,
        v_in,
        simulation: simulation.unwrap_or(Losses::none(v_in)),
        settled: settled.unwrap_or(true) && v_std.is_none_or(|v_std| v_std <= UNSETTLED * v_out.abs()),
    }))
}

/// Unsettled points are refused, or left out if so wished.
fn settled(table: &mut Table, options: &TableOptions, sheet: &Sheet<'_>, faults: &mut Vec<Fault>) {
    let unsettled: Vec<usize> = table.points.iter().filter(|p| !p.settled).map(|p| p.line).collect();
    if unsettled.is_empty() {
        return;
    }
    if options.skip_unsettled {
        table
            .notes
            .push(format!("left out as unsettled: {}", lines(&unsettled)));
        table.points.retain(|point| point.settled);
        return;
    }
    for line in unsettled {
        let expected = format!(
            "`settled` yes and `v_std` at most {} % of the voltage",
            100.0 * UNSETTLED
        );
        let hint = "measure it again after a longer wait, or leave such points out with --skip-unsettled";
        let message = Message::new("the point had not settled").expected(expected).hint(hint);
        faults.push(sheet.line_fault(line, message));
    }
}

/// `line 3` or `lines 3, 4`.
pub(crate) fn lines(lines: &[usize]) -> String {
    let list: Vec<String> = lines.iter().map(usize::to_string).collect();
    let s = if lines.len() == 1 { "" } else { "s" };
    format!("line{s} {}", list.join(", "))
}

//! From the rows of a sheet to settled points.

use measured::{Cell, Located, Quantity, Sheet, Signal, table_faults};
use toml_input::{Fault, Faults, Message, Sink};

use super::point::{PLAN_COLUMNS, Point, Table, TableOptions, lines};
use super::suspicion;
use crate::formula::Losses;

/// More points than this are a record over time, not a table of settled points.
// a convention: at two seconds a point, the longest that `acquire` waits at 10 kHz, more than an hour on a bench
const MOST_POINTS: usize = 2000;
/// A standard deviation above this share of the voltage means that the point had not settled.
// 0.5 V at 100 V: the band within which the paper's voltage counts as settled
const UNSETTLED: f64 = 0.005;

/// The quantities of every point.
const NEEDED: [&str; 4] = ["duty", "v_out", "i_out", "v_in"];
/// What a table may say beside them.
const OPTIONAL: [&str; 2] = ["v_std", "settled"];

/// A sheet whose quantities are found.
pub(super) struct Reading<'a> {
    pub sheet: &'a Sheet,
    pub duty: &'a Signal,
    pub v_out: &'a Signal,
    pub i_out: &'a Signal,
    pub v_in: &'a Signal,
    v_std: Option<&'a Signal>,
    settled: Option<&'a Signal>,
    /// The row of each point.
    rows: Vec<usize>,
}

pub(super) fn read(sheet: &Sheet, options: &TableOptions) -> Result<Table, Faults> {
    let wanted = [&NEEDED[..], &OPTIONAL[..]].concat();
    let wanted = Quantity::all(&wanted);
    let located = sheet.locate(&wanted, &options.columns)?;
    let mut reading = Reading::new(sheet, &located)?;
    let mut table = Table {
        points: Vec::new(),
        open: Vec::new(),
        notes: located.notes(sheet, &PLAN_COLUMNS),
    };
    let mut faults = table_faults();
    for row in 0..sheet.rows() {
        if reading.is_open(row) {
            table.open.push(sheet.line(row));
        } else if let Some(point) = reading.point(row, options.simulation, &mut faults) {
            table.points.push(point);
            reading.rows.push(row);
        }
    }
    // ranges and units are judged on whole points only
    faults.propagate()?;
    suspicion::check(&mut table, &reading)?;
    if !options.partial {
        suspicion::variety(&table.points, &reading)?;
    }
    reading.settled(&mut table, options.skip_unsettled)?;
    if table.points.len() > MOST_POINTS {
        let message = Message::new("too many rows for a table of settled points")
            .found(format!("{} rows", table.points.len()))
            .expected(format!("at most {MOST_POINTS}, one for each settled point"));
        let hint = "average a record over the time in which the converter had settled";
        return Err(sheet.fault(message.hint(hint)).into());
    }
    Ok(table)
}

impl<'a> Reading<'a> {
    fn new(sheet: &'a Sheet, located: &'a Located) -> Result<Self, Faults> {
        let found = NEEDED.map(|name| located.signal(name));
        let [Some(duty), Some(v_out), Some(i_out), Some(v_in)] = found else {
            let absent = |name: &&Quantity<'_>| located.signal(name.name).is_none();
            let missing = |quantity: &Quantity<'_>| {
                let hint = match quantity.name {
                    "v_in" => ", or how high it was, --map v_in=24",
                    _ => "",
                };
                sheet.missing(quantity, hint)
            };
            let faults: Sink = Quantity::all(&NEEDED).iter().filter(absent).map(missing).collect();
            // one of the four is missing
            return faults.conclude(None, || sheet.header_fault(Message::new("the table cannot be read")));
        };
        Ok(Reading {
            sheet,
            duty,
            v_out,
            i_out,
            v_in,
            v_std: located.signal("v_std"),
            settled: located.signal("settled"),
            rows: Vec::new(),
        })
    }

    /// Whether nothing of a row is measured yet.
    fn is_open(&self, row: usize) -> bool {
        let measured = [self.duty, self.v_out, self.i_out, self.v_in];
        let mut columns = measured.iter().filter(|signal| signal.column().is_some());
        columns.all(|signal| signal.cell(self.sheet, row) == Cell::Empty)
    }

    /// A fault of a point of the table.
    pub fn fault(&self, point: usize, message: Message) -> Fault {
        match self.rows.get(point) {
            Some(row) => self.sheet.row_fault(*row, message),
            None => self.sheet.fault(message),
        }
    }

    /// One row; nothing if it has faults.
    fn point(&self, row: usize, simulation: Option<Losses>, faults: &mut Sink) -> Option<Point> {
        let before = faults.count();
        let mut number = |signal: &Signal| {
            let number = signal.number(self.sheet, row);
            if number.is_none() {
                let mut fault = signal.not_a_number(self.sheet, row);
                if signal.cell(self.sheet, row) == Cell::Empty {
                    let hint =
                        "measure the point again or remove its row; a row of which nothing is measured yet may stay";
                    fault.hint = Some(hint.to_owned());
                }
                faults.push(fault);
            }
            number
        };
        let [duty, v_out, i_out, v_in] = [self.duty, self.v_out, self.i_out, self.v_in].map(&mut number);
        let given = |signal: &&Signal| signal.cell(self.sheet, row) != Cell::Empty;
        let v_std = self.v_std.filter(given).and_then(&mut number);
        let settled = self
            .settled
            .filter(given)
            .and_then(|signal| self.yes_or_no(signal, row, faults));
        if faults.count() > before {
            return None;
        }
        let (v_out, v_in) = (v_out?, v_in?);
        Some(Point {
            line: self.sheet.line(row),
            d_real: duty?,
            v_out,
            i_out: i_out?,
            v_in,
            // the paper's d_sim = v_out / v_in, with the input voltage of each point
            simulation: simulation.unwrap_or(Losses::none(v_in)),
            settled: settled.unwrap_or(true) && v_std.is_none_or(|v_std| v_std <= UNSETTLED * v_out.abs()),
        })
    }

    fn yes_or_no(&self, signal: &Signal, row: usize, faults: &mut Sink) -> Option<bool> {
        match signal.cell(self.sheet, row) {
            Cell::Number(1.0) => return Some(true),
            Cell::Number(0.0) => return Some(false),
            Cell::Word(word) if ["yes", "true"].iter().any(|yes| word.eq_ignore_ascii_case(yes)) => return Some(true),
            Cell::Word(word) if ["no", "false"].iter().any(|no| word.eq_ignore_ascii_case(no)) => return Some(false),
            Cell::Number(_) | Cell::Word(_) | Cell::Empty => {}
        }
        let message = Message::new("a cell is neither yes nor no").expected("yes or no");
        faults.push(signal.fault(self.sheet, row, message));
        None
    }

    /// Unsettled points are refused, or left out if so wished.
    fn settled(&self, table: &mut Table, skip: bool) -> Result<(), Faults> {
        let unsettled: Vec<usize> = (0..table.points.len()).filter(|n| !table.points[*n].settled).collect();
        if skip && !unsettled.is_empty() {
            let left_out: Vec<usize> = unsettled.iter().map(|n| table.points[*n].line).collect();
            table.notes.push(format!("left out as unsettled: {}", lines(&left_out)));
            table.points.retain(|point| point.settled);
            return Ok(());
        }
        let mut faults = table_faults();
        for point in unsettled {
            let most = 100.0 * UNSETTLED;
            let message = Message::new("the point had not settled")
                .expected(format!("`settled` yes and `v_std` at most {most} % of the voltage"))
                .hint("measure it again after a longer wait, or leave such points out with --skip-unsettled");
            faults.push(self.fault(point, message));
        }
        faults.propagate()
    }
}

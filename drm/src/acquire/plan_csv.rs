//! A plan as CSV: written to be filled in, read back to go on.

use std::fmt::{self, Write};

use measured::{Cell, Column, Sheet};
use toml_input::Faults;

use crate::acquire::{Hold, LoadSetting, Measurement, Plan, PlanPoint};
use crate::table::{PLAN_COLUMNS, Point, Table, TableOptions};

const HEADER: &str = "point,duty,load,hold,d_real,v_out,i_out,v_in,v_std,settled";

const HELP: &str = "\
# Settled points for `policyc drm fit`, in the order of measurement. Fill in d_real (commanded duty, fraction), v_out (V),
# i_out (A) and v_in (V, at the switch) as means over at least a second at rest, with the sensors the controller uses;
# v_std (V) and settled (yes, no) if you know them. Points may be left out; go on another day with --resume.";

const HELP_CLOSED: &str = "\
# closed loop: with a constant power load the open loop is unstable unless the series resistance exceeds L P / (C V^2).
# Hold the voltage with the controller in use and note the mean duty; or replace the load by a current load or resistor
# that draws the same current: only duty, voltage and current count for the mapping.";

impl Plan {
    /// The plan with what is measured of it, as CSV.
    ///
    /// # Errors
    /// Never, in fact: writing to a text does not fail.
    pub fn to_csv(&self) -> Result<String, fmt::Error> {
        let mut out = format!("{HELP}\n");
        if self.points.iter().any(|(point, _)| point.hold != Hold::OpenLoop) {
            writeln!(out, "{HELP_CLOSED}")?;
        }
        if self.cool_down > 0.0 {
            writeln!(
                out,
                "# after each point: switch off and cool down for {} s",
                self.cool_down
            )?;
        }
        writeln!(out, "{HEADER}")?;
        for (index, (point, measurement)) in self.points.iter().enumerate() {
            let hold = match (measurement, point) {
                (Some(measurement), _) => measurement.hold.to_string(),
                (None, point) => hold_text(point),
            };
            write!(out, "{},{},{},{hold},", index + 1, point.duty, point.load)?;
            match measurement {
                None => writeln!(out, ",,,,,")?,
                Some(m) => writeln!(
                    out,
                    "{:.8},{:.6},{:.6},{:.6},{:.6},{}",
                    m.d_real,
                    m.v_out,
                    m.i_out,
                    m.v_in,
                    m.v_std,
                    if m.settled { "yes" } else { "no" }
                )?,
            }
        }
        Ok(out)
    }

    /// Takes over the measured rows of an earlier table; they are found by `point`, `duty` and `load`.
    ///
    /// The table may have gone through a spreadsheet: other separators and decimal commas are read like any table.
    /// Unsettled rows are measured again. Returns how many rows were taken over.
    ///
    /// # Errors
    /// All faults of the table, as for a fit.
    pub fn resume(&mut self, sheet: &Sheet) -> Result<usize, Faults> {
        let options = TableOptions {
            skip_unsettled: true,
            partial: true,
            ..TableOptions::default()
        };
        let wished = PLAN_COLUMNS.map(|name| sheet.column(name));
        let measured = ["d_real", "v_out", "i_out", "v_in"].map(|name| sheet.column(name));
        let is_open = |column: &Column| (0..sheet.rows()).all(|row| column.cell(row) == Cell::Empty);
        // `Table::read` refuses a table without any point; for a plan that is no fault
        if measured.iter().all(|column| column.is_some_and(is_open)) {
            // nothing is measured yet
            return Ok(0);
        }
        let table = Table::read(sheet, &options)?;
        let [Some(point), Some(duty), Some(load), hold] = wished else {
            // settled points of another origin: nobody knows which point is which
            return Ok(0);
        };
        let v_std = sheet.column("v_std");
        let mut taken = 0;
        for row in 0..sheet.rows() {
            let Some(measured) = table.points.iter().find(|point| point.line == sheet.line(row)) else {
                continue;
            };
            let (Cell::Number(number), Cell::Number(duty), Cell::Word(load)) =
                (point.cell(row), duty.cell(row), load.cell(row))
            else {
                continue;
            };
            // `as` saturates: a number that is no index finds no point
            let entry = self.points.get_mut((number as usize).wrapping_sub(1));
            // the plan may be another than that of the table: a number alone would take over a point nobody asked for
            if let Some((point, measurement)) = entry
                && duty == point.duty
                // compared as text: with its unit the cell is a word, which a spreadsheet leaves as it was written
                && load == point.load.to_string()
            {
                let v_std = v_std.map_or(Cell::Empty, |column| column.cell(row));
                let hold = hold.map_or(Cell::Empty, |column| column.cell(row));
                *measurement = Some(taken_over(point, measured, hold, v_std));
                taken += 1;
            }
        }
        Ok(taken)
    }
}

fn taken_over(point: &PlanPoint, measured: &Point, hold: Cell<'_>, v_std: Cell<'_>) -> Measurement {
    Measurement {
        d_real: measured.d_real,
        v_out: measured.v_out,
        i_out: measured.i_out,
        v_in: measured.v_in,
        v_std: if let Cell::Number(v_std) = v_std { v_std } else { 0.0 },
        settled: measured.settled,
        hold: if let Cell::Word(hold) = hold {
            held_as(hold)
        } else {
            None
        }
        .unwrap_or(point.hold),
    }
}

/// Reads what [`hold_text`] or a measurement wrote.
fn held_as(text: &str) -> Option<Hold> {
    if text == Hold::OpenLoop.to_string() {
        return Some(Hold::OpenLoop);
    }
    let voltage = text.strip_prefix("closed loop at ")?.split(' ').next()?;
    voltage.parse().ok().map(Hold::ClosedLoop)
}

/// What the person at the bench must do.
fn hold_text(point: &PlanPoint) -> String {
    match (point.hold, point.load) {
        (Hold::ClosedLoop(v_out), LoadSetting::Power(watt)) => {
            format!("{} or current load {:.4} A", point.hold, watt / v_out)
        }
        _ => point.hold.to_string(),
    }
}

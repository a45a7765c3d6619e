//! A plan as CSV: written to be filled in, read back to go on.

use std::fmt::{self, Write};

use toml_input::{Faults, Source};

use crate::acquire::{Hold, LoadSetting, Measurement, Plan, PlanPoint};
use crate::table::{Point, Table, TableOptions};

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
    /// Unsettled rows are measured again. Returns how many rows were taken over.
    ///
    /// # Errors
    /// All faults of the table, as for a fit.
    pub fn resume(&mut self, text: &Source) -> Result<usize, Faults> {
        let options = TableOptions {
            skip_unsettled: true,
            partial: true,
            ..TableOptions::default()
        };
        if !text.text.contains(HEADER) || rows(text).all(|(_, row)| row.ends_with(",,,,,")) {
            // nothing is measured yet, or it is another table: say which columns are missing
            return if text.text.contains(HEADER) {
                Ok(0)
            } else {
                Table::parse(text, &options).map(|_| 0)
            };
        }
        let table = Table::parse(text, &options)?;
        let mut taken = 0;
        for (line, row) in rows(text) {
            let Some(measured) = table.points.iter().find(|point| point.line == line) else {
                continue;
            };
            let cells: Vec<&str> = row.split(',').map(str::trim).collect();
            let [number, duty, load, hold, ..] = cells[..] else {
                continue;
            };
            let entry = number
                .parse::<usize>()
                .ok()
                .and_then(|number| self.points.get_mut(number.wrapping_sub(1)));
            if let Some((point, measurement)) = entry
                && duty.parse() == Ok(point.duty)
                && load == point.load.to_string()
            {
                let v_std = cells.get(8).and_then(|cell| cell.parse().ok()).unwrap_or(0.0);
                *measurement = Some(taken_over(point, measured, hold, v_std));
                taken += 1;
            }
        }
        Ok(taken)
    }
}

/// Rows below the header with their lines.
fn rows(text: &Source) -> impl Iterator<Item = (usize, &str)> {
    let is_row = |(_, line): &(usize, &str)| line.starts_with(|c: char| c.is_ascii_digit());
    text.text
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.trim()))
        .filter(is_row)
}

fn taken_over(point: &PlanPoint, measured: &Point, hold: &str, v_std: f64) -> Measurement {
    Measurement {
        d_real: measured.d_real,
        v_out: measured.v_out,
        i_out: measured.i_out,
        v_in: measured.v_in,
        v_std,
        settled: measured.settled,
        hold: held_as(hold).unwrap_or(point.hold),
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

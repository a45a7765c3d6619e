//! A measured record as the plant can be driven by it: one row a control period, or settled points.

mod digits;
mod suspicion;

use std::path::Path;

use plant::{Load, Parameters};
use toml_input::{Fault, Faults, Message, Place};

use crate::columns::{Columns, DutyIs, NAMES};
use crate::csv::{Column, Table};
use digits::{last_digit, lattice};

/// Channels: `v_o`, `i_l`, `i_o`, `v_in`.
pub const CHANNELS: usize = 4;
/// Their names.
pub const CHANNEL_NAMES: [&str; CHANNELS] = ["v_o", "i_l", "i_o", "v_in"];
/// Their units.
pub const CHANNEL_UNITS: [&str; CHANNELS] = ["V", "A", "A", "V"];

/// Fewest rows of a record.
const FEWEST: usize = 20;
/// Fewest settled points.
const FEWEST_SETTLED: usize = 3;

/// Most rows in a switching period, and most periods between rows.
const MOST_PER_PERIOD: f64 = 500.0;
const MOST_PERIODS: f64 = 100.0;

/// Rows that are simulated in one go from an estimated state.
pub type Segment = std::ops::Range<usize>;

/// A record.
#[derive(Debug, Clone)]
pub struct Record {
    /// File name without folder and extension.
    pub name: String,
    /// Time of each row, s; the row's number in a settled table.
    pub time: Vec<f64>,
    /// Sampling instant as a fraction of the PWM period.
    pub phase: f64,
    /// Duty of the PWM period in which a row lies (starts, if sampled at its start).
    pub duty: Vec<f64>,
    /// Set load in the same period.
    pub load: Vec<Load>,
    /// Measured channels; NaN where nothing was measured.
    pub measured: [Vec<f64>; CHANNELS],
    /// Step on whose multiples all values of a channel lie, if that is coarser than the digits written; else 0.
    pub lattice: [f64; CHANNELS],
    /// The last digit written of each channel: nothing finer is known.
    pub resolution: [f64; CHANNELS],
    /// Source voltage set for this record over that of the model, 1.
    pub v_in_ratio: f64,
    /// What the duty is.
    pub duty_is: DutyIs,
    /// Rows are settled operating points.
    pub settled: bool,
    /// There is a row in each period, gaps apart.
    pub dense: bool,
    /// Stretches to simulate.
    pub segments: Vec<Segment>,
    /// What was repaired or left out, in plain words.
    pub repairs: Vec<String>,
}

impl Record {
    /// Reads the record in `file` for a converter of `parameters`.
    ///
    /// # Errors
    /// The faults of the table, missing or unusable columns, time that goes backward, another sample rate.
    pub fn open(file: &Path, columns: &Columns, parameters: &Parameters) -> Result<Self, Faults> {
        Self::new(Table::open(file)?, columns, parameters)
    }

    /// Makes a record of a table.
    ///
    /// # Errors
    /// As [`Record::open`].
    pub fn new(table: Table, columns: &Columns, parameters: &Parameters) -> Result<Self, Faults> {
        let mut raw = Raw::new(table, columns)?;
        raw.check_duty()?;
        raw.report_missing_duty();
        let name = raw
            .table
            .file
            .file_stem()
            .map(|name| name.to_string_lossy().into_owned());
        let settled = raw.signal("t").is_none();
        let t_sw = parameters.t_sw();
        let (rows, phase) = if settled {
            ((0..raw.rows()).map(Some).collect(), 0.5)
        } else {
            raw.align(t_sw, columns.phase)?
        };
        let fewest = if settled { FEWEST_SETTLED } else { FEWEST };
        if rows.iter().flatten().count() < fewest {
            let used = rows.iter().flatten().count();
            let message = Message::new("too few rows").found(match raw.rows() > used {
                true => format!("{used} switching periods in {} rows", raw.rows()),
                false => used.to_string(),
            });
            let message = message.expected(format!("{fewest} or more"));
            let hint = "a capture of a settled point is one row of a table without `t`: note its means there";
            return Err(raw.whole(if settled { message } else { message.hint(hint) }).into());
        }
        let loads = raw.loads()?;
        let measured: [Vec<f64>; CHANNELS] =
            std::array::from_fn(|n| raw.pick(CHANNEL_NAMES[n], &rows, f64::NAN).unwrap_or_default());
        let lattice = std::array::from_fn(|n| raw.lattice(CHANNEL_NAMES[n]));
        let resolution = std::array::from_fn(|n| raw.resolution(CHANNEL_NAMES[n]));
        let duty = held(raw.pick("d", &rows, f64::NAN).unwrap_or_default());
        let mut record = Record {
            name: name.unwrap_or_else(|| "record".to_owned()),
            time: (0..rows.len())
                .map(|n| raw.start + n as f64 * if settled { 1.0 } else { t_sw })
                .collect(),
            phase,
            duty,
            load: held_loads(&rows, &loads),
            measured,
            lattice,
            resolution,
            v_in_ratio: columns
                .constant("v_in")
                .map_or(1.0, |v_in| v_in / parameters.converter.v_in),
            duty_is: columns.duty,
            settled,
            dense: settled || 2 * rows.iter().flatten().count() > rows.len(),
            segments: segments(&rows, settled),
            repairs: raw.table.repairs,
        };
        record.report_holes();
        record.leave_out_stuck();
        if record
            .measured
            .iter()
            .all(|channel| channel.iter().all(|value| value.is_nan()))
        {
            let message = Message::new("nothing is measured in this record")
                .expected("a column v_o, i_l, i_o or v_in that is not constant");
            return Err(Fault::new(&raw.table.file, Place::File, message).into());
        }
        let odd = suspicion::of(&record, parameters);
        let place = |message| Fault::new(&raw.table.file, Place::File, message);
        Faults::unless_empty(odd.into_iter().map(place).collect())?;
        Ok(record)
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.duty.len()
    }

    /// Gaps and empty cells are filled or left out, but said.
    fn report_holes(&mut self) {
        if !self.settled && self.segments.len() > 1 {
            let at = |segment: &Segment| format!("{:.6} s", self.time[segment.start]);
            let list: Vec<String> = self.segments.iter().skip(1).take(5).map(at).collect();
            self.repairs.push(format!(
                "{} gaps: simulated anew behind each, from {}",
                self.segments.len() - 1,
                list.join(", ")
            ));
        }
        for (n, values) in self.measured.iter().enumerate() {
            let inside = self
                .segments
                .iter()
                .flat_map(|segment| values.get(segment.clone()).unwrap_or_default());
            let (empty, all) = inside.fold((0, 0), |(empty, all), v| (empty + usize::from(v.is_nan()), all + 1));
            if empty > 0 && empty < all && self.dense {
                let name = CHANNEL_NAMES[n];
                self.repairs
                    .push(format!("{empty} of {all} rows without {name}: not used"));
            }
        }
    }

    /// A channel that never moves is a setting or a dead sensor, not a measurement.
    fn leave_out_stuck(&mut self) {
        for (n, values) in self.measured.iter_mut().enumerate() {
            let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
            let constant = finite.len() >= FEWEST && finite.iter().all(|v| *v == finite[0]);
            if constant {
                let name = CHANNEL_NAMES[n];
                self.repairs.push(format!(
                    "column {name} is constant at {}: not taken as measured",
                    finite[0]
                ));
                values.fill(f64::NAN);
            }
            if values.is_empty() {
                *values = vec![f64::NAN; self.duty.len()];
            }
        }
    }
}

/// A table with its signals found.
struct Raw {
    table: Table,
    /// Column, scale and offset of each canonical name.
    found: Vec<Option<(usize, f64, f64)>>,
    constants: Vec<Option<f64>>,
    start: f64,
}

impl Raw {
    fn new(table: Table, columns: &Columns) -> Result<Self, Faults> {
        let headers: Vec<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
        let mut faults = header_faults(&headers);
        let mut found = Vec::new();
        for name in NAMES {
            let place = columns.find(name, &headers);
            if let (None, Some(wanted)) = (&place, columns.wanted(name)) {
                let message = Message::new(format!("no column `{wanted}` for {name}"));
                faults.push(message.found(headers.join(", ")));
            }
            found.push(place.map(|(index, source)| (index, source.scale, source.offset)));
        }
        let constants: Vec<_> = NAMES.iter().map(|name| columns.constant(name)).collect();
        let has = |name: &str| {
            NAMES
                .iter()
                .position(|n| *n == name)
                .is_some_and(|n| found[n].is_some() || constants[n].is_some())
        };
        if !has("d") {
            let message = Message::new("no duty column `d`").found(headers.join(", "));
            faults.push(message.hint("name it in a map file: --columns MAP.toml with [columns] d = \"...\""));
        }
        if !["r_load", "i_load", "p_load", "i_o"].into_iter().any(has) {
            let message = Message::new("nothing says what the load is").found(headers.join(", "));
            let hint = "give r_load, i_load or p_load as a column, or under [constants] in the map file";
            faults.push(message.expected("r_load, i_load, p_load or i_o").hint(hint));
        }
        if !CHANNEL_NAMES.into_iter().any(has) {
            let message = Message::new("nothing is measured in this record").found(headers.join(", "));
            faults.push(message.expected("at least one of v_o, i_l, i_o, v_in"));
        }
        let file = table.file.clone();
        let faults = faults
            .into_iter()
            .map(|message| Fault::new(&file, Place::File, message));
        Faults::unless_empty(faults.collect())?;
        Ok(Raw {
            table,
            found,
            constants,
            start: 0.0,
        })
    }

    fn rows(&self) -> usize {
        self.table.lines.len()
    }

    fn whole(&self, message: Message) -> Fault {
        Fault::new(&self.table.file, Place::File, message)
    }

    fn at(&self, row: usize, message: Message) -> Fault {
        let columns = self.table.columns.iter();
        let cells: Vec<String> = columns.map(|column| column.values[row].to_string()).collect();
        let place = Place::Span {
            line: self.table.lines[row],
            column: 1,
            text: cells.join(","),
            length: 1,
        };
        Fault::new(&self.table.file, place, message)
    }

    /// A signal in SI.
    fn signal(&self, name: &str) -> Option<Vec<f64>> {
        let n = NAMES.iter().position(|known| *known == name)?;
        match self.found[n] {
            Some((column, scale, offset)) => {
                let values = self.table.columns[column].values.iter();
                Some(values.map(|value| value * scale + offset).collect())
            }
            None => self.constants[n].map(|value| vec![value; self.rows()]),
        }
    }

    fn pick(&self, name: &str, rows: &[Option<usize>], otherwise: f64) -> Option<Vec<f64>> {
        let n = NAMES.iter().position(|known| *known == name)?;
        if self.found[n].is_none() && name != "d" {
            return None;
        }
        let values = self.signal(name)?;
        Some(
            rows.iter()
                .map(|row| row.map_or(otherwise, |row| values[row]))
                .collect(),
        )
    }

    fn check_duty(&mut self) -> Result<(), Faults> {
        let duty = self.signal("d").unwrap_or_default();
        let highest = duty.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
        let outside = duty.iter().position(|d| *d < -1e-9 || *d > 1.0 + 1e-9);
        if let Some(row) = outside {
            let percent = highest > 1.5 && highest <= 100.0;
            let hint = match percent {
                true => "percent? name the column `d_percent`, or give scale = 0.01 in the map file",
                false => "a duty is a share of the period",
            };
            let message = Message::new("a duty outside 0 to 1").found(duty[row].to_string());
            return Err(self.at(row, message.expected("0 to 1").hint(hint)).into());
        }
        Ok(())
    }

    /// A row without duty has that of the row before.
    fn report_missing_duty(&mut self) {
        let missing = self
            .signal("d")
            .unwrap_or_default()
            .iter()
            .filter(|d| d.is_nan())
            .count();
        if missing > 0 {
            let text = format!("{missing} rows without duty: that of the row before is held");
            self.table.repairs.push(text);
        }
    }

    /// Rows for each control period in order (nothing in a gap), and the sampling phase.
    fn align(&mut self, t_sw: f64, phase: Option<f64>) -> Result<(Vec<Option<usize>>, f64), Faults> {
        let time = self.signal("t").unwrap_or_default();
        if let Some(row) = time.iter().position(|t| t.is_nan()) {
            let hint = "leave the row out, or fill in its time";
            return Err(self.at(row, Message::new("a row without time").hint(hint)).into());
        }
        if let Some(row) = (1..time.len()).find(|n| time[*n] < time[*n - 1]) {
            let message = Message::new("time goes backward").found(format!("{} after {}", time[row], time[row - 1]));
            return Err(self
                .at(row, message.hint("cut the file into one record for each run"))
                .into());
        }
        let twice = (1..time.len()).filter(|n| time[*n] == time[*n - 1]).count();
        if twice > 0 {
            let text = format!("{twice} rows repeat the time of the row before: the first of each is kept");
            self.table.repairs.push(text);
        }
        let mut steps: Vec<f64> = time
            .windows(2)
            .map(|t| t[1] - t[0])
            .filter(|step| *step > 0.0)
            .collect();
        steps.sort_by(f64::total_cmp);
        let Some(step) = steps.get(steps.len() / 2).copied() else {
            return Err(self.whole(Message::new("too few rows").expected("20 or more")).into());
        };
        let ratio = step / t_sw;
        let (fast, slow) = ((1.0 / ratio).round(), ratio.round());
        let fits = |a: f64, b: f64| (a / b - 1.0).abs() < 0.02;
        let faster = (1.0..=MOST_PER_PERIOD).contains(&fast) && fits(1.0 / ratio, fast);
        let slower = (1.0..=MOST_PERIODS).contains(&slow) && fits(ratio, slow);
        if !(faster || slower) {
            let message = Message::new("the sample rate does not fit the switching frequency")
                .found(format!("a row every {step:e} s"))
                .expected(format!(
                    "the period, {t_sw:e} s, a whole multiple or a whole part of it"
                ))
                .hint("is the time in us or ms? name the column `t_us`; is `converter.f_sw` right?");
            return Err(self.whole(message).into());
        }
        Ok(self.place(&time, t_sw, phase, step))
    }

    fn place(&mut self, time: &[f64], t_sw: f64, phase: Option<f64>, step: f64) -> (Vec<Option<usize>>, f64) {
        let fraction = (time[0] / t_sw).rem_euclid(1.0);
        let phase = phase.unwrap_or(if !(1e-3..=1.0 - 1e-3).contains(&fraction) {
            0.0
        } else {
            fraction
        });
        let skip = match step < 0.75 * t_sw {
            true => (phase - fraction).rem_euclid(1.0) * t_sw,
            false => 0.0,
        };
        let first = time[0] + skip;
        self.start = first;
        let slot = |t: f64| ((t - first) / t_sw).round();
        let count = time.last().map_or(0.0, |t| slot(*t)) as usize + 1;
        let mut rows: Vec<Option<usize>> = vec![None; count.min(10_000_000)];
        let (mut jitter, mut used) = (0.0f64, 0);
        for (row, t) in time.iter().enumerate() {
            let place = slot(*t);
            let off = ((t - first) / t_sw - place).abs();
            let fast = step < 0.75 * t_sw;
            if place < 0.0 || place as usize >= rows.len() || (fast && off * t_sw > 0.51 * step) {
                continue;
            }
            let entry = &mut rows[place as usize];
            if entry.is_none() {
                (*entry, used) = (Some(row), used + 1);
                jitter = jitter.max(off);
            }
        }
        while rows.last() == Some(&None) {
            rows.pop();
        }
        if step < 0.75 * t_sw {
            let text = format!("{used} of {} rows used: one each switching period", time.len());
            self.table.repairs.push(text);
        } else if jitter > 0.02 {
            let text = format!("sampling instants jitter by up to {:.1} % of a period", 100.0 * jitter);
            self.table.repairs.push(text);
        }
        (rows, phase)
    }

    fn loads(&self) -> Result<Vec<Load>, Faults> {
        let zero = vec![0.0; self.rows()];
        let set = |name: &str| self.signal(name);
        let (resistance, current, power) = (set("r_load"), set("i_load"), set("p_load"));
        if resistance.is_none() && current.is_none() && power.is_none() {
            let drawn = self.signal("i_o").unwrap_or(zero);
            return Ok(drawn.into_iter().map(Load::current).collect());
        }
        let (r, i, p) = (
            resistance.unwrap_or_else(|| zero.clone()),
            current.unwrap_or_else(|| zero.clone()),
            power.unwrap_or(zero),
        );
        let mut loads = Vec::with_capacity(r.len());
        let mut last = Load::default();
        for row in 0..r.len() {
            let (r, i, p) = (r[row], i[row], p[row]);
            if r < 0.0 || p < 0.0 {
                let message = Message::new("a negative load").found(format!("{r} ohm, {p} W"));
                return Err(self.at(row, message).into());
            }
            if !(r.is_nan() || i.is_nan() || p.is_nan()) {
                last = Load {
                    conductance: if r > 0.0 { 1.0 / r } else { 0.0 },
                    current: i,
                    power: p,
                };
            }
            loads.push(last);
        }
        Ok(loads)
    }

    /// The column of a signal and its scale to SI.
    fn column(&self, name: &str) -> Option<(&Column, f64)> {
        let n = NAMES.iter().position(|known| *known == name)?;
        let (column, scale, _) = self.found[n]?;
        Some((&self.table.columns[column], scale.abs()))
    }

    fn lattice(&self, name: &str) -> f64 {
        self.column(name)
            .map_or(0.0, |(column, scale)| scale * lattice(&column.values, column.decimals))
    }

    fn resolution(&self, name: &str) -> f64 {
        self.column(name)
            .map_or(0.0, |(column, scale)| scale * last_digit(column.decimals))
    }
}

/// A table without a header, and names that stand in it twice.
fn header_faults(headers: &[&str]) -> Vec<Message> {
    if headers.iter().all(|header| header.parse::<f64>().is_ok()) {
        let message = Message::new("the first line holds numbers, not the names of the columns");
        let hint = "put a first line above such as t,d,v_o,i_l,i_o,v_in,r_load";
        return vec![message.found(headers.join(", ")).expected("a header").hint(hint)];
    }
    let twice = |(n, header): (usize, &&str)| {
        let again = !header.is_empty() && headers[..n].contains(header);
        again.then(|| Message::new(format!("two columns are called `{header}`")).hint("rename or remove one"))
    };
    headers.iter().enumerate().filter_map(twice).collect()
}

/// Gaps are filled with the value before.
fn held(values: Vec<f64>) -> Vec<f64> {
    let mut last = values.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
    let hold = |value: f64| {
        if value.is_finite() {
            last = value.clamp(0.0, 1.0);
        }
        last
    };
    values.into_iter().map(hold).collect()
}

fn held_loads(rows: &[Option<usize>], loads: &[Load]) -> Vec<Load> {
    let mut last = rows.iter().flatten().next().map_or(Load::default(), |row| loads[*row]);
    let hold = |row: &Option<usize>| {
        if let Some(row) = row {
            last = loads[*row];
        }
        last
    };
    rows.iter().map(hold).collect()
}

/// Stretches without a long gap; a short one is bridged with the duty held (as in a record of a slower rate).
fn segments(rows: &[Option<usize>], settled: bool) -> Vec<Segment> {
    if settled {
        return (0..rows.len()).map(|n| n..n + 1).collect();
    }
    let used: Vec<usize> = (0..rows.len()).filter(|n| rows[*n].is_some()).collect();
    let mut steps: Vec<usize> = used.windows(2).map(|n| n[1] - n[0]).collect();
    steps.sort_unstable();
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(1);
    let mut segments = Vec::new();
    let mut start = used.first().copied().unwrap_or(0);
    for pair in used.windows(2) {
        if pair[1] - pair[0] > usual {
            segments.push(start..pair[0] + 1);
            start = pair[1];
        }
    }
    segments.push(start..used.last().map_or(0, |n| n + 1));
    segments.retain(|segment| segment.len() > 4);
    segments
}

#[cfg(test)]
mod tests;

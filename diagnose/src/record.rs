//! A measured record as the plant can be driven by it: one row a control period, or settled points.

mod align;
mod beside_resistor;
mod captured;
mod channels;
mod clipped;
mod digits;
pub(crate) mod edges;
mod exchanged;
mod levels;
mod load_unit;
mod logged;
mod raw;
mod rows;
mod source;
mod stamp;
mod steady;
pub(crate) mod still;
mod suspicion;
mod together;
mod unread;

use measured::{ColumnMap, DutyIs, Options, Sampled, Sheet};
use plant::{Load, Parameters};
use toml_input::{Faults, FileName, Message, Sink};

use channels::FEWEST;
pub(crate) use channels::QUANTITIES;
pub use channels::{CHANNEL_NAMES, CHANNEL_UNITS, CHANNELS, LOAD_CURRENT, Segment, V_IN};
pub use levels::{Level, Part};
use raw::Raw;
pub(crate) use source::Source;
pub use together::open_all;
pub use unread::{Unread, quantity};

use crate::capture::Capture;

/// A record.
#[derive(Debug, Clone)]
pub struct Record {
    /// File name without folder and extension.
    pub name: String,
    /// Time of each row, s; the row's number in a settled table.
    pub time: Vec<f64>,
    /// How much later than the first record it began on the clock of a line on the source, s, but for whole turns.
    pub clock: f64,
    /// Sampling instant as a fraction of the PWM period.
    pub phase: f64,
    /// Duty of the PWM period in which a row lies (starts, if sampled at its start).
    pub duty: Vec<f64>,
    /// Set load in the same period.
    pub load: Vec<Load>,
    /// The columns of the channels, as the file calls them.
    pub headers: [String; CHANNELS],
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
    /// Channels that another instrument measured: what is true, not what the model's sensor shows.
    pub is_true: [bool; CHANNELS],
    /// Rows are settled operating points.
    pub settled: bool,
    /// Neighbouring settled points repeat each other: they are means of rows of one stretch.
    pub repeated: bool,
    /// Standard deviation of the noise of such rows, by channel. A mean of many is not taken for better than one: what an
    /// instrument gets wrong does not average out.
    pub scatter: [f64; CHANNELS],
    /// Noise of the meter whose current is the load, A; nothing if the load was set, or is taken as it was measured.
    pub metered: Option<f64>,
    /// Levels that were read off that meter.
    pub levels: Vec<Level>,
    /// Those of them that are estimated beside every fit.
    pub free_levels: Vec<Level>,
    /// What a settled point holds; nothing if the data have to say it.
    pub sampled: Option<Sampled>,
    /// There is a row in each period, gaps apart.
    pub dense: bool,
    /// Stretches to simulate.
    pub segments: Vec<Segment>,
    /// Rows of load steps whose instant in the period is estimated beside every fit (docs/decisions/0007-instants-of-load-steps.md).
    pub free_steps: Vec<usize>,
    /// A few periods at the rate of an oscilloscope, of which the one row holds duty and load ([`crate::capture`]).
    pub capture: Option<Box<Capture>>,
    /// Columns of channels that the model predicts and that are not compared.
    pub unread: Vec<Unread>,
    /// Where the range of a channel's instrument ends, if it was left.
    pub ends: [Option<f64>; CHANNELS],
    /// What was repaired or left out, in plain words.
    pub repairs: Vec<String>,
}

impl Record {
    /// Reads the record in `file` for a converter of `parameters`.
    ///
    /// # Errors
    /// A file that cannot be read, and those of [`Record::read`].
    pub fn open(file: impl Into<FileName>, map: &ColumnMap, parameters: &Parameters) -> Result<Self, Faults> {
        Self::read(&Sheet::open(file, &Self::file_options())?, map, parameters)
    }

    /// How files with records are read: a logger that was switched off leaves half a line.
    #[must_use]
    pub fn file_options() -> Options {
        Options {
            leave_out_cut_line: true,
            ..Options::default()
        }
    }

    /// Makes a record of a table. Without a time column its rows are settled points, if the map says so or nothing in
    /// it looks like time.
    ///
    /// # Errors
    /// The faults of the table, missing or unusable columns, time that goes backward, another sample rate, a column
    /// that looks like time and is not known as such.
    pub fn read(sheet: &Sheet, map: &ColumnMap, parameters: &Parameters) -> Result<Self, Faults> {
        let map = &*map.of(sheet.file());
        let mut raw = Raw::new(sheet, map)?;
        raw.check_duty()?;
        if let Some(record) = raw.captured(map, parameters)? {
            return Ok(record);
        }
        raw.needs_duty_and_channel()?;
        raw.report_missing_duty();
        let lines = raw.lines(map, parameters)?;
        let mut record = Record {
            name: name_of(sheet),
            time: lines.time,
            phase: lines.phase,
            duty: lines.duty,
            load: lines.load,
            headers: QUANTITIES.map(|name| raw.source(name).header),
            measured: lines.measured,
            lattice: QUANTITIES.map(|name| raw.lattice(name)),
            resolution: QUANTITIES.map(|name| raw.resolution(name)),
            v_in_ratio: map
                .constant("v_in")
                .map_or(1.0, |v_in| v_in / parameters.converter.v_in),
            duty_is: map.duty,
            is_true: [false; CHANNELS],
            settled: lines.settled,
            repeated: lines.repeated,
            scatter: lines.scatter,
            clock: 0.0,
            metered: lines.metered,
            levels: lines.levels,
            free_levels: Vec::new(),
            sampled: lines.sampled,
            dense: lines.dense,
            segments: lines.segments,
            free_steps: Vec::new(),
            capture: None,
            unread: raw.unread.clone(),
            ends: [None; CHANNELS],
            repairs: raw.repairs.clone(),
        };
        let labels = QUANTITIES.map(|name| raw.label(name));
        if let Some(v_in) = map.constant("v_in") {
            record.repairs.push(format!(
                "v_in = {v_in}, a number, is what the source was set to: nothing measured it, and its resistance may still be a cause"
            ));
        }
        record.report_holes(&labels);
        edges::leave_out(&mut record, parameters);
        record.leave_out_stuck(&labels);
        record.leave_out_clipped(&labels);
        if record.measured.iter().flatten().all(|value| value.is_nan()) {
            let message = Message::new("nothing is measured in this record")
                .expected("a column v_out, i_l, i_out or v_in that is not constant");
            return Err(sheet.fault(message).into());
        }
        let sources = QUANTITIES.map(|name| raw.source(name));
        let odd = suspicion::of(&record, parameters, &sources, &raw.source("duty"));
        let mut faults: Sink = odd.into_iter().map(|message| sheet.fault(message)).collect();
        faults.propagate()?;
        Ok(record)
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.duty.len()
    }

    /// Whether two rows have one duty and one load.
    #[must_use]
    pub fn is_same_point(&self, one: usize, other: usize) -> bool {
        self.duty[one] == self.duty[other] && self.load[one] == self.load[other]
    }

    /// Gaps and empty cells are filled or left out, but said.
    fn report_holes(&mut self, labels: &[String; CHANNELS]) {
        if !self.settled && self.segments.len() > 1 {
            let at = |segment: &Segment| format!("{:.6} s", self.time[segment.start]);
            let list: Vec<String> = self.segments.iter().skip(1).take(5).map(at).collect();
            let count = self.segments.len() - 1;
            let s = if count == 1 { "" } else { "s" };
            let what = match self.dense {
                true => {
                    let pairs = self.segments.windows(2);
                    let lost: usize = pairs.map(|pair| pair[1].start - pair[0].end).sum();
                    let are = if lost == 1 { "row is" } else { "rows are" };
                    format!("{count} gap{s}, in which {lost} {are} missing")
                }
                false => format!("{count} step{s} and gaps"),
            };
            let each = if count == 1 { "it" } else { "each" };
            self.repairs.push(format!(
                "{what}: simulated anew behind {each}, from {}",
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
                let name = &labels[n];
                self.repairs
                    .push(format!("{empty} of {all} rows without {name}: not used"));
            }
        }
    }

    /// What lies at the end of an instrument's range was larger.
    fn leave_out_clipped(&mut self, labels: &[String; CHANNELS]) {
        if self.settled {
            return;
        }
        for (n, name) in labels.iter().enumerate() {
            let step = self.lattice[n].max(self.resolution[n]);
            if let Some((end, _)) = clipped::at(&self.measured[n], step) {
                self.leave_out_end(n, name, end);
            }
        }
    }

    /// Leaves out the rows of a channel that lie at `end`, where the range of its instrument ends.
    pub(crate) fn leave_out_end(&mut self, n: usize, name: &str, end: f64) {
        let at_end = self.measured[n].iter_mut().filter(|v| **v == end);
        let count = at_end.map(|v| *v = f64::NAN).count();
        if count > 0 {
            let rows = if count == 1 { "row" } else { "rows" };
            self.repairs.push(format!(
                "{count} {rows} of {name} lie at {end}, as if cut off at the end of a range: left out. Was the range of the \
                 instrument too small?"
            ));
        }
        self.ends[n] = Some(end);
    }

    /// A channel that never moves is a setting or a dead sensor, not a measurement.
    fn leave_out_stuck(&mut self, labels: &[String; CHANNELS]) {
        for (n, values) in self.measured.iter_mut().enumerate() {
            let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
            let constant = finite.len() >= FEWEST && finite.iter().all(|v| *v == finite[0]);
            if constant {
                let name = &labels[n];
                self.repairs.push(format!(
                    "column {name} is constant at {}: not taken as measured",
                    finite[0]
                ));
                self.unread.extend(Unread::stuck(n, name));
                values.fill(f64::NAN);
            }
            if values.is_empty() {
                *values = vec![f64::NAN; self.duty.len()];
            }
        }
    }
}

/// File name without folder and extension.
fn name_of(sheet: &Sheet) -> String {
    let name = sheet.file().file_stem().map(|name| name.to_string_lossy().into_owned());
    name.unwrap_or_else(|| "record".to_owned())
}

#[cfg(test)]
mod tests;

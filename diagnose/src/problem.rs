//! Records, noise and model as one least-squares problem. The initial states are unknowns of no interest: they are
//! estimated beside every fit, and the part of a signal that they can explain is projected out.

mod beginnings;
mod setup;

use std::ops::Range;

use measured::DutyIs;

use crate::capture::terms::Drive;
use crate::causes::{Bases, Knob};
use crate::drive::{Begin, Model, Start, Unseen, simulate_counted};
use crate::flicker;
use crate::left_out;
use crate::noise::Outlier;
use crate::record::{CHANNELS, LOAD_CURRENT, Record};
use crate::work::Work;
use setup::{bases, cut_unstable, leave_out_collapse, share_source_voltage};

/// What stands in a residual where no number is simulated: far beyond any real error, and its square still a number.
pub const LOST: f64 = 1e6;

/// What stands in a residual where a value that counts is met to its last digit, over the noise: 0 says that nothing counts.
const NO_ERROR: f64 = 1e-12;

/// What stands in a residual where nobody knows what a right model would show, over the noise: as much as noise leaves.
const AS_NOISE: f64 = 1.0;

/// The channel in which a load step leaps beside its current.
const OUTPUT_VOLTAGE: usize = 0;

/// The problem.
#[derive(Debug, Clone)]
pub struct Problem {
    /// The records.
    pub records: Vec<Record>,
    /// The model to begin with.
    pub base: Model,
    /// Magnitudes.
    pub bases: Bases,
    /// Standard deviation of the noise of each channel; infinite for one that no record has.
    pub sigma: [f64; CHANNELS],
    /// Rows that are not scored, for each record and channel: outliers.
    pub masked: Vec<[Vec<bool>; CHANNELS]>,
    /// Start of each record in the vectors; behind the rows and captures stand the free levels of the load, and last the trim over its
    /// accuracy.
    pub offsets: Vec<usize>,
    /// The trim is not estimated.
    pub trim_held: bool,
    /// What is computed with it, and with all others of the same diagnosis.
    pub(crate) work: Work,
}

/// What the edges of a gate add to or take from the time that the switch is on, s.
// half-bridges of VDMOS models with resistors at their gates, in ngspice, 12 to 200 V and 20 kHz to 1 MHz: 5 to 40 ns
const EDGES: f64 = 20e-9;
/// The same as a share of the period, at least: half a count of a modulator with 1000, 50 ns at 10 kHz.
const LEAST_DUTY: f64 = 5e-4;
/// And at most: who switches faster takes faster gates. Those half-bridges were off by 0.08 to 0.96 % of their periods.
const MOST_DUTY: f64 = 5e-3;
/// Largest trim that is put into a model, in standard deviations. More stands for a cause: those half-bridges end at 40 ns, and at 0.96 % of their
/// periods.
const MOST_TRIM: f64 = 2.0;

/// Standard deviation of what a model of ideal edges may be off in the duty, 1, at a switching frequency in Hz: what the edges do is a
/// time, what the modulator rounds is a share. It is estimated beside every fit, so that nothing that small is called a cause.
/// The price: what loses less than twice as much duty (100 ns of dead time at 10 kHz, 33 ns at 300 kHz) is left to the trim, and goes unnamed.
#[must_use]
pub fn duty_accuracy(f_sw: f64) -> f64 {
    (EDGES * f_sw).clamp(LEAST_DUTY, MOST_DUTY)
}

/// What is estimated beside every fit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Starts {
    /// Initial states of all segments of all records.
    pub states: Vec<Vec<Start>>,
    /// How much later than the table says each free load step of each record was, periods.
    pub late: Vec<Vec<f64>>,
    /// How far each free level of the load of each record is off, standard deviations.
    pub levels: Vec<Vec<f64>>,
    /// Duty added by the edges of the gate, 1.
    pub trim: f64,
}

impl Starts {
    /// Where the simulation of a record begins.
    #[must_use]
    pub fn of(&self, record: usize) -> Begin<'_> {
        Begin {
            states: &self.states[record],
            late: &self.late[record],
            levels: self.levels.get(record).map_or(&[], Vec::as_slice),
            trim: self.trim,
        }
    }

    /// The trim where it is more than what gates do: something else has to be behind it.
    #[must_use]
    pub fn trim_of_nobody(&self, f_sw: f64) -> Option<f64> {
        (self.trim.abs() > MOST_TRIM * duty_accuracy(f_sw)).then_some(self.trim)
    }

    /// The trim; 0 where it is so large that it must stand for something else.
    #[must_use]
    pub fn trim_or_none(&self, f_sw: f64) -> f64 {
        if self.trim_of_nobody(f_sw).is_none() {
            self.trim
        } else {
            0.0
        }
    }
}

/// A sample this near to the start of a period, in periods, is taken at the instant of a load step that stands there: which of the two
/// came first nobody knows. Jitter of a trigger and of a table's times is smaller, and a step inside of the period is found by its
/// instant ([`crate::instants`]).
const AT_ONCE: f64 = 0.02;

/// A load that changes in more than this share of the rows is no load of steps: a meter's reading, row by row. Steps of a test stand
/// tens of rows apart, and a reading without levels changes in nearly all; a convention between the two.
const MOST_IN_STEPS: f64 = 0.5;

/// Rows that are not scored from the start: what the load did before a sample inside a slope, or at the very instant of one, is not in
/// the table, and the voltage leaps with it by the series resistance of the capacitor. The current of the inductor does not.
fn in_steps(record: &Record) -> [Vec<bool>; CHANNELS] {
    let mut masked = std::array::from_fn(|_| vec![false; record.rows()]);
    let (before, behind) = (record.phase > 1.0 - AT_ONCE, record.phase < AT_ONCE);
    // between rows further apart nobody takes a load for one of a slope
    for step in flicker::steps(&record.load)
        .iter()
        .filter(|_| record.dense && !record.settled)
    {
        for channel in [OUTPUT_VOLTAGE, LOAD_CURRENT] {
            let rows = step.first - usize::from(before)..step.last + usize::from(behind);
            masked[channel][rows].fill(true);
        }
    }
    // without its steps nothing would be left of the voltage, while what it leaps by from reading to reading is next to nothing
    let most = MOST_IN_STEPS * record.rows() as f64;
    for channel in &mut masked {
        if channel.iter().filter(|row| **row).count() as f64 > most {
            channel.fill(false);
        }
    }
    for rows in left_out::ends(record) {
        for channel in &mut masked {
            channel[rows.clone()].fill(true);
        }
    }
    masked
}

impl Problem {
    /// Size of a channel's signals, V or A.
    pub(crate) fn scale(&self, n: usize) -> f64 {
        [self.bases.v, self.bases.i, self.bases.i, self.bases.v_in][n]
    }

    /// Leaves single rows out of every sum.
    pub fn leave_out(&mut self, rows: &[Outlier]) {
        for one in rows {
            self.masked[one.record][one.channel][one.row] = true;
        }
    }

    /// Sets the problem up; noise and outliers are those of [`crate::noise`].
    #[must_use]
    pub fn new(mut records: Vec<Record>, base: Model) -> Self {
        share_source_voltage(&mut records, base.plant.converter.v_in);
        let bases = bases(&records, &base);
        for record in &mut records {
            leave_out_collapse(record, bases.v);
            cut_unstable(record, &base, bases.v);
        }
        let mut offsets = Vec::with_capacity(records.len());
        let mut total = 0;
        for record in &records {
            offsets.push(total);
            total += record.rows() * CHANNELS;
        }
        Problem {
            masked: records.iter().map(in_steps).collect(),
            sigma: [1.0; CHANNELS],
            bases,
            base,
            offsets,
            records,
            trim_held: false,
            work: Work::default(),
        }
    }

    /// [`duty_accuracy`] at the model's frequency.
    #[must_use]
    pub fn duty_accuracy(&self) -> f64 {
        duty_accuracy(self.base.plant.converter.f_sw)
    }

    /// Length of the vectors.
    #[must_use]
    pub fn len(&self) -> usize {
        self.level(self.records.len(), 0) + 1
    }

    /// Where the vectors have what is known before of a free level of a record's load.
    #[must_use]
    pub fn level(&self, record: usize, place: usize) -> usize {
        let before = self.records.iter().take(record).map(|one| one.free_levels.len());
        self.rows() + self.records.iter().map(terms).sum::<usize>() + before.sum::<usize>() + place
    }

    /// Length of the part that holds rows of records.
    pub(crate) fn rows(&self) -> usize {
        self.records.iter().map(|record| record.rows() * CHANNELS).sum()
    }

    /// Where a record's capture has its residuals, if it has one.
    #[must_use]
    pub fn tail(&self, index: usize) -> Option<Range<usize>> {
        let before: usize = self.records.iter().take(index).map(terms).sum();
        let start = self.rows() + before;
        let length = self.records.get(index).map(terms).filter(|length| *length > 0)?;
        Some(start..start + length)
    }

    /// Whether there is no record.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Whether a value counts.
    fn counts(&self, record: usize, row: usize, channel: usize) -> bool {
        self.records[record].measured[channel][row].is_finite() && !self.masked[record][channel][row]
    }

    /// An error over the noise of its channel; [`LOST`] where the model is no plant or its simulation left the numbers.
    fn scored(&self, error: f64, channel: usize) -> f64 {
        let sigma = self.sigma[channel];
        match error / sigma {
            // nobody knows this channel's noise: it is not compared, whatever the model says
            _ if sigma.is_infinite() => 0.0,
            0.0 => NO_ERROR,
            scored if scored.is_finite() => scored,
            _ => LOST,
        }
    }

    /// Measured minus simulated, over the noise; 0 where nothing counts. The first row of a segment does not count: no
    /// period leads to it.
    #[must_use]
    pub fn residual(&self, model: &Model, starts: &Starts) -> Vec<f64> {
        self.residual_counted(model, starts).0
    }

    /// The same, and what it took, in rows ([`Work`]).
    pub(crate) fn residual_counted(&self, model: &Model, starts: &Starts) -> (Vec<f64>, u64) {
        let (mut out, mut rows) = (vec![0.0; self.len()], 0);
        for (index, record) in self.records.iter().enumerate() {
            if let (Some(capture), Some(range)) = (&record.capture, self.tail(index)) {
                let left = capture.residual(model, &capture_drive(record, starts.trim));
                out[range].copy_from_slice(&left);
                continue;
            }
            let (shown, ran) = simulate_counted(model, record, &starts.of(index));
            rows += self.work.add(ran);
            let unseen = Unseen::of(model, record);
            for segment in &record.segments {
                let first = segment.start + usize::from(!record.settled);
                for (row, shown) in (first..).zip(&shown[first.min(segment.end)..segment.end]) {
                    for (channel, shown) in shown.iter().enumerate() {
                        if self.counts(index, row, channel) {
                            let error = record.measured[channel][row] - shown;
                            let place = self.offsets[index] + row * CHANNELS + channel;
                            // not 0, or a delay would gain by what it hides
                            out[place] = match unseen.holds(record, segment, row, channel) {
                                true => AS_NOISE,
                                false => self.scored(error, channel),
                            };
                        }
                    }
                }
            }
        }
        for (index, levels) in starts.levels.iter().enumerate() {
            for (place, by) in levels.iter().enumerate() {
                out[self.level(index, place)] = -by;
            }
        }
        if let Some(last) = out.last_mut() {
            *last = -starts.trim / self.duty_accuracy();
        }
        (out, rows)
    }

    /// Number of values that count.
    #[must_use]
    pub fn count(&self) -> usize {
        let of = |index: usize| {
            let record = &self.records[index];
            let skip = usize::from(!record.settled);
            let rows = record.segments.iter().flat_map(|s| s.start + skip..s.end);
            rows.map(|row| {
                (0..CHANNELS)
                    .filter(|channel| self.counts(index, row, *channel))
                    .count()
            })
            .sum::<usize>()
        };
        let captured = self.records.iter().filter_map(|record| record.capture.as_ref());
        (0..self.records.len()).map(of).sum::<usize>() + captured.map(|capture| capture.counted()).sum::<usize>()
    }
}

/// Number of residuals of a record's capture.
fn terms(record: &Record) -> usize {
    record.capture.as_ref().map_or(0, |capture| capture.terms())
}

/// What drives the model in a record that is a capture.
#[must_use]
pub fn capture_drive(record: &Record, trim: f64) -> Drive {
    Drive {
        duty: record.duty.first().copied().unwrap_or(0.0),
        load: record.load.first().copied().unwrap_or_default(),
        v_in_ratio: record.v_in_ratio,
        applied: matches!(record.duty_is, DutyIs::Applied | DutyIs::Direct),
        trim,
    }
}

/// Scalar product.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `a += k b`.
pub fn axpy(a: &mut [f64], k: f64, b: &[f64]) {
    for (a, b) in a.iter_mut().zip(b) {
        *a += k * b;
    }
}

/// Change of the residual for a step of a knob.
#[must_use]
pub fn nudged(model: &Model, knob: &Knob, range: &[f64; 3]) -> (Model, f64) {
    let value = knob.get(model);
    // small against where the response bends, and four times what is no effect at all (`causes`' TINY)
    let step = 0.2 * range[2];
    // inwards at the upper bound
    let step = if value + step > range[1] { -step } else { step };
    let mut moved = model.clone();
    knob.set(&mut moved, value + step);
    (moved, step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trim_goes_into_a_model_or_is_nobodys() {
        for (trim, is_edges) in [(0.0, true), (-0.0009, true), (0.0011, false), (-0.0073, false)] {
            let starts = Starts {
                trim,
                ..Starts::default()
            };
            assert_eq!(starts.trim_of_nobody(1e4).is_none(), is_edges, "{trim}");
            assert_eq!(starts.trim_or_none(1e4), if is_edges { trim } else { 0.0 });
        }
    }

    /// The half-bridges in ngspice that [`EDGES`] tells of, each at its frequency: none needs a cause beside its edges.
    #[test]
    fn measured_edges_are_within_what_a_gate_may_do() {
        for (f_sw, seconds) in [
            (3e5, 12.3e-9),
            (3e5, 32e-9),
            (1e6, 6.6e-9),
            (1.5e5, 37.7e-9),
            (2e4, 40e-9),
        ] {
            let starts = Starts {
                trim: seconds * f_sw,
                ..Starts::default()
            };
            assert_eq!(starts.trim_of_nobody(f_sw), None, "{f_sw}");
        }
        // a dead time of 200 ns at 300 kHz does
        let dead = Starts {
            trim: -200e-9 * 3e5,
            ..Starts::default()
        };
        assert!(dead.trim_of_nobody(3e5).is_some());
    }
}

//! What the extension is worth on records that no fit has seen.

use measured::DutyIs;
use plant::Rectifier;

use crate::balance;
use crate::clocks;
use crate::drive::Model;
use crate::fit::State;
use crate::ideal::{self, Ideal};
use crate::instants;
use crate::noise;
use crate::problem::{Problem, Starts, dot};
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS, CHANNELS, Record};
use crate::sampling;
use crate::sides;
use crate::unsure_levels;
use crate::words::{noise as noise_said, si};

/// Which rows of a record are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub enum Regime {
    /// All of them.
    #[serde(rename = "all")]
    All,
    /// The inductor current never rests.
    #[serde(rename = "CCM")]
    Continuous,
    /// It does.
    #[serde(rename = "DCM")]
    Discontinuous,
    /// Soon after the duty or the load moved.
    #[serde(rename = "transient")]
    Transient,
}

impl Regime {
    /// Its word in results.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Regime::All => "all",
            Regime::Continuous => "CCM",
            Regime::Discontinuous => "DCM",
            Regime::Transient => "transient",
        }
    }

    const ALL: [Regime; 4] = [
        Regime::All,
        Regime::Continuous,
        Regime::Discontinuous,
        Regime::Transient,
    ];
}

/// Errors of one channel of one held-out record.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Held {
    /// Record.
    pub record: String,
    /// Channel.
    pub channel: &'static str,
    /// Regime of the rows.
    pub regime: Regime,
    /// Root mean square error of the model as given.
    pub rmse_before: f64,
    /// Of the extended model.
    pub rmse_after: f64,
    /// Standard deviation of the noise.
    pub floor: f64,
    /// Share of what is above the noise that is gone, 1; none if nothing is above it.
    pub removed: Option<f64>,
    /// Unit of the errors.
    pub unit: &'static str,
    /// Rows.
    pub rows: usize,
}

impl Held {
    /// In words.
    #[must_use]
    pub fn words(&self) -> String {
        let [before, after] = [self.rmse_before, self.rmse_after].map(|value| si(value, self.unit));
        let floor = noise_said(self.rmse_after, self.floor, self.unit);
        format!(
            "held-out: {} of {}: error {before} before, {after} after, noise {floor}",
            self.channel, self.record
        )
    }
}

/// A held-out record that the extended model fits much worse than the training records: something else was different there.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Shift {
    /// Place of the record among the held-out ones: two of them may bear one name.
    #[serde(skip)]
    pub(crate) index: usize,
    /// Place of the channel.
    #[serde(skip)]
    pub(crate) number: usize,
    /// Record.
    pub record: String,
    /// Channel.
    pub channel: &'static str,
    /// Mean of measured minus simulated.
    pub mean: f64,
    /// The same over the training records.
    pub training: f64,
    /// Root mean square error over that of the training records, 1.
    pub ratio: f64,
    /// Whether the record lies beside the model throughout; if not, its error is only larger.
    pub throughout: bool,
    /// Unit.
    pub unit: &'static str,
}

/// A shift makes at least this share of the squared error (a convention: it has to be seen in the picture) ...
const SHIFT_SHARE: f64 = 0.3;
/// ... and lies so many standard errors from 0, of the means of so many stretches. Student's t of 7 degrees passes 4 once in 200:
/// with three channels of three records a false remark in 5 % of diagnoses, and a remark changes no verdict.
const SHIFT_ERRORS: f64 = 4.0;
const STRETCHES: usize = 8;
/// Mean square error over that of the training records from which on a record is another bench's: the errors are 1.6 times as
/// large, as in [`crate::shape`]. A convention.
pub(crate) const MUCH_WORSE: f64 = 2.5;

/// A held-out record with both simulations, for pictures.
#[derive(Debug, Clone)]
pub struct Pair {
    /// The problem of the held-out records alone.
    pub problem: Problem,
    /// Model as given.
    pub before: State,
    /// Extended model.
    pub after: State,
    /// What was noticed about the records.
    pub remarks: Vec<String>,
    /// Single rows that are left out.
    pub spikes: Vec<noise::Outlier>,
}

/// Simulates the held-out records with both models. `sigma` is the noise of the training records, `trim` what the
/// gate's edges were found to add.
#[must_use]
pub fn hold(records: &[Record], base: &Model, extended: &Model, sigma: [f64; CHANNELS], trim: f64) -> Pair {
    let mut problem = Problem::new(records.to_vec(), base.clone());
    balance::leave_out_odd(&mut problem);
    // a channel that no training record has gets no weight
    problem.sigma = sigma.map(|s| if s.is_finite() { s } else { f64::INFINITY });
    // a trim that is fitted to a record that judges would flatter the model
    problem.trim_held = true;
    sampling::decide(&mut problem, extended);
    let mut remarks = other_chains(&mut problem, base, extended, trim);
    clocks::tune(&mut problem, extended, trim, 0);
    let mut before = State::settle(&problem, base, &problem.first_starts(base), None);
    if sides::leave_out(&mut problem, &before) {
        before = State::settle(&problem, base, &before.starts, None);
    }
    let spikes = noise::outliers(&problem, &before.residual);
    if !spikes.is_empty() {
        remarks.extend(noise::spikes(&problem, &spikes));
        problem.leave_out(&spikes);
        before = State::settle(&problem, base, &before.starts, None);
    }
    if unsure_levels::free(&mut problem, extended, &mut before) {
        before = State::settle(&problem, base, &before.starts, None);
    }
    // where a current rests no step leads from a wrong beginning to the right one: those of the model as given are one place to begin, and
    // what the record shows at each beginning is another
    let settle = |starts: &Starts| {
        let starts = Starts { trim, ..starts.clone() };
        State::settle(&problem, extended, &starts, None)
    };
    let [along, afresh] = [
        settle(&before.starts),
        settle(&with_levels_of(&before.starts, problem.first_starts(extended))),
    ];
    let after = if afresh.chi2 < along.chi2 { afresh } else { along };
    let inflation = noise::inflation(&problem, &after.residual);
    if let Some((mut problem, after)) = instants::freed(&problem, &after, inflation) {
        instants::note(&mut problem, &after.starts);
        return Pair {
            before: instants::scanned(&problem, base, &before.starts),
            after,
            problem,
            remarks,
            spikes,
        };
    }
    Pair {
        problem,
        before,
        after,
        remarks,
        spikes,
    }
}

/// The beginnings of `first` with the rest of `known`.
fn with_levels_of(known: &Starts, first: Starts) -> Starts {
    Starts {
        states: first.states,
        ..known.clone()
    }
}

/// A channel is taken as another instrument's if that lowers chi-square by this: five standard deviations, since the choice is made
/// on a held-out record and must not flatter the model.
const ANOTHER_SENSOR: f64 = 25.0;

/// A record sampled at another instant than the model's has another chain; whether its duties are commanded or applied,
/// and whether its sensors filter, is decided by what fits.
fn other_chains(problem: &mut Problem, base: &Model, extended: &Model, trim: f64) -> Vec<String> {
    let mut remarks = Vec::new();
    let own = base.plant.pwm.sampling_phase;
    for index in 0..problem.records.len() {
        let record = &problem.records[index];
        // as near as the instants of one sampler lie: from there on their jitter is told
        if record.duty_is != DutyIs::Unknown || record.settled || (record.phase - own).abs() < 0.02 {
            continue;
        }
        let chi2 = |duty_is: DutyIs, is_true: [bool; CHANNELS]| {
            let mut alone = problem.clone();
            alone.records = vec![Record {
                duty_is,
                is_true,
                ..record.clone()
            }];
            (alone.offsets, alone.masked) = (vec![0], vec![problem.masked[index].clone()]);
            let mut starts = alone.first_starts(extended);
            starts.trim = trim;
            State::settle(&alone, extended, &starts, None).chi2
        };
        // `min_by` takes the first of equals: commanded, as without a choice
        let kinds = [DutyIs::Commanded, DutyIs::Applied, DutyIs::Direct];
        let fits = kinds.map(|kind| (chi2(kind, record.is_true), kind));
        let (mut least, best) = fits
            .into_iter()
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((f64::INFINITY, DutyIs::Commanded));
        let mut is_true = record.is_true;
        for n in 0..CHANNELS {
            let mut tried = is_true;
            tried[n] = true;
            let with = chi2(best, tried);
            if with < least - ANOTHER_SENSOR {
                (least, is_true) = (with, tried);
                remarks.push(format!(
                    "{} of {} shows none of the sensor's errors",
                    CHANNEL_NAMES[n], record.name
                ));
            }
        }
        let record = &mut problem.records[index];
        (record.duty_is, record.is_true) = (best, is_true);
        let words = match best {
            DutyIs::Applied => "delays and rounding of the duty do not show in it: its duties are taken as applied",
            DutyIs::Direct => {
                "neither delays of the duty nor filters of the sensors show in it: taken as applied duties and direct \
                 measurements"
            }
            _ => continue,
        };
        remarks.push(format!(
            "{} is sampled at another instant than the model's; {words}",
            record.name
        ));
    }
    remarks
}

impl Pair {
    /// Errors of each record, channel and regime.
    #[must_use]
    pub fn errors(&self) -> Vec<Held> {
        let mut list = Vec::new();
        for index in 0..self.problem.records.len() {
            for n in 0..CHANNELS {
                for regime in Regime::ALL {
                    list.extend(self.error(index, n, regime));
                }
            }
        }
        list
    }

    fn error(&self, index: usize, n: usize, regime: Regime) -> Option<Held> {
        let record = &self.problem.records[index];
        let before = noise::channel(&self.problem, &self.before.residual, index, n);
        let after = noise::channel(&self.problem, &self.after.residual, index, n);
        let belongs = |row: &usize| is_in(regime, &self.problem, record, *row);
        let rows: Vec<usize> = (0..record.rows())
            .filter(|row| before[*row] != 0.0 && belongs(row))
            .collect();
        if rows.len() < 3 {
            return None;
        }
        let sigma = self.problem.sigma[n];
        let square =
            |values: &[f64]| rows.iter().map(|row| values[*row] * values[*row]).sum::<f64>() / rows.len() as f64;
        let (a, b) = (square(&before), square(&after));
        // the noise of a mean square, twice
        let above = 2.0 * (2.0 / rows.len() as f64).sqrt();
        Some(Held {
            record: record.name.clone(),
            channel: CHANNEL_NAMES[n],
            regime,
            rmse_before: sigma * a.sqrt(),
            rmse_after: sigma * b.sqrt(),
            floor: sigma,
            // errors without their noise, which adds in squares and which no model removes
            removed: (a > 1.0 + above).then(|| 1.0 - (b - 1.0).max(0.0).sqrt() / (a - 1.0).sqrt()),
            unit: CHANNEL_UNITS[n],
            rows: rows.len(),
        })
    }

    /// Records that the extended model does not fit as it fits the training records; `training` are the training records at that model.
    #[must_use]
    pub fn shifts(&self, training: &Problem, at: &State) -> Vec<Shift> {
        let mut list = Vec::new();
        let ideal = Ideal::at(&self.problem.base.plant, 1.0);
        for (index, record) in self.problem.records.iter().enumerate() {
            if record.settled || ideal.is_unstable_with(record) {
                continue;
            }
            for n in 0..CHANNELS {
                let used = |values: Vec<f64>| values.into_iter().filter(|v| *v != 0.0).collect::<Vec<f64>>();
                let values = used(noise::channel(&self.problem, &self.after.residual, index, n));
                if values.len() < 5 * STRETCHES {
                    continue;
                }
                let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
                let (whole, square) = (mean(&values), dot(&values, &values) / values.len() as f64);
                let parts: Vec<f64> = values.chunks(values.len().div_ceil(STRETCHES)).map(mean).collect();
                let scatter = parts.iter().map(|part| (part - whole) * (part - whole)).sum::<f64>();
                let error = (scatter / (parts.len() * (parts.len() - 1)).max(1) as f64).sqrt();
                let all = (0..training.records.len()).flat_map(|r| used(noise::channel(training, &at.residual, r, n)));
                let all: Vec<f64> = all.collect();
                let own = mean(&all);
                // training records that lie below their own noise by chance must not make others look worse
                let usual = (dot(&all, &all) / all.len().max(1) as f64).max(1.0);
                let apart = (whole - own).abs() > SHIFT_ERRORS * error && whole.abs() > 3.0 * own.abs();
                // below the noise a shift is no matter
                let throughout = apart && whole * whole > SHIFT_SHARE * square && whole.abs() > 1.0;
                if throughout || square > MUCH_WORSE * usual {
                    list.push(Shift {
                        index,
                        number: n,
                        record: record.name.clone(),
                        channel: CHANNEL_NAMES[n],
                        mean: whole * self.problem.sigma[n],
                        training: own * self.problem.sigma[n],
                        ratio: (square / usual).sqrt(),
                        throughout,
                        unit: CHANNEL_UNITS[n],
                    });
                }
            }
        }
        list
    }

    /// Chi-square over the number of values, before and after.
    #[must_use]
    pub fn total(&self) -> (f64, f64) {
        let count = self.problem.count().max(1) as f64;
        (
            self.before.chi2 / count,
            dot(&self.after.residual, &self.after.residual) / count,
        )
    }
}

/// Rows that count as transient after the duty or load moved: 3 ms of the paper's converter, whose filter swings with a period
/// of 3.4 ms at 150 uF. A convention: it sorts rows in a table, and no verdict hangs on it.
const TRANSIENT: usize = 30;

/// CCM or DCM by the drawn current against half the ripple.
fn is_in(regime: Regime, problem: &Problem, record: &Record, row: usize) -> bool {
    let p = &problem.base.plant.converter;
    let (d, ideal) = (record.duty[row], Ideal::of(record, &problem.base.plant));
    let mean = ideal.inductor(ideal::drawn(&record.load[row], ideal.volts(d)), d);
    let is_discontinuous = p.rectifier == Rectifier::Diode && mean < ideal.half(d);
    let moved = |n: usize| record.duty[n] != record.duty[n - 1] || record.load[n] != record.load[n - 1];
    match regime {
        Regime::All => true,
        Regime::Continuous => !is_discontinuous,
        Regime::Discontinuous => is_discontinuous,
        Regime::Transient => !record.settled && (row.saturating_sub(TRANSIENT).max(1)..=row).any(moved),
    }
}

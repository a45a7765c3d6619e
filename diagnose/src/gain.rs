//! What the extension is worth on records that no fit has seen.

use crate::columns::DutyIs;
use crate::drive::Model;
use crate::fit::State;
use crate::noise;
use crate::problem::{Problem, dot};
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS, CHANNELS, Record};

/// Errors of one channel of one held-out record.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Held {
    /// Record.
    pub record: String,
    /// Channel.
    pub channel: &'static str,
    /// Regime of the rows: `all`, or one of `CCM`, `DCM`, `transient`.
    pub regime: &'static str,
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
}

/// Simulates the held-out records with both models. `sigma` is the noise of the training records, `trim` what the
/// gate's edges were found to add.
#[must_use]
pub fn hold(records: &[Record], base: &Model, extended: &Model, sigma: [f64; CHANNELS], trim: f64) -> Pair {
    let mut problem = Problem::new(records.to_vec(), base.clone());
    problem.sigma = sigma.map(|s| if s.is_finite() { s } else { f64::INFINITY });
    problem.trim_held = true;
    let remarks = other_chains(&mut problem, base, extended, trim);
    let before = State::settle(&problem, base, &problem.first_starts(), None);
    let mut starts = before.starts.clone();
    starts.trim = trim;
    let after = State::settle(&problem, extended, &starts, None);
    Pair {
        problem,
        before,
        after,
        remarks,
    }
}

/// A record sampled at another instant than the model's has another chain; whether its duties are commanded or applied,
/// and whether its sensors filter, is decided by what fits.
fn other_chains(problem: &mut Problem, base: &Model, extended: &Model, trim: f64) -> Vec<String> {
    let mut remarks = Vec::new();
    let own = base.plant.pwm.sampling_phase;
    for index in 0..problem.records.len() {
        let record = &problem.records[index];
        if record.duty_is != DutyIs::Unknown || record.settled || (record.phase - own).abs() < 0.02 {
            continue;
        }
        let chi2 = |duty_is: DutyIs| {
            let mut alone = problem.clone();
            alone.records = vec![Record {
                duty_is,
                ..record.clone()
            }];
            (alone.offsets, alone.masked) = (vec![0], vec![problem.masked[index].clone()]);
            let mut starts = alone.first_starts();
            starts.trim = trim;
            State::settle(&alone, extended, &starts, None).chi2
        };
        let kinds = [DutyIs::Commanded, DutyIs::Applied, DutyIs::Direct];
        let fits = kinds.map(|kind| (chi2(kind), kind));
        let best = fits
            .iter()
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(DutyIs::Commanded, |(_, kind)| *kind);
        let record = &mut problem.records[index];
        record.duty_is = best;
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
                for regime in ["all", "CCM", "DCM", "transient"] {
                    list.extend(self.error(index, n, regime));
                }
            }
        }
        list
    }

    fn error(&self, index: usize, n: usize, regime: &'static str) -> Option<Held> {
        let record = &self.problem.records[index];
        let before = noise::channel(&self.problem, &self.before.residual, index, n);
        let after = noise::channel(&self.problem, &self.after.residual, index, n);
        let belongs = |row: &usize| regime == "all" || regimes(&self.problem, record, *row).contains(&regime);
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
            removed: (a > 1.0 + above).then(|| 1.0 - (b - 1.0).max(0.0).sqrt() / (a - 1.0).sqrt()),
            unit: CHANNEL_UNITS[n],
            rows: rows.len(),
        })
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

/// CCM or DCM by the drawn current against half the ripple; transient within 3 ms (of the paper's converter: thirty
/// periods) after the duty or load moved.
fn regimes(problem: &Problem, record: &Record, row: usize) -> [&'static str; 2] {
    let p = &problem.base.plant.converter;
    let d = record.duty[row];
    let ripple = p.v_in * d * (1.0 - d) / (p.inductance * p.f_sw);
    let conduction = if noise::is_discontinuous(record, row, ripple) {
        "DCM"
    } else {
        "CCM"
    };
    let recent = row.saturating_sub(30).max(1)..=row;
    let moved = recent
        .clone()
        .any(|n| n > 0 && (record.duty[n] != record.duty[n - 1] || record.load[n] != record.load[n - 1]));
    [conduction, if moved { "transient" } else { "steady" }]
}

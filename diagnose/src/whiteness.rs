//! Whether what a model leaves is noise, as figures; how large it is stands in the table of fits (`page::comparison`).
//!
//! - Ljung and Box's sum over the correlations of a residual with itself tells colour: for white noise it is a chi-square.
//! - The correlation with duty and load, some rows later, tells what of these the model does not carry on.
//!
//! No verdict hangs on them: real noise is never quite white, and a large record tells it (`shape` has a level of its own).

use serde::Serialize;

use crate::fit::State;
use crate::gain::Pair;
use crate::noise::channel;
use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNELS};

/// Lags that are looked at: two milliseconds at 10 kHz, most of a period of the paper's filter.
const LAGS: usize = 20;
/// Fewest rows for so many lags.
const FEWEST: usize = 60;
/// 99 % of a normal number, to either side.
const BAND: f64 = 2.576;

/// A correlation at the lag where it is largest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Largest {
    /// The correlation.
    pub correlation: f64,
    /// Rows by which the residual follows.
    pub lag: usize,
}

/// What the residual of one channel of one record still has of what drives the converter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Driven {
    /// Record.
    pub record: String,
    /// Channel.
    pub channel: &'static str,
    /// Whether the record took no part in the fit.
    pub heldout: bool,
    /// With the duty, if that moves.
    pub with_duty: Option<Largest>,
    /// With the set load, if that moves.
    pub with_load: Option<Largest>,
    /// Within this to either side are 99 % of the correlations of noise at one lag.
    pub band: f64,
}

/// The figures of the training records at the best model, then those of held-out records at the extended one.
#[must_use]
pub fn of_both((problem, state): (&Problem, &State), held: Option<&Pair>) -> Vec<Driven> {
    let mut list = of(problem, state, false);
    list.extend(held.into_iter().flat_map(|pair| of(&pair.problem, &pair.after, true)));
    list
}

/// The figures of all channels of records over time.
fn of(problem: &Problem, state: &State, heldout: bool) -> Vec<Driven> {
    let mut list = Vec::new();
    for (index, record) in problem.records.iter().enumerate() {
        if record.settled || record.capture.is_some() {
            continue;
        }
        for (n, name) in CHANNEL_NAMES.iter().enumerate().take(CHANNELS) {
            let left = channel(problem, &state.residual, index, n);
            let rows: Vec<usize> = (0..left.len()).filter(|row| left[*row] != 0.0).collect();
            // a channel that no training record has is not compared: nobody knows its noise
            if rows.len() < FEWEST || !problem.sigma[n].is_finite() {
                continue;
            }
            let pick = |values: &[f64]| rows.iter().map(|row| values[*row]).collect::<Vec<f64>>();
            let load: Vec<f64> = (record.load.iter())
                .map(|load| load.current + load.conductance * problem.bases.v + load.power / problem.bases.v)
                .collect();
            let shown = pick(&left);
            list.push(Driven {
                record: record.name.clone(),
                channel: name,
                heldout,
                with_duty: largest(&shown, &pick(&record.duty)),
                with_load: largest(&shown, &pick(&load)),
                band: BAND / (rows.len() as f64).sqrt(),
            });
        }
    }
    list
}

fn centred(values: &[f64]) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|v| v - mean).collect()
}

fn lagged(a: &[f64], b: &[f64], lag: usize) -> f64 {
    a.iter().skip(lag).zip(b).map(|(a, b)| a * b).sum()
}

/// The chance that white noise resembles itself more than these errors, which are 0 where nothing counts; nothing with too few.
#[must_use]
pub fn white_chance(errors: &[f64]) -> Option<f64> {
    let values: Vec<f64> = errors.iter().copied().filter(|error| *error != 0.0).collect();
    (values.len() >= FEWEST).then(|| ljung_box(&values))
}

/// The chance that white noise has more of Ljung and Box's sum (Wilson and Hilferty's normal number of a chi-square).
fn ljung_box(values: &[f64]) -> f64 {
    let (a, n) = (centred(values), values.len() as f64);
    let square = lagged(&a, &a, 0).max(f64::MIN_POSITIVE);
    let terms = (1..=LAGS).map(|lag| {
        let r = lagged(&a, &a, lag) / square;
        r * r / (n - lag as f64)
    });
    let sum = n * (n + 2.0) * terms.sum::<f64>();
    let (count, spread) = (LAGS as f64, 2.0 / (9.0 * LAGS as f64));
    let normal = (libm::cbrt(sum / count) - (1.0 - spread)) / spread.sqrt();
    0.5 * libm::erfc(normal / std::f64::consts::SQRT_2)
}

/// The largest correlation of a residual with what drives the converter; nothing if that stands still.
fn largest(left: &[f64], input: &[f64]) -> Option<Largest> {
    let (a, b) = (centred(left), centred(input));
    let scale = (lagged(&a, &a, 0) * lagged(&b, &b, 0)).sqrt();
    let moves = input.windows(2).any(|pair| pair[0] != pair[1]);
    let each = (0..=LAGS).map(|lag| Largest {
        correlation: lagged(&a, &b, lag) / scale,
        lag,
    });
    each.filter(|_| moves && scale > 0.0)
        .max_by(|a, b| a.correlation.abs().total_cmp(&b.correlation.abs()))
}

#[cfg(test)]
mod tests {
    use super::{largest, ljung_box};

    fn noise(count: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..count).map(|_| (0..12).map(|_| uniform()).sum()).collect()
    }

    #[test]
    fn white_noise_has_a_chance_that_is_evenly_spread_and_coloured_noise_none() {
        let chances: Vec<f64> = (0..200).map(|seed| ljung_box(&noise(300, seed + 1))).collect();
        for limit in [0.1, 0.5, 0.9] {
            let share = chances.iter().filter(|chance| **chance < limit).count() as f64 / 200.0;
            // three standard deviations of a share of 200
            assert!(
                (share - limit).abs() < 3.0 * (limit * (1.0 - limit) / 200.0).sqrt(),
                "{limit}: {share}"
            );
        }
        let white = noise(300, 5);
        let coloured: Vec<f64> = white.windows(2).map(|pair| pair[1] + 0.6 * pair[0]).collect();
        assert!(ljung_box(&coloured) < 1e-3);
    }

    #[test]
    fn a_residual_that_follows_its_input_is_seen_at_its_lag() {
        let input: Vec<f64> = (0..300).map(|n| f64::from(u8::from((n / 37) % 2 == 0))).collect();
        let white = noise(300, 6);
        let left: Vec<f64> = (0..300).map(|n| white[n] + 2.0 * input[usize::max(n, 5) - 5]).collect();
        let found = largest(&left, &input).unwrap();
        assert!(found.lag.abs_diff(5) <= 1 && found.correlation > 0.5, "{found:?}");
        assert!(largest(&left, &[1.0; 300]).is_none());
    }
}

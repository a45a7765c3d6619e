//! What a residual looks like that no cause explains.

use crate::fit::State;
use crate::level::ACCURACY;
use crate::noise::{self, BLOCK, channel};
use crate::problem::Problem;
use crate::record::CHANNEL_NAMES;
use crate::small;
use crate::spectrum::strongest_line;

/// Structure is seen where block means scatter this much more than white noise of the same size would let them: twice as much,
/// however many blocks there are. Real noise is never quite white; a convention.
const SLOW: f64 = 1.0;
/// Standard deviations of that scatter which noise may reach. Sums of squares have long tails: a record of 25 blocks
/// passes 5 once in 1e4, and some ten channels are looked at.
const SIGMAS: f64 = 5.0;
/// A line is named if it holds this share of a channel's residual power. The strongest line in 250 rows of white noise holds
/// about 4 %. It only words what is left.
const LINE: f64 = 0.15;

/// Structure left in one channel.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Structure {
    /// Record.
    pub record: String,
    /// Channel.
    pub channel: &'static str,
    /// Mean square over that of the noise.
    pub mean_square: f64,
    /// Mean square of block means over that of white noise.
    pub slow: f64,
    /// Correlation of neighbouring rows.
    pub correlation: f64,
    /// In words: a line, a step, a drift, a burst, or depending on the operating point.
    pub shape: String,
}

/// All channels in which a state leaves structure. What the model as given, `null`, leaves tells how much the accuracy of a
/// simulator may leave.
#[must_use]
pub fn structures(problem: &Problem, null: &State, state: &State, inflation: f64) -> Vec<Structure> {
    let mut found = Vec::new();
    for (index, record) in problem.records.iter().enumerate() {
        let disorder = small::disorder(problem, state, index);
        if disorder.is_some() {
            found.extend(disorder);
            continue;
        }
        for (n, name) in CHANNEL_NAMES.iter().enumerate() {
            let values = channel(problem, &state.residual, index, n);
            let left = noise::left(&values);
            let before = noise::left(&channel(problem, &null.residual, index, n));
            if left.blocks < 5 {
                found.extend(small::structure(problem, index, n, &values, before.square));
            }
            // fewer block means tell no scatter
            if left.blocks < 5 {
                continue;
            }
            // chi-square of n blocks has the variance 2 n; the bound, so that correlated noise hides no structure
            let scatter = (2.0 / left.blocks as f64).sqrt() * inflation.sqrt().min(1.5);
            // a coarse converter leaves patterns that are none of the plant's
            let step = record.lattice[n];
            let coarse = step > 1.5 * problem.sigma[n] && left.square.sqrt() * problem.sigma[n] < step;
            // a simulator that is off by ACCURACY leaves that share of what was there, in squares
            let slow = left.slow > 1.0 + SLOW.max(SIGMAS * scatter) + ACCURACY * ACCURACY * before.slow;
            // fast structure: white, but 1.6 times as large as the noise that second differences showed
            let wild = left.square > 2.5 + ACCURACY * ACCURACY * before.square;
            if (slow || wild) && !coarse {
                found.push(Structure {
                    record: record.name.clone(),
                    channel: name,
                    mean_square: left.square,
                    slow: left.slow,
                    correlation: left.lag1,
                    shape: shape(problem, state, index, n, &values),
                });
            }
        }
    }
    found
}

fn shape(problem: &Problem, state: &State, index: usize, n: usize, values: &[f64]) -> String {
    let total: f64 = values.iter().map(|v| v * v).sum();
    let sigma = problem.sigma[n];
    if let Some((row, share)) = burst(values, total) {
        let t = problem.records[index].time[row];
        return format!("a burst around t = {t:.4} s ({:.0} % of the power)", 100.0 * share);
    }
    let line = strongest_line(problem, &state.residual, n).filter(|line| line.share > LINE);
    if let Some(line) = line {
        return format!(
            "a line at {:.0} Hz of {:.3} ({:.0} % of the power)",
            line.frequency,
            line.amplitude,
            100.0 * line.share
        );
    }
    let (at, step) = largest_step(values);
    let t = problem.records[index].time[at];
    let trend = correlation_with_time(values);
    // the limits below choose words only
    if trend.abs() > 0.6 {
        return format!("a drift over the record (correlation with time {trend:.2})");
    }
    if step.abs() > 0.5 {
        return format!("a step of {:.3} at t = {t:.4} s", step * sigma);
    }
    let duty = correlation(values, &problem.records[index].duty);
    format!("slow, depending on the operating point (correlation with duty {duty:.2}, with time {trend:.2})")
}

/// Twenty neighbouring rows that hold most of the power.
fn burst(values: &[f64], total: f64) -> Option<(usize, f64)> {
    let window = 2 * BLOCK;
    if values.len() < 8 * window {
        return None;
    }
    let sums = values.windows(window).map(|w| w.iter().map(|v| v * v).sum::<f64>());
    let (row, most) = sums.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    // "most of the power", as the words above say
    (most > 0.5 * total).then_some((row + BLOCK, most / total))
}

/// Where the mean before and after differ most, and by how much.
fn largest_step(values: &[f64]) -> (usize, f64) {
    let n = values.len();
    let mut best = (0, 0.0f64, 0.0f64);
    let total: f64 = values.iter().sum();
    let mut before = 0.0;
    for at in 1..n {
        before += values[at - 1];
        let (a, b) = (at as f64, (n - at) as f64);
        let step = (total - before) / b - before / a;
        let weight = step * step * a * b / n as f64;
        if weight > best.2 {
            best = (at, step, weight);
        }
    }
    (best.0, best.1)
}

fn correlation_with_time(values: &[f64]) -> f64 {
    let time: Vec<f64> = (0..values.len()).map(|n| n as f64).collect();
    let means: Vec<f64> = values
        .chunks(BLOCK)
        .map(|b| b.iter().sum::<f64>() / b.len() as f64)
        .collect();
    let times: Vec<f64> = time
        .chunks(BLOCK)
        .map(|b| b.iter().sum::<f64>() / b.len() as f64)
        .collect();
    correlation(&means, &times)
}

/// Pearson's correlation.
#[must_use]
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len()).max(1) as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        ab += (x - ma) * (y - mb);
        aa += (x - ma) * (x - ma);
        bb += (y - mb) * (y - mb);
    }
    if aa > 0.0 && bb > 0.0 {
        ab / (aa * bb).sqrt()
    } else {
        0.0
    }
}

//! Tables too small for block means: settled points, and records below fifty rows. What a cause leaves there is judged by its size
//! against what a meter may be off, and by whether it is smooth; and few rows carry few parameters.

use crate::fit::State;
use crate::noise;
use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS};
use crate::shape::Structure;
use crate::words::si;

/// Mean square over that of the noise that is allowed beside its own scatter: twice, as for long records.
const WILD: f64 = 2.0;
const SIGMAS: f64 = 5.0;
/// So few second differences that the noise which they show may be next to nothing by chance: five of seven values are the first that
/// tell any, and of three no noise comes.
const UNKNOWN: f64 = 40.0;
const SHOWN: f64 = 7.0;
const TOO_FEW: f64 = 5.0;
/// Neighbours that differ by so many standard deviations less than noise would make them do: once in 3e4 tables.
const SMOOTH: f64 = 4.0;
/// Fewer rows say nothing of their order.
const ORDERED: usize = 8;
/// Rows of a table for each parameter. Two more than one could be chance: a line through three points leaves one that may disagree.
const ROWS_PER_PARAMETER: usize = 3;
/// A signal whose noise is this share of its size, and of whose movement a model leaves half, was not made by this converter: filter and
/// inductor let no real signal leap so.
const NOISY: f64 = 0.03;
const LEFT: f64 = 0.5;

/// Parameters that settled points carry; all that there are if a record shows transients.
#[must_use]
pub fn most_parameters(problem: &Problem) -> usize {
    match problem.records.iter().all(|record| record.settled) {
        true => (distinct(problem) / ROWS_PER_PARAMETER).max(1) + captured(problem),
        false => usize::MAX,
    }
}

/// Numbers that captures hold beside settled points.
fn captured(problem: &Problem) -> usize {
    let captures = problem.records.iter().filter_map(|record| record.capture.as_ref());
    captures.map(|capture| capture.freedom()).sum()
}

/// Settled points that do not repeat the one before.
fn distinct(problem: &Problem) -> usize {
    let of = |record: &crate::record::Record| {
        let is_new = |n: &usize| *n == 0 || !record.is_same_point(*n, *n - 1);
        (0..record.rows()).filter(is_new).count()
    };
    problem.records.iter().map(of).sum()
}

/// Said where a small table stays unexplained.
#[must_use]
pub fn freedom(problem: &Problem) -> Option<String> {
    let most = most_parameters(problem);
    let said = || {
        format!(
            "{} settled points carry {most} free numbers at most: more causes were not tried",
            distinct(problem)
        )
    };
    (most < 6).then(said)
}

/// Mean square of `count` values over that of the noise which these values show by their second differences: noise is above it once in a
/// thousand channels.
// the 99.9 % quantile of that ratio, over `noise::few::unsure` squared, in 200,000 draws of white noise each: 14.8, 8.6, 5.6, 4.3, 4.9, 3.1
// and 2.4 for 7, 8, 9, 10, 12, 15 and 20 values. Chi-square alone, for a noise that is known, would be 4.7 for 7
fn most_of_noise(count: f64) -> f64 {
    let unknown = UNKNOWN / (count.max(SHOWN) - TOO_FEW).powi(2);
    WILD + SIGMAS * (2.0 / count).sqrt() + unknown
}

/// Structure in one channel of a record, if it is small; `values` are what is left over the noise, `before` what the model as given leaves.
pub(crate) fn structure(problem: &Problem, index: usize, n: usize, values: &[f64], before: f64) -> Option<Structure> {
    let record = &problem.records[index];
    let mut rows: Vec<usize> = (0..values.len()).filter(|row| values[*row] != 0.0).collect();
    if rows.len() < 3 {
        return None;
    }
    if record.settled {
        rows.sort_by(|a, b| record.duty[*a].total_cmp(&record.duty[*b]));
    }
    let left: Vec<f64> = rows.iter().map(|row| values[*row]).collect();
    let shown = noise::left(&left);
    let count = left.len() as f64;
    let allowed = crate::level::ACCURACY * crate::level::ACCURACY * before;
    let wild = shown.square > most_of_noise(count) + allowed;
    // von Neumann's ratio: squared differences of neighbours over squares, 2 for noise
    let differences: f64 = left.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum();
    let ratio = differences / (count * shown.square).max(1e-300);
    let scatter = 2.0 * ((count - 2.0) / (count * count - 1.0)).sqrt();
    let smooth = left.len() >= ORDERED && ratio < 2.0 - SMOOTH * scatter && shown.square > WILD + allowed;
    let rms = shown.square.sqrt() * problem.sigma[n];
    let shape = match (wild || smooth, smooth, record.settled) {
        (false, ..) => return None,
        (_, true, true) => format!("{} that goes smoothly with the duty", si(rms, CHANNEL_UNITS[n])),
        (_, true, false) => format!("{} that goes smoothly with time", si(rms, CHANNEL_UNITS[n])),
        (_, false, true) => format!(
            "{} of scatter between settled points, more than a meter has",
            si(rms, CHANNEL_UNITS[n])
        ),
        (_, false, false) => format!(
            "{} of scatter, more than its rows show as noise",
            si(rms, CHANNEL_UNITS[n])
        ),
    };
    Some(Structure {
        record: record.name.clone(),
        channel: CHANNEL_NAMES[n],
        mean_square: shown.square,
        slow: shown.slow.max(if smooth { shown.square } else { 0.0 }),
        correlation: shown.lag1,
        shape,
    })
}

/// Noise that no signal of this converter has, in records of any length.
pub(crate) fn disorder(problem: &Problem, state: &State, index: usize) -> Option<Structure> {
    let record = &problem.records[index];
    let values = noise::channel(problem, &state.residual, index, 0);
    let sigma = problem.sigma[0];
    if record.settled || sigma < NOISY * problem.scale(0) {
        return None;
    }
    let counted = (0..values.len()).filter(|row| values[*row] != 0.0);
    let signal: Vec<f64> = counted.map(|row| record.measured[0][row]).collect();
    let mean = signal.iter().sum::<f64>() / signal.len().max(1) as f64;
    let moved = signal.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    let left = values.iter().map(|v| (v * sigma).powi(2)).sum::<f64>();
    let shown = noise::left(&values);
    (left > LEFT * moved).then(|| Structure {
        record: record.name.clone(),
        channel: CHANNEL_NAMES[0],
        mean_square: shown.square,
        slow: shown.slow,
        correlation: shown.lag1,
        shape: format!(
            "{} of scatter from row to row, which the filter of no such converter lets through",
            si(sigma, CHANNEL_UNITS[0])
        ),
    })
}

/// Whether every record is in such disorder: what no filter lets through no cause makes, and none is sought.
#[must_use]
pub fn is_disordered(problem: &Problem, state: &State) -> bool {
    !problem.records.is_empty() && (0..problem.records.len()).all(|index| disorder(problem, state, index).is_some())
}

#[cfg(test)]
mod tests {
    use super::most_of_noise;

    /// Quantiles of 200,000 draws each, as above.
    #[test]
    fn noise_of_any_number_of_values_is_below_its_bound_but_once_in_a_thousand() {
        for (count, quantile) in [
            (7.0, 14.8),
            (8.0, 8.6),
            (9.0, 5.7),
            (10.0, 4.4),
            (12.0, 4.94),
            (15.0, 3.1),
            (20.0, 2.5),
        ] {
            let bound = most_of_noise(count);
            assert!((0.9 * quantile..1.8 * quantile).contains(&bound), "{count}: {bound}");
        }
    }
}

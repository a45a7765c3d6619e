//! Noise of each channel, outliers, and what is left in a residual that noise would not leave.

mod few;
mod rings;
mod spikes;
mod table;

use crate::exact::Exact;
use crate::flicker;
use crate::median::middle;
use crate::problem::{Problem, dot};
use crate::record::{CHANNELS, Record};

pub use spikes::{Outlier, outliers, spikes};

/// A channel is stuck on one value if this share of neighbours are equal. Noise of half a step still changes the value between half
/// of all rows. A convention between that and 1.
const STUCK: f64 = 0.8;
/// Rows averaged to look for slow structure: 1 ms of the paper's converter, a third of the period of its filter, and long enough
/// that a mean scatters a third as much as a row.
pub const BLOCK: usize = 10;
/// Lags over which a residual's correlation is summed: two blocks. Slower noise looks like structure anyway.
const LAGS: usize = 20;

/// One channel of a residual: `residual[row]` for each row, 0 where nothing counts.
#[must_use]
pub fn channel(problem: &Problem, residual: &[f64], record: usize, channel: usize) -> Vec<f64> {
    let start = problem.offsets[record] + channel;
    (0..problem.records[record].rows())
        .map(|row| residual[start + row * CHANNELS])
        .collect()
}

/// Standard deviation of each channel's noise: from second differences of the residual, which hardly see what is slow,
/// by the smaller of them, which hardly see what is rare. Infinite for a channel that no record has.
#[must_use]
pub fn sigma(problem: &Problem, residual: &[f64]) -> [f64; CHANNELS] {
    std::array::from_fn(|n| {
        let of = |record: usize| -> f64 {
            let one = &problem.records[record];
            if one.repeated {
                // points of a logger have no neighbours in time: their scatter was taken from the rows of each
                return one.scatter[n] / problem.sigma[n];
            }
            let values = channel(problem, residual, record, n);
            let mut rows: Vec<usize> = (0..values.len()).collect();
            if !one.dense {
                // rows of a slower rate have nothing between them
                rows.retain(|row| values[*row] != 0.0);
            }
            let shown: Vec<f64> = rows.iter().map(|row| values[*row]).collect();
            let digit = one.lattice[n].max(one.resolution[n]) / problem.sigma[n];
            // rows without a value are no meter that shows one all the time
            let measured: Vec<f64> = shown.iter().copied().filter(|v| *v != 0.0).collect();
            let seen =
                scatter_of_ringing(&shown, |rows| rows.iter().all(|v| *v != 0.0)).max(flicker::noise(&measured, digit));
            match one.settled {
                true => table::scatter(problem, one, &values, n)
                    .map_or(seen, |beside| beside.min(seen.max(few::of_order(beside, shown.len())))),
                false => seen,
            }
        };
        // the median: one noisy record must not hide what the others show
        let typical = middle((0..problem.records.len()).map(of)) * few::unsure(problem, n);
        let scale = problem.scale(n);
        let least = least(problem, n);
        let has = problem
            .records
            .iter()
            .any(|r| r.measured[n].iter().any(|v| v.is_finite()));
        match (has, typical.is_finite()) {
            (false, _) => f64::INFINITY,
            (true, true) => (typical * problem.sigma[n])
                .min(few::most(problem, n, scale))
                .max(least)
                .hypotenuse(metered(problem, n)),
            (true, false) => few::of_fewest(problem, residual, n, scale).max(least),
        }
    })
}

/// The least noise of a channel, V or A: what its digits, its meter and the simulators are, whatever its values happen to scatter by.
#[must_use]
pub(crate) fn least(problem: &Problem, n: usize) -> f64 {
    let steps = problem.records.iter().map(|r| r.lattice[n].max(r.resolution[n]));
    let lattice = steps.fold(0.0, f64::max);
    // step / sqrt 12: the standard deviation of rounding
    (lattice / 12f64.sqrt())
        .max(least_share(problem) * problem.scale(n))
        .max(stuck(problem, n))
        .max(few::steps(problem, n))
        .max(few::rounded(problem, n))
}

/// The least noise, as a share of the signal. A row a period is sampled with 13 bits at best (1e-4), and two simulators of
/// one circuit differ by as much; settled points are means, and good meters show five digits.
fn least_share(problem: &Problem) -> f64 {
    if problem.records.iter().all(|record| record.settled) {
        1e-5
    } else {
        1e-4
    }
}

/// A record over time with noise below this share of its signal was not measured: a fifth of the above.
const TOO_CLEAN: f64 = 2e-5;

/// What to say of records over time that are too clean to be measured; `residual` is that of the model as given.
#[must_use]
pub fn too_clean(problem: &Problem, residual: &[f64]) -> Option<String> {
    let clean = |(index, record): (usize, &Record)| {
        let is_clean = |n: &usize| {
            let shown: Vec<f64> = channel(problem, residual, index, *n)
                .into_iter()
                .filter(|v| *v != 0.0)
                .collect();
            let noise = scatter(&shown, |_| true) * problem.sigma[*n];
            // a coarse converter hides what noise there is
            noise.max(record.lattice[*n]) < TOO_CLEAN * problem.scale(*n)
        };
        let has = |n: &usize| record.measured[*n].iter().any(|v| v.is_finite());
        let mut measured = (0..2).filter(has).peekable();
        (!record.settled && measured.peek().is_some() && measured.all(|n| is_clean(&n))).then(|| record.name.clone())
    };
    let names: Vec<String> = problem.records.iter().enumerate().filter_map(clean).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{}: too clean to be measured, noise below 2e-5 of the signals. A simulation? Nothing below a noise of 1e-4 is named in it",
            names.join(", ")
        )
    })
}

/// What a level of the load that is a mean of metered rows adds to the noise of the inductor current, which follows the load: the
/// meter's own noise. A mean over n rows is off by s / sqrt n, as is the other current's: together the sum over the level scatters as
/// if each row had both.
fn metered(problem: &Problem, n: usize) -> f64 {
    let of_records = problem.records.iter().filter(|_| n == 1);
    of_records.filter_map(|record| record.metered).fold(0.0, f64::max)
}

/// Standard deviation of noise by second differences of the triples that count; NaN where there are too few.
pub(crate) fn scatter(values: &[f64], counts: impl Fn(&[f64]) -> bool) -> f64 {
    let triples = values.windows(3).filter(|triple| counts(triple));
    let second: Vec<f64> = triples.map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    if second.len() < 5 {
        return f64::NAN;
    }
    // three independent terms with weights 1, -2, 1
    kept(second) / 6f64.sqrt()
}

/// [`scatter`] where what swings is not to be seen as noise.
pub(crate) fn scatter_of_ringing(values: &[f64], counts: impl Fn(&[f64]) -> bool) -> f64 {
    rings::scatter(values, &counts, scatter(values, &counts))
}

/// Standard deviation of a normal number of which the sizes are `sizes`, by the smaller four fifths: a mean, since the median of values
/// on the steps of a converter is a step itself, a quarter off where a step is half the noise.
fn kept(mut sizes: Vec<f64>) -> f64 {
    sizes.sort_by(f64::total_cmp);
    let kept = &sizes[..sizes.len() - sizes.len() / 5];
    // their mean over sigma for a normal distribution
    kept.iter().sum::<f64>() / kept.len() as f64 / 0.558_61
}

/// A converter coarser than the noise shows one value nearly always: its rounding error is then the same in all rows, which
/// together say no more than one. The standard deviation that gives them that weight; 0 for any other channel.
fn stuck(problem: &Problem, n: usize) -> f64 {
    let (mut pairs, mut equal, mut gap) = (0, 0, f64::INFINITY);
    for record in problem.records.iter().filter(|record| !record.repeated) {
        let shown: Vec<f64> = record.measured[n].iter().copied().filter(|v| v.is_finite()).collect();
        if record.settled {
            // a meter that shows one value for all points tells the step that the file states, or its last digit
            let is_one = shown.windows(2).all(|pair| pair[0] == pair[1]);
            gap = gap.min(if is_one {
                few::digit(problem, record, n)
            } else {
                f64::INFINITY
            });
        }
        let whole = record.measured[n].windows(2);
        for pair in whole.filter(|pair| pair.iter().all(|v| v.is_finite())) {
            pairs += 1;
            match (pair[1] - pair[0]).abs() {
                0.0 => equal += 1,
                step => gap = gap.min(step),
            }
        }
    }
    let is_stuck = gap.is_finite() && f64::from(equal) > STUCK * f64::from(pairs);
    if is_stuck {
        gap / 12f64.sqrt() * f64::from(pairs).sqrt()
    } else {
        0.0
    }
}

/// How much more a sum over the records scatters than independent white noise would: noise that is the same in several
/// records, and noise that is correlated in time.
#[must_use]
pub fn inflation(problem: &Problem, residual: &[f64]) -> f64 {
    let (mut shared, mut pairs) = (0.0, 0.0);
    let (mut lagged, mut total, mut count) = (vec![0.0; LAGS], 0.0, 0);
    for n in 0..CHANNELS {
        let all: Vec<Vec<f64>> = (0..problem.records.len())
            .map(|record| channel(problem, residual, record, n))
            .collect();
        for (k, a) in all.iter().enumerate() {
            total += dot(a, a);
            count += a.iter().filter(|value| **value != 0.0).count();
            for (lag, sum) in lagged.iter_mut().enumerate() {
                *sum += a.iter().zip(a.iter().skip(lag + 1)).map(|(x, y)| x * y).sum::<f64>();
            }
            for b in &all[..k] {
                // of differences: a slow error of the model is alike in all records and no noise
                let (da, db) = (differences(a), differences(b));
                let scale = (dot(&da, &da) * dot(&db, &db)).sqrt();
                if scale > 0.0 {
                    shared += dot(&da, &db) / scale;
                    pairs += 1.0;
                }
            }
        }
    }
    let rho = if pairs > 0.0 { shared / pairs } else { 0.0 };
    let records = problem.records.len() as f64;
    // three standard deviations of the correlation of so many rows of white noise: twenty lags of thirty settled points would add up to more than
    // any noise, and .2 and .05 are those of 250 rows and of 3600, below which no noise is known to be that white
    let by_chance = 3.0 / (count.max(1) as f64).sqrt();
    let same = if rho > by_chance.max(0.2) {
        1.0 + rho * (records - 1.0)
    } else {
        1.0
    };
    let slow: f64 = lagged
        .iter()
        .map(|sum| sum / total.max(1e-300))
        .filter(|rho| *rho > by_chance.max(0.05))
        .sum();
    // beyond 4 it is no noise but structure, and must not hide itself
    same * (1.0 + 2.0 * slow).clamp(1.0, 4.0)
}

fn differences(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|w| w[1] - w[0]).collect()
}

/// What is left in a residual, for each channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Left {
    /// Mean square; 1 for noise.
    pub square: f64,
    /// Mean square of block means times the block's length; 1 for white noise.
    pub slow: f64,
    /// Number of blocks.
    pub blocks: usize,
    /// Correlation of neighbours.
    pub lag1: f64,
    /// Mean.
    pub mean: f64,
}

/// What is left in one channel of one record.
#[must_use]
pub fn left(values: &[f64]) -> Left {
    let counted: Vec<f64> = values.iter().copied().filter(|v| *v != 0.0).collect();
    let n = counted.len().max(1) as f64;
    let square = dot(&counted, &counted) / n;
    let blocks: Vec<f64> = counted
        .chunks_exact(BLOCK)
        .map(|block| {
            let mean = block.iter().sum::<f64>() / BLOCK as f64;
            mean * mean * BLOCK as f64
        })
        .collect();
    let neighbours: f64 = counted.windows(2).map(|w| w[0] * w[1]).sum();
    Left {
        square,
        slow: blocks.iter().sum::<f64>() / blocks.len().max(1) as f64,
        blocks: blocks.len(),
        lag1: neighbours / dot(&counted, &counted).max(1e-300),
        mean: counted.iter().sum::<f64>() / n,
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::scatter;

    /// Twelve uniform numbers of a linear congruential generator make a normal one.
    pub(crate) fn normal(state: &mut u64) -> f64 {
        let uniform = |_| {
            *state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (*state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..12).map(uniform).sum()
    }

    #[test]
    fn the_steps_of_a_converter_hardly_change_the_noise_that_is_seen() {
        let mut state = 7;
        for step in [0.01, 0.3, 0.6, 0.8, 1.0] {
            let each = (0..40).map(|_| {
                let values: Vec<f64> = (0..240).map(|_| (normal(&mut state) / step).round() * step).collect();
                scatter(&values, |_| true)
            });
            let all: Vec<f64> = each.collect();
            // Sheppard: rounding adds a twelfth of the square of the step
            let expected = (1.0f64 + step * step / 12.0).sqrt();
            let mean = all.iter().sum::<f64>() / 40.0 / expected;
            let spread = (all.iter().map(|seen| (seen / expected - mean).powi(2)).sum::<f64>() / 40.0).sqrt();
            assert!(
                (mean - 1.0).abs() < 0.04 && spread < 0.1,
                "step {step}: {mean} with {spread}"
            );
        }
    }

    #[test]
    fn rare_leaps_hardly_change_the_noise_that_is_seen() {
        let mut state = 7;
        let values: Vec<f64> = (0..1000)
            .map(|n| normal(&mut state) + if n % 100 == 0 { 50.0 } else { 0.0 })
            .collect();
        assert!((scatter(&values, |_| true) - 1.0).abs() < 0.15);
    }
}

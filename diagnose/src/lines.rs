//! Lines in what is left, up to half of the sampling rate: a dither, a limit cycle, pick-up. Block means do not see them, and beside the
//! noise they need not make a channel any louder.
//!
//! ```text
//! residual ─ pieces of 128 rows, Hann ─ power of each frequency, over all pieces of all records ─ over that of its neighbours
//! ```
//!
//! Of white noise each power is exponential (Bartlett 1948), and a sum over independent pieces has a gamma distribution. So the
//! chance that noise makes the strongest sum is known.

use std::f64::consts::TAU;

use crate::fit::State;
use crate::level::ACCURACY;
use crate::noise::channel;
use crate::problem::Problem;
use crate::record::CHANNEL_NAMES;
use crate::shape::Structure;

/// Rows of a piece. 78 Hz at 10 kHz: a line that wanders by less stays whole, and a record of 130 rows has a piece.
const PIECE: usize = 128;
/// Lowest frequency, as a share of the sampling rate: what is slower block means of ten rows see.
const LOWEST: f64 = 0.1;
/// Neighbours to each side that make the level of a frequency; the nearest two hold what the window spreads.
const NEIGHBOURS: usize = 10;
const NEAREST: usize = 3;
/// Chance that noise makes a line in one of the four channels of a diagnosis. 1 in 1000: one in a hundred of the diagnoses of a set
/// of 200 would be two.
const FALSE_ALARM: f64 = 1e-3;

/// Lines that stand out of the noise, the strongest of each channel.
#[must_use]
pub fn of(problem: &Problem, null: &State, state: &State) -> Vec<Structure> {
    (0..CHANNEL_NAMES.len())
        .filter_map(|n| line(problem, null, state, n))
        .collect()
}

fn line(problem: &Problem, null: &State, state: &State, n: usize) -> Option<Structure> {
    let mut sums = vec![0.0; PIECE / 2];
    let mut before = vec![0.0; PIECE / 2];
    let (mut pieces, mut loudest) = (0, Vec::new());
    for (index, record) in problem.records.iter().enumerate() {
        // a coarse converter leaves patterns that are none of the converter's
        let coarse = record.lattice[n] > 1.5 * problem.sigma[n];
        if record.settled || !record.dense || coarse {
            continue;
        }
        let own = powers(&channel(problem, &state.residual, index, n));
        for power in &own {
            add(&mut sums, power);
        }
        for power in powers(&channel(problem, &null.residual, index, n)) {
            add(&mut before, &power);
        }
        pieces += own.len();
        let mut all = vec![0.0; PIECE / 2];
        own.iter().for_each(|power| add(&mut all, power));
        loudest.push((index, all, own.len()));
    }
    if pieces == 0 {
        return None;
    }
    let first = (LOWEST * PIECE as f64).ceil() as usize;
    let tried = (PIECE / 2 - first) as f64 * CHANNEL_NAMES.len() as f64;
    let over = |bin: usize| {
        // what the model's accuracy leaves of a line that was explained is none
        (sums[bin] - ACCURACY * ACCURACY * before[bin]) / level(&sums, bin) * pieces as f64
    };
    let bin = (first..PIECE / 2).max_by(|a, b| over(*a).total_cmp(&over(*b)))?;
    if tail(over(bin), pieces) * tried > FALSE_ALARM {
        return None;
    }
    let (index, _, own) = loudest.iter().max_by(|a, b| a.1[bin].total_cmp(&b.1[bin]))?;
    let record = &problem.records[*index];
    let frequency = bin as f64 / PIECE as f64 / problem.bases.t_sw;
    // a sine of amplitude A has the power A^2 L / 4 in a window of length L that is scaled to keep the noise's power 1, times the
    // window's gain of 2/3 for lines
    let excess = (sums[bin] - level(&sums, bin)).max(0.0) / pieces as f64;
    let amplitude = (excess * 4.0 / PIECE as f64 * 1.5).sqrt() * problem.sigma[n];
    let values = channel(problem, &state.residual, *index, n);
    let left = crate::noise::left(&values);
    let unit = crate::record::CHANNEL_UNITS[n];
    Some(Structure {
        record: record.name.clone(),
        channel: CHANNEL_NAMES[n],
        mean_square: left.square,
        slow: left.slow,
        correlation: left.lag1,
        shape: format!(
            "a line near {} of about {}, {:.0} times the noise there, in {own} pieces of {PIECE} rows{}",
            crate::words::si(frequency, "Hz"),
            crate::words::si(amplitude, unit),
            over(bin) / pieces as f64,
            if is_quarter(bin) {
                ": a dither of four periods"
            } else {
                ""
            },
        ),
    })
}

/// A quarter of the sampling rate: two periods up and two down.
fn is_quarter(bin: usize) -> bool {
    bin.abs_diff(PIECE / 4) <= 1
}

fn add(sums: &mut [f64], power: &[f64]) {
    for (sum, power) in sums.iter_mut().zip(power) {
        *sum += power;
    }
}

/// The power of each frequency in each piece; of white noise of size 1 it is 1 in the mean.
fn powers(values: &[f64]) -> Vec<Vec<f64>> {
    let window: Vec<f64> = (0..PIECE)
        .map(|n| (0.5 - 0.5 * libm::cos(TAU * (n as f64 + 0.5) / PIECE as f64)) * (8.0f64 / 3.0).sqrt())
        .collect();
    let turns: Vec<(f64, f64)> = (0..PIECE)
        .map(|n| {
            let angle = TAU * n as f64 / PIECE as f64;
            (libm::sin(angle), libm::cos(angle))
        })
        .collect();
    let of = |piece: &[f64]| -> Vec<f64> {
        let bin = |k: usize| {
            let (mut sine, mut cosine) = (0.0, 0.0);
            for (n, (value, weight)) in piece.iter().zip(&window).enumerate() {
                let (s, c) = turns[k * n % PIECE];
                sine += value * weight * s;
                cosine += value * weight * c;
            }
            (sine * sine + cosine * cosine) / PIECE as f64
        };
        (0..PIECE / 2).map(bin).collect()
    };
    values.chunks_exact(PIECE).map(of).collect()
}

/// The median of the neighbours: one line among them, or two, do not lift it.
fn level(sums: &[f64], bin: usize) -> f64 {
    let near = (bin.saturating_sub(NEIGHBOURS)..(bin + NEIGHBOURS + 1).min(sums.len()))
        .filter(|other| other.abs_diff(bin) >= NEAREST)
        .map(|other| sums[other]);
    let mut near: Vec<f64> = near.collect();
    near.sort_by(f64::total_cmp);
    near[near.len() / 2].max(f64::MIN_POSITIVE)
}

/// Chance that a sum of `count` exponential powers of mean 1 exceeds `sum`.
fn tail(sum: f64, count: usize) -> f64 {
    let sum = sum.max(0.0);
    let mut term = libm::exp(-sum);
    let mut all = term;
    for k in 1..count {
        term *= sum / k as f64;
        all += term;
    }
    all.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_is_that_of_the_gamma_distribution() {
        // tables: chi-square of 2 k degrees is twice such a sum; 18.307 is the 95 % point of ten
        assert!((tail(18.307 / 2.0, 5) - 0.05).abs() < 1e-4);
        assert!((tail(3.0, 1) - (-3.0f64).exp()).abs() < 1e-15);
        assert_eq!(tail(0.0, 7), 1.0);
    }

    #[test]
    fn white_noise_has_power_one_and_a_sine_its_own() {
        let mut state = 5u64;
        let mut normal = || {
            let uniform = |_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            };
            (0..12).map(uniform).sum::<f64>()
        };
        let noise: Vec<f64> = (0..PIECE * 200).map(|_| normal()).collect();
        let all = powers(&noise);
        let mean = all.iter().map(|power| power[20]).sum::<f64>() / all.len() as f64;
        assert!((mean - 1.0).abs() < 0.2, "{mean}");
        let sine: Vec<f64> = (0..PIECE).map(|n| 0.5 * (TAU * 0.25 * n as f64).sin()).collect();
        let power = powers(&sine)[0][PIECE / 4];
        assert!((power - 0.25 * PIECE as f64 / 4.0 / 1.5).abs() < 0.1, "{power}");
    }
}

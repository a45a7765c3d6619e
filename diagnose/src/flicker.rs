//! A meter whose noise is less than a digit: it shows one value in most rows, and the digit beside it now and then.
//!
//! ```text
//! meter   ·····'····'·,·····'···     most rows are one and the same digit
//! load    ──────────────────────     no step at any of them
//! ```
//! The middle of the differences from row to row is 0 there, and so is any estimate of noise that rests on middles.

use std::f64::consts::PI;

use measured::is_metered;
use plant::Load;

use crate::slopes::{LoadStep, load_steps};

/// Share of second differences that are 0 from which on values flicker. Noise of half a digit leaves a fifth of them at 0, and hides the digit.
const TIED: f64 = 0.2;
/// Second differences of a flicker, in digits: one row up between two that are down by one makes 4.
const MOST_DIGITS: f64 = 4.5;
/// Differences below this share of a digit are none but for the binary form of decimal numbers.
const SAME: f64 = 1e-3;
/// A change of so many standard deviations of the difference of two rows is a step.
const STEP: f64 = 4.0;

/// Standard deviation of the noise of values on steps of `digit` that are alike in most rows; NaN for others.
pub(crate) fn noise(values: &[f64], digit: f64) -> f64 {
    if digit.is_nan() || digit <= 0.0 {
        return f64::NAN;
    }
    let second = values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs() / digit);
    // a larger one is a step of the signal
    let small: Vec<f64> = second.filter(|d| *d <= MOST_DIGITS).collect();
    let tied = small.iter().filter(|d| **d < SAME).count() as f64;
    if small.len() < 5 || tied < TIED * small.len() as f64 {
        return f64::NAN;
    }
    // three independent terms with weights 1, -2, 1. A mean square, since no middle tells how often the digit beside is shown
    let square = small.iter().map(|d| d * d).sum::<f64>() / small.len() as f64;
    digit * (square / 6.0).sqrt()
}

/// Most values of a meter that goes between digits beside each other: with more a signal moves across them, and their rounding evens out.
const FEW: usize = 4;
/// Share of rows that are another value between two of one: a flicker has many, a load of levels none.
const SINGLE: f64 = 0.05;

/// The digit of a meter that flickers between a few; 0 for any other.
pub(crate) fn digit(measured: &[f64]) -> f64 {
    let shown: Vec<f64> = measured.iter().copied().filter(|v| v.is_finite()).collect();
    let mut values = shown.clone();
    values.sort_by(f64::total_cmp);
    values.dedup();
    let gaps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let least = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    let single = shown.windows(3).filter(|w| w[0] == w[2] && w[1] != w[0]).count();
    // one apart but for their decimal form
    let beside = gaps.iter().all(|gap| (gap / least - 1.0).abs() < 0.05);
    let is_flicker = (2..=FEW).contains(&values.len()) && beside && single as f64 > SINGLE * shown.len() as f64;
    if is_flicker { least } else { 0.0 }
}

/// How far the mean of a meter that flickers may lie beside the truth: noise below a digit does not even its rounding out. 0 for any other.
// the first harmonic of the sawtooth of rounding, behind normal noise: digit / pi exp(-2 pi^2 (sigma / digit)^2)
pub(crate) fn bias(measured: &[f64]) -> f64 {
    let digit = digit(measured);
    let noise = noise(measured, digit);
    if digit <= 0.0 || noise.is_nan() {
        return 0.0;
    }
    // less the most that rounding adds to it: between two digits a quarter, as of a coin, whatever the noise is
    let square = ((noise / digit).powi(2) - 0.25).max(0.0);
    digit / PI * libm::exp(-2.0 * PI * PI * square)
}

/// Steps of a load; what its meter's last digit does is none, where the load is driven by the meter.
pub(crate) fn steps(load: &[Load]) -> Vec<LoadStep> {
    let steps = load_steps(load);
    let within = within(load);
    let is_step = |step: &LoadStep| {
        let (old, new) = (load[step.first - 1], load[step.last]);
        let others = (old.conductance, old.power) != (new.conductance, new.power);
        others || (old.current - new.current).abs() > within
    };
    steps.into_iter().filter(is_step).collect()
}

/// The largest change of a load's current that is a flicker of its meter, A; 0 where it steps alone.
fn within(load: &[Load]) -> f64 {
    let changes: Vec<f64> = load
        .windows(2)
        .map(|pair| (pair[1].current - pair[0].current).abs())
        .filter(|change| *change > 0.0)
        .collect();
    let current: Vec<f64> = load.iter().map(|load| load.current).collect();
    // a staircase of one digit each, or a load that is pulsed, steps
    if !is_metered(&current) {
        return 0.0;
    }
    // digits written as decimals are one apart but for their binary form
    let digit = changes.iter().copied().fold(f64::INFINITY, f64::min);
    let noise = noise(&current, digit);
    if noise.is_nan() {
        return 0.0;
    }
    (STEP * 2f64.sqrt() * noise).max((1.0 + SAME) * digit)
}

#[cfg(test)]
mod tests {
    use plant::Load;

    use super::{noise, steps};
    use crate::noise::tests::normal;

    /// A level that steps from 2 to 3.5 to 2.5, with noise and a last digit.
    fn metered(sigma: f64, digit: f64, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let level = |n: usize| [2.0, 3.5, 2.5][n / 200];
        (0..600)
            .map(|n| ((level(n) + sigma * normal(&mut state)) / digit).round() * digit)
            .collect()
    }

    /// The oracle is the scatter about the levels, which are known here.
    #[test]
    fn the_noise_of_a_flicker_is_its_scatter_about_its_levels() {
        for (sigma, digit) in [(0.004, 0.01), (0.003, 0.01), (0.02, 0.05), (0.0005, 0.001)] {
            for seed in 1..6 {
                let values = metered(sigma, digit, seed);
                let off = |(n, v): (usize, &f64)| (v - [2.0, 3.5, 2.5][n / 200]).powi(2);
                let true_noise = (values.iter().enumerate().map(off).sum::<f64>() / 600.0).sqrt();
                let seen = noise(&values, digit);
                assert!(
                    (seen / true_noise - 1.0).abs() < 0.2,
                    "{sigma} {digit} {seed}: {seen} of {true_noise}"
                );
            }
        }
        // noise of two digits is no flicker
        assert!(noise(&metered(0.02, 0.01, 3), 0.01).is_nan());
    }

    #[test]
    fn the_mean_of_a_flicker_lies_beside_the_truth_by_no_more_than_its_bias() {
        for (sigma, digit) in [(0.26, 1.0), (0.3, 1.0), (0.35, 1.0)] {
            for off in [0.05, 0.15, 0.25, 0.35, 0.45] {
                let mut state = 11;
                let values: Vec<f64> = (0..20_000)
                    .map(|_| (off + sigma * normal(&mut state)).round())
                    .collect();
                assert_eq!(super::digit(&values), digit);
                let beside = (values.iter().sum::<f64>() / 20_000.0 - off).abs();
                let bias = super::bias(&values);
                assert!(
                    beside < 1.3 * bias + 0.01 && bias < 0.32,
                    "{sigma} {off}: {beside}, bias {bias}"
                );
            }
        }
        let levels: Vec<f64> = (0..300).map(|n| f64::from(n / 100)).collect();
        assert_eq!(
            (super::digit(&levels), super::bias(&levels)),
            (0.0, 0.0),
            "levels are no flicker"
        );
    }

    #[test]
    fn a_flicker_is_no_step_and_a_step_beside_it_is_one() {
        for seed in 1..6 {
            let load: Vec<Load> = metered(0.004, 0.01, seed).into_iter().map(Load::current).collect();
            let rows: Vec<usize> = steps(&load).iter().map(|step| step.last).collect();
            assert!(
                rows.len() == 2 && rows[0].abs_diff(200) < 3 && rows[1].abs_diff(400) < 3,
                "{seed}: {rows:?}"
            );
        }
        let clean: Vec<Load> = (0..200).map(|n| Load::current(2.0 + 0.01 * (n / 20) as f64)).collect();
        let pulsed: Vec<Load> = (0..200).map(|n| Load::current([5.0, 5.4][n / 7 % 2])).collect();
        assert_eq!(steps(&pulsed).len(), 28, "so do pulses");
        assert_eq!(steps(&clean).len(), 9, "small steps of a load that was set stay steps");
    }
}

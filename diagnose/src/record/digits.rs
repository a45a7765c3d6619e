//! The steps of a converter, from the digits of its values.

use super::channels::FEWEST;

/// The last digit written.
pub fn last_digit(decimals: u32) -> f64 {
    (0..decimals).fold(1.0, |digit, _| digit / 10.0)
}

/// Digits that a value may have: binary64 has no whole numbers one apart beyond 2^53.
const MOST_DIGITS: f64 = 9_007_199_254_740_992.0;

/// The whole number of last digits of which all values are multiples apart, if it is more than one and enough values say so.
fn whole_step(values: &[f64], digit: f64) -> Option<f64> {
    let count = |v: &f64| {
        let count = (v / digit).round();
        (count.abs() <= MOST_DIGITS).then_some(count as i64)
    };
    let counts: Vec<i64> = values
        .iter()
        .filter(|v| v.is_finite())
        .map(count)
        .collect::<Option<_>>()?;
    let first = *counts.first()?;
    let common = counts
        .iter()
        .fold(0, |common, count| divisor(common, (count - first).abs()));
    let mut distinct = counts.clone();
    distinct.sort_unstable();
    distinct.dedup();
    (common > 1 && distinct.len() >= 5 && counts.len() >= FEWEST).then_some(common as f64 * digit)
}

fn divisor(a: i64, b: i64) -> i64 {
    if b == 0 { a } else { divisor(b, a % b) }
}

/// The step of which all values are multiples: a whole number of the last digit written, or at least five times it.
pub fn lattice(values: &[f64], decimals: u32) -> f64 {
    let digit = last_digit(decimals);
    if let Some(step) = whole_step(values, digit) {
        return step;
    }
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let gaps: Vec<f64> = sorted
        .windows(2)
        .map(|v| v[1] - v[0])
        // between one digit and two: the same value, written twice
        .filter(|gap| *gap > 1.5 * digit)
        .collect();
    let smallest = gaps.iter().copied().fold(f64::INFINITY, f64::min);
    // five digits, of which rounding may take half a one
    if sorted.len() < FEWEST || gaps.len() < 5 || smallest < 4.5 * digit {
        return 0.0;
    }
    let (low, high) = (sorted[0], sorted[sorted.len() - 1]);
    // rounding of the written digits: the step is known ever better over a longer span
    let mut step = smallest;
    for gap in &sorted {
        let count = ((gap - low) / step).round();
        // two values, each off by half a digit, and as much again for the step so far
        if count >= 1.0 && (gap - low - count * step).abs() <= 1.01 * digit * 2.0 {
            step = (gap - low) / count;
        }
    }
    let near = |value: &f64| {
        let count = ((value - low) / step).round();
        // two values, each off by half a digit, and a fifth for the step
        (value - low - count * step).abs() <= 1.2 * digit
    };
    if sorted.iter().all(near) && high > low {
        step
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_beyond_all_whole_numbers_have_no_step_of_the_last_digit() {
        let ends = [f64::MAX, f64::MIN, 1e300, -1e300, 3.0, 5.0, 7.0];
        let values: Vec<f64> = ends.iter().copied().cycle().take(4 * FEWEST).collect();
        assert_eq!(whole_step(&values, 1.0), None);
        let small: Vec<f64> = (0..4 * FEWEST).map(|n| (n % 9) as f64 * 0.4).collect();
        assert!((whole_step(&small, 0.1).unwrap() - 0.4).abs() < 1e-12);
    }
}

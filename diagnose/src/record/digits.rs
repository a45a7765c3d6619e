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

/// Steps that may lie between the two values that are nearest to each other.
// five gaps of which none is one step are rare, and two numbers of steps without a common factor begin with 2 and 3
const STEPS_OF_SMALLEST: [f64; 3] = [1.0, 2.0, 3.0];
/// Smallest step in last digits: below it what is rounded lies on any lattice.
const LEAST_DIGITS: f64 = 4.5;
/// A value on a lattice is off it by half a digit, and by a fifth for what the lattice itself is not known to.
const OFF_DIGITS: f64 = 0.7;

/// The step of which all values are multiples apart: a whole number of the last digit written, or at least five times it.
pub fn lattice(values: &[f64], decimals: u32) -> f64 {
    let digit = last_digit(decimals);
    if let Some(step) = whole_step(values, digit) {
        return step;
    }
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let count = sorted.len();
    // between one digit and two: the same value, written twice
    sorted.dedup_by(|next, kept| *next - *kept <= 1.5 * digit);
    if count < FEWEST || sorted.len() < 6 {
        return 0.0;
    }
    let smallest = sorted.windows(2).map(|v| v[1] - v[0]).fold(f64::INFINITY, f64::min);
    let steps = STEPS_OF_SMALLEST.iter().map(|steps| smallest / steps);
    steps
        .take_while(|step| *step >= LEAST_DIGITS * digit)
        .find_map(|step| step_near(&sorted, step, digit))
        .unwrap_or(0.0)
}

/// The step near `first` of which the `sorted` values are multiples apart, all within what rounding to a `digit` leaves open. It is known the
/// better, the longer the span: spans come from the shortest on, each with the number of steps that those before it leave possible.
fn step_near(sorted: &[f64], first: f64, digit: f64) -> Option<f64> {
    // two values, each off by half a digit
    let [mut low, mut high] = [first - 1.01 * digit, first + 1.01 * digit];
    for apart in (0..usize::BITS)
        .map(|power| 1 << power)
        .take_while(|apart| *apart < sorted.len())
    {
        let mut spans: Vec<f64> = sorted.windows(apart + 1).map(|v| v[apart] - v[0]).collect();
        spans.sort_by(f64::total_cmp);
        for span in spans {
            let [most, least] = [(span + digit) / low, (span - digit) / high];
            let steps = (0.5 * (most + least)).round();
            // two numbers of steps are possible: this span tells nothing yet
            if steps < 1.0 || most - least >= 1.0 {
                continue;
            }
            low = low.max((span - 1.01 * digit) / steps);
            high = high.min((span + 1.01 * digit) / steps);
            if low > high {
                return None;
            }
        }
    }
    let step = 0.5 * (low + high);
    let base = sorted[0];
    let off: Vec<f64> = (sorted.iter())
        .map(|value| value - base - ((value - base) / step).round() * step)
        .collect();
    let ends = off
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(*v), b.max(*v)]);
    (ends[1] - ends[0] <= 2.0 * OFF_DIGITS * digit).then_some(step)
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

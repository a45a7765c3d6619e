//! The steps of a converter, from the digits of its values.

use std::collections::BTreeMap;

use super::channels::FEWEST;

/// The last digit written.
pub fn last_digit(decimals: u32) -> f64 {
    (0..decimals).fold(1.0, |digit, _| digit / 10.0)
}

/// Values of one decade from which on the most digits among them are those that are written: of so many one has a last digit other than 0, nine
/// times of ten each.
const OF_A_DECADE: usize = 3;

/// What the numbers of a column are rounded to, the same for all: the last digit of `decimals`; where digits count from the first on, as `%.7g` and
/// single precision write them, that of the largest number.
pub fn rounding(values: &[f64], decimals: u32) -> f64 {
    let written: Vec<f64> = (values.iter().copied())
        .filter(|v| v.is_finite() && *v != 0.0)
        .collect();
    let counted = of_significant_digits(&written).unwrap_or(0.0);
    let single = of_single_precision(&written).unwrap_or(0.0);
    last_digit(decimals).max(counted).max(single)
}

/// The last digit of the largest of the `written` numbers, if all decades show the same number of significant digits.
fn of_significant_digits(written: &[f64]) -> Option<f64> {
    let mut decades: BTreeMap<i32, (usize, i32)> = BTreeMap::new();
    for value in written {
        let (digits, exponent) = significant(*value)?;
        let (count, most) = decades.entry(exponent).or_default();
        *count += 1;
        *most = digits.max(*most);
    }
    let most = decades.values().map(|(_, most)| *most).max()?;
    let mut telling = decades.values().filter(|(count, _)| *count >= OF_A_DECADE);
    let is_counted = telling.clone().count() > 1 && telling.all(|(_, digits)| *digits == most);
    let largest = *decades.last_key_value()?.0;
    is_counted.then(|| 10f64.powi(largest + 1 - most))
}

/// Significant digits of a number, without zeros at its end, and its power of ten.
fn significant(value: f64) -> Option<(i32, i32)> {
    let text = format!("{:e}", value.abs());
    let (mantissa, exponent) = text.split_once('e')?;
    let digits = mantissa.bytes().filter(u8::is_ascii_digit).count();
    Some((i32::try_from(digits).ok()?, exponent.parse().ok()?))
}

/// The distance of the largest of the `written` numbers from the next one in single precision, if each is such a number; twice that, if each is the
/// shortest text of one, which is rounded once more.
#[allow(clippy::float_cmp, reason = "the very number that was written")]
fn of_single_precision(written: &[f64]) -> Option<f64> {
    let is_single = |value: &f64| f64::from(*value as f32) == *value;
    let is_its_text = |value: &f64| (*value as f32).to_string().parse() == Ok(*value);
    let largest = written.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    if largest == 0.0 || largest >= f64::from(f32::MAX) {
        return None;
    }
    let apart = f64::from(f32::EPSILON) * 2f64.powi(largest.log2().floor() as i32);
    match written.iter().all(is_single) {
        true => Some(apart),
        false => (written.iter())
            .all(|value| is_single(value) || is_its_text(value))
            .then_some(2.0 * apart),
    }
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

/// The step of which all values are multiples apart: a whole number of the last digit written, or at least five times what they are rounded to.
pub fn lattice(values: &[f64], decimals: u32) -> f64 {
    let digit = rounding(values, decimals);
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

    /// An instrument of seven bits, read off six decades and less as `write` has it.
    fn written(write: impl Fn(f64) -> f64) -> Vec<f64> {
        let code = |n: usize| 1 + (n * 37 + n * n * 11) % 127;
        (0..200).map(|n| write(code(n) as f64 * 7.5 / 128.0 * 1.01)).collect()
    }

    fn with_digits(digits: usize) -> impl Fn(f64) -> f64 {
        move |value| format!("{value:.*e}", digits - 1).parse().unwrap()
    }

    #[test]
    fn digits_that_count_from_the_first_on_are_those_of_the_largest_number() {
        for digits in [4, 7, 9] {
            let values = written(with_digits(digits));
            let decimals = values.iter().map(|v| v.to_string().len() as u32 - 2).max().unwrap();
            let expected = 10f64.powi(1 - digits as i32);
            assert!((rounding(&values, decimals) / expected - 1.0).abs() < 1e-9, "{digits}");
            let step = 7.5 / 128.0 * 1.01;
            let found = lattice(&values, decimals);
            assert!((found - step).abs() < expected, "{digits}: {found} {step}");
        }
    }

    #[test]
    fn single_precision_is_that_of_the_largest_number() {
        let step = 7.5 / 128.0 * 1.01;
        for write in [
            |v: f64| f64::from(v as f32),
            |v: f64| (v as f32).to_string().parse().unwrap(),
        ] {
            let values = written(write);
            let decimals = values.iter().map(|v| v.to_string().len() as u32 - 2).max().unwrap();
            let found = lattice(&values, decimals);
            assert!((found - step).abs() < 1e-6, "{found} {step}");
        }
    }

    #[test]
    fn digits_behind_the_point_are_those_that_are_written() {
        // on steps of a quarter no number has more digits than it needs, and large ones have as many behind the point as small ones
        let quarters: Vec<f64> = (1..200).map(|n| 0.25 * f64::from(n)).collect();
        assert!((rounding(&quarters, 2) - 0.01).abs() < 1e-12);
        let fixed: Vec<f64> = (1..200).map(|n| f64::from(n * 37 % 2000) / 1000.0).collect();
        assert!((rounding(&fixed, 3) - 0.001).abs() < 1e-12);
        assert_eq!(rounding(&[0.0, 0.0], 3), last_digit(3));
    }

    #[test]
    fn values_beyond_all_whole_numbers_have_no_step_of_the_last_digit() {
        let ends = [f64::MAX, f64::MIN, 1e300, -1e300, 3.0, 5.0, 7.0];
        let values: Vec<f64> = ends.iter().copied().cycle().take(4 * FEWEST).collect();
        assert_eq!(whole_step(&values, 1.0), None);
        let small: Vec<f64> = (0..4 * FEWEST).map(|n| (n % 9) as f64 * 0.4).collect();
        assert!((whole_step(&small, 0.1).unwrap() - 0.4).abs() < 1e-12);
    }
}

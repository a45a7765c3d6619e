//! Noise under a ring: what swings bends from row to row, and second differences take its bends for noise.
//!
//! ```text
//! order    white noise of 1    a sine of 1 at a tenth of the rate
//!   2             1                        0.11
//!   4             1                        0.012
//!   6             1                        0.0013
//! ```
//! A difference of a higher order hardly sees what swings below a sixth of the rate, where every filter of a converter does. It sees
//! noise that is not white less truly, too, so it is asked only where second differences themselves go on from row to row.

use super::kept;

/// Half the orders that are tried beside the second. A difference of the tenth needs eleven rows without a hole.
const HALVES: [usize; 4] = [2, 3, 4, 5];
/// Share of neighbouring second differences with one sign: that of white noise, whose neighbours have a correlation of -2/3, is
/// 1/2 - asin(2/3) / pi. Noise of which each row has half of the one before has 0.31 to 0.36, a ring alone nearly 1.
const WHITE: f64 = 0.268;
/// A ring may be there from this share on, where it makes the noise a twentieth too large, and so many standard deviations above that of
/// white noise.
const PERHAPS: f64 = 0.33;
const SIGMAS: f64 = 3.0;
/// It is there for sure from this share on, where it makes the noise a fifth too large. Below that it is asked whether orders four and six
/// tell the same, by this ratio: of noise with a memory the sixth tells 6 % less.
const RINGS: f64 = 0.42;
const SAME: f64 = 0.97;
/// Share of bends that the next but one goes on with, at least: half for a swing at an eighth of the rate, less for every faster one. A dither
/// at a quarter or a fifth of it is none that a higher order sees less of.
const SLOW: f64 = 0.42;
/// Fewest differences of a higher order: of fewer the smallest of several estimates is too small by itself.
const FEWEST: usize = 40;
/// The next order is asked as long as it tells this much less noise.
const LESS: f64 = 0.95;

/// `scatter` of values that ring, whose second differences show `second`; `second` for others.
pub(super) fn scatter(values: &[f64], counts: &impl Fn(&[f64]) -> bool, second: f64) -> f64 {
    let ([share, second_next], scatter) = alike(values, counts);
    let is_perhaps = second_next > SLOW && share > PERHAPS.max(WHITE + SIGMAS * scatter);
    let agree = || {
        let [four, six] = [2, 3].map(|half| of_order(values, counts, half));
        four.zip(six).is_some_and(|(four, six)| six > SAME * four)
    };
    if !is_perhaps || share < RINGS && !agree() {
        return second;
    }
    let mut least = second;
    for half in HALVES {
        // each is too high by what it sees of the ring; where the next says the same nothing of the ring is left in it
        match of_order(values, counts, half) {
            Some(next) if next < LESS * least => least = next,
            _ => break,
        }
    }
    least
}

/// Shares of bends that go on to the next row and to the one behind it, and how far the first may be off by chance where there is noise alone.
fn alike(values: &[f64], counts: &impl Fn(&[f64]) -> bool) -> ([f64; 2], f64) {
    let (mut pairs, mut alike) = (0.0, [0.0; 2]);
    for five in values.windows(5).filter(|five| counts(five)) {
        let bend = |at: usize| five[at] - 2.0 * five[at + 1] + five[at + 2];
        pairs += 1.0;
        for (next, alike) in alike.iter_mut().enumerate() {
            *alike += f64::from(u8::from(bend(0) * bend(next + 1) > 0.0));
        }
    }
    // neighbouring pairs share a bend: they scatter a little less than independent ones
    let count = f64::max(pairs, 1.0);
    (alike.map(|alike| alike / count), (WHITE * (1.0 - WHITE) / count).sqrt())
}

/// Standard deviation by differences of the order 2 `half`.
fn of_order(values: &[f64], counts: &impl Fn(&[f64]) -> bool, half: usize) -> Option<f64> {
    let order = 2 * half;
    let mut weights = vec![1.0];
    for _ in 0..order {
        let (before, after) = ([&weights[..], &[0.0]].concat(), [&[0.0], &weights[..]].concat());
        weights = before.iter().zip(&after).map(|(a, b)| a - b).collect();
    }
    let size = weights.iter().map(|weight| weight * weight).sum::<f64>().sqrt();
    let windows = values.windows(order + 1).filter(|window| counts(window));
    let differences: Vec<f64> = windows
        .map(|window| window.iter().zip(&weights).map(|(v, w)| v * w).sum::<f64>().abs() / size)
        .collect();
    (differences.len() >= FEWEST).then(|| kept(differences))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::tests::normal;

    fn seen(values: &[f64]) -> f64 {
        super::super::scatter_of_ringing(values, |_| true)
    }

    /// A ring of many times the noise, begun anew every 80 rows.
    fn ringing(amplitude: f64, rate: f64, rows: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        (0..rows)
            .map(|n| {
                let since = (n % 80) as f64;
                amplitude * (-since / 40.0).exp() * (TAU * rate * since).cos() + normal(&mut state)
            })
            .collect()
    }

    #[test]
    fn a_ring_hardly_changes_the_noise_that_is_seen() {
        for (amplitude, rate) in [(10.0, 0.03), (30.0, 0.06), (50.0, 0.1), (20.0, 0.13), (100.0, 0.08)] {
            for rows in [160, 400, 1200] {
                let all: Vec<f64> = (1..9).map(|seed| seen(&ringing(amplitude, rate, rows, seed))).collect();
                let mean = all.iter().sum::<f64>() / 8.0;
                assert!(
                    (0.9..1.2).contains(&mean),
                    "{amplitude} at {rate}, {rows} rows: {mean} of {all:?}"
                );
            }
        }
    }

    #[test]
    fn noise_without_a_ring_is_seen_as_before() {
        let mut kept = 0;
        for seed in 1..40 {
            let mut state = seed;
            let white: Vec<f64> = (0..300).map(|_| normal(&mut state)).collect();
            // each with half of the one before it: the colour of a filter, which is no ring
            let coloured: Vec<f64> = white.windows(2).map(|pair| pair[1] + 0.5 * pair[0]).collect();
            for values in [&white[..60], &white] {
                let second = super::super::scatter(values, |_| true);
                assert_eq!(seen(values), second, "{seed}, {} rows", values.len());
            }
            let second = super::super::scatter(&coloured, |_| true);
            assert!(
                seen(&coloured) > 0.8 * second,
                "{seed}: {} of {second}",
                seen(&coloured)
            );
            kept += usize::from(seen(&coloured) == second);
        }
        assert!(kept > 30, "{kept} of 39");
    }

    #[test]
    fn a_ring_as_small_as_its_noise_is_seen_too() {
        // a steady one of which the bends are a third of those of the noise
        let one = |seed: u64| {
            let mut state = seed;
            let values: Vec<f64> = (0..400)
                .map(|n| 6.0 * (TAU * 0.055 * f64::from(n)).cos() + normal(&mut state))
                .collect();
            seen(&values)
        };
        let mean = (1..21).map(one).sum::<f64>() / 20.0;
        assert!((0.95..1.06).contains(&mean), "{mean}");
    }

    #[test]
    fn a_dither_of_two_to_six_rows_is_no_ring() {
        for period in 2..=6 {
            let mut state = 3;
            let dither = |n: u32| 4.0 * (TAU * f64::from(n) / f64::from(period) + 0.4).cos();
            let values: Vec<f64> = (0..300).map(|n| normal(&mut state) + dither(n)).collect();
            assert_eq!(seen(&values), super::super::scatter(&values, |_| true), "{period} rows");
        }
    }
}

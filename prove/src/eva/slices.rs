//! Slices of the memory of a low-pass, in which intervals show that a step stays within its bound.
//!
//! `y + k(x - y)` with `low <= x <= high` and y in a slice from `from` to `to`, where an interval takes the two y for two numbers:
//!
//! ```text
//!  -M ────────── low ─────────────── high ────────── M
//!      from + k(low - to) >= -M      to + k(high - from) <= M        each slice needs both
//! ```
//!
//! So slices are thin near an end of the bound that x nearly reaches, and long where x keeps away from it.

use policy::{Expr, Input, Policy};

/// Largest number of slices of a word; with so many all its runs together take a quarter of a minute.
const MOST_SLICES: usize = 320;

/// More than what one operation rounds by: of the magnitude of what it gives (contract section 1).
const ROUNDING: f64 = 1.0 / 1_048_576.0;

/// Least and largest number.
pub(super) type Ends = (f64, f64);

/// The ends of slices from -bound to bound, ascending; `None` where too many would be needed. Where x lies may be unknown: M says how
/// large it is at most.
pub(super) fn slices(bound: f64, input: Option<Ends>, gain: f64) -> Option<Vec<f64>> {
    // M exceeds the largest magnitude of x by 2^-19 of itself (contract section 1). A quarter of that is room: the ends of slices are
    // rounded outwards, by a 32nd each in binary32, and what is multiplied and subtracted to nearest
    let excess = bound / f64::from(1 << 19);
    let (room, rounded) = (excess / 4.0, excess / 16.0);
    let (low, high) = input.unwrap_or((excess - bound, bound - excess));
    // how far x keeps away from either end
    let above = bound - (high + room);
    let below = bound + (low - room);
    // distances from the upper end, growing
    let mut distances = vec![0.0];
    let mut distance: f64 = 0.0;
    while distance < 2.0 * bound {
        if distances.len() > MOST_SLICES {
            return None;
        }
        // beyond 8 times few slices are saved
        let of_upper = ((distance - rounded).max(0.0) / gain + above).min((8.0 * distance).max(above));
        let rest = 2.0 * bound - distance;
        let of_lower = match rest <= below {
            true => 0.0,
            false => (gain * (rest - below) + rounded).max(rest / 8.0),
        };
        let next = of_upper.min(2.0 * bound - of_lower);
        if next <= distance {
            return None;
        }
        distance = next;
        distances.push(distance);
    }
    let ends = distances.iter().rev().map(|distance| (bound - distance).max(-bound));
    Some(ends.collect())
}

/// Where a source lies (contract section 3), rounding included.
pub(super) fn source(expr: &Expr, policy: &Policy) -> Ends {
    let wider = |(low, high): Ends| (low - low.abs() * ROUNDING, high + high.abs() * ROUNDING);
    match expr {
        Expr::Input(Input::Signal(index)) => {
            let range = policy.signals.get(*index).map(|signal| signal.range);
            range.map_or((0.0, 0.0), |range| (range.low, range.high))
        }
        Expr::Input(Input::PreviousDuty | Input::PreviousCommand | Input::OutputDuty(_) | Input::OutputCommand(_)) => {
            (0.0, 1.0)
        }
        Expr::Input(Input::Estimate(index, estimate)) => {
            let range = policy.observers.get(*index).map(|observer| observer.range(*estimate));
            wider(range.map_or((0.0, 0.0), |range| (range.low, range.high)))
        }
        Expr::Constant(value) => wider((*value, *value)),
        Expr::Neg(x) => {
            let (low, high) = source(x, policy);
            (-high, -low)
        }
        Expr::Add(x, y) => {
            let (x, y) = (source(x, policy), source(y, policy));
            wider((x.0 + y.0, x.1 + y.1))
        }
        Expr::Sub(x, y) => {
            let (x, y) = (source(x, policy), source(y, policy));
            wider((x.0 - y.1, x.1 - y.0))
        }
        // constant and product are rounded
        Expr::Scale(by, x) => {
            let (low, high) = source(x, policy);
            let (low, high) = (by * low, by * high);
            wider(wider((low.min(high), low.max(high))))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_cover_the_whole_range_in_order() {
        let most = 3.0 / (1.0 + ROUNDING) / (1.0 + ROUNDING);
        for (low, high, count) in [(-most, most, 26), (0.0, most, 16), (-0.5, 0.5, 8)] {
            let ends = slices(3.0, Some((low, high)), 0.1).expect("few");
            assert_eq!((ends[0], ends[ends.len() - 1]), (-3.0, 3.0));
            assert!(ends.windows(2).all(|pair| pair[0] < pair[1]), "{ends:?}");
            assert!(ends.len() < count, "{low} {high}: {}", ends.len());
        }
        assert_eq!(slices(3.0, None, 0.9999), None);
    }

    /// By the rule in binary64: from the slice one step stays within the bound.
    #[test]
    fn every_slice_is_kept() {
        // X from M as in section 1
        let (bound, growth) = (100.0, 1.0 + 1.0 / 1_048_576.0);
        let most = bound / growth / growth;
        // with 0.99 too many would be needed, which is said instead
        assert_eq!(slices(100.0, None, 0.99), None);
        for gain in [0.001, 0.02, 0.1, 0.12, 0.13, 0.3, 0.5, 0.8, 0.9, 0.93] {
            for (least, largest) in [(-most, most), (0.0, most), (-most, -20.0), (-30.0, 99.0), (1.0, 2.0)] {
                let ends = slices(bound, Some((least, largest)), gain).expect("few");
                for pair in ends.windows(2) {
                    // ends as binary32 has them, outwards
                    let low = f64::from((pair[0] as f32).next_down()).max(-bound);
                    let high = f64::from((pair[1] as f32).next_up()).min(bound);
                    // with what the difference, the product and the gain are rounded by
                    let rounded = |x: f64| x + x.abs() * 3.0 / f64::from(1 << 24);
                    // the bound is a number of the format, so what is not above it is not rounded above it
                    let next = high + gain * rounded(largest - low);
                    assert!(next <= bound, "{gain} {least} {largest} {pair:?} {next}");
                    let next = low - gain * rounded(high - least);
                    assert!(next >= -bound, "{gain} {least} {largest} {pair:?} {next}");
                }
            }
        }
    }
}

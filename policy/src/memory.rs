//! How large the words of the filter memories can be in any numeric format (contract section 1).
//!
//! A check at run time compares with these bounds, so they must never be too small. They may be larger than what a filter
//! holds: magnitudes are added where intervals would cancel, which is sound in binary64 as well as in binary32.

use crate::model::{Estimate, Expr, Filter, Input, Interval, Observer, Policy};

/// More than what one operation can round up by, in either format.
// 16 unit roundoffs of binary32
const GROWTH: f64 = 1.0 + 1.0 / 1_048_576.0;
/// More than a few roundings of subnormal numbers.
// 1e-40 is 70,000 steps of 2^-149
const TINY: f64 = 1e-40;
/// Unit roundoff of binary32.
const UNIT: f64 = 1.0 / 16_777_216.0;

/// Bound of the magnitude of every word, in the order of the state.
#[must_use]
pub fn memory_bounds(policy: &Policy) -> Vec<f64> {
    let mut words: Vec<f64> = policy.observers.iter().flat_map(|own| observed(own, policy)).collect();
    for feature in &policy.features {
        let mut x = source(&feature.source, policy);
        for filter in &feature.filters {
            x = through(filter, x, policy.sample_period, &mut words);
        }
    }
    words
}

/// Words of an observer: its estimates behind their clamps, and the signals that it keeps.
fn observed(observer: &Observer, policy: &Policy) -> Vec<f64> {
    let magnitude = |range: Interval| range.low.abs().max(range.high.abs());
    // the ends of a clamp are rounded to nearest
    let estimates = Estimate::STATE.map(|estimate| magnitude(observer.range(estimate)) * GROWTH);
    let kept = observer
        .remembered()
        .map(|index| source(&Expr::Input(Input::Signal(index)), policy));
    estimates.into_iter().chain(kept).collect()
}

fn source(expr: &Expr, policy: &Policy) -> f64 {
    match expr {
        Expr::Input(Input::Signal(index)) => {
            let signal = policy.signals.get(*index);
            // the parser made the index from a signal that is there
            signal.map_or(0.0, |signal| signal.range.low.abs().max(signal.range.high.abs()))
        }
        // duties are within 0..1, those of a continuous head in either arithmetic: `contract::continuous` has seen to it
        Expr::Input(Input::PreviousDuty | Input::PreviousCommand | Input::OutputDuty(_) | Input::OutputCommand(_)) => {
            1.0
        }
        Expr::Input(Input::Estimate(index, estimate)) => {
            let range = policy.observers.get(*index).map(|observer| observer.range(*estimate));
            range.map_or(0.0, |range| range.low.abs().max(range.high.abs()) * GROWTH)
        }
        Expr::Constant(value) => value.abs() * GROWTH,
        Expr::Neg(x) => source(x, policy),
        Expr::Add(x, y) | Expr::Sub(x, y) => (source(x, policy) + source(y, policy)) * GROWTH,
        Expr::Scale(by, x) => by.abs() * source(x, policy) * GROWTH * GROWTH,
    }
}

/// Adds the words of a filter whose input is within +-x; gives the bound of its output.
fn through(filter: &Filter, x: f64, period: f64, words: &mut Vec<f64>) -> f64 {
    match *filter {
        Filter::Delay { samples } => {
            words.extend(std::iter::repeat_n(x, samples));
            x
        }
        Filter::BackwardDifference => {
            words.push(x);
            2.0 * x / period * GROWTH * GROWTH * GROWTH
        }
        // it passes its input by rounding errors only
        Filter::LowPass { .. } => {
            let y = x * GROWTH * GROWTH + TINY;
            words.push(y);
            y
        }
        Filter::FilteredDerivative { time_constant } => {
            let (sum, width) = (time_constant + period, 2.0 * x);
            // section 1: e = 10 u X/s + ..., with a width of 2X
            let error = 5.0 * UNIT * width / sum + TINY * (1.0 + 1.0 / sum);
            // what one step rounds off adds up over all steps that p keeps
            let decay = 1.0 - time_constant / sum - 3.0 * UNIT;
            let y = match decay > 0.0 {
                // `bounds` has shown that the value stays within binary32, in every format
                true => ((width / sum + error / decay) * GROWTH).min(f64::from(f32::MAX)),
                false => f64::from(f32::MAX),
            };
            words.extend([x, y]);
            y
        }
        Filter::MovingAverage { samples } => {
            words.extend(std::iter::repeat_n(x, samples.saturating_sub(1)));
            // n - 1 sums, k and the product with it round n + 1 times: less than 2 n units and the growth
            x * (1.0 + 2.0 * UNIT * samples as f64) * GROWTH
        }
        Filter::Integrator { min, max, .. } => {
            let y = min.abs().max(max.abs()) * GROWTH;
            words.push(y);
            y
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: f64 = 1e-4;

    /// Words and bound behind a filter for an input within +-10.
    fn of(filter: &Filter) -> (Vec<f64>, f64) {
        let mut words = Vec::new();
        let y = through(filter, 10.0, T, &mut words);
        (words, y)
    }

    /// The constants of section 1, written out.
    fn g() -> f64 {
        1.0 + f64::powi(2.0, -20)
    }

    fn assert_near(found: f64, expected: f64) {
        // binary64 in another order of operations
        assert!((found / expected - 1.0).abs() < 1e-14, "{found} {expected}");
    }

    /// The table of section 1 of the numeric contract, row by row.
    #[test]
    fn the_bounds_are_those_of_the_contract() {
        assert_eq!(of(&Filter::Delay { samples: 3 }), (vec![10.0; 3], 10.0));
        let (words, y) = of(&Filter::BackwardDifference);
        assert_eq!(words, [10.0]);
        assert_near(y, g() * g() * g() * 20.0 / T);
        let (words, y) = of(&Filter::LowPass { time_constant: 1e-3 });
        assert_near(y, g() * g() * 10.0);
        assert_eq!(words, [y]);
        // of an input that is 0 the rounding of subnormal numbers is left
        let mut words = Vec::new();
        assert_eq!(
            through(&Filter::LowPass { time_constant: 1e-3 }, 0.0, T, &mut words),
            1e-40
        );
        let (words, y) = of(&Filter::MovingAverage { samples: 4 });
        assert_eq!(words, [10.0; 3]);
        assert_near(y, g() * (1.0 + 8.0 * f64::powi(2.0, -24)) * 10.0);
        // a leak takes of the sum, and the clamp holds what is left
        for leak in [1.0, 0.5] {
            let integrator = Filter::Integrator {
                min: -3.0,
                max: 2.0,
                initial: 0.0,
                leak,
            };
            let (words, y) = of(&integrator);
            assert_near(y, 3.0 * g());
            assert_eq!(words, [y]);
        }
    }

    /// `g (2X/s + e/d)` with `s = tau + T`, `e = 10 u X/s + 1e-40 (1 + 1/s)`, `d = 1 - tau/s - 3u`.
    #[test]
    fn a_filtered_derivative_adds_up_its_rounding_errors() {
        let (tau, u) = (9e-4, f64::powi(2.0, -24));
        let s = tau + T;
        let (words, y) = of(&Filter::FilteredDerivative { time_constant: tau });
        let (e, d) = (10.0 * u * 10.0 / s + 1e-40 * (1.0 + 1.0 / s), 1.0 - tau / s - 3.0 * u);
        assert_near(y, g() * (20.0 / s + e / d));
        assert_eq!(words, [10.0, y]);
        // of an input that is 0 the second term of e alone: 1e-40 (1 + 1000) / 0.1
        let mut words = Vec::new();
        let y = through(&Filter::FilteredDerivative { time_constant: tau }, 0.0, T, &mut words);
        assert!((y / 1.001e-36 - 1.0).abs() < 1e-4, "{y}");
        // a memory that does not decay holds any number of the format
        let slow = Filter::FilteredDerivative { time_constant: 1e6 };
        assert_eq!(of(&slow).1, f64::from(f32::MAX));
    }
}

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
    let estimates = Estimate::ALL.map(|estimate| magnitude(observer.range(estimate)) * GROWTH);
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
        Expr::Input(Input::PreviousDuty | Input::PreviousCommand) => 1.0,
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

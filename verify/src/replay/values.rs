//! What comparison and reasons ask of a row of values.

use policy::{Expr, Feature, Filter, Input, Policy};

/// Smallest and largest.
pub(super) fn ends(values: &[f64]) -> [f64; 2] {
    let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    [lowest, highest]
}

/// What binary32 leaves of a difference of two large numbers, as a share of them.
// a rounding of 2^-24 in the samples and in the sum: a settled converter's error is made of little else
const CANCELLED: f64 = 1.2e-7;

/// How far apart two values of a feature may be.
pub(super) fn allowed(policy: &Policy, feature: &Feature, logged: &[f64], tolerance: f64) -> f64 {
    let largest = logged.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let most = feature.bound.low.abs().max(feature.bound.high.abs());
    (tolerance * largest).max(CANCELLED * most.max(terms(policy, feature)))
}

/// What the terms of a feature's source amount to at most behind filters and scale: the clip hides how large they are, and the
/// rounding that they leave.
fn terms(policy: &Policy, feature: &Feature) -> f64 {
    let through = |gain: f64, filter: &Filter| gain * gain_of(filter, policy.sample_period);
    (feature.filters.iter()).fold(magnitude(policy, &feature.source), through) * feature.scale.abs()
}

fn magnitude(policy: &Policy, expression: &Expr) -> f64 {
    let of = |expression: &Expr| magnitude(policy, expression);
    match expression {
        Expr::Input(Input::Signal(index)) => {
            (policy.signals.get(*index)).map_or(0.0, |signal| signal.range.low.abs().max(signal.range.high.abs()))
        }
        // duties are at most 1; the roundings of an observer are those of its own memory, which the bound of the feature has
        Expr::Input(_) => 1.0,
        Expr::Constant(value) => value.abs(),
        Expr::Neg(inner) => of(inner),
        Expr::Add(a, b) | Expr::Sub(a, b) => of(a) + of(b),
        Expr::Scale(factor, inner) => factor.abs() * of(inner),
    }
}

/// How much of a rounding that is another one in each period a filter lets through.
fn gain_of(filter: &Filter, period: f64) -> f64 {
    match *filter {
        Filter::Delay { .. } | Filter::LowPass { .. } | Filter::MovingAverage { .. } => 1.0,
        Filter::BackwardDifference => 2.0 / period,
        Filter::FilteredDerivative { time_constant } => 2.0 / (time_constant + period),
        // without a leak it goes on for as long as the log; the clamp bounds what is allowed then
        Filter::Integrator { leak, .. } if leak < 1.0 => period / (1.0 - leak),
        Filter::Integrator { .. } => period,
    }
}

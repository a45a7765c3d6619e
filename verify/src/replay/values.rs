//! What comparison and reasons ask of a row of values.

use policy::Feature;

/// Smallest and largest.
pub(super) fn ends(values: &[f64]) -> [f64; 2] {
    let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    [lowest, highest]
}

/// What binary32 leaves of a difference of two large numbers, as a share of what the feature may be at most.
// a rounding of 2^-24 in the samples and in the sum: a settled converter's error is made of little else
const CANCELLED: f64 = 1.2e-7;

/// How far apart two values of a feature may be.
pub(super) fn allowed(feature: &Feature, logged: &[f64], tolerance: f64) -> f64 {
    let largest = logged.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let most = feature.bound.low.abs().max(feature.bound.high.abs());
    (tolerance * largest).max(CANCELLED * most)
}

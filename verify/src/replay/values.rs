//! What comparison and reasons ask of a row of values.

/// Smallest and largest.
pub(super) fn ends(values: &[f64]) -> [f64; 2] {
    let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    [lowest, highest]
}

/// How far apart two values of a feature may be.
pub(super) fn allowed(logged: &[f64], tolerance: f64) -> f64 {
    tolerance * logged.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()))
}

//! Ranges of numbers.

use serde::Serialize;

/// Closed interval `[low, high]`, `low <= high`, both finite.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

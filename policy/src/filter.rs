//! The filters of a feature.

use serde::Serialize;

/// Discrete-time filter (contract section 4).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Filter {
    /// Pure delay.
    Delay {
        /// Sample periods, 1 to [`crate::limits::MAX_LINE`].
        samples: usize,
    },
    /// Difference to the sample before, over T.
    BackwardDifference,
    /// First order, backward Euler.
    LowPass {
        /// tau in seconds, > 0.
        time_constant: f64,
    },
    /// Derivative with first-order low-pass, backward Euler.
    FilteredDerivative {
        /// tau in seconds, > 0.
        time_constant: f64,
    },
    /// Mean of the last samples.
    MovingAverage {
        /// Number of samples, 2 to [`crate::limits::MAX_LINE`].
        samples: usize,
    },
    /// Integral over time, clamped.
    Integrator {
        /// Lower clamp.
        min: f64,
        /// Upper clamp.
        max: f64,
        /// Value at priming, within the clamp.
        initial: f64,
        /// What is kept of the value before in each period, above 0 and at most 1; 1 keeps all.
        // left out where it is 1, so that contracts without it keep their digest
        #[serde(skip_serializing_if = "is_one")]
        leak: f64,
    },
}

// serde hands over a reference
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_one(value: &f64) -> bool {
    *value == 1.0
}

//! First-order low-pass before the sampler, `1 / (2 pi f)` of its corner frequency `f`.
//!
//! With ripple it also turns into a bias: the filtered ripple at the sampling instant is not its mean.

use crate::entry::{Effect, Way, of_each_sensor};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "sensor_low_pass",
    meaning: "low-pass of a sensor",
    needs: Way::Full,
    parameters: of_each_sensor!(
        low_pass,
        ("s", "s"),
        // corners of 160 kHz to 1.6 kHz
        "time constant of the low-pass",
        (0.0, 10.0),
        (1e-6, 1e-4),
        0.0
    ),
};

//! First-order low-pass before the sampler, `1 / (2 pi f)` of its corner frequency `f`.
//!
//! With ripple it also turns into a bias: the filtered ripple at the sampling instant is not its mean.

use crate::catalogue::{Effect, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "sensor_low_pass",
    meaning: "low-pass of a sensor",
    parameters: &[
        number!(
            sensors.v_out.low_pass,
            "sensors.v_out.low_pass",
            "s",
            "time constant of the low-pass",
            (0.0, 10.0),
            (1e-6, 1e-4),
            0.0
        ),
        number!(
            sensors.i_l.low_pass,
            "sensors.i_l.low_pass",
            "s",
            "time constant of the low-pass",
            (0.0, 10.0),
            (1e-6, 1e-4),
            0.0
        ),
        number!(
            sensors.i_out.low_pass,
            "sensors.i_out.low_pass",
            "s",
            "time constant of the low-pass",
            (0.0, 10.0),
            (1e-6, 1e-4),
            0.0
        ),
        number!(
            sensors.v_in.low_pass,
            "sensors.v_in.low_pass",
            "s",
            "time constant of the low-pass",
            (0.0, 10.0),
            (1e-6, 1e-4),
            0.0
        ),
    ],
};

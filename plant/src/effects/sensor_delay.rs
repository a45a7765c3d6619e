//! Age of what a sensor shows: shown(t) = true(t - delay), after the low-pass.
//!
//! For a sampler that comes late use `pwm.sampling_phase`.

use crate::catalogue::{Effect, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "sensor_delay",
    meaning: "age of what a sensor shows",
    parameters: &[
        number!(
            sensors.v_out.delay,
            "sensors.v_out.delay",
            "s",
            "age of what is shown",
            (0.0, 1.0),
            (1e-6, 5e-5),
            0.0
        ),
        number!(
            sensors.i_l.delay,
            "sensors.i_l.delay",
            "s",
            "age of what is shown",
            (0.0, 1.0),
            (1e-6, 5e-5),
            0.0
        ),
        number!(
            sensors.i_out.delay,
            "sensors.i_out.delay",
            "s",
            "age of what is shown",
            (0.0, 1.0),
            (1e-6, 5e-5),
            0.0
        ),
        number!(
            sensors.v_in.delay,
            "sensors.v_in.delay",
            "s",
            "age of what is shown",
            (0.0, 1.0),
            (1e-6, 5e-5),
            0.0
        ),
    ],
};

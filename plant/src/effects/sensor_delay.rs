//! Age of what a sensor shows: shown(t) = true(t - delay), after the low-pass.
//!
//! For a sampler that comes late use `pwm.sampling_phase`.

use crate::entry::{Effect, Way, of_each_sensor};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "sensor_delay",
    meaning: "age of what a sensor shows",
    needs: Way::Walk,
    // from a conversion to half a period at 10 kHz
    parameters: of_each_sensor!(delay, ("s", "s"), "age of what is shown", (0.0, 1.0), (1e-6, 5e-5), 0.0),
};

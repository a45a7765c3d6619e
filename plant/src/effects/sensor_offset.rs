//! Offset of a sensor: shown = (gain * true) + offset.

use crate::catalogue::{Effect, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "sensor_offset",
    meaning: "offset of a sensor",
    parameters: &[
        number!(
            sensors.v_out.offset,
            "sensors.v_out.offset",
            "V",
            "shown when the true value is 0",
            (-1e5, 1e5),
            (-0.5, 0.5),
            0.0
        ),
        number!(
            sensors.i_l.offset,
            "sensors.i_l.offset",
            "A",
            "shown when the true value is 0",
            (-1e5, 1e5),
            (-0.5, 0.5),
            0.0
        ),
        number!(
            sensors.i_out.offset,
            "sensors.i_out.offset",
            "A",
            "shown when the true value is 0",
            (-1e5, 1e5),
            (-0.5, 0.5),
            0.0
        ),
        number!(
            sensors.v_in.offset,
            "sensors.v_in.offset",
            "V",
            "shown when the true value is 0",
            (-1e5, 1e5),
            (-0.5, 0.5),
            0.0
        ),
    ],
};

//! Gain of a sensor: shown = gain * true (+ offset).
//!
//! A gain of v_out scales the mapping's coefficient a, one of i_out scales b.

use crate::catalogue::{Effect, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "sensor_gain",
    meaning: "gain of a sensor",
    parameters: &[
        number!(
            sensors.v_out.gain,
            "sensors.v_out.gain",
            "1",
            "shown over true",
            (0.0, 10.0),
            (0.97, 1.03),
            1.0
        ),
        number!(
            sensors.i_l.gain,
            "sensors.i_l.gain",
            "1",
            "shown over true",
            (0.0, 10.0),
            (0.97, 1.03),
            1.0
        ),
        number!(
            sensors.i_out.gain,
            "sensors.i_out.gain",
            "1",
            "shown over true",
            (0.0, 10.0),
            (0.97, 1.03),
            1.0
        ),
        number!(
            sensors.v_in.gain,
            "sensors.v_in.gain",
            "1",
            "shown over true",
            (0.0, 10.0),
            (0.97, 1.03),
            1.0
        ),
    ],
};

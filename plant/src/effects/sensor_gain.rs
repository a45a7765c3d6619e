//! Gain of a sensor: shown = gain * true (+ offset).
//!
//! A gain of v_out scales the mapping's coefficient a, one of i_out scales b.

use crate::entry::{Effect, Way, of_each_sensor};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "sensor_gain",
    meaning: "gain of a sensor",
    needs: Way::Batch,
    // two resistors of 1 % each, and a reference of as much
    parameters: of_each_sensor!(gain, ("1", "1"), "shown over true", (0.0, 10.0), (0.97, 1.03), 1.0),
};

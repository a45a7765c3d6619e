//! Offset of a sensor: shown = (gain * true) + offset.

use crate::entry::{Effect, Way, of_each_sensor};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "sensor_offset",
    meaning: "offset of a sensor",
    needs: Way::Batch,
    parameters: of_each_sensor!(
        offset,
        ("V", "A"),
        // some steps of the quantisation
        "shown when the true value is 0",
        (-1e5, 1e5),
        (-0.5, 0.5),
        0.0
    ),
};

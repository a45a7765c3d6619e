//! The analog-digital converter: rounded to the nearest multiple of `lsb`, half up.

use crate::entry::{Effect, Way, of_each_sensor};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "sensor_quantisation",
    meaning: "step of the analog-digital converter",
    needs: Way::Batch,
    // 12 bits over 4 to 400 V or A
    parameters: of_each_sensor!(lsb, ("V", "A"), "step of the converter", (0.0, 1e4), (1e-3, 0.1), 0.0),
};

/// The code of `value`, in the sensor's unit.
#[inline]
pub(crate) fn round(value: f64, lsb: f64) -> f64 {
    if lsb == 0.0 {
        return value;
    }
    (value / lsb + 0.5).floor() * lsb
}

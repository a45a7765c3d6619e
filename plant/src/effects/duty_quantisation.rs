//! The modulator counts: the duty is rounded to the nearest multiple of `duty_lsb`, half up.

use crate::entry::{Effect, Way, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "duty_quantisation",
    meaning: "step of the duty",
    needs: Way::Batch,
    parameters: &[number!(
        pwm.duty_lsb,
        "1",
        // counters of 10,000 down to 200 counts a period
        "step of the duty",
        (0.0, 0.5),
        (1e-4, 5e-3),
        0.0
    )],
};

/// The duty the modulator makes of `duty`.
#[inline(always)]
pub(crate) fn round(duty: f64, lsb: f64) -> f64 {
    if lsb == 0.0 {
        return duty;
    }
    // a step that does not divide 1 can round a duty of 1 above it: 0.4 gives 1.2
    ((duty / lsb + 0.5).floor() * lsb).min(1.0)
}

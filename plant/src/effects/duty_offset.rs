//! A constant that the modulator adds to the duty, for example a comparator's offset or a dead band that shortens the pulse at both
//! ends. The carrier decides which edges move: with a centred one, each by half.
//!
//! Moves the settled point like a late edge of `duty_offset t_sw`; of dead time and delays of one edge it differs in the instants of
//! the edges alone, so that samples away from the middle of the on-interval tell them apart by the ripple.

use crate::entry::{Effect, Way, number};
use crate::parameters::Pwm;

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "duty_offset",
    meaning: "constant that the modulator adds to the duty",
    needs: Way::Batch,
    parameters: &[number!(
        pwm.duty_offset,
        "1",
        // from counts of a counter to dead bands of some per cent
        "added to every duty but 0 and 1",
        (-0.5, 0.5),
        (-0.05, 0.05),
        0.0
    )],
};

/// The duty with the offset; a switch that stays off or on has no edges that could move.
#[inline(always)]
pub(crate) fn shift(duty: f64, pwm: &Pwm) -> f64 {
    if pwm.duty_offset == 0.0 || duty <= 0.0 || duty >= 1.0 {
        return duty;
    }
    (duty + pwm.duty_offset).clamp(0.0, 1.0)
}

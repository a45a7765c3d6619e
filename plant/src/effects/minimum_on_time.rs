//! Pulses shorter than the minimum on-time are left out, or lengthened to it.

use crate::entry::{Effect, Way, number};
use crate::parameters::{Pwm, ShortPulse};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "minimum_on_time",
    meaning: "shortest pulse of the switch",
    needs: Way::Batch,
    parameters: &[number!(
        pwm.min_on_time,
        "s",
        // from controllers of small MOSFETs to drivers of IGBT modules
        "shortest pulse of the switch",
        (0.0, 1.0),
        (1e-7, 3e-6),
        0.0
    )],
};

/// The duty that is left of `duty`.
#[inline(always)]
pub(crate) fn limit(duty: f64, pwm: &Pwm, t_sw: f64) -> f64 {
    // a duty of 0 asks for no pulse, so there is none to lengthen
    if pwm.min_on_time == 0.0 || duty * t_sw >= pwm.min_on_time || duty == 0.0 {
        return duty;
    }
    match pwm.short_pulse {
        ShortPulse::Drop => 0.0,
        // the minimum may be longer than the period: its range is in seconds and knows no frequency
        ShortPulse::Extend => (pwm.min_on_time / t_sw).min(1.0),
    }
}

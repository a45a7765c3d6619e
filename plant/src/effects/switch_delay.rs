//! Turn-on and turn-off delay of driver and switch.
//!
//! `turn_on_delay - turn_off_delay` over the period is lost duty; slow turn-off gains duty.

use crate::entry::{Effect, Way, number};
use crate::parameters::Parameters;

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "switch_delay",
    meaning: "delay between the command and the switch",
    needs: Way::Walk,
    parameters: &[
        number!(
            switch.turn_on_delay,
            "s",
            // from MOSFETs at 10 ohm of gate resistance to IGBT modules; those turn off with a tail
            "from the command to the current when turning on",
            (0.0, 1e-3),
            (2e-8, 1e-6),
            0.0
        ),
        number!(
            switch.turn_off_delay,
            "s",
            "from the command to no current when turning off",
            (0.0, 1e-3),
            (2e-8, 2e-6),
            0.0
        ),
    ],
};

/// Delays of the rising and the falling edge, s.
pub(crate) fn edges(p: &Parameters) -> (f64, f64) {
    (p.switch.turn_on_delay, p.switch.turn_off_delay)
}

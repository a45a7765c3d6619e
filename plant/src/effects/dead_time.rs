//! Dead time: each switch is told to turn on that much later than the other was told to turn off.
//!
//! A diode leg loses `dead_time / t_sw` of duty. In a synchronous leg the body diodes carry the current meanwhile: the
//! duty is lost while the current is positive and kept while it is negative.

use crate::entry::{Effect, Way, number};
use crate::parameters::Parameters;

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "dead_time",
    meaning: "time during which neither switch is told to conduct",
    needs: Way::Walk,
    parameters: &[number!(
        switch.dead_time,
        "s",
        // from drivers of small MOSFETs to those of IGBT modules
        "how much later a switch is told to turn on",
        (0.0, 1e-3),
        (5e-8, 4e-6),
        0.0
    )],
};

/// How much later a rising edge comes, s.
pub(crate) fn hold_back(p: &Parameters) -> f64 {
    p.switch.dead_time
}

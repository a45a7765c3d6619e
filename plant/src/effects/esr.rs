//! Equivalent series resistance of the output capacitor: `v_out = v_c + esr (i_l - i_out)`.
//!
//! Ripple in phase with the current, a step of `esr di` at a load step, a zero at `1/(esr C)`; damps a constant-power
//! load only when in series with it. No trace in the mean.

use crate::entry::{Effect, Way, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "esr",
    meaning: "series resistance of the output capacitor",
    needs: Way::Full,
    parameters: &[number!(
        capacitor.esr,
        "ohm",
        // from film and polymer to aluminium electrolytic capacitors, of which a few uF for 400 V have tens of ohm
        "series resistance",
        (0.0, 100.0),
        (0.002, 0.3),
        0.0
    )],
};

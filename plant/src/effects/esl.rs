//! Equivalent series inductance of the output capacitor: `v_out = v_c + esr i_c + esl di_c/dt`.
//!
//! With the inductor it divides the step of the switch node: v_out jumps by `v_in esl / (L + esl)` at every edge. The
//! derivative of the load current without cable is left out: it decays within `esl G`, nanoseconds.

use crate::entry::{Effect, Way, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "esl",
    meaning: "series inductance of the output capacitor",
    needs: Way::Full,
    parameters: &[number!(
        capacitor.esl,
        "H",
        // from a chip on its pads to a can with leads and wires of its own
        "series inductance",
        (0.0, 1e-4),
        (5e-9, 2e-7),
        0.0
    )],
};

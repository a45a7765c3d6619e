//! Source impedance and input capacitor. Without a capacitor the switch sees `v_in - resistance i` while it conducts;
//! with one, the source current and the capacitor's voltage are states.
//!
//! Lowers the output like a resistance of `resistance d^2` (with capacitor) and shows in `v_in`. The `v_in` reported
//! at an edge is that just before it.

use crate::entry::{Effect, Way, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "source_impedance",
    meaning: "impedance of the source and input capacitor",
    needs: Way::Full,
    parameters: &[
        number!(
            source.resistance,
            "ohm",
            // a laboratory supply with its wires, to a rectifier or a battery behind a fuse
            "series resistance",
            (0.0, 1e3),
            (0.01, 1.0),
            0.0
        ),
        number!(
            source.inductance,
            "H",
            // 1 uH a metre of two wires: a decimetre to the reach of a hall
            "series inductance; needs c_in",
            (0.0, 1.0),
            (1e-7, 1e-4),
            0.0
        ),
        // film at the leg to the electrolytic capacitor of a rectifier
        number!(source.c_in, "F", "input capacitor", (0.0, 10.0), (1e-5, 1e-2), 0.0),
        number!(
            source.esr_in,
            "ohm",
            // as of the output capacitor
            "series resistance of the input capacitor; needs c_in",
            (0.0, 100.0),
            (0.005, 0.2),
            0.0
        ),
    ],
};

//! Load cable: series L and R, and the capacitor at the load's terminals. `i_out` is the current into the cable, `v_out`
//! the voltage at the converter's side.
//!
//! A resonance of `1 / (2 pi sqrt(L C))`, and `resistance i` between converter and load.

use crate::entry::{Effect, Way, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "cable",
    meaning: "wires to the load and the capacitor at their end",
    needs: Way::Full,
    parameters: &[
        number!(
            cable.inductance,
            "H",
            // 1 uH a metre of two wires side by side: 0.2 to 5 m
            "inductance of both wires; needs capacitance",
            (0.0, 1e-2),
            (2e-7, 5e-6),
            0.0
        ),
        number!(
            cable.resistance,
            "ohm",
            // of those metres, in copper of 10 to 1.5 mm2
            "resistance of both wires; needs inductance",
            (0.0, 100.0),
            (0.002, 0.1),
            0.0
        ),
        number!(
            cable.capacitance,
            "F",
            // from ceramics to the electrolytic capacitor of an electronic load's input
            "capacitor at the load's terminals; needs inductance",
            (0.0, 1.0),
            (1e-6, 1e-3),
            0.0
        ),
    ],
};

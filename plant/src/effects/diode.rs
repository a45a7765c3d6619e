//! The diode's drop: `v_sw = -(v_f + r_d i)` while it conducts; also the body diodes of a synchronous leg.
//!
//! Lowers the output by `(1 - d) (v_f + r_d i)` (CCM) and ends the conduction earlier (DCM).

use crate::entry::{Effect, Way, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "diode",
    meaning: "forward voltage and resistance of the diode",
    needs: Way::Batch,
    parameters: &[
        // from Schottky to silicon carbide and fast silicon; a slope of those, and of body diodes
        number!(switch.v_f, "V", "forward voltage", (0.0, 100.0), (0.3, 2.0), 0.0),
        number!(
            switch.r_d,
            "ohm",
            "differential resistance",
            (0.0, 100.0),
            (0.001, 0.1),
            0.0
        ),
    ],
};

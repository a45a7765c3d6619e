//! On-resistance of the switches: `v_sw = v_in - r_ds_on i` while the upper one is on, `-r_ds_on_low i` while the lower
//! one of a synchronous leg is.
//!
//! Lowers the output by `d r_ds_on i` (CCM).

use crate::entry::{Effect, Way, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "switch_resistance",
    meaning: "on-resistance of the switches",
    needs: Way::Batch,
    parameters: &[
        number!(
            switch.r_ds_on,
            "ohm",
            // MOSFETs from 30 V to 650 V
            "on-resistance of the switch",
            (0.0, 100.0),
            (0.005, 0.5),
            0.0
        ),
        number!(
            switch.r_ds_on_low,
            "ohm",
            "on-resistance of the second switch of a synchronous leg",
            (0.0, 100.0),
            (0.005, 0.5),
            0.0
        ),
    ],
};

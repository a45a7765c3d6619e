//! Below `v_fold` a constant-power load is the resistor `v_fold^2 / P`: no real load draws unlimited current.

use crate::entry::{Effect, Way, detail};

/// Catalogue entry. Not an effect that can be absent: every plant has it.
pub const EFFECT: Effect = Effect {
    name: "cpl_fold",
    meaning: "voltage below which constant power becomes a resistor",
    needs: Way::Batch,
    parameters: &[detail!(
        load.v_fold,
        "V",
        // a share of the output, from which a load gives up its regulation
        "voltage of the fold",
        (1e-3, 1e5),
        (1.0, 50.0),
        5.0
    )],
};

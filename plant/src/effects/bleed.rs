//! A conductance that is always across the output, beside the set load; part of `i_out`.

use crate::entry::{Effect, Way, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "bleed",
    meaning: "conductance that is always across the output",
    needs: Way::Batch,
    // a bleeder of 1 kohm and more
    parameters: &[number!(load.bleed, "S", "conductance", (0.0, 1e3), (0.0, 1e-3), 0.0)],
};

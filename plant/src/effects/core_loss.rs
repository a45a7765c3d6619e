//! Core loss as a conductance across the inductance: the winding carries `i + g v_l`.
//!
//! A current step of `g v_in` at every edge, and slightly more damping. When the winding current ends (DCM), what the
//! inductance still holds (`g v_out`, milliamperes) is lost in the core at once.

use crate::entry::{Effect, Way, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "core_loss",
    meaning: "loss in the inductor's core",
    needs: Way::Full,
    parameters: &[number!(
        inductor.core_conductance,
        "S",
        // 0.1 to 5 W at 100 V across the inductance
        "conductance across the inductance",
        (0.0, 10.0),
        (1e-5, 5e-4),
        0.0
    )],
};

//! Resistance of the inductor's winding: `v_sw - v_out = L di/dt + dcr i`.
//!
//! Lowers the output by `dcr i` (CCM) and damps the LC resonance. In steady state it cannot be told from equal
//! changes of `r_ds_on` and `r_d`.

use crate::entry::{Effect, Way, number};
use crate::parameters::Inductor;

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "dcr",
    meaning: "resistance of the inductor's winding",
    needs: Way::Batch,
    parameters: &[number!(
        inductor.dcr,
        "ohm",
        // power inductors, from tens of microhenries to ten millihenries
        "winding resistance",
        (0.0, 100.0),
        (0.005, 0.5),
        0.0
    )],
};

/// What is in series with the inductance whatever the leg does, ohm; both circuits take it from here.
#[inline]
pub(crate) fn in_series(inductor: &Inductor) -> f64 {
    inductor.dcr
}

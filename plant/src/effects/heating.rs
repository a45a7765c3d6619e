//! Copper that warms: at a steady current `i` the winding has `dcr + heating i^2`.
//!
//! Its loss `R i^2` warms it in seconds to minutes, by which its resistance rises (0.39 % a kelvin). A run is shorter than that: the winding stays as warm
//! as the converter was where it began, and a settled point is one that has stood long enough. The current is the mean of the inductor's, as the load
//! draws it. Lowers the settled output by `heating i^3` (CCM); one run alone shows it as another `dcr`.

use crate::entry::{Effect, Way, number};
use crate::parameters::Parameters;

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "heating",
    meaning: "winding that warms with the current at which the converter stands",
    // what is remembered is the current at which a run began
    needs: Way::Step,
    parameters: &[number!(
        inductor.heating,
        "ohm/A^2",
        "rise of the winding's resistance with the square of its steady current",
        (0.0, 100.0),
        // a tenth of a winding's resistance at the paper's 2.5 A, and all of it
        (1e-3, 2e-2),
        0.0
    )],
};

/// What a winding has that is warm from `current` A.
pub(crate) fn warmed(p: &Parameters, current: f64) -> Parameters {
    let mut warm = p.clone();
    warm.inductor.dcr += p.inductor.heating * current * current;
    warm
}

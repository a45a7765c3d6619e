//! States that follow neither from the output voltage nor from the inductor's current: those of a cable and of an input filter.

use super::{Full, I_CABLE, I_L, STATES, States, V_CIN};

impl Full {
    /// Whether there are any.
    pub fn has_states_beside(&self) -> bool {
        self.has_cable || self.has_c_in
    }
}

/// States around another output voltage and inductor current that are `at_rest` around theirs: all but the inductor's swing beside those
/// `without_ripple` as they do there. `x` are the ones without ripple here. By how much the load's current and the input capacitor's
/// voltage then differ from those at rest, A and V.
pub(crate) fn swung(x: &mut States, at_rest: &States, without_ripple: &States) -> [f64; 2] {
    let differ = [I_CABLE, V_CIN].map(|n| x[n] - without_ripple[n]);
    for n in (0..STATES).filter(|n| *n != I_L) {
        x[n] += at_rest[n] - without_ripple[n];
    }
    differ
}

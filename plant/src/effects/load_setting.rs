//! The electronic load draws another current or power than it was set to; a resistor has another value than printed.

use crate::entry::{Effect, Way, number};
use crate::parameters::LoadBox;
use crate::signals::Load;

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "load_setting",
    meaning: "gain between the set and the drawn load",
    needs: Way::Batch,
    parameters: &[
        number!(
            load.setting_gain,
            "1",
            // resistors of 5 or 10 %; electronic loads are better
            "drawn over set current or power",
            (0.0, 10.0),
            (0.9, 1.1),
            1.0
        ),
        number!(
            load.resistor_gain,
            "1",
            "real over set conductance",
            (0.0, 10.0),
            (0.9, 1.1),
            1.0
        ),
    ],
};

/// What is drawn when `set` is set, the bleed included.
#[inline(always)]
pub(crate) fn drawn(load_box: &LoadBox, set: &Load) -> Load {
    Load {
        conductance: set.conductance * load_box.resistor_gain + load_box.bleed,
        current: set.current * load_box.setting_gain,
        power: set.power * load_box.setting_gain,
    }
}

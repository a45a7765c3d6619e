//! Regulation of a constant-power load: its current follows `P / v` with a first-order lag.
//!
//! 0 is the ideal, immediate load. A slow one behaves as a current sink in the first moments of a step.

use crate::entry::{Effect, Way, number};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "cpl_bandwidth",
    meaning: "lag of the constant-power regulation",
    needs: Way::Full,
    parameters: &[number!(
        load.cpl_time_constant,
        "s",
        // bandwidths of electronic loads, 16 kHz to 160 Hz
        "time constant of the regulation",
        (0.0, 10.0),
        (1e-5, 1e-3),
        0.0
    )],
};

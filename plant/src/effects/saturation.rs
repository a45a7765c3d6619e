//! The inductance falls with current: `L(i) = L0 (1 - k x^2 / (1 + x^2))`, x = i / i_sat.
//!
//! Differential inductance, v = L(i) di/dt. Half of the share k is lost at `i_sat`; k = 0 is the linear inductor.
//! More ripple at high current, a faster response there; nothing in steady state in CCM.

use crate::entry::{Effect, Way, detail, number};
use crate::parameters::Inductor;

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "saturation",
    meaning: "inductance that falls with current",
    needs: Way::Full,
    parameters: &[
        number!(
            inductor.saturation,
            "1",
            "share of the inductance that is lost far above i_sat",
            // something must be left: the steps of the full circuit are as short as the least inductance asks for
            (0.0, 0.95),
            // data sheets rate the current at a drop of 10 to 30 %; powder cores go on falling
            (0.1, 0.7),
            0.0
        ),
        detail!(
            inductor.i_sat,
            "A",
            "current at which half of that share is lost",
            (1e-3, 1e6),
            (2.0, 50.0),
            10.0
        ),
    ],
};

/// L(i) over L0.
#[inline]
pub(crate) fn relative_inductance(inductor: &Inductor, i: f64) -> f64 {
    // a rational law: one with an exponential would need libm, whose bits differ between machines
    let x = i / inductor.i_sat;
    let square = x * x;
    1.0 - inductor.saturation * square / (1.0 + square)
}

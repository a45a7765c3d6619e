//! The capacitance falls with voltage: `C(v) = C0 (1 - k x^2 / (1 + x^2))`, x = v / v_half.
//!
//! Differential capacitance, i = C(v) dv/dt, as ceramics of class II have it. More ripple and a deeper dip at higher
//! voltage; nothing in the mean. At one voltage it cannot be told from a smaller C.

use crate::entry::{Effect, Way, detail, number};
use crate::parameters::{Capacitor, Parameters};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "derating",
    meaning: "capacitance that falls with voltage",
    needs: Way::Full,
    parameters: &[
        number!(
            capacitor.derating,
            "1",
            "share of the capacitance that is lost far above v_half",
            // 1 is `C0 / (1 + x^2)`: at every voltage something is left
            (0.0, 1.0),
            // ceramics of class II at their rated voltage
            (0.1, 0.8),
            0.0
        ),
        detail!(
            capacitor.v_half,
            "V",
            "voltage at which half of that share is lost: C = C0 (1 - derating y / (1 + y)), y = (v / v_half)^2",
            (1e-3, 1e6),
            (5.0, 200.0),
            100.0
        ),
    ],
};

/// The least that is left of C0 while the converter works: at `BEYOND` times the source's voltage.
pub(crate) fn least(p: &Parameters) -> f64 {
    relative_capacitance(&p.capacitor, BEYOND * p.converter.v_in)
}

/// Output voltage over that of the source, beyond which nobody asks how accurate a step is.
// an undamped filter swings up to twice the source; boosts and buck-boosts of more than four times it are rare, and steps of a twentieth
// of a time constant leave room
const BEYOND: f64 = 4.0;

/// C(v) over C0.
#[inline]
pub(crate) fn relative_capacitance(capacitor: &Capacitor, v: f64) -> f64 {
    // a rational law, as of the inductance: no libm
    let x = v / capacitor.v_half;
    let square = x * x;
    1.0 - capacitor.derating * square / (1.0 + square)
}

//! Core loss as a conductance across the inductance: the winding carries `i + g v_l`, `g = g0 (|v_l| / v_in)^(n - 2)`.
//!
//! A current step of `g v_in` at every edge, and slightly more damping. When the winding current ends (DCM), what the
//! inductance still holds (`g v_out`, milliamperes) is lost in the core at once.
//! n is the power of the voltage with which the loss grows: 2 for a conductor, another one for a core that follows Steinmetz's law. Mean values
//! over a period know no voltage of an interval: the averaged model has the conductor.

use crate::entry::{Effect, Way, detail, number};
use crate::parameters::{Model, Parameters};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "core_loss",
    meaning: "loss in the inductor's core",
    needs: Way::Full,
    parameters: &[
        number!(
            inductor.core_conductance,
            "S",
            // 0.1 to 5 W at 100 V across the inductance
            "conductance across the inductance, at the source's voltage",
            (0.0, 10.0),
            (1e-5, 5e-4),
            0.0
        ),
        detail!(
            inductor.core_exponent,
            "1",
            "power of the voltage with which the loss grows: g = core_conductance (abs(v) / v_in)^(core_exponent - 2)",
            // from a current of one size, whatever the voltage, to twice the power of a conductor
            (1.0, 4.0),
            (1.5, 3.0),
            2.0
        ),
    ],
};

/// Below this share of the source's voltage the conductance stays as it is there: one that grows without bound towards no voltage would be a
/// short circuit. A thousandth of the voltage is that of no interval of a period.
const LEAST: f64 = 1e-3;

/// Whether the conductance is the same at every voltage.
#[inline]
pub(crate) fn is_linear(p: &Parameters) -> bool {
    let is_mean = p.converter.model == Model::Averaged;
    is_mean || p.inductor.core_conductance == 0.0 || p.inductor.core_exponent == 2.0
}

/// The conductance at a voltage `v` across the inductance, S.
// of the libm crate, which is Rust: the same bits on every machine
#[inline(never)]
pub(crate) fn conductance(p: &Parameters, v: f64) -> f64 {
    let share = (v.abs() / p.converter.v_in).max(LEAST);
    p.inductor.core_conductance * libm::pow(share, p.inductor.core_exponent - 2.0)
}

#[cfg(test)]
mod tests {
    use super::{conductance, is_linear};
    use crate::parameters::{Model, Parameters};

    #[test]
    fn the_loss_grows_with_its_power_of_the_voltage() {
        let mut p = Parameters::ideal(48.0, 20e-6, 100e-6, 200e3);
        p.inductor.core_conductance = 1e-3;
        assert!(is_linear(&p) && (conductance(&p, 7.0) - 1e-3).abs() < 1e-18);
        for exponent in [1.0, 1.6, 2.5, 3.0, 4.0] {
            p.inductor.core_exponent = exponent;
            let loss = |v: f64| conductance(&p, v) * v * v;
            // at the source's voltage that of the conductance, whatever the power
            assert!((loss(-48.0) / (1e-3 * 48.0 * 48.0) - 1.0).abs() < 1e-12);
            assert!((loss(24.0) / loss(12.0) / 2.0_f64.powf(exponent) - 1.0).abs() < 1e-12);
            assert!(conductance(&p, 0.0).is_finite() && !is_linear(&p));
        }
        p.converter.model = Model::Averaged;
        assert!(is_linear(&p));
    }
}

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
    // e to the 14th at most, so that 3e-15 of the power is lost; `pow` takes three times as long for its last bit
    p.inductor.core_conductance * libm::exp(power(p) * libm::log(share))
}

fn power(p: &Parameters) -> f64 {
    p.inductor.core_exponent - 2.0
}

/// A conductance from which those at voltages near by follow: within an interval the voltage across the inductance changes by the ripple of the output.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near {
    /// 1 over the voltage, 1/V; 0 where nothing is known.
    per_v: f64,
    /// S
    conductance: f64,
}

/// How far from the voltage the series goes, relative: its first term left out is 2e-10 of the conductance for powers from -1 to 2.
const NEAR: f64 = 0.03;

impl Near {
    pub const NOWHERE: Near = Near {
        per_v: 0.0,
        conductance: 0.0,
    };

    pub fn new(p: &Parameters, v: f64) -> Self {
        match v.abs() > 2.0 * LEAST * p.converter.v_in {
            true => Near {
                per_v: 1.0 / v,
                conductance: conductance(p, v),
            },
            false => Near::NOWHERE,
        }
    }

    /// [`conductance`].
    #[inline]
    pub fn conductance(&self, p: &Parameters, v: f64) -> f64 {
        // (1 + e)^n; -1 where nothing is known
        let e = v * self.per_v - 1.0;
        if e.abs() > NEAR {
            return conductance(p, v);
        }
        let n = power(p);
        let term = |k: f64| (n - k) / (k + 1.0) * e;
        let inner = 1.0 + term(4.0);
        let series = 1.0 + term(0.0) * (1.0 + term(1.0) * (1.0 + term(2.0) * (1.0 + term(3.0) * inner)));
        self.conductance * series
    }
}

#[cfg(test)]
mod tests {
    use super::{NEAR, Near, conductance, is_linear};
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

    #[test]
    fn what_is_near_a_known_voltage_follows_from_it() {
        let mut p = Parameters::ideal(48.0, 20e-6, 100e-6, 200e3);
        p.inductor.core_conductance = 1e-3;
        for exponent in [1.0, 1.3, 2.6, 3.5, 4.0] {
            p.inductor.core_exponent = exponent;
            for known in [-30.0, 0.2, 17.0] {
                let near = Near::new(&p, known);
                for ratio in [1.0 - NEAR, 0.99, 1.0, 1.02, 1.0 + NEAR, 1.2, -1.0, 0.0] {
                    let exact = conductance(&p, ratio * known);
                    let found = near.conductance(&p, ratio * known);
                    assert!(
                        (found / exact - 1.0).abs() < 1e-9,
                        "{exponent} {known} {ratio}: {found} {exact}"
                    );
                }
            }
        }
        let unknown = Near::new(&p, 0.0);
        assert_eq!(unknown.conductance(&p, 3.0).to_bits(), conductance(&p, 3.0).to_bits());
    }
}

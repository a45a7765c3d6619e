//! What a record's converter shows at rest without losses, in continuous conduction: sizes to judge by, before any simulation.

use plant::{Carrier, Load, Parameters, Topology};

use crate::record::Record;

/// Mean inductor current over half its ripple from which on it surely never rests: at rest the voltage is above that of the duty, at
/// any factor.
const CONTINUOUS: f64 = 1.2;

/// The loss-free converter at the source voltage of a record.
#[derive(Debug, Clone, Copy)]
pub struct Ideal {
    /// Which of the three it is.
    pub topology: Topology,
    /// Source voltage of the record, V.
    pub v_in: f64,
    /// Inductance over the period, ohm.
    slope: f64,
    /// Switching periods in a swing of the filter.
    swing: f64,
}

impl Ideal {
    /// At the source voltage of a record.
    pub fn of(record: &Record, parameters: &Parameters) -> Self {
        Self::at(parameters, record.v_in_ratio)
    }

    /// At a share of the model's source voltage.
    pub fn at(parameters: &Parameters, v_in_ratio: f64) -> Self {
        let p = &parameters.converter;
        Self {
            topology: p.topology,
            v_in: p.v_in * v_in_ratio,
            slope: p.inductance * p.f_sw,
            swing: std::f64::consts::TAU * (p.inductance * p.capacitance).sqrt() * p.f_sw,
        }
    }

    /// Switching periods in a swing of the filter, at the duty of a buck; a boost's is slower.
    pub fn swing(&self) -> f64 {
        self.swing
    }

    /// Output voltage that a duty makes, V.
    pub fn volts(&self, duty: f64) -> f64 {
        self.topology.voltage(self.v_in, duty)
    }

    /// Mean inductor current that delivers `drawn` at a duty, A.
    pub fn inductor(&self, drawn: f64, duty: f64) -> f64 {
        drawn / self.topology.give(duty)
    }

    /// Half the ripple of the inductor current, A.
    pub fn half(&self, duty: f64) -> f64 {
        let volts = match self.topology {
            Topology::Buck => self.v_in * duty * (1.0 - duty),
            Topology::Boost | Topology::BuckBoost => self.v_in * duty,
        };
        0.5 * volts / self.slope
    }

    /// How far the inductor current is above what a sensor with a low-pass of `tau` seconds shows of it at rest, at the sampling instant `phase`
    /// of a period of `t_sw` seconds: behind a steep ripple a sensor shows another current than flows. For a current that never rests.
    // for a line of slope s the sensor is tau s behind, but for what is left of the corner before it, which fades with tau: e at the two
    // corners follows from e(on) = e(off) b + step and e(off) = e(on) a - step, where tau s leaps by step
    pub fn above_shown(&self, (carrier, duty): (Carrier, f64), phase: f64, tau: f64, t_sw: f64) -> f64 {
        let lasts = [duty, 1.0 - duty].map(|share| share * t_sw);
        if tau <= 0.0 || lasts.iter().any(|time| *time <= 0.0) {
            return 0.0;
        }
        let slopes = [2.0 * self.half(duty) / lasts[0], -2.0 * self.half(duty) / lasts[1]];
        let since = since_on((carrier, duty), phase) * t_sw;
        let fades = lasts.map(|time| libm::exp(-time / tau));
        let step = tau * (slopes[0] - slopes[1]) / (1.0 - fades[0] * fades[1]);
        let (slope, corner, since) = match since < lasts[0] {
            true => (slopes[0], step * (1.0 - fades[1]), since),
            false => (slopes[1], -step * (1.0 - fades[0]), since - lasts[0]),
        };
        tau * slope - corner * libm::exp(-since / tau)
    }

    /// The inductor current at rest at the sampling instant `phase` of a period, whose mean is `mean`. Where it rests it begins at 0.
    pub fn at_phase(&self, mean: f64, (carrier, duty): (Carrier, f64), phase: f64) -> f64 {
        if duty <= 0.0 || duty >= 1.0 {
            return mean;
        }
        let half = self.half(duty);
        let since = since_on((carrier, duty), phase);
        let above_low = match since < duty {
            true => 2.0 * half * since / duty,
            false => 2.0 * half * (1.0 - (since - duty) / (1.0 - duty)),
        };
        // the triangle of a current that rests is narrower and as steep
        (mean - half).max(0.0) + above_low
    }

    /// Whether the inductor current surely never rests: a voltage then follows from the duty alone.
    pub fn never_rests(&self, drawn: f64, duty: f64) -> bool {
        self.inductor(drawn, duty) > CONTINUOUS * self.half(duty)
    }

    /// Source voltage that makes an output voltage at a duty, when `drop` is lost at the inductor over a period, V.
    pub fn source(&self, volts: f64, duty: f64, drop: f64) -> f64 {
        match self.topology {
            Topology::Buck => (volts + drop) / duty,
            Topology::Boost => volts * (1.0 - duty) + drop,
            Topology::BuckBoost => (volts * (1.0 - duty) + drop) / duty,
        }
    }
}

/// Where in the period a phase lies, from the instant at which the switch turns on.
fn since_on((carrier, duty): (Carrier, f64), phase: f64) -> f64 {
    let begins = match carrier {
        Carrier::Trailing => 0.0,
        Carrier::Leading => 1.0 - duty,
        Carrier::Centre => 0.5 * (1.0 - duty),
    };
    (phase - begins).rem_euclid(1.0)
}

/// What a load draws at a voltage, A.
pub fn drawn(load: &Load, volts: f64) -> f64 {
    load.conductance * volts + load.current + if volts > 0.0 { load.power / volts } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 200 V, 2 mH and 10 kHz: at a duty of one half a ripple of 2.5 A to either side.
    #[test]
    fn the_current_at_an_instant_lies_on_the_triangle_and_begins_at_0_where_it_rests() {
        let ideal = Ideal::at(&Parameters::paper_table(), 1.0);
        let half = ideal.half(0.5);
        for (carrier, off) in [
            (Carrier::Trailing, 0.5),
            (Carrier::Leading, 0.0),
            (Carrier::Centre, 0.75),
        ] {
            let at = |mean: f64, phase: f64| ideal.at_phase(mean, (carrier, 0.5), phase);
            for mean in [2.0 * half, 5.0 * half] {
                assert!((at(mean, off) - mean - half).abs() < 1e-9, "{carrier:?}: the peak");
                assert!(
                    (at(mean, off + 0.25) - mean).abs() < 1e-9,
                    "{carrier:?}: on the way down"
                );
                assert!(
                    (at(mean, off + 0.5) - mean + half).abs() < 1e-9,
                    "{carrier:?}: the valley"
                );
            }
            assert!((at(0.1 * half, off + 0.5)).abs() < 1e-9 && at(0.1 * half, off) > 0.0);
        }
        assert_eq!(ideal.at_phase(3.0, (Carrier::Trailing, 1.0), 0.3), 3.0);
    }
}

//! What a record's converter shows at rest without losses, in continuous conduction: sizes to judge by, before any simulation.

use plant::{Carrier, Load, Parameters, Rectifier, Topology};

use crate::record::Record;

/// Mean inductor current over half its ripple from which on it surely never rests: at rest the voltage is above that of the duty, at
/// any factor.
const CONTINUOUS: f64 = 1.2;

/// A voltage that steps up rises with a light load to so many times that of the duty at most: nothing that is measured is above.
const RISES: f64 = 100.0;
/// Halvings of that range to below the digits of a meter.
const BISECTIONS: usize = 40;

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
    /// Whether its current rests where it would turn.
    rests: bool,
}

/// The inductor current over a period at rest: up while the switch is on, down behind that, and at `low` until the period's end.
#[derive(Debug, Clone, Copy)]
pub struct Triangle {
    /// Its least, A.
    low: f64,
    /// Most above least, A.
    height: f64,
    /// Shares of the period of both sides.
    lasts: [f64; 2],
}

impl Triangle {
    /// The current at a share of the period behind the instant at which the switch turns on, A.
    fn since(&self, since: f64) -> f64 {
        let [up, down] = self.lasts;
        let above = match since < up {
            true => since / up,
            false => 1.0 - (since - up) / down,
        };
        self.low + self.height * above.max(0.0)
    }

    /// The current at a phase of the period, A.
    pub fn at(&self, carrier: Carrier, phase: f64) -> f64 {
        if self.lasts.iter().any(|share| *share <= 0.0) {
            return self.low + 0.5 * self.height;
        }
        self.since(since_on((carrier, self.lasts[0]), phase))
    }

    /// How far the current is above what a sensor with a low-pass of `tau` periods shows of it at a phase: behind a steep ripple a sensor shows
    /// another current than flows.
    // for a line of slope s the sensor is tau s behind, but for what is left of what it was behind before, which fades with tau
    pub fn above_shown(&self, carrier: Carrier, phase: f64, tau: f64) -> f64 {
        let [up, down] = self.lasts;
        if tau <= 0.0 || up <= 0.0 || down <= 0.0 {
            return 0.0;
        }
        let rest = (1.0 - up - down).max(0.0);
        let sides = [(up, self.height / up), (down, -self.height / down), (rest, 0.0)];
        let along =
            |behind: f64, (lasts, slope): (f64, f64)| tau * slope + (behind - tau * slope) * libm::exp(-lasts / tau);
        let period = |behind: f64| sides.iter().fold(behind, |behind, side| along(behind, *side));
        // what is kept of a period's begin, and what a period adds
        let (added, kept) = (period(0.0), libm::exp(-1.0 / tau));
        let mut behind = added / (1.0 - kept);
        let mut left = since_on((carrier, up), phase);
        for (lasts, slope) in sides {
            behind = along(behind, (left.min(lasts), slope));
            left = (left - lasts).max(0.0);
        }
        behind
    }
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
            rests: p.rectifier == Rectifier::Diode,
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

    /// Output voltage at which the loss-free converter rests with a load: that of the duty, or where the inductor current rests in each period the
    /// voltage up to which its triangles fill the load. For a duty between 0 and 1.
    // the charge of a triangle, q = half L ipk (1/rise + 1/fall) ipk: what of it reaches the output is both sides for a buck, the fall for the others
    pub fn volts_into(&self, load: &Load, duty: f64) -> f64 {
        let own = self.volts(duty);
        let peak = self.v_in * duty / self.slope;
        let given = |v: f64| match self.topology {
            Topology::Buck => 0.5 * duty * peak * (self.v_in - v).max(0.0) / v,
            Topology::Boost => 0.5 * duty * peak * self.v_in / (v - self.v_in),
            Topology::BuckBoost => 0.5 * duty * peak * self.v_in / v,
        };
        let most = match self.topology {
            Topology::Buck => self.v_in,
            Topology::Boost | Topology::BuckBoost => RISES * own,
        };
        if given(own) <= drawn(load, own) {
            return own;
        }
        let (mut low, mut high) = (own, most);
        for _ in 0..BISECTIONS {
            let v = 0.5 * (low + high);
            match given(v) > drawn(load, v) {
                true => low = v,
                false => high = v,
            }
        }
        0.5 * (low + high)
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

    /// The inductor current over a period at rest, whose mean is `mean` A at an output of `volts` V.
    pub fn triangle(&self, mean: f64, volts: f64, duty: f64) -> Triangle {
        let (rises, falls) = match self.topology {
            Topology::Buck => (self.v_in - volts, volts),
            Topology::Boost => (self.v_in, volts - self.v_in),
            Topology::BuckBoost => (self.v_in, volts),
        };
        // of a voltage that no such duty makes at rest the triangle would not close
        let own = 2.0 * self.half(duty);
        let is_closed = duty > 0.0 && duty < 1.0 && rises > 0.0 && falls > 0.0;
        if self.rests && mean < self.half(duty) && is_closed {
            let peak = rises / self.slope * duty;
            let off = (peak * self.slope / falls).min(1.0 - duty);
            return Triangle {
                low: 0.0,
                height: peak,
                lasts: [duty, off],
            };
        }
        Triangle {
            low: mean - 0.5 * own,
            height: own,
            lasts: [duty, 1.0 - duty],
        }
    }

    /// Whether there is a diode, behind which the current may rest.
    pub fn may_rest(&self) -> bool {
        self.rests
    }

    /// Whether the inductor current surely never rests: a voltage then follows from the duty alone.
    pub fn never_rests(&self, drawn: f64, duty: f64) -> bool {
        self.inductor(drawn, duty) > CONTINUOUS * self.half(duty)
    }

    /// Whether power alone is drawn somewhere in a record, beyond what holds the voltage: small errors grow there, and say nothing about the bench.
    pub fn is_unstable_with(&self, record: &Record) -> bool {
        record.load.iter().zip(&record.duty).any(|(load, duty)| {
            let v = self.volts(*duty);
            load.power > load.conductance * v * v
        })
    }

    /// Share of the period in which the inductor has the source's voltage.
    pub fn source_share(&self, duty: f64) -> f64 {
        match self.topology {
            Topology::Boost => 1.0,
            Topology::Buck | Topology::BuckBoost => duty,
        }
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
    fn the_current_at_an_instant_lies_on_the_triangle() {
        let ideal = Ideal::at(&Parameters::paper_table(), 1.0);
        let half = ideal.half(0.5);
        for (carrier, off) in [
            (Carrier::Trailing, 0.5),
            (Carrier::Leading, 0.0),
            (Carrier::Centre, 0.75),
        ] {
            for mean in [2.0 * half, 5.0 * half] {
                let at = |phase: f64| ideal.triangle(mean, 100.0, 0.5).at(carrier, phase);
                assert!((at(off) - mean - half).abs() < 1e-9, "{carrier:?}: the peak");
                assert!((at(off + 0.25) - mean).abs() < 1e-9, "{carrier:?}: on the way down");
                assert!((at(off + 0.5) - mean + half).abs() < 1e-9, "{carrier:?}: the valley");
            }
            // at 150 V it rises by 1.25 A, a quarter of the slope, and is down behind a sixth of the period
            let at = |phase: f64| ideal.triangle(0.1 * half, 150.0, 0.5).at(carrier, phase);
            assert!(
                (at(off) - 1.25).abs() < 1e-9,
                "{carrier:?}: the peak of a current that rests"
            );
            assert!(
                (at(off + 1.0 / 12.0) - 0.625).abs() < 1e-9,
                "{carrier:?}: on the way down"
            );
            assert!(
                at(off + 0.2).abs() < 1e-9 && at(off + 0.49).abs() < 1e-9,
                "{carrier:?}: at rest"
            );
        }
        assert_eq!(ideal.triangle(3.0, 200.0, 1.0).at(Carrier::Trailing, 0.3), 3.0);
    }

    /// A sensor that follows such a current step by step shows as much less.
    #[test]
    fn a_slow_sensor_is_behind_a_current_whether_it_rests_or_not() {
        let ideal = Ideal::at(&Parameters::paper_table(), 1.0);
        for (mean, volts) in [(6.0, 100.0), (0.2, 150.0)] {
            let triangle = ideal.triangle(mean, volts, 0.5);
            for tau in [0.03, 0.3, 3.0] {
                let (steps, mut shown) = (20_000, mean);
                for period in 0..40 {
                    for n in 0..steps {
                        let phase = f64::from(n) / f64::from(steps);
                        let true_one = triangle.at(Carrier::Trailing, phase);
                        if period == 39 && n % 2_500 == 0 {
                            let behind = triangle.above_shown(Carrier::Trailing, phase, tau);
                            assert!(
                                (true_one - shown - behind).abs() < 2e-3,
                                "{mean} {tau} {phase}: {behind}"
                            );
                        }
                        shown += (triangle.at(Carrier::Trailing, phase + 0.5 / f64::from(steps)) - shown)
                            / tau
                            / f64::from(steps);
                    }
                }
            }
        }
    }
}

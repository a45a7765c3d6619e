//! The exact steady state of a buck converter with losses, and what the mapping's two forms can make of it.
//!
//! In continuous conduction, with `lost_duty` the lost share of the period, `v_f + r_d i` the diode's path, `r_on` the
//! switch and `dcr` the inductor:
//!
//! `v = (d - lost_duty) (v_in - r_on i) - (1 - d + lost_duty) (v_f + r_d i) - dcr i`, and the simulator says `v = d_sim v_in`.
//!
//! Solved for d, with `V = v_in + v_f` and `rho = (r_on - r_d) / V`:
//!
//! `d_real = lost_duty + [d_sim v_in + v_f + i (dcr + r_d)] / [V (1 - rho i)]`.
//!
//! `1 / (1 - rho i) = 1 + rho i + (rho i)^2 / (1 - rho i)`: the first two terms are the four-term form, what is left is
//! its error, `q = rho i^2 (dcr + r_d) / V + (rho i)^2 [d_sim v_in + v_f + i (dcr + r_d)] / [V (1 - rho i)]`. A fit over a
//! balanced grid takes the part of q that is linear in i away, too; [`Losses::expected_errors`] says what stays.
//!
//! In a synchronous leg the second switch takes the diode's place: `v_f` is 0, `r_d` its resistance `r_low`. With a dead time
//! of the share `delta` of a period the upper switch loses `delta`, and the lower diode carries the current for `delta` on
//! both sides of the lower switch's time, as long as that current is positive. Its ripple is symmetrical about `i` there,
//! so the balance loses `2 delta [v_f + (r_d - r_low) i]` more: [`Losses::v_dead`] and a part of [`Losses::dcr`]. Where the
//! current turns negative before the upper switch turns on, its diode keeps the duty that was lost
//! ([`crate::Conduction`] has the boundary).

use plant::{Model, Parameters, Rectifier};
use policy::Coefficients;
use serde::Serialize;
use toml_input::Faults;

/// What makes a converter differ from `v = d v_in`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Losses {
    /// Voltage at the switch, V.
    pub v_in: f64,
    /// Forward voltage of the diode, V.
    pub v_f: f64,
    /// Differential resistance of the diode, or of the second switch, ohm.
    pub r_d: f64,
    /// On-resistance of the switch, ohm.
    pub r_on: f64,
    /// Resistance of the inductor, ohm.
    pub dcr: f64,
    /// Share of the period that the switch is on for less than commanded: dead time plus turn-on minus turn-off delay, minus the
    /// modulator's offset.
    pub lost_duty: f64,
    /// What the body diodes of a synchronous leg take in the dead times, as a mean over the period, V.
    pub v_dead: f64,
}

impl Losses {
    /// The losses of a plant, as long as its inductor current is positive throughout the period.
    ///
    /// # Errors
    /// Another topology than the buck.
    pub fn of(plant: &Parameters) -> Result<Self, Faults> {
        plant.require_buck("the formula of the mapping")?;
        let switch = &plant.switch;
        let at_edges = (switch.dead_time + switch.turn_on_delay - switch.turn_off_delay) * plant.converter.f_sw;
        // a modulator that is off moves the edges of both switches: no body diode conducts for it
        let lost_duty = at_edges - plant.pwm.duty_offset;
        let losses = Losses {
            v_f: switch.v_f,
            r_d: switch.r_d,
            r_on: switch.r_ds_on,
            dcr: plant.inductor.dcr,
            lost_duty,
            ..Losses::none(plant.converter.v_in)
        };
        if plant.converter.rectifier == Rectifier::Diode {
            return Ok(losses);
        }
        // the averaged model knows no body diodes; edges that overlap leave them no time
        let in_diodes = match plant.converter.model {
            Model::Switched => 2.0 * at_edges.max(0.0),
            Model::Averaged => 0.0,
        };
        Ok(Losses {
            v_f: 0.0,
            r_d: switch.r_ds_on_low,
            dcr: losses.dcr + in_diodes * (switch.r_d - switch.r_ds_on_low),
            v_dead: in_diodes * switch.v_f,
            ..losses
        })
    }

    /// A converter without any.
    #[must_use]
    pub fn none(v_in: f64) -> Self {
        Losses {
            v_in,
            v_f: 0.0,
            r_d: 0.0,
            r_on: 0.0,
            dcr: 0.0,
            lost_duty: 0.0,
            v_dead: 0.0,
        }
    }

    /// Whether it has none of these.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Losses::none(self.v_in)
    }

    /// What a unit of duty is worth at `i_out` A, V.
    #[must_use]
    pub fn v_per_duty(&self, i_out: f64) -> f64 {
        self.v() * (1.0 - self.rho() * i_out)
    }

    /// The voltage at `duty` and `i_out` A, V.
    #[must_use]
    pub fn v_out(&self, duty: f64, i_out: f64) -> f64 {
        (duty - self.d_real(0.0, i_out)) * self.v_per_duty(i_out)
    }

    /// The duty that brings `d_sim v_in` V at `i_out` A.
    #[must_use]
    pub fn d_real(&self, d_sim: f64, i_out: f64) -> f64 {
        let wanted = d_sim * self.v_in + self.v_constant() + i_out * (self.dcr + self.r_d);
        self.lost_duty + wanted / self.v_per_duty(i_out)
    }

    /// The four-term form: exact up to terms in `i^2`.
    #[must_use]
    pub fn four_term(&self) -> Coefficients {
        let v = self.v();
        Coefficients {
            a: self.v_in / v,
            b: (self.dcr + self.r_d + self.rho() * self.v_constant()) / v,
            c: self.lost_duty + self.v_constant() / v,
            r: Some(self.rho() * self.v_in / v),
        }
    }

    /// The three-term form, the tangent at the load current `i_m` A and `d_m` = d_sim there.
    #[must_use]
    pub fn three_term(&self, i_m: f64, d_m: f64) -> Coefficients {
        let four = self.four_term();
        let r = self.rho() * self.v_in / self.v();
        Coefficients {
            a: four.a + r * i_m,
            b: four.b + r * d_m,
            c: four.c - r * i_m * d_m,
            r: None,
        }
    }

    /// What a least-squares fit of the three- and of the four-term form leaves on a full grid of `d_sim` and `i_out`, rms
    /// of d_real, to first order in `rho i`.
    ///
    /// The four-term form lacks `rho i^2 [dcr + r_d + rho (d_sim v_in + v_f)] / V`, of which the part beyond a line in i
    /// stays. The three-term form lacks `r (d_sim - mean) (i - mean)` as well; on a full grid the two are orthogonal.
    #[must_use]
    pub fn expected_errors(&self, d_sim: &[f64], i_out: &[f64]) -> (f64, f64) {
        let mean = |x: &mut dyn Iterator<Item = f64>, n: usize| x.sum::<f64>() / n as f64;
        let spread = |x: &[f64]| {
            let centre = mean(&mut x.iter().copied(), x.len());
            mean(&mut x.iter().map(|x| (x - centre) * (x - centre)), x.len()).sqrt()
        };
        let bent = beyond_a_line(i_out);
        let factor = |d: &f64| {
            let one = self.rho() * (self.dcr + self.r_d + self.rho() * (d * self.v_in + self.v_constant())) / self.v();
            one * one
        };
        let four = bent * mean(&mut d_sim.iter().map(factor), d_sim.len()).sqrt();
        let product = self.rho() * self.v_in / self.v() * spread(d_sim) * spread(i_out);
        ((product * product + four * four).sqrt(), four)
    }

    /// What is lost at any duty and current, V.
    fn v_constant(&self) -> f64 {
        self.v_f + self.v_dead
    }

    fn v(&self) -> f64 {
        self.v_in + self.v_f
    }

    fn rho(&self) -> f64 {
        (self.r_on - self.r_d) / self.v()
    }
}

/// Rms of what is left of `x^2` after its best line in `x`.
fn beyond_a_line(x: &[f64]) -> f64 {
    let n = x.len() as f64;
    let centre = x.iter().sum::<f64>() / n;
    let centred: Vec<f64> = x.iter().map(|x| x - centre).collect();
    let moment = |power: i32| centred.iter().map(|x| x.powi(power)).sum::<f64>() / n;
    let (second, third) = (moment(2), moment(3));
    if second == 0.0 {
        return 0.0;
    }
    // x^2 = centred^2 + a line in x, so only centred^2 counts
    (moment(4) - second * second - third * third / second).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOSSY: Losses = Losses {
        v_in: 195.0,
        v_f: 1.5,
        r_d: 0.02,
        r_on: 0.5,
        dcr: 0.1,
        lost_duty: 0.04,
        v_dead: 0.0,
    };

    #[test]
    fn the_formula_solves_the_balance_of_the_circuit() {
        let (d_sim, i) = (0.5, 8.0);
        let d = LOSSY.d_real(d_sim, i);
        let on = d - LOSSY.lost_duty;
        let v = on * (195.0 - 0.5 * i) - (1.0 - on) * (1.5 + 0.02 * i) - 0.1 * i;
        assert!((v - d_sim * 195.0).abs() < 1e-12, "{v}");
        assert!((LOSSY.v_out(d, i) - v).abs() < 1e-12);
    }

    /// The oracle is the switched plant, settled: 48 V to 12 V at 200 kHz with 100 ns of dead time.
    #[test]
    fn the_formula_is_the_steady_state_of_a_synchronous_leg() {
        let mut plant = Parameters::paper_model();
        plant.converter.rectifier = Rectifier::Synchronous;
        (plant.converter.v_in, plant.converter.f_sw) = (48.0, 200e3);
        // the plant is sampled at the valley: a large capacitor keeps its ripple, 4.7 mV there at 200 uF, out of the sample
        (plant.converter.inductance, plant.converter.capacitance) = (10e-6, 20e-3);
        (plant.switch.r_ds_on, plant.switch.r_ds_on_low) = (0.02, 0.008);
        (plant.switch.v_f, plant.switch.r_d) = (0.8, 0.05);
        (plant.switch.dead_time, plant.inductor.dcr) = (100e-9, 0.012);
        plant.pwm.duty_offset = -0.015;
        let losses = Losses::of(&plant).unwrap();
        let boundary = crate::Conduction::of(&plant).unwrap().boundary(12.0, 48.0);
        for i_out in [1.05 * boundary, 5.0, 12.0] {
            let settled = plant::Plant::new(&plant)
                .unwrap()
                .settle(12.0, &plant::Load::current(i_out));
            assert!(settled.converged);
            let found = losses.v_out(settled.duty, i_out);
            // resistances bend the ripple a little: second order in r T / L
            assert!((found - 12.0).abs() < 5e-4, "{found} V at {i_out} A");
        }
    }

    #[test]
    fn the_forms_touch_the_formula_where_they_should() {
        let at = |k: Coefficients, d: f64, i: f64| k.a * d + k.b * i + k.c + k.r.unwrap_or(0.0) * d * i;
        assert!((at(LOSSY.four_term(), 0.5, 0.0) - LOSSY.d_real(0.5, 0.0)).abs() < 1e-15);
        let three = at(LOSSY.three_term(6.0, 0.5), 0.5, 6.0);
        assert!((three - at(LOSSY.four_term(), 0.5, 6.0)).abs() < 1e-15);
    }

    #[test]
    fn what_lies_beyond_a_line_is_the_second_orthogonal_polynomial() {
        // n equidistant points of step h: sum of squares n (n^2 - 1) (n^2 - 4) h^4 / 180
        let x = [2.0, 4.0, 6.0, 8.0, 10.0];
        let expected = (24.0_f64 * 21.0 / 180.0 * 16.0).sqrt();
        assert!((beyond_a_line(&x) - expected).abs() < 1e-12);
    }
}

//! The steady state in which the plant runs at a given sampled voltage.

use crate::parameters::Parameters;
use crate::plant::Plant;
use crate::signals::{Load, Signals};

/// How [`Plant::settle`] ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settled {
    /// The duty that holds the voltage.
    pub duty: f64,
    /// Whether voltage and duty came to rest, to 1e-9 of the voltage.
    pub converged: bool,
    /// Periods it took.
    pub periods: u32,
}

/// A slow current-mode regulator: holds a voltage also under a load that is unstable in open loop.
#[derive(Debug, Clone, Copy)]
pub struct Regulator {
    v_out: f64,
    v_in: f64,
    slowness: f64,
    /// Current per voltage error, S.
    g: f64,
    /// Voltage per current error, ohm.
    k: f64,
    integral: f64,
}

impl Regulator {
    /// Holds `v_out` V at a converter with these parameters, from the signals it has now.
    #[must_use]
    pub fn new(p: &Parameters, v_out: f64, now: &Signals) -> Self {
        let (v_in, l, c) = (p.converter.v_in, p.converter.inductance, p.converter.capacitance);
        let slowness = f64::from(1 + p.pwm.duty_delay) + p.pwm.sampling_phase;
        let t = p.t_sw();
        // conductance that corrects a voltage error in about ten periods, gain that corrects a current in about four
        let g = 0.1 / slowness * c / t;
        let k = 0.25 / slowness * l / t;
        Regulator {
            v_out,
            v_in,
            slowness,
            g,
            k,
            integral: v_out - k * (now.i_out - now.i_l),
        }
    }

    /// The duty for the next period, 0..1.
    pub fn duty(&mut self, now: &Signals) -> f64 {
        let (g, k) = (self.g, self.k);
        let error = self.v_out - now.v_out;
        self.integral = (self.integral + 0.1 * k * g * error / self.slowness).clamp(-self.v_in, 2.0 * self.v_in);
        let wanted = self.integral + k * (g * error + now.i_out - now.i_l);
        (wanted / self.v_in).clamp(0.0, 1.0)
    }
}

const MOST_PERIODS: u32 = 20_000;
const AT_REST: u32 = 20;

impl Plant {
    /// Runs the plant under `load` until its sampled output voltage rests at `v_out` V, held by a [`Regulator`] on the
    /// true signals; a load that is unstable in open loop is fine. Not for a plant whose quantised duty
    /// cannot hold the voltage exactly: there it ends near it, not converged.
    pub fn settle(&mut self, v_out: f64, load: &Load) -> Settled {
        let p = self.parameters();
        let (v_in, l) = (p.converter.v_in, p.converter.inductance);
        let t = self.t_sample();
        let i_out = self.reset_at(v_out, 0.0, load).i_out;
        let ripple = v_out * (1.0 - v_out / v_in) * t / l;
        let mut sample = self.reset_at(v_out, (i_out - 0.5 * ripple).max(0.0), load);
        let mut regulator = Regulator::new(self.parameters(), v_out, &sample.signals());
        let (mut duty, mut rests) = (0.0, 0);
        let mut last = sample;
        for period in 1..=MOST_PERIODS {
            let error = v_out - sample.v_out;
            duty = regulator.duty(&sample.signals());
            sample = self.step(duty, load);
            let moved = (sample.v_out - last.v_out).abs() + (sample.i_l - last.i_l).abs() * regulator.k;
            let small = 1e-9 * v_out.abs().max(1.0);
            rests = if error.abs() + moved < small { rests + 1 } else { 0 };
            last = sample;
            if rests >= AT_REST {
                return Settled {
                    duty,
                    converged: true,
                    periods: period,
                };
            }
        }
        Settled {
            duty,
            converged: false,
            periods: MOST_PERIODS,
        }
    }
}

//! The steady state in which the plant runs at a given sampled voltage.

use crate::plant::Plant;
use crate::signals::Load;

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

const MOST_PERIODS: u32 = 20_000;
const AT_REST: u32 = 20;

impl Plant {
    /// Runs the plant under `load` until its sampled output voltage rests at `v_out` V, held by a slow current-mode
    /// regulator on the true signals; a load that is unstable in open loop is fine. Not for a plant whose quantised duty
    /// cannot hold the voltage exactly: there it ends near it, not converged.
    pub fn settle(&mut self, v_out: f64, load: &Load) -> Settled {
        let p = self.parameters();
        let (v_in, l, c) = (p.converter.v_in, p.converter.inductance, p.converter.capacitance);
        let slowness = f64::from(1 + p.pwm.duty_delay) + p.pwm.sampling_phase;
        let t = self.t_sample();
        let i_out = self.reset_at(v_out, 0.0, load).i_out;
        let ripple = v_out * (1.0 - v_out / v_in) * t / l;
        let mut sample = self.reset_at(v_out, (i_out - 0.5 * ripple).max(0.0), load);
        // conductance that corrects a voltage error in about ten periods, gain that corrects a current in about four
        let g = 0.1 / slowness * c / t;
        let k = 0.25 / slowness * l / t;
        let mut integral = v_out - k * (i_out - sample.i_l);
        let (mut duty, mut rests) = (0.0, 0);
        let mut last = sample;
        for period in 1..=MOST_PERIODS {
            let error = v_out - sample.v_out;
            integral = (integral + 0.1 * k * g * error / slowness).clamp(-v_in, 2.0 * v_in);
            let wanted = integral + k * (g * error + sample.i_out - sample.i_l);
            duty = (wanted / v_in).clamp(0.0, 1.0);
            sample = self.step(duty, load);
            let moved = (sample.v_out - last.v_out).abs() + (sample.i_l - last.i_l).abs() * k;
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

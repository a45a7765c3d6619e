//! PID on the output voltage.

use plant::Signals;

use super::Design;

/// PID on the output voltage with a backward difference, clamped, without windup.
///
/// The tuning rule: to a voltage controller the converter is nearly a double integrator,
/// `(z-1)^2 E = b (z+1)/2 D` with `b = v_in T^2/(L C)`; the gains are `GAINS` over b, so that they hold for any L, C
/// and T.
#[derive(Debug, Clone)]
pub struct Pid {
    v_ref: f64,
    proportional: f64,
    derivative: f64,
    integral: f64,
    sum: f64,
    last: Option<f64>,
}

/// `b Kp`, `b Kd` and `b Ki` per period, without delay and with one period of it. Found by random search for the least
/// deviation and settling time on the paper's two plants (200 to 1000 W and back), rounded. Longer delays divide them by
/// the square, the first and the third power of the periods.
const GAINS: [[f64; 3]; 2] = [[0.3, 0.8, 0.005], [0.05, 0.44, 0.006]];

impl Pid {
    /// Designed by the rule above.
    #[must_use]
    pub fn new(design: &Design) -> Self {
        let [proportional, derivative, integral] = GAINS[design.delay.min(1)];
        let n = design.delay.max(1) as f64;
        let unit = design.l * design.c / (design.v_in * design.t * design.t);
        Self {
            v_ref: design.v_ref,
            proportional: proportional * unit / (n * n),
            derivative: derivative * unit / n,
            integral: integral * unit / (n * n * n),
            sum: design.rest(),
            last: None,
        }
    }

    /// The duty for a measurement.
    pub fn step(&mut self, measured: &Signals) -> f64 {
        let error = self.v_ref - measured.v_out;
        // no kick at the first sample
        let change = error - self.last.unwrap_or(error);
        self.last = Some(error);
        let wanted = self.sum + self.proportional * error + self.derivative * change;
        let duty = wanted.clamp(0.0, 1.0);
        // at a limit the sum stands still, else it winds up
        if duty == wanted {
            self.sum += self.integral * error;
        }
        duty
    }
}

//! PID on the output voltage.

use plant::Signals;

use super::Design;

/// PID on the output voltage with a backward difference, clamped, without windup.
///
/// The tuning rule: to a voltage controller the converter is nearly a double integrator,
/// `(z-1)^2 E = b (z+1)/2 D` with `b = v_in T^2/(L C)`; the gains are `GAINS` over b, so that they hold for any L, C
/// and T. With another topology `b = V D' T^2/(L C)`, V being what the duty switches to the inductor, and the crossover stays
/// below the zero in the right half-plane (`OF_ZERO`).
#[derive(Debug, Clone)]
pub struct Pid {
    v_ref: f64,
    proportional: f64,
    derivative: f64,
    integral: f64,
    sum: f64,
    last: Option<f64>,
    most: f64,
}

/// `b Kp`, `b Kd` and `b Ki` per period, without delay and with one period of it. Found by random search for the least
/// deviation and settling time on the paper's two plants (200 to 1000 W and back), rounded. A sample inside of the period counts as
/// one of delay; longer delays divide them by the square, the first and the third power of the periods.
const GAINS: [[f64; 3]; 2] = [[0.3, 0.8, 0.005], [0.05, 0.44, 0.006]];

impl Pid {
    /// Designed by the rule above.
    #[must_use]
    pub fn new(design: &Design) -> Self {
        let [proportional, derivative, integral] = GAINS[design.begun().min(1)];
        // the derivative makes the crossover: its gain over the periods
        let n = f64::max(
            design.begun().max(1) as f64,
            derivative * design.periods_of_zero(design.i_out),
        );
        let unit = design.l * design.c / (design.span() * design.t * design.t) / design.give();
        Self {
            v_ref: design.v_ref,
            proportional: proportional * unit / (n * n),
            derivative: derivative * unit / n,
            integral: integral * unit / (n * n * n),
            sum: design.rest(),
            most: design.most(),
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
        let duty = wanted.clamp(0.0, self.most);
        // at a limit the sum stands still, else it winds up
        if duty == wanted {
            self.sum += self.integral * error;
        }
        duty
    }
}

//! Cascade of a voltage and a current regulator.

use plant::Signals;

use super::Design;

/// PI on the output voltage that sets the current of a PI on the inductor current.
///
/// The tuning rule: `GAINS`, in units in which 1 is deadbeat (`L/(T v_in)` of duty per ampere, `C/T` of current per
/// volt), so that they hold for any L, C and T. With another topology these are `L/(T V)`, V being what the duty switches to
/// the inductor, and `C/(T D')`, and the voltage loop stays below the zero in the right half-plane (`OF_ZERO`).
#[derive(Debug, Clone)]
pub struct Cascade {
    v_ref: f64,
    below_mean: f64,
    voltage: Pi,
    current: Pi,
}

/// Gains without delay and with one period of it: of the current, of the voltage, and the shares of both that are
/// integrated each period. Found by random search for the least deviation and settling time on the paper's two plants
/// (200 to 1000 W and back), rounded. A sample inside of the period counts as one of them; longer
/// delays divide the gains by the periods.
const GAINS: [[f64; 4]; 2] = [[1.0, 0.8, 0.1, 0.2], [0.65, 0.28, 0.01, 0.1]];

/// A PI regulator that stops integrating at its limits.
#[derive(Debug, Clone)]
struct Pi {
    gain: f64,
    share: f64,
    /// Nothing before the first sample: it starts without a jump.
    sum: Option<f64>,
    range: [f64; 2],
}

impl Pi {
    fn step(&mut self, error: f64, start: f64) -> f64 {
        let sum = self.sum.unwrap_or(start);
        let wanted = sum + self.gain * error;
        let out = wanted.clamp(self.range[0], self.range[1]);
        let growth = if out == wanted {
            self.share * self.gain * error
        } else {
            0.0
        };
        self.sum = Some(sum + growth);
        out
    }
}

impl Cascade {
    /// Designed by the rule above.
    #[must_use]
    pub fn new(design: &Design) -> Self {
        let [current, voltage, current_share, voltage_share] = GAINS[design.begun().min(1)];
        let n = design.begun().max(1) as f64;
        let outer = f64::max(n, voltage * design.periods_of_zero(design.i_out));
        Self {
            v_ref: design.v_ref,
            below_mean: design.below_mean(),
            voltage: Pi {
                gain: voltage * design.c / design.t / design.give() / outer,
                share: voltage_share / outer,
                sum: None,
                // no limit of current is known of a plant
                range: [f64::NEG_INFINITY, f64::INFINITY],
            },
            current: Pi {
                gain: current * design.l / design.t / design.span() / n,
                share: current_share / n,
                sum: Some(design.rest()),
                range: [0.0, design.most()],
            },
        }
    }

    /// The duty for a measurement.
    pub fn step(&mut self, measured: &Signals) -> f64 {
        // the sample may be taken at the valley, and what the load needs is the mean
        let i_l = measured.i_l + self.below_mean;
        let i_ref = self.voltage.step(self.v_ref - measured.v_out, i_l);
        // its sum begins at the duty at rest, so this start is never taken
        self.current.step(i_ref - i_l, 0.0)
    }
}

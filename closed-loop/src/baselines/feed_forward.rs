//! Current control with feed-forward of the load current.

use plant::Signals;

use super::Design;

/// The inductor current is told to be the load current plus a share of the charge that is missing, and gets there within
/// one period.
///
/// The tuning rule: `i_ref = i_out + C/T (v_ref - v)/(2 (1+delay))`, the current loop deadbeat
/// (`duty = (v + L/T (i_ref - i_l))/v_in`) on current and voltage predicted over the delay. For the losses that this leaves
/// out, an integral of the voltage error with `INTEGRAL_PERIODS` as its time, at rest only: while the correction is
/// below the ripple.
#[derive(Debug, Clone)]
pub struct FeedForward {
    design: Design,
    gain: f64,
    integral: f64,
    sum: f64,
    /// Commanded, not yet in force; the oldest first.
    pending: Vec<f64>,
}

/// Integral time in control periods, for each period that a duty takes.
// slow against the one or two periods of the current loop, within the 5 ms that the paper takes to settle
const INTEGRAL_PERIODS: f64 = 50.0;

impl FeedForward {
    /// Designed by the rule above.
    #[must_use]
    pub fn new(design: &Design) -> Self {
        let n = (1 + design.delay) as f64;
        let gain = design.c / design.t / (2.0 * n);
        Self {
            gain,
            integral: gain / (INTEGRAL_PERIODS * n),
            sum: 0.0,
            pending: vec![design.rest(); design.delay],
            design: *design,
        }
    }

    /// The duty for a measurement.
    pub fn step(&mut self, measured: &Signals) -> f64 {
        let Design { l, c, t, v_ref, .. } = self.design;
        let half_ripple = self.design.half_ripple();
        let (mut v, mut i) = (measured.v_out, measured.i_l);
        // what is commanded now acts behind these: control the state in which it will be met
        for duty in &self.pending {
            let next = i + t / l * (duty * measured.v_in - v);
            v += t / c * (0.5 * (i + next) + half_ripple - measured.i_out);
            i = next;
        }
        let i_ref = measured.i_out - half_ripple + self.gain * (v_ref - v) + self.sum;
        let wanted = (v + l / t * (i_ref - i)) / measured.v_in;
        let duty = wanted.clamp(0.0, 1.0);
        // only at rest: in a transient the sum would grow by an error that is not due to losses
        if duty == wanted && (self.gain * (v_ref - v)).abs() < half_ripple {
            self.sum += self.integral * (v_ref - v);
        }
        if !self.pending.is_empty() {
            self.pending.remove(0);
            self.pending.push(duty);
        }
        duty
    }
}

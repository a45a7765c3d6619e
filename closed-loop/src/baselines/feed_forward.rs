//! Current control with feed-forward of the load current.

use plant::Signals;

use super::Design;

/// The inductor current is told to be the load current plus a share of the charge that is missing, and gets there within
/// one period.
///
/// The tuning rule: `i_ref = i_out + C/T (v_ref - v)/(2 (1+late))`, the current loop deadbeat
/// (`duty = (v + L/T (i_ref - i_l))/v_in`) on current and voltage predicted to where it acts, `late` periods on. For the losses that this leaves
/// out, an integral of the voltage error with `INTEGRAL_PERIODS` as its time, at rest only: while the correction is
/// below the ripple.
///
/// With another topology the current is `i_out/D'` and the law of the current `(V_0 + L/T (i_ref - i_l))/V`, V being what the
/// duty switches to the inductor and V_0 what stands against it; the voltage's share stays below the zero in the right
/// half-plane (`OF_ZERO`) at the load that is measured.
#[derive(Debug, Clone)]
pub struct FeedForward {
    design: Design,
    sum: f64,
    /// Acts until the next start of a PWM period.
    in_force: f64,
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
        Self {
            sum: 0.0,
            in_force: design.rest(),
            pending: vec![design.rest(); design.delay],
            design: *design,
        }
    }

    /// The duty for a measurement.
    pub fn step(&mut self, measured: &Signals) -> f64 {
        let Design {
            l,
            c,
            t,
            v_ref,
            topology,
            ..
        } = self.design;
        let (half_ripple, below_mean) = (self.design.half_ripple(), self.design.below_at_start());
        let n = 1.0 + self.design.late();
        let gain = self.design.by_voltage(measured.i_out);
        let integral = gain / (INTEGRAL_PERIODS * n);
        let (mut v, mut i) = (measured.v_out, measured.i_l);
        // what is commanded now acts behind these: control the state in which it will be met
        let wait = self.design.wait();
        if wait > 0.0 {
            let on = self.design.on(self.in_force, self.design.phase, 1.0) / wait;
            let (span, level) = (topology.span(measured.v_in, v), topology.level(measured.v_in, v));
            let next = i + wait * t / l * (on * span - level);
            v += wait * t / c * (topology.give(on) * 0.5 * (i + next) - measured.i_out);
            i = next;
        }
        for duty in &self.pending {
            let (span, level) = (topology.span(measured.v_in, v), topology.level(measured.v_in, v));
            let next = i + t / l * (duty * span - level);
            v += t / c * (topology.give(*duty) * (0.5 * (i + next) + below_mean) - measured.i_out);
            i = next;
        }
        let i_ref = measured.i_out / self.design.give() - below_mean + gain * (v_ref - v) + self.sum;
        let wanted = (topology.level(measured.v_in, v) + l / t * (i_ref - i)) / topology.span(measured.v_in, v);
        let duty = wanted.clamp(0.0, self.design.most());
        // only at rest: in a transient the sum would grow by an error that is not due to losses
        if duty == wanted && (gain * (v_ref - v)).abs() < half_ripple {
            self.sum += integral * (v_ref - v);
        }
        self.pending.push(duty);
        self.in_force = self.pending.remove(0);
        duty
    }
}

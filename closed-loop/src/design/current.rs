//! A law of control for a converter whose inductor current is measured.
//!
//! ```text
//!  v_out ─► loop of the voltage, below the zero in the right half-plane ─► current wanted ─┐
//!  i_out ─► current that holds the voltage ────────────────────────────────────────────────┴─► deadbeat of the current ─► duty
//! ```
//!
//! The law of [`FeedForward`](crate::baselines::FeedForward), made affine around rest, as a contract wants it, and without its
//! integral.

use plant::{Parameters, Rectifier, Topology};
use toml_input::Message;

use super::rounded;
use crate::baselines;
use crate::faults::Error;
use crate::suits::reaches;

/// Share of what a loop of the voltage may ask for, of `baselines::Design::by_voltage`.
// whatever is asked for during a dip deepens it. With L and C 15 % low the law exceeds the limit of all duties of
// examples/plants/boost-24-48.toml by 19, 15, 13 and 10 % at shares of 1, .7, .5 and .35, and that of buck-boost-12-24.toml by
// 29, 24, 18 and 15 %, where it settles in .18, .26, .35 and .48 ms
const SHARE: f64 = 0.4;
/// Digits of a gain, as in the other laws.
const DIGITS: usize = 4;

/// A law on the measured signals `v_out`, `i_l` and `i_out`.
#[derive(Debug, Clone, PartialEq)]
pub struct CurrentLaw {
    /// The converter.
    pub topology: Topology,
    /// Voltage to hold, V.
    pub v_ref: f64,
    /// Source voltage, V.
    pub v_in: f64,
    /// Inductance, H.
    pub inductance: f64,
    /// Capacitance, F.
    pub capacitance: f64,
    /// Control period, s.
    pub period: f64,
    /// Periods from a measurement to its duty, 0 or 1.
    pub compute_delay: u32,
    /// The current stops at 0 A.
    pub has_diode: bool,
    /// Half of the current's ripple, A.
    pub half_ripple: f64,
    /// How far the sampled current lies below its mean, A.
    pub below_mean: f64,
    /// The duty at rest, without losses.
    pub rest: f64,
    /// Share of the inductor's current that the output receives at rest.
    pub give: f64,
    /// What the duty switches to the inductor at rest, V.
    pub span: f64,
    /// Current per volt of error, A/V.
    pub by_voltage: f64,
}

impl CurrentLaw {
    /// For the nominal values of a plant and loads up to `i_out` A; its losses stay unknown.
    ///
    /// # Errors
    /// If the topology cannot make the voltage, or the plant delays its duty by more than a period.
    pub fn new(plant: &Parameters, v_ref: f64, i_out: f64, file: &std::path::Path) -> Result<Self, Error> {
        reaches(plant, v_ref, file)?;
        let compute_delay = match plant.pwm.duty_delay {
            delay @ 0..=1 => delay,
            delay => {
                let message = Message::new("the duty waits longer than a law looks ahead");
                let message = message.found(format!("pwm.duty_delay = {delay}"));
                return Err(message.expected("0 or 1 period").into());
            }
        };
        let design = baselines::Design::new(plant, v_ref, i_out);
        Ok(Self {
            topology: design.topology,
            v_ref,
            v_in: design.v_in,
            inductance: design.l,
            capacitance: design.c,
            period: design.t,
            compute_delay,
            has_diode: plant.converter.rectifier == Rectifier::Diode,
            half_ripple: design.half_ripple(),
            below_mean: design.below_mean(),
            rest: design.rest(),
            give: design.give(),
            span: design.span(),
            by_voltage: SHARE * design.by_voltage(i_out),
        })
    }

    /// Control periods in which the loop of the voltage leaves 37 % of an error.
    #[must_use]
    pub fn loop_periods(&self) -> f64 {
        self.capacitance / self.period / (self.give * self.by_voltage)
    }

    /// How much more current there is than holds the voltage, A, as an expression of a contract: the mean of the inductor's
    /// current, where the duty of this step begins, without what the load needs.
    #[must_use]
    pub fn surplus(&self) -> String {
        let (rest, give) = (short(self.rest), short(self.give));
        let mean = match short(self.below_mean) {
            0.0 => String::new(),
            x if x > 0.0 => format!(" + {x}"),
            x => format!(" - {}", -x),
        };
        let by_duty = self.period / self.inductance * self.span;
        // `d (span d - level)/dv` at rest is the share of the output, with a minus, in either topology
        let by_voltage = self.period / self.inductance * self.give;
        let ahead = match self.compute_delay {
            0 => String::new(),
            _ => format!(
                " + {} * (previous_duty - {rest}) - {} * (v_out - {})",
                short(by_duty),
                short(by_voltage),
                self.v_ref
            ),
        };
        format!("i_l{mean} - i_out / {give}{ahead}")
    }

    /// The duty of the law, as an expression of a contract.
    #[must_use]
    pub fn law(&self) -> String {
        let by_current = self.inductance / self.period / self.span;
        // the duty at rest changes with the voltage by `D'/V`, V being the span
        let by_voltage = by_current * self.by_voltage - self.give / self.span;
        format!(
            "{} - {} * ({}) - {} * (v_out - {})",
            short(self.rest),
            short(by_current),
            self.surplus(),
            short(by_voltage),
            self.v_ref
        )
    }
}

fn short(x: f64) -> f64 {
    rounded(x, DIGITS)
}

//! A law of control for a converter whose inductor current is measured.
//!
//! ```text
//!  v_out ─► loop of the voltage, below the zero in the right half-plane ─► current wanted ─┐
//!  i_out ─► current that holds the voltage ────────────────────────────────────────────────┴─► deadbeat of the current ─► duty
//! ```
//!
//! The law of [`FeedForward`](crate::baselines::FeedForward), made affine around rest, as a contract wants it, and without its
//! integral.

use plant::Parameters;

use super::{Nominal, short};
use crate::faults::Error;

/// A law on the measured signals `v_out`, `i_l` and `i_out`.
#[derive(Debug, Clone, PartialEq)]
pub struct CurrentLaw {
    /// What it is made for.
    pub nominal: Nominal,
}

impl CurrentLaw {
    /// For the nominal values of a plant and loads up to `i_out` A; its losses stay unknown.
    ///
    /// # Errors
    /// As of [`Nominal::new`].
    pub fn new(plant: &Parameters, v_ref: f64, i_out: f64) -> Result<Self, Error> {
        Ok(Self {
            nominal: Nominal::new(plant, v_ref, i_out)?,
        })
    }

    /// How much more current there is than holds the voltage, A, as an expression of a contract: the mean of the inductor's
    /// current, where the duty of this step begins, without what the load needs.
    #[must_use]
    pub fn surplus(&self) -> String {
        let own = &self.nominal;
        let (rest, give) = (short(own.rest), short(own.give));
        let mean = match short(own.sampled_below_mean) {
            0.0 => String::new(),
            x if x > 0.0 => format!(" + {x}"),
            x => format!(" - {}", -x),
        };
        let by_duty = own.period / own.inductance * own.span;
        // `d (span d - level)/dv` at rest is the share of the output, with a minus, in either topology
        let by_voltage = own.period / own.inductance * own.give;
        let ahead = match own.compute_delay {
            0 => String::new(),
            _ => format!(
                " + {} * (previous_duty - {rest}) - {} * (v_out - {})",
                short(by_duty),
                short(by_voltage),
                own.v_ref
            ),
        };
        format!("i_l{mean} - i_out / {give}{ahead}")
    }

    /// The duty of the law, as an expression of a contract.
    #[must_use]
    pub fn law(&self) -> String {
        let own = &self.nominal;
        let by_current = own.by_current();
        format!(
            "{} - {} * ({}) - {} * (v_out - {})",
            short(own.rest),
            short(by_current),
            self.surplus(),
            short(own.by_voltage(by_current)),
            own.v_ref
        )
    }
}

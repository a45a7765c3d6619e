//! A correction of the duty over operating point and rate: it describes what was measured, and is no physics.
//!
//! ```text
//! z = clamp((value - centre) / span, -1, 1)     of d (commanded), v (capacitor) and i (inductor) at the period's start
//! r = clamp((d - low-pass of d) / rate_span, -1, 1)
//! duty = d + constant + d z_d + v z_v + i z_i + rate r + squares and products of two of them
//! ```
//!
//! It acts on the duty, because that is the one number through which all topologies and both models are driven, and a share of
//! the source voltage is a voltage at the switch node as well. Outside of `centre` +- `span` it stays what it is at the edge: a
//! polynomial that is extrapolated is worse than none. At a settled point the rate is 0. A switch that is told to stay off
//! (0) or on (1) stays so. Nothing can be told apart from it: any loss, delay or offset is a function of the same signals.

use crate::entry::{Effect, Way, detail, number};
use crate::full::States;
use crate::parameters::{Empirical, Parameters};

/// Largest coefficient, duty: more than a correction.
const MOST: f64 = 0.5;
/// Time constants of the rate's low-pass after which a duty counts as forgotten.
const MEMORY: f64 = 5.0;

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "empirical",
    meaning: "correction of the duty that describes and explains nothing",
    // the low-pass of the duty is remembered from period to period
    needs: Way::Step,
    parameters: &[
        number!(
            empirical.constant,
            "1",
            "added to the duty throughout",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.d,
            "1",
            "added to the duty per scaled duty",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.v,
            "1",
            "added to the duty per scaled output voltage",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.i,
            "1",
            "added to the duty per scaled inductor current",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.rate,
            "1",
            "added to the duty per scaled rate of the duty",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.d_d,
            "1",
            "added to the duty per square of the scaled duty",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.v_v,
            "1",
            "added to the duty per square of the scaled voltage",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.i_i,
            "1",
            "added to the duty per square of the scaled current",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.rate_rate,
            "1",
            "added to the duty per square of the scaled rate",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.d_v,
            "1",
            "added to the duty per product of scaled duty and voltage",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.d_i,
            "1",
            "added to the duty per product of scaled duty and current",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.v_i,
            "1",
            "added to the duty per product of scaled voltage and current",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.d_rate,
            "1",
            "added to the duty per product of scaled duty and rate",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.v_rate,
            "1",
            "added to the duty per product of scaled voltage and rate",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        number!(
            empirical.i_rate,
            "1",
            "added to the duty per product of scaled current and rate",
            (-MOST, MOST),
            (0.0, 0.02),
            0.0
        ),
        detail!(
            empirical.d_centre,
            "1",
            "middle of the range of the duty",
            (0.0, 1.0),
            (0.3, 0.7),
            0.5
        ),
        detail!(
            empirical.d_span,
            "1",
            "half of that range",
            (1e-6, 1.0),
            (0.1, 0.5),
            0.5
        ),
        detail!(
            empirical.v_centre,
            "V",
            "middle of the range of the output voltage",
            (-1e6, 1e6),
            (12.0, 120.0),
            0.0
        ),
        detail!(
            empirical.v_span,
            "V",
            "half of that range",
            (1e-6, 1e6),
            (5.0, 60.0),
            1.0
        ),
        detail!(
            empirical.i_centre,
            "A",
            "middle of the range of the inductor current",
            (-1e6, 1e6),
            (0.0, 10.0),
            0.0
        ),
        detail!(
            empirical.i_span,
            "A",
            "half of that range",
            (1e-6, 1e6),
            (1.0, 10.0),
            1.0
        ),
        detail!(
            empirical.rate_span,
            "1",
            "half of the range of the duty less its low-pass",
            (1e-6, 1.0),
            (0.02, 0.2),
            1.0
        ),
        detail!(
            empirical.rate_time,
            "s",
            "time constant of that low-pass",
            (1e-9, 1e3),
            (1e-4, 1e-2),
            1e-3
        ),
    ],
};

impl Empirical {
    /// What the correction depends on, with the range in which it was fitted: duty (1), output voltage (V), inductor current (A).
    /// Nothing if there is no correction.
    #[must_use]
    pub fn ranges(&self) -> Vec<(&'static str, &'static str, [f64; 2])> {
        let t = self;
        let range = |centre: f64, span: f64| [centre - span, centre + span];
        let all = [
            (
                "duty",
                "",
                [t.d, t.d_d, t.d_v, t.d_i, t.d_rate],
                range(t.d_centre, t.d_span),
            ),
            (
                "v_out",
                " V",
                [t.v, t.v_v, t.d_v, t.v_i, t.v_rate],
                range(t.v_centre, t.v_span),
            ),
            (
                "i_l",
                " A",
                [t.i, t.i_i, t.d_i, t.v_i, t.i_rate],
                range(t.i_centre, t.i_span),
            ),
        ];
        let used = all.into_iter().filter(|(_, _, terms, _)| *terms != [0.0; 5]);
        used.map(|(name, unit, _, range)| (name, unit, range)).collect()
    }
}

/// The correction of one plant.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Correction {
    is_on: bool,
    terms: Empirical,
    /// What the low-pass takes of a duty in a period.
    share: f64,
    /// The period, s.
    t_sw: f64,
}

impl Correction {
    pub fn new(p: &Parameters) -> Self {
        Correction {
            is_on: EFFECT.is_on(p),
            share: 1.0 - (-p.t_sw() / p.empirical.rate_time).exp(),
            t_sw: p.t_sw(),
            terms: p.empirical.clone(),
        }
    }

    /// Periods for which its rate remembers a duty, 0 without a rate.
    pub fn memory(&self) -> usize {
        let t = &self.terms;
        let is_used = [t.rate, t.rate_rate, t.d_rate, t.v_rate, t.i_rate] != [0.0; 5];
        // beyond five time constants 0.7 % of a step are left
        let periods = (MEMORY * t.rate_time / self.t_sw).ceil();
        if is_used { periods as usize } else { 0 }
    }

    /// Moves the low-pass `slow` by a period of `duty`.
    #[inline]
    pub fn follow(&self, duty: f64, slow: &mut f64) {
        *slow += self.share * (duty - *slow);
    }

    /// The duty for a commanded one in the state `x`; `slow` is the low-pass of the duties before it.
    #[inline(always)]
    pub fn correct(&self, duty: f64, slow: &mut f64, x: &States) -> f64 {
        if !self.is_on {
            return duty;
        }
        self.corrected(duty, slow, x)
    }

    #[inline(never)]
    fn corrected(&self, duty: f64, slow: &mut f64, x: &States) -> f64 {
        let t = &self.terms;
        let scaled = |value: f64, centre: f64, span: f64| ((value - centre) / span).clamp(-1.0, 1.0);
        let (d, v, i) = (
            scaled(duty, t.d_centre, t.d_span),
            scaled(x[1], t.v_centre, t.v_span),
            scaled(x[0], t.i_centre, t.i_span),
        );
        let r = scaled(duty - *slow, 0.0, t.rate_span);
        self.follow(duty, slow);
        if duty <= 0.0 || duty >= 1.0 {
            return duty;
        }
        let straight = t.constant + t.d * d + t.v * v + t.i * i + t.rate * r;
        let squares = t.d_d * d * d + t.v_v * v * v + t.i_i * i * i + t.rate_rate * r * r;
        let products =
            t.d_v * d * v + t.d_i * d * i + t.v_i * v * i + t.d_rate * d * r + t.v_rate * v * r + t.i_rate * i * r;
        (duty + straight + squares + products).clamp(0.0, 1.0)
    }
}

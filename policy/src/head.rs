//! What the outputs of the network mean: a choice among duties, one number that becomes a duty, or the gains of a law
//! (contract sections 7, 7b, 7c and 8).

use serde::Serialize;

use crate::activation::{Activation, Shape};
use crate::interval::Interval;
use crate::model::Expr;
use crate::output::Output;
use crate::rounding::{inward_f32, nearest_f32};

/// From the last layer to a duty before the mapping.
#[derive(Debug, Clone, PartialEq)]
pub enum Head {
    /// The greedy action: a duty for each output, at least 2.
    Choice(Vec<Action>),
    /// The greedy action, whose offset is added to a law of control.
    Residual(Residual),
    /// One output, as a number.
    Continuous(Continuous),
    /// The outputs are the gains of a law of control.
    Schedule(Schedule),
    /// Several duties, each decided by its own columns (section 9b); at least 2.
    Several(Vec<Output>),
}

/// `duty = clamp(clamp(base) + offset)`: a law that is known, and what a network has learnt to add to it (section 8).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Residual {
    /// Affine law in signals and estimates; its value is a duty.
    pub base: Source,
    /// For each output what is added to the law; `duty` of an action is an offset here, -1..1.
    pub offsets: Vec<Action>,
    /// Where all of these hold nothing is added; nowhere if there are none.
    pub dead_zone: Vec<Still>,
    /// The limits of the duty, which both clamps have.
    pub limits: Interval,
}

/// An expression as it is computed and as it was written.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Source {
    /// Affine, constants folded.
    pub tree: Expr,
    /// The text.
    pub text: String,
}

/// `-within <= source <= within`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Still {
    /// What is small at rest.
    pub source: Source,
    /// How small, in the unit of the source; > 0.
    pub within: f64,
}

/// One discrete action.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Action {
    /// Duty `xi + c * phi` in binary64.
    pub duty: f64,
    /// The pair it came from, if the contract gave pairs.
    pub pair: Option<Pair>,
}

/// The paper's action form: duty = xi + c phi.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pair {
    /// Centre duty.
    pub xi: f64,
    /// Step.
    pub phi: f64,
    /// -1, 0 or 1.
    pub c: i8,
}

/// `duty = scale * s + offset`, where `s` is the output behind the squash. Duties at both ends lie within 0..1 in
/// binary32 and in binary64.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Continuous {
    /// What bounds the output.
    pub squash: Squash,
    /// Duty per unit of `s`; not 0.
    pub scale: f64,
    /// Duty at `s = 0`.
    pub offset: f64,
}

/// What makes a bounded number of an output.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Squash {
    /// A curve with two ends: an actor that was trained with it (TD3, DDPG, the mean of SAC).
    Curve(Activation),
    /// The output itself, clamped: an actor whose environment clips (the mean of PPO or A2C).
    Clip(Interval),
}

/// `duty = clamp(base + g_0 x_0 + g_1 x_1 + ...)`: a law of control whose gains the network gives (section 7c).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Schedule {
    /// Affine law in signals and estimates that the products are added to; its value is a duty.
    pub base: Source,
    /// Sound bound of the base in f32 arithmetic, over all plausible measurements.
    #[serde(skip)]
    pub base_bound: Interval,
    /// In the order of the network's outputs, which is that of the sum.
    pub gains: Vec<Gain>,
    /// Where all of these hold the base alone is commanded; nowhere if there are none.
    pub dead_zone: Vec<Still>,
    /// The limits of the duty, to which the sum is clamped.
    pub limits: Interval,
}

/// One gain: `clamp(scale * s + offset)`, where `s` is an output of the network behind its squash.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gain {
    /// What it is multiplied with.
    pub factor: Factor,
    /// What bounds the output; `None` takes it as it is, and there are limits then.
    pub squash: Option<Squash>,
    /// Gain per unit of `s`; not 0.
    pub scale: f64,
    /// Gain at `s = 0`.
    pub offset: f64,
    /// Where the gain is cut off.
    pub limits: Option<Interval>,
    /// Sound bound of the factor in f32 arithmetic, over all plausible measurements; 1 without one.
    #[serde(skip)]
    pub factor_bound: Interval,
}

/// What a gain is multiplied with.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Factor {
    /// An affine expression.
    Source(Source),
    /// The value of that feature behind its filters, before scale, offset and clip.
    Feature(usize),
    /// Nothing: the gain is added as it is.
    One,
}

impl Head {
    /// Outputs of the network.
    #[must_use]
    pub fn outputs(&self) -> usize {
        match self {
            Head::Choice(actions) => actions.len(),
            Head::Residual(head) => head.offsets.len(),
            Head::Continuous(_) => 1,
            Head::Schedule(head) => head.gains.len(),
            Head::Several(outputs) => outputs.iter().map(|output| output.head.outputs()).sum(),
        }
    }

    /// The discrete actions, whose duties are offsets of a residual head; none of a head without a choice.
    #[must_use]
    pub fn actions(&self) -> &[Action] {
        match self {
            Head::Choice(actions) => actions,
            Head::Residual(head) => &head.offsets,
            Head::Continuous(_) | Head::Schedule(_) | Head::Several(_) => &[],
        }
    }

    /// The continuous head, if it is one.
    #[must_use]
    pub fn continuous(&self) -> Option<&Continuous> {
        match self {
            Head::Continuous(head) => Some(head),
            Head::Choice(_) | Head::Residual(_) | Head::Schedule(_) | Head::Several(_) => None,
        }
    }

    /// The residual head, if it is one.
    #[must_use]
    pub fn residual(&self) -> Option<&Residual> {
        match self {
            Head::Residual(head) => Some(head),
            Head::Choice(_) | Head::Continuous(_) | Head::Schedule(_) | Head::Several(_) => None,
        }
    }

    /// The gain schedule, if it is one.
    #[must_use]
    pub fn schedule(&self) -> Option<&Schedule> {
        match self {
            Head::Schedule(head) => Some(head),
            Head::Choice(_) | Head::Residual(_) | Head::Continuous(_) | Head::Several(_) => None,
        }
    }

    /// Distance between the least and the largest duty of a head without a choice: the unit of errors of its duty.
    #[must_use]
    pub fn duty_span(&self) -> Option<f64> {
        match self {
            Head::Choice(_) | Head::Residual(_) | Head::Several(_) => None,
            Head::Continuous(head) => Some(head.span()),
            Head::Schedule(head) => Some(head.limits.high - head.limits.low),
        }
    }

    /// Whether it chooses one of several actions.
    #[must_use]
    pub fn is_choice(&self) -> bool {
        matches!(self, Head::Choice(_) | Head::Residual(_))
    }

    /// What it reads beside the network: a law of control, where that is left alone, and what gains are multiplied with.
    pub fn sources(&self) -> impl Iterator<Item = &Source> {
        let (base, zone, gains): (_, &[Still], &[Gain]) = match self {
            Head::Choice(_) | Head::Continuous(_) | Head::Several(_) => (None, &[], &[]),
            Head::Residual(head) => (Some(&head.base), &head.dead_zone, &[]),
            Head::Schedule(head) => (Some(&head.base), &head.dead_zone, &head.gains),
        };
        let factors = gains.iter().filter_map(|gain| match &gain.factor {
            Factor::Source(source) => Some(source),
            Factor::Feature(_) | Factor::One => None,
        });
        base.into_iter()
            .chain(zone.iter().map(|still| &still.source))
            .chain(factors)
    }

    /// The duties before the mapping: those of all actions, or the two ends of any other head, as binary32 has them.
    #[must_use]
    pub fn duties(&self) -> Vec<f64> {
        match self {
            Head::Choice(actions) => actions.iter().map(|action| action.duty).collect(),
            Head::Residual(Residual { limits, .. }) | Head::Schedule(Schedule { limits, .. }) => {
                let ends = inward_f32(*limits);
                ends.map_or(Vec::new(), |(low, high)| vec![f64::from(low), f64::from(high)])
            }
            Head::Continuous(head) => head.ends_32().to_vec(),
            Head::Several(outputs) => outputs.iter().flat_map(|output| output.head.duties()).collect(),
        }
    }
}

impl Squash {
    /// Least and largest value behind it.
    #[must_use]
    pub fn ends(&self) -> Interval {
        match self {
            Squash::Curve(curve) => curve.range().unwrap_or(Interval { low: -1.0, high: 1.0 }),
            Squash::Clip(clip) => *clip,
        }
    }

    /// The value of an output in binary64: a reference for what a numeric format makes of it, not its bits.
    #[must_use]
    pub fn value(&self, output: f64) -> f64 {
        match self {
            Squash::Curve(curve) => match curve.shape() {
                Shape::Curve(curve) => (curve.value)(output),
                // the reader lets no other shape through
                Shape::Hinge { .. } => output,
            },
            Squash::Clip(clip) => clamped(output, *clip),
        }
    }
}

/// Section 4: a NaN stays one, which `max` and `min` would make an end of.
fn clamped(x: f64, Interval { low, high }: Interval) -> f64 {
    match x {
        x if x < low => low,
        x if x > high => high,
        x => x,
    }
}

impl Continuous {
    /// Least and largest value behind the squash.
    #[must_use]
    pub fn squashed(&self) -> Interval {
        self.squash.ends()
    }

    /// The duty of an output in binary64: a reference for what a numeric format makes of it, not its bits.
    #[must_use]
    pub fn duty(&self, output: f64) -> f64 {
        self.scale * self.squash.value(output) + self.offset
    }

    /// Distance between the least and the largest duty: the unit of errors.
    #[must_use]
    pub fn span(&self) -> f64 {
        let Interval { low, high } = self.squashed();
        self.scale.abs() * (high - low)
    }

    /// The duties at both ends of the squash, in binary32 (section 8). A rounded product and a rounded sum keep the order of
    /// what they round, so all duties lie between.
    pub(crate) fn ends_32(&self) -> [f64; 2] {
        let Interval { low, high } = self.squashed();
        // multiplication by 1 and addition of 0 are exact: that section 8 leaves them out changes no end
        let duty = |s: f64| f64::from(nearest_f32(s) * nearest_f32(self.scale) + nearest_f32(self.offset));
        [duty(low), duty(high)]
    }

    /// The same in binary64.
    pub(crate) fn ends_64(&self) -> [f64; 2] {
        let Interval { low, high } = self.squashed();
        [low, high].map(|s| s * self.scale + self.offset)
    }
}

impl Gain {
    /// The gain of an output in binary64: a reference for what a numeric format makes of it, not its bits.
    #[must_use]
    pub fn value(&self, output: f64) -> f64 {
        let squashed = self.squash.map_or(output, |squash| squash.value(output));
        let gain = self.scale * squashed + self.offset;
        self.limits.map_or(gain, |limits| clamped(gain, limits))
    }

    /// Least and largest gain, as binary32 has them: rounded products and sums keep the order of what they round.
    #[must_use]
    pub fn ends(&self) -> Interval {
        let nearest = |x: f64| f64::from(nearest_f32(x));
        let limits = self.limits.map(|limits| Interval {
            low: nearest(limits.low),
            high: nearest(limits.high),
        });
        let Some(squash) = self.squash else {
            // the reader asks for limits where nothing else bounds the output
            return limits.unwrap_or(Interval { low: 0.0, high: 0.0 });
        };
        let Interval { low, high } = squash.ends();
        let ends = [low, high].map(|s| {
            let gain = f64::from(nearest_f32(s) * nearest_f32(self.scale) + nearest_f32(self.offset));
            limits.map_or(gain, |limits| clamped(gain, limits))
        });
        Interval {
            low: ends[0].min(ends[1]),
            high: ends[0].max(ends[1]),
        }
    }

    /// Distance between the least and the largest gain: the unit of errors.
    #[must_use]
    pub fn span(&self) -> f64 {
        let Interval { low, high } = self.ends();
        high - low
    }

    /// Largest magnitude of the factor.
    #[must_use]
    pub fn largest_factor(&self) -> f64 {
        self.factor_bound.low.abs().max(self.factor_bound.high.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_is_squashed_scaled_shifted_and_cut_off() {
        let gain = |squash: Option<Squash>, scale: f64, limits: Option<Interval>| Gain {
            factor: Factor::One,
            squash,
            scale,
            offset: 0.5,
            limits,
            factor_bound: Interval { low: 1.0, high: 1.0 },
        };
        let clip = Some(Squash::Clip(Interval { low: -1.0, high: 1.0 }));
        let cut = Interval { low: 0.25, high: 0.625 };
        let values = |gain: &Gain| [-9.0, 0.25, 9.0].map(|output| gain.value(output));
        let all = gain(clip, -0.5, None);
        assert_eq!(values(&all), [1.0, 0.375, 0.0]);
        assert_eq!(all.ends(), Interval { low: 0.0, high: 1.0 });
        let limited = gain(clip, -0.5, Some(cut));
        assert_eq!(values(&limited), [0.625, 0.375, 0.25]);
        assert_eq!((limited.ends(), limited.span()), (cut, 0.375));
        let plain = gain(None, 0.25, Some(cut));
        assert_eq!(values(&plain), [0.25, 0.5625, 0.625]);
        assert_eq!(plain.ends(), cut);
        assert!(all.value(f64::NAN).is_nan() && limited.value(f64::NAN).is_nan());
    }

    #[test]
    fn a_duty_is_a_line_over_the_clipped_output() {
        let head = Continuous {
            squash: Squash::Clip(Interval { low: -1.0, high: 1.0 }),
            scale: 0.25,
            offset: 0.5,
        };
        let duties = [-3.0, 0.5, 3.0].map(|output| head.duty(output));
        assert!(duties == [0.25, 0.625, 0.75] && head.span() == 0.5, "{duties:?}");
        assert!(head.duty(f64::NAN).is_nan());
    }
}

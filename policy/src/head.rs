//! What the outputs of the network mean: a choice among duties, or one number that becomes a duty (contract sections 7
//! and 8).

use serde::Serialize;

use crate::activation::{Activation, Shape};
use crate::interval::Interval;
use crate::model::Expr;
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

impl Head {
    /// Outputs of the network.
    #[must_use]
    pub fn outputs(&self) -> usize {
        match self {
            Head::Choice(actions) => actions.len(),
            Head::Residual(head) => head.offsets.len(),
            Head::Continuous(_) => 1,
        }
    }

    /// The discrete actions, whose duties are offsets of a residual head; none of a continuous one.
    #[must_use]
    pub fn actions(&self) -> &[Action] {
        match self {
            Head::Choice(actions) => actions,
            Head::Residual(head) => &head.offsets,
            Head::Continuous(_) => &[],
        }
    }

    /// The continuous head, if it is one.
    #[must_use]
    pub fn continuous(&self) -> Option<&Continuous> {
        match self {
            Head::Choice(_) | Head::Residual(_) => None,
            Head::Continuous(head) => Some(head),
        }
    }

    /// The residual head, if it is one.
    #[must_use]
    pub fn residual(&self) -> Option<&Residual> {
        match self {
            Head::Residual(head) => Some(head),
            Head::Choice(_) | Head::Continuous(_) => None,
        }
    }

    /// What it reads beside the network: a law of control and where that is left alone.
    pub fn sources(&self) -> impl Iterator<Item = &Source> {
        self.residual().into_iter().flat_map(|head| {
            let still = head.dead_zone.iter().map(|still| &still.source);
            std::iter::once(&head.base).chain(still)
        })
    }

    /// The duties before the mapping: those of all actions, or the two ends of a continuous or a residual head, as binary32
    /// has them.
    #[must_use]
    pub fn duties(&self) -> Vec<f64> {
        match self {
            Head::Choice(actions) => actions.iter().map(|action| action.duty).collect(),
            Head::Residual(head) => {
                let ends = inward_f32(head.limits);
                ends.map_or(Vec::new(), |(low, high)| vec![f64::from(low), f64::from(high)])
            }
            Head::Continuous(head) => head.ends_32().to_vec(),
        }
    }
}

impl Continuous {
    /// Least and largest value behind the squash.
    #[must_use]
    pub fn squashed(&self) -> Interval {
        match self.squash {
            Squash::Curve(curve) => curve.range().unwrap_or(Interval { low: -1.0, high: 1.0 }),
            Squash::Clip(clip) => clip,
        }
    }

    /// The duty of an output in binary64: a reference for what a numeric format makes of it, not its bits.
    #[must_use]
    pub fn duty(&self, output: f64) -> f64 {
        let squashed = match self.squash {
            Squash::Curve(curve) => match curve.shape() {
                Shape::Curve(curve) => (curve.value)(output),
                // the reader lets no other shape through
                Shape::Hinge { .. } => output,
            },
            // section 4: a NaN stays one, which `max` and `min` would make an end of
            Squash::Clip(clip) if output < clip.low => clip.low,
            Squash::Clip(clip) if output > clip.high => clip.high,
            Squash::Clip(_) => output,
        };
        self.scale * squashed + self.offset
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

#[cfg(test)]
mod tests {
    use super::*;

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

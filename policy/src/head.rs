//! What the outputs of the network mean: a choice among duties, or one number that becomes a duty (contract sections 7
//! and 8).

use serde::Serialize;

use crate::activation::{Activation, Shape};
use crate::interval::Interval;
use crate::rounding::nearest_f32;

/// From the last layer to a duty before the mapping.
#[derive(Debug, Clone, PartialEq)]
pub enum Head {
    /// The greedy action: a duty for each output, at least 2.
    Choice(Vec<Action>),
    /// One output, as a number.
    Continuous(Continuous),
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
            Head::Continuous(_) => 1,
        }
    }

    /// The discrete actions; none of a continuous head.
    #[must_use]
    pub fn actions(&self) -> &[Action] {
        match self {
            Head::Choice(actions) => actions,
            Head::Continuous(_) => &[],
        }
    }

    /// The continuous head, if it is one.
    #[must_use]
    pub fn continuous(&self) -> Option<&Continuous> {
        match self {
            Head::Choice(_) => None,
            Head::Continuous(head) => Some(head),
        }
    }

    /// The duties before the mapping: those of all actions, or the two ends of a continuous head, as binary32 has them.
    #[must_use]
    pub fn duties(&self) -> Vec<f64> {
        match self {
            Head::Choice(actions) => actions.iter().map(|action| action.duty).collect(),
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

//! From the outputs of the network to a duty (contract sections 7, 7b, 7c and 8).

use ndarray::ArrayView1;
use policy::{Factor, Squash};

use crate::activation::activate;
use crate::feature::{Inputs, Source};
use crate::network::argmax;
use crate::real::{Range, Real};
use crate::trace::FeatureTrace;

/// What the outputs mean, in the format.
#[derive(Debug, Clone)]
pub(crate) enum Head<T> {
    /// Duty per action.
    Choice(Vec<T>),
    /// Offset per action, and what they are added to.
    Residual(Vec<T>, Law<T>),
    /// One output as a duty.
    Continuous(Continuous<T>),
    /// The outputs as gains of a law.
    Schedule(Schedule<T>),
}

/// The law of control of a residual head (section 8).
#[derive(Debug, Clone)]
pub(crate) struct Law<T> {
    base: Source<T>,
    /// What is within its range in the dead zone.
    still: Vec<(Source<T>, Range<T>)>,
    limits: Range<T>,
}

/// What a law says in a step; the default where there is none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Base<T> {
    /// The law's duty; of a residual head clamped to the limits, of a gain schedule the base as it is.
    pub duty: T,
    /// Nothing is added to it: the dead zone.
    pub still: bool,
}

/// Section 7c.
#[derive(Debug, Clone)]
pub(crate) struct Schedule<T> {
    base: Source<T>,
    still: Vec<(Source<T>, Range<T>)>,
    gains: Vec<Gain<T>>,
    limits: Range<T>,
}

/// A gain and what it is multiplied with.
#[derive(Debug, Clone)]
pub(crate) struct Gain<T> {
    factor: Multiplied<T>,
    /// `None` takes the output as it is.
    squash: Option<Squash>,
    /// The ends of the clip.
    clip: Option<Range<T>>,
    /// `None` where it is exactly 1.
    scale: Option<T>,
    /// `None` where it is exactly 0.
    offset: Option<T>,
    limits: Option<Range<T>>,
}

#[derive(Debug, Clone)]
enum Multiplied<T> {
    Source(Source<T>),
    /// Behind its filters.
    Feature(usize),
    Nothing,
}

/// Section 7b.
#[derive(Debug, Clone)]
pub(crate) struct Continuous<T> {
    squash: Squash,
    /// The ends of the clip or of the curve.
    ends: Range<T>,
    /// `None` where it is exactly 1.
    scale: Option<T>,
    /// `None` where it is exactly 0.
    offset: Option<T>,
}

impl<T: Real> Head<T> {
    pub fn new(head: &policy::Head) -> Self {
        match head {
            policy::Head::Choice(actions) => {
                Self::Choice(actions.iter().map(|action| T::nearest(action.duty)).collect())
            }
            policy::Head::Residual(head) => {
                let law = Law {
                    base: Source::new(&head.base.tree),
                    still: still(&head.dead_zone),
                    limits: Range::inwards(head.limits),
                };
                let offsets = head.offsets.iter().map(|action| T::nearest(action.duty));
                Self::Residual(offsets.collect(), law)
            }
            policy::Head::Continuous(head) => {
                let ends = head.squashed();
                Self::Continuous(Continuous {
                    squash: head.squash,
                    ends: Range {
                        lo: T::nearest(ends.low),
                        hi: T::nearest(ends.high),
                    },
                    // left out by what the contract says, not by what it rounds to
                    scale: (head.scale != 1.0).then(|| T::nearest(head.scale)),
                    offset: (head.offset != 0.0).then(|| T::nearest(head.offset)),
                })
            }
            policy::Head::Schedule(head) => Self::Schedule(Schedule {
                base: Source::new(&head.base.tree),
                still: still(&head.dead_zone),
                gains: head.gains.iter().map(Gain::new).collect(),
                limits: Range::inwards(head.limits),
            }),
            // an output has one of the others: `Policy::paths` takes this apart
            policy::Head::Several(_) => Self::Choice(Vec::new()),
        }
    }

    /// Outputs of the network.
    pub fn outputs(&self) -> usize {
        match self {
            Self::Choice(table) | Self::Residual(table, _) => table.len(),
            Self::Continuous(_) => 1,
            Self::Schedule(head) => head.gains.len(),
        }
    }

    /// What the law of a residual head or of a gain schedule says.
    pub fn base(&self, inputs: Inputs<'_, T>) -> Base<T> {
        let (duty, still) = match self {
            Self::Residual(_, law) => (law.limits.clamp(law.base.value(inputs)), &law.still),
            Self::Schedule(head) => (head.base.value(inputs), &head.still),
            Self::Choice(_) | Self::Continuous(_) => return Base::default(),
        };
        let within = |(source, range): &(Source<T>, Range<T>)| range.contains(source.value(inputs));
        Base {
            duty,
            still: !still.is_empty() && still.iter().all(within),
        }
    }

    /// What the gains are multiplied with, 1 where that is nothing; nothing of any other head.
    pub fn factors(&self, inputs: Inputs<'_, T>, features: &[FeatureTrace<T>], to: &mut [T]) {
        let Self::Schedule(head) = self else { return };
        for (gain, to) in head.gains.iter().zip(to) {
            *to = match &gain.factor {
                Multiplied::Source(source) => source.value(inputs),
                Multiplied::Feature(index) => features[*index].filter_output(),
                Multiplied::Nothing => T::nearest(1.0),
            };
        }
    }

    /// How many of them there are.
    pub fn factor_count(&self) -> usize {
        match self {
            Self::Schedule(head) => head.gains.len(),
            Self::Choice(_) | Self::Residual(..) | Self::Continuous(_) => 0,
        }
    }

    /// The duty of a gain schedule, of its outputs and factors (section 7c); `None` of any other head.
    pub fn scheduled(&self, base: Base<T>, factors: &[T], outputs: ArrayView1<'_, T>) -> Option<T> {
        let Self::Schedule(head) = self else { return None };
        let mut d = base.duty;
        for ((gain, x), y) in head.gains.iter().zip(factors).zip(outputs) {
            let g = gain.of(*y);
            d = d + match gain.factor {
                Multiplied::Source(_) | Multiplied::Feature(_) => g * *x,
                Multiplied::Nothing => g,
            };
        }
        Some(head.limits.clamp(if base.still { base.duty } else { d }))
    }

    /// The duty before the mapping of what [`Head::decide`] or [`Head::choose`] gave.
    pub fn duty(&self, base: Base<T>, chosen: T) -> T {
        match self {
            Self::Residual(_, law) => {
                let offset = if base.still { T::ZERO } else { chosen };
                law.limits.clamp(base.duty + offset)
            }
            Self::Choice(_) | Self::Continuous(_) | Self::Schedule(_) => chosen,
        }
    }

    /// Action index of a network's outputs, and their duty; of a residual head the offset.
    pub fn decide(&self, outputs: ArrayView1<'_, T>) -> (u32, T) {
        match self {
            Self::Choice(table) | Self::Residual(table, _) => {
                let index = argmax(outputs);
                (index as u32, table[index])
            }
            Self::Continuous(head) => (0, head.duty(outputs[0])),
            // a measurement makes a duty of them: `scheduled`
            Self::Schedule(head) => (0, head.limits.lo),
        }
    }

    /// Index and duty, or offset, of an action that was chosen elsewhere; `None` where there are none.
    pub fn choose(&self, action_index: u32) -> Option<(u32, T)> {
        match self {
            Self::Choice(table) | Self::Residual(table, _) => {
                let index = (action_index as usize).min(table.len().checked_sub(1)?);
                Some((index as u32, table[index]))
            }
            Self::Continuous(_) | Self::Schedule(_) => None,
        }
    }

    /// The duties of all actions, or those at both ends of all others.
    pub fn duties(&self) -> Vec<T> {
        match self {
            Self::Choice(table) => table.clone(),
            Self::Residual(_, law) => vec![law.limits.lo, law.limits.hi],
            Self::Schedule(head) => vec![head.limits.lo, head.limits.hi],
            Self::Continuous(head) => [head.ends.lo, head.ends.hi].map(|s| head.scaled(s)).to_vec(),
        }
    }
}

fn still<T: Real>(zone: &[policy::Still]) -> Vec<(Source<T>, Range<T>)> {
    let one = |still: &policy::Still| {
        let within = T::nearest(still.within);
        let range = Range {
            lo: -within,
            hi: within,
        };
        (Source::new(&still.source.tree), range)
    };
    zone.iter().map(one).collect()
}

impl<T: Real> Gain<T> {
    fn new(gain: &policy::Gain) -> Self {
        Self {
            factor: match &gain.factor {
                Factor::Source(source) => Multiplied::Source(Source::new(&source.tree)),
                Factor::Feature(index) => Multiplied::Feature(*index),
                Factor::One => Multiplied::Nothing,
            },
            squash: gain.squash,
            clip: match gain.squash {
                Some(Squash::Clip(clip)) => Some(Range::nearest(clip)),
                Some(Squash::Curve(_)) | None => None,
            },
            scale: (gain.scale != 1.0).then(|| T::nearest(gain.scale)),
            offset: (gain.offset != 0.0).then(|| T::nearest(gain.offset)),
            limits: gain.limits.map(Range::nearest),
        }
    }

    /// The gain of an output.
    pub fn of(&self, output: T) -> T {
        let mut s = [output];
        if let Some(Squash::Curve(curve)) = self.squash {
            activate(curve, s.iter_mut());
        }
        let s = self.clip.map_or(s[0], |clip| clip.clamp(s[0]));
        let scaled = self.scale.map_or(s, |scale| s * scale);
        let shifted = self.offset.map_or(scaled, |offset| scaled + offset);
        self.limits.map_or(shifted, |limits| limits.clamp(shifted))
    }
}

impl<T: Real> Schedule<T> {
    pub fn gains(&self) -> &[Gain<T>] {
        &self.gains
    }
}

impl<T: Real> Continuous<T> {
    pub fn duty(&self, output: T) -> T {
        let mut s = [output];
        match self.squash {
            Squash::Curve(curve) => activate(curve, s.iter_mut()),
            Squash::Clip(_) => s[0] = self.ends.clamp(output),
        }
        self.scaled(s[0])
    }

    fn scaled(&self, s: T) -> T {
        let scaled = self.scale.map_or(s, |scale| s * scale);
        self.offset.map_or(scaled, |offset| scaled + offset)
    }
}

#[cfg(test)]
mod tests {
    use ndarray::aview1;
    use policy::{Activation, Interval};

    use super::*;

    fn head(squash: Squash, [lo, hi]: [f32; 2], scale: Option<f32>, offset: Option<f32>) -> Head<f32> {
        Head::Continuous(Continuous {
            squash,
            ends: Range { lo, hi },
            scale,
            offset,
        })
    }

    fn tanh(scale: Option<f32>, offset: Option<f32>) -> Head<f32> {
        head(Squash::Curve(Activation::Tanh), [-1.0, 1.0], scale, offset)
    }

    #[test]
    fn an_output_is_squashed_then_scaled_then_shifted() {
        let (index, duty) = tanh(Some(0.45), Some(0.5)).decide(aview1(&[0.3_f32]));
        assert_eq!(index, 0);
        // libm's tanh in the place of the contract's: 4e-7 at most beside it
        let expected = f64::from(0.3_f32).tanh() * f64::from(0.45_f32) + 0.5;
        assert!((f64::from(duty) - expected).abs() < 4e-7, "{duty} {expected}");
        // shifted first it would be another number
        assert!((f64::from(duty) - 0.45 * (0.3_f64.tanh() + 0.5)).abs() > 1e-2);
    }

    #[test]
    fn a_clip_acts_before_scale_and_offset() {
        let clip = Squash::Clip(Interval { low: -1.0, high: 1.0 });
        let clipped = head(clip, [-1.0, 1.0], Some(0.25), Some(0.5));
        for (output, duty) in [(-7.0, 0.25), (7.0, 0.75), (0.5, 0.625), (f32::INFINITY, 0.75)] {
            assert_eq!(clipped.decide(aview1(&[output])).1, duty, "{output}");
        }
    }

    #[test]
    fn every_duty_lies_between_those_of_both_ends() {
        for squashed in [
            tanh(Some(0.45), Some(0.5)),
            tanh(Some(-0.3), Some(0.55)),
            tanh(Some(0.1), None),
        ] {
            let ends = squashed.duties();
            let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            for bits in (0..=f32::MAX.to_bits()).step_by(100_003) {
                for x in [f32::from_bits(bits), -f32::from_bits(bits)] {
                    let duty = squashed.decide(aview1(&[x])).1;
                    assert!((low..=high).contains(&duty), "{x}: {duty}");
                }
            }
            assert_eq!(squashed.decide(aview1(&[f32::MAX])).1, ends[1], "the end is reached");
        }
    }

    #[test]
    fn a_scale_of_1_and_an_offset_of_0_change_no_bit() {
        // -0 + 0 would be +0
        assert_eq!(tanh(None, None).decide(aview1(&[-0.0_f32])).1.to_bits(), 1 << 31);
    }

    #[test]
    fn nothing_can_be_chosen_from_a_continuous_head() {
        assert_eq!(tanh(None, None).choose(3), None);
        assert_eq!(Head::Choice(vec![0.1_f32, 0.2]).choose(3), Some((1, 0.2)));
    }
}

//! What an error of a continuous actor's output does to its duty (numeric contract, section 7b).

use policy::{Continuous, Interval, Shape, Squash};

/// Unit roundoff of binary32.
pub(crate) const UNIT_32: f64 = 1.0 / 16_777_216.0;
/// More than the rounding errors of a few operations in the subnormal range of binary32.
pub(crate) const TINY_32: f64 = 1e-40;

/// Bound of |duty in the format - real duty|, where the real output lies in `real` and that of the format is at most `error` off.
///
/// The duty is `scale * s + offset`, and `s` moves by at most its largest slope times the error, wherever between the two outputs.
pub(crate) fn duty_bound(head: &Continuous, real: Interval, error: f64) -> f64 {
    let Squashed {
        error: squashed,
        own,
        largest,
    } = squashed(Some(head.squash), real, error);
    let scale = head.scale.abs();
    // scale, offset, product and sum are rounded once each, at magnitudes of at most these
    let rounded = 4.0 * UNIT_32 * (scale * largest + head.offset.abs()) + TINY_32;
    // no duty of the format, and no real one, leaves the head's range by more than its own rounding
    let most = head.span() + rounded + scale * own;
    // 1e-12: more than this line rounds
    ((scale * squashed + rounded).min(most)) * (1.0 + 1e-6)
}

/// An output behind its squash.
pub(crate) struct Squashed {
    /// Bound of how far that of the format is off.
    pub error: f64,
    /// The part of it that the squash itself makes in binary32.
    pub own: f64,
    /// Largest magnitude.
    pub largest: f64,
}

/// An output of which the real value lies in `real`, and that of the format at most `error` off; `None` takes it as it is.
pub(crate) fn squashed(squash: Option<Squash>, real: Interval, error: f64) -> Squashed {
    let hull = Interval {
        low: (real.low - error).next_down(),
        high: (real.high + error).next_up(),
    };
    let Interval { low, high } = squash.map_or(hull, |squash| squash.ends());
    let largest = low.abs().max(high.abs());
    let (slope, own) = match squash {
        None => (1.0, 0.0),
        Some(Squash::Curve(curve)) => match curve.shape() {
            // what binary32 makes of the curve, beside the curve
            Shape::Curve(curve) => (curve.slopes(hull).1, curve.error_32.at(hull.high)),
            Shape::Hinge { .. } => (1.0, 0.0),
        },
        // both outputs beyond one end are cut to the same number
        Some(Squash::Clip(clip)) if hull.low >= clip.high || hull.high <= clip.low => (0.0, UNIT_32 * largest),
        Some(Squash::Clip(_)) => (1.0, UNIT_32 * largest),
    };
    Squashed {
        error: slope * error + own + TINY_32,
        own,
        largest,
    }
}

#[cfg(test)]
mod tests {
    use policy::Activation;

    use super::*;

    fn tanh() -> Continuous {
        Continuous {
            squash: Squash::Curve(Activation::Tanh),
            scale: 0.4,
            offset: 0.5,
        }
    }

    fn clip() -> Continuous {
        Continuous {
            squash: Squash::Clip(Interval { low: 0.1, high: 0.9 }),
            scale: 1.0,
            offset: 0.0,
        }
    }

    /// The duty in binary32, section by section.
    fn in_binary32(head: &Continuous, y: f32) -> f64 {
        let s = match head.squash {
            Squash::Curve(_) => f64::from(y).tanh() as f32,
            Squash::Clip(clip) => y.clamp(clip.low as f32, clip.high as f32),
        };
        f64::from(s * head.scale as f32 + head.offset as f32)
    }

    #[test]
    fn the_bound_holds_for_outputs_that_are_off() {
        for head in [tanh(), clip()] {
            for n in -400..=400 {
                let real = f64::from(n) / 100.0;
                for error in [0.0, 1e-6, 1e-3, 0.2] {
                    let bound = duty_bound(&head, Interval { low: real, high: real }, error);
                    for off in [-error, error] {
                        let y = (real + off) as f32;
                        let exact = match head.squash {
                            Squash::Curve(_) => head.scale * real.tanh() + head.offset,
                            Squash::Clip(clip) => real.clamp(clip.low, clip.high),
                        };
                        let apart = (in_binary32(&head, y) - exact).abs();
                        // the output itself is rounded to binary32 here
                        assert!(apart <= bound + 4.0 * UNIT_32, "{real} {error}: {apart} {bound}");
                    }
                }
            }
        }
    }

    #[test]
    fn where_the_actor_is_saturated_an_error_hardly_counts() {
        let at = |head: &Continuous, y: f64| duty_bound(head, Interval { low: y, high: y }, 0.1);
        assert!(at(&tanh(), 0.0) > 0.03 && at(&tanh(), 0.0) < 0.041);
        assert!(at(&tanh(), 6.0) < 1e-5);
        assert!(at(&clip(), 0.5) > 0.09 && at(&clip(), 0.5) < 0.11);
        assert!(at(&clip(), 1.5) < 1e-6);
    }
}

//! What errors of a network's outputs do to the duty of the law whose gains they are (numeric contract, section 7c).

use policy::{Gain, Interval, Schedule};

use crate::actor::{Squashed, TINY_32, UNIT_32, squashed};

/// Bound of |duty in the format - real duty|, of real outputs with the bounds of their errors in the format.
///
/// *Real* is the law in exact arithmetic on the base and the factors that the format has. Each factor is as large as the
/// plausible measurements let it be. The clamp to the limits of the duty moves two numbers no further apart.
pub(crate) fn duty_bound(head: &Schedule, outputs: &[(Interval, f64)]) -> f64 {
    // what is added up so far: its error, and the largest magnitude that it can have in the format
    let (mut error, mut sum) = (0.0, magnitude(head.base_bound));
    for (gain, (real, off)) in head.gains.iter().zip(outputs) {
        let product = largest(gain) * gain.largest_factor();
        sum += product;
        // the product and the sum round once each; a few roundings more in `sum` drown in the last line's share
        error += gain.largest_factor() * gain_bound(gain, *real, *off) + UNIT_32 * (product + sum) + 2.0 * TINY_32;
    }
    let limits = head.limits;
    // the limits are rounded as well
    let ends = UNIT_32 * magnitude(limits);
    // 1e-6: more than all that is not counted above, and than these lines round
    (error.min(limits.high - limits.low) + ends) * (1.0 + 1e-6)
}

/// Bound of |gain in the format - real gain|.
pub(crate) fn gain_bound(gain: &Gain, real: Interval, off: f64) -> f64 {
    let Squashed { error, largest: s, .. } = squashed(gain.squash, real, off);
    let scale = gain.scale.abs();
    // scale, offset, product and sum are rounded once each, at magnitudes of at most these, and so are the gain's own limits
    let rounded = 4.0 * UNIT_32 * (scale * s + gain.offset.abs()) + UNIT_32 * largest(gain) + TINY_32;
    // both gains lie within the ends, but for their rounding
    (scale * error + rounded).min(gain.span() + 4.0 * UNIT_32 * largest(gain) + TINY_32)
}

fn largest(gain: &Gain) -> f64 {
    magnitude(gain.ends())
}

fn magnitude(of: Interval) -> f64 {
    of.low.abs().max(of.high.abs())
}

#[cfg(test)]
mod tests {
    use policy::{Activation, Expr, Factor, Source, Squash};

    use super::*;

    const FACTORS: [f32; 3] = [-7.5, 0.37, 1.0];

    fn head() -> Schedule {
        let base = Source {
            tree: Expr::Constant(0.4),
            text: String::new(),
        };
        let gain = |squash: Option<Squash>, factor: f32, limits: Option<Interval>| Gain {
            factor: match factor {
                1.0 => Factor::One,
                _ => Factor::Source(base.clone()),
            },
            squash,
            scale: 0.03,
            offset: 0.01,
            limits,
            factor_bound: Interval {
                low: -f64::from(factor.abs()),
                high: f64::from(factor.abs()),
            },
        };
        let limits = Some(Interval { low: -0.01, high: 0.03 });
        Schedule {
            gains: vec![
                gain(Some(Squash::Curve(Activation::Tanh)), FACTORS[0], None),
                gain(
                    Some(Squash::Clip(Interval { low: -1.0, high: 0.5 })),
                    FACTORS[1],
                    limits,
                ),
                gain(None, FACTORS[2], limits),
            ],
            base: base.clone(),
            base_bound: Interval { low: 0.4, high: 0.4 },
            dead_zone: Vec::new(),
            limits: Interval { low: 0.05, high: 0.95 },
        }
    }

    /// The duty in binary32, section by section; the tanh is that of libm, rounded.
    fn in_binary32(head: &Schedule, outputs: [f64; 3]) -> f64 {
        let mut d = 0.4_f32;
        for ((gain, y), x) in head.gains.iter().zip(outputs).zip(FACTORS) {
            let y = y as f32;
            let s = match gain.squash {
                Some(Squash::Curve(_)) => f64::from(y).tanh() as f32,
                Some(Squash::Clip(clip)) => y.clamp(clip.low as f32, clip.high as f32),
                None => y,
            };
            let g = s * gain.scale as f32 + gain.offset as f32;
            let g = gain
                .limits
                .map_or(g, |limits| g.clamp(limits.low as f32, limits.high as f32));
            d += if matches!(gain.factor, Factor::One) { g } else { g * x };
        }
        f64::from(d.clamp(0.05, 0.95))
    }

    fn exact(head: &Schedule, outputs: [f64; 3]) -> f64 {
        let gains = head.gains.iter().zip(outputs).zip(FACTORS);
        let sum: f64 = gains.map(|((gain, y), x)| gain.value(y) * f64::from(x)).sum();
        (0.4 + sum).clamp(0.05, 0.95)
    }

    #[test]
    fn the_bound_holds_for_outputs_that_are_off() {
        let head = head();
        let mut largest = 0.0_f64;
        for n in -300..=300 {
            let real = [f64::from(n) / 100.0, f64::from(n) / 211.0, f64::from(-n) / 170.0];
            for off in [0.0, 1e-6, 1e-3, 0.2] {
                let outputs = real.map(|y| (Interval { low: y, high: y }, off));
                let bound = duty_bound(&head, &outputs);
                for signs in 0..8_u32 {
                    let moved = [0, 1, 2].map(|i| real[i] + if signs >> i & 1 == 1 { off } else { -off });
                    let apart = (in_binary32(&head, moved) - exact(&head, real)).abs();
                    // the outputs themselves are rounded to binary32 here
                    assert!(apart <= bound + 1e-6, "{real:?} {off}: {apart} {bound}");
                    largest = largest.max(apart / (bound + 1e-6));
                }
            }
        }
        assert!(
            largest > 0.5,
            "a bound that is far above all that happens says nothing: {largest}"
        );
    }

    #[test]
    fn the_limits_of_the_duty_bound_the_error() {
        let wide = Interval {
            low: -100.0,
            high: 100.0,
        };
        let bound = duty_bound(&head(), &[(wide, 50.0); 3]);
        assert!(bound < 0.91 && bound > 0.2, "{bound}");
    }
}

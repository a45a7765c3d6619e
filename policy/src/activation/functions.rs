//! The curves: what section 6 of the numeric contract computes, in binary64, and what is true of it.
//!
//! All but two rest on one rational tanh, so that there is one approximation to bound, to prove and to keep fast. The bounds of
//! the errors were taken over every binary32 number that the check of a policy lets arise (`every_number_of_a_curve` in `interp`), and
//! rounded up. Where x is large a value is rounded to its last place: half a unit is 6.0e-8 of it.

use super::curve::{Bend, Curve, Error};
use crate::interval::Interval;

/// Numerator of the contract's tanh, lowest power first.
pub const TANH_NUMERATOR: [f64; 5] = [
    0.999_999_9,
    0.133_732_08,
    0.003_486_593_3,
    2.047_200_7e-5,
    1.318_444_4e-8,
];
/// Denominator of the contract's tanh, lowest power first.
pub const TANH_DENOMINATOR: [f64; 5] = [1.0, 0.467_065_04, 0.025_842_024, 0.000_327_140_35, 7.702_759e-7];
/// Beyond this magnitude the contract's tanh is that of the end of its range.
// tanh(9) lies within 3.1e-8 of 1: cutting off there costs less than the 4e-7 of the whole approximation
pub const TANH_RANGE: f64 = 9.0;

/// Beyond this magnitude a SiLU is x or about 0: where its tanh, of half of it, ends as well.
pub const SILU_RANGE: f64 = 2.0 * TANH_RANGE;
/// What the argument of GELU's tanh is of x, by powers of x^2: least squares with weights, which level the largest error of
/// `x (1 + tanh)/2` to 6.3e-7. One term less leaves 3.0e-6, one more 2.9e-7, below the error of the tanh.
pub const GELU_TERMS: [f64; 6] = [
    0.797_872_165,
    0.036_366_780_8,
    -5.863_892_84e-5,
    -4.705_679_26e-5,
    2.775_528_46e-6,
    -5.575_962_19e-8,
];
/// Beyond this magnitude a GELU is x or about 0: 5.6 (1 - Phi(5.6)) is 6e-8.
pub const GELU_RANGE: f64 = 5.6;
/// sqrt(2/pi), and 0.044715 of it: the definition of the approximation.
pub const GELU_TANH_TERMS: [f64; 2] = [0.797_884_560_802_865_4, 0.035_677_408_136_300_125];
/// Beyond this magnitude it is x or about 0: the tanh of 12.5 is 1 in every format.
pub const GELU_TANH_RANGE: f64 = 6.0;
/// Where the hard sigmoid and the hard swish end to bend.
pub const HARD_RANGE: f64 = 3.0;
/// Slope of the hard sigmoid.
pub const HARD_SLOPE: f64 = 1.0 / 6.0;
/// `2 artanh(v) / v` by powers of v^2 for v up to 1/3: the first is exact, the others are minimax, 8.4e-8 off.
pub const SOFTPLUS_TERMS: [f64; 4] = [2.0, 0.666_761_4, 0.395_672_6, 0.343_975_4];

/// Slope 1 at 0, and flatter outwards.
const STEEP_AT_ZERO: &[Bend] = &[Bend {
    x: 0.0,
    slopes: (1.0, 1.0),
}];
const UNIT: Interval = Interval { low: 0.0, high: 1.0 };
const BOTH: Interval = Interval { low: -1.0, high: 1.0 };

const fn error(absolute: f64, relative: f64) -> Error {
    Error { absolute, relative }
}

pub(super) static TANH: Curve = Curve {
    value: tanh,
    slope: |x| {
        let y = tanh(x);
        1.0 - y * y
    },
    // a slope changes by at most twice as much as the value it is taken from; the rest of 2.5 is room for roundings
    slope_near: 2.5 * 5e-7,
    slope_of_value: Some(|y| 1.0 - y * y),
    bends: STEEP_AT_ZERO,
    least: None,
    range: Some(BOTH),
    // section 6 bounds the binary32 value by 4e-7, section 11 the binary64 value by 4e-8: this holds for both
    near: error(4e-7 + 1e-7, 0.0),
    error_32: error(4e-7, 0.0),
    real: libm::tanh,
};

pub(super) static SOFTSIGN: Curve = Curve {
    value: softsign,
    slope: |x| {
        let below = 1.0 - softsign(x).abs();
        below * below
    },
    slope_near: 2.5 * 3e-16,
    slope_of_value: Some(|y| (1.0 - y.abs()) * (1.0 - y.abs())),
    bends: STEEP_AT_ZERO,
    least: None,
    range: Some(BOTH),
    // two roundings of binary64, then of binary32, each of at most half a unit of a value up to 1
    near: error(3e-16, 0.0),
    error_32: error(1.3e-7, 0.0),
    // one sum and one quotient: no libm could differ here
    real: softsign,
};

pub(super) static SIGMOID: Curve = Curve {
    value: sigmoid,
    slope: |x| {
        let y = sigmoid(x);
        y * (1.0 - y)
    },
    // the derivative of y (1 - y) is at most 1: the error of y
    slope_near: 2e-8,
    slope_of_value: Some(|y| y * (1.0 - y)),
    bends: &[Bend {
        x: 0.0,
        slopes: (0.25, 0.25),
    }],
    least: None,
    range: Some(UNIT),
    near: error(2e-8, 0.0),
    error_32: error(2.5e-7, 0.0),
    real: |x| 1.0 / (1.0 + libm::exp(-x)),
};

pub(super) static HARD_SIGMOID: Curve = Curve {
    value: hard_sigmoid,
    slope: |x| if x.abs() < HARD_RANGE { HARD_SLOPE } else { 0.0 },
    slope_near: 1e-16,
    slope_of_value: Some(|y| if 0.0 < y && y < 1.0 { HARD_SLOPE as f32 } else { 0.0 }),
    bends: &[
        Bend {
            x: -HARD_RANGE,
            slopes: (0.0, HARD_SLOPE),
        },
        Bend {
            x: HARD_RANGE,
            slopes: (0.0, HARD_SLOPE),
        },
    ],
    least: None,
    range: Some(UNIT),
    near: error(3e-16, 0.0),
    error_32: error(5e-8, 0.0),
    real: |x| (x + 3.0).clamp(0.0, 6.0) / 6.0,
};

pub(super) static ELU: Curve = Curve {
    value: elu,
    // above 0 as below: e^x, of which x alone is left of the value there
    slope: |x| 1.0 + elu(x.min(0.0)),
    slope_near: 5e-8,
    slope_of_value: Some(|y| if y > 0.0 { 1.0 } else { y + 1.0 }),
    bends: &[],
    least: None,
    range: None,
    near: error(5e-8, 1e-15),
    error_32: error(2.5e-7, 0.0),
    real: |x| if x > 0.0 { x } else { libm::expm1(x) },
};

pub(super) static SOFTPLUS: Curve = Curve {
    value: softplus,
    slope: sigmoid,
    slope_near: 2e-8,
    // 1 - exp(-y): an exponential, which only a libm has
    slope_of_value: None,
    bends: &[],
    least: None,
    range: None,
    near: error(2e-7, 1e-15),
    error_32: error(4e-7, 6.1e-8),
    real: |x| x.max(0.0) + libm::log1p(libm::exp(-x.abs())),
};

pub(super) static SILU: Curve = Curve {
    value: silu,
    slope: |x| {
        let x = x.clamp(-SILU_RANGE, SILU_RANGE);
        let y = sigmoid(x);
        y + x * y * (1.0 - y)
    },
    // beyond the range slope and function are flat up to 18 exp(-18) = 3e-7
    slope_near: 1e-6,
    slope_of_value: None,
    bends: &[
        Bend {
            x: -2.399_357_280_515_467_7,
            slopes: (-0.099_839_320_128_867, -0.099_839_320_128_866),
        },
        Bend {
            x: 2.399_357_280_515_467_7,
            slopes: (1.099_839_320_128_866, 1.099_839_320_128_867),
        },
    ],
    least: Some((-1.278_464_542_761_074, -0.278_464_542_761_073_8)),
    range: None,
    near: error(5e-7, 1e-15),
    error_32: error(3e-6, 6.1e-8),
    real: |x| x / (1.0 + libm::exp(-x)),
};

pub(super) static GELU: Curve = Curve {
    value: gelu,
    slope: |x| gate_slope(x, GELU_RANGE, &GELU_TERMS),
    // the derivative of the approximation, measured over a grid; at the end of the range the normal density is left
    slope_near: 2e-5,
    slope_of_value: None,
    bends: &[
        Bend {
            x: -std::f64::consts::SQRT_2,
            slopes: (-0.128_904_145_185_155, -0.128_904_145_185_154),
        },
        Bend {
            x: std::f64::consts::SQRT_2,
            slopes: (1.128_904_145_185_154, 1.128_904_145_185_155),
        },
    ],
    least: Some((-0.751_791_524_693_564_5, -0.169_971_207_479_903_67)),
    range: None,
    near: error(1e-6, 1e-15),
    error_32: error(1.6e-6, 6.1e-8),
    real: |x| 0.5 * x * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2),
};

pub(super) static GELU_TANH: Curve = Curve {
    value: gelu_tanh,
    slope: |x| gate_slope(x, GELU_TANH_RANGE, &GELU_TANH_TERMS),
    slope_near: 1e-6,
    slope_of_value: None,
    bends: &[
        Bend {
            x: -1.418_504_008_790_828_4,
            slopes: (-0.128_993_068_658_772, -0.128_993_068_658_771),
        },
        Bend {
            x: 1.418_504_008_790_828_4,
            slopes: (1.128_993_068_658_771, 1.128_993_068_658_772),
        },
    ],
    least: Some((-0.752_461_422_071_016_3, -0.170_040_750_571_254_05)),
    range: None,
    near: error(2e-7, 1e-15),
    error_32: error(9e-7, 6.1e-8),
    real: |x| {
        let [first, third] = GELU_TANH_TERMS;
        0.5 * x * (1.0 + libm::tanh(x * (first + third * x * x)))
    },
};

pub(super) static HARD_SWISH: Curve = Curve {
    value: hard_swish,
    slope: |x| {
        if x.abs() < HARD_RANGE {
            x / 3.0 + 0.5
        } else if x > 0.0 {
            1.0
        } else {
            0.0
        }
    },
    slope_near: 1e-15,
    slope_of_value: None,
    bends: &[
        Bend {
            x: -HARD_RANGE,
            slopes: (-0.5, 0.0),
        },
        Bend {
            x: HARD_RANGE,
            slopes: (1.0, 1.5),
        },
    ],
    least: Some((-1.5, -0.375)),
    range: None,
    near: error(1e-15, 1e-15),
    error_32: error(1.2e-7, 6.1e-8),
    real: |x| x * (x + 3.0).clamp(0.0, 6.0) / 6.0,
};

fn horner(terms: &[f64], z: f64) -> f64 {
    terms.iter().rev().fold(0.0, |sum, term| sum * z + term)
}

/// The contract's tanh.
fn tanh(x: f64) -> f64 {
    let t = x.clamp(-TANH_RANGE, TANH_RANGE);
    let z = t * t;
    (t * horner(&TANH_NUMERATOR, z) / horner(&TANH_DENOMINATOR, z)).clamp(-1.0, 1.0)
}

fn softsign(x: f64) -> f64 {
    x / (1.0 + x.abs())
}

fn sigmoid(x: f64) -> f64 {
    tanh(x * 0.5) * 0.5 + 0.5
}

fn hard_sigmoid(x: f64) -> f64 {
    (x * HARD_SLOPE).clamp(-0.5, 0.5) + 0.5
}

fn elu(x: f64) -> f64 {
    let t = tanh((-x).max(0.0) * 0.5).abs();
    x.max(0.0) - (t + t) / (1.0 + t)
}

fn softplus(x: f64) -> f64 {
    let t = tanh(x.abs() * 0.5);
    let v = (1.0 - t) / (3.0 + t);
    x.max(0.0) + horner(&SOFTPLUS_TERMS, v * v) * v
}

/// `x (1 + tanh(u))/2`, where u is odd in x and `a` is |x|, limited: the part of x above 0 less what the tanh leaves of it.
fn gate(x: f64, a: f64, u: f64) -> f64 {
    x.max(0.0) - a * (0.5 - tanh(u) * 0.5)
}

fn silu(x: f64) -> f64 {
    let a = x.abs().min(SILU_RANGE);
    gate(x, a, a * 0.5)
}

fn gelu(x: f64) -> f64 {
    let a = x.abs().min(GELU_RANGE);
    gate(x, a, a * horner(&GELU_TERMS, a * a))
}

fn gelu_tanh(x: f64) -> f64 {
    let a = x.abs().min(GELU_TANH_RANGE);
    gate(x, a, a * horner(&GELU_TANH_TERMS, a * a))
}

fn hard_swish(x: f64) -> f64 {
    let a = x.abs().min(HARD_RANGE);
    x.max(0.0) - a * (0.5 - (a * HARD_SLOPE).clamp(-0.5, 0.5))
}

/// Derivative of `x (1 + tanh(x P(x^2)))/2`: `s + x s' u'` with `s` the sigmoid of `2 u`.
fn gate_slope(x: f64, range: f64, terms: &[f64]) -> f64 {
    let x = x.clamp(-range, range);
    let z = x * x;
    let powers = (0..terms.len() as u32).map(|power| f64::from(2 * power + 1));
    let derived: Vec<f64> = terms.iter().zip(powers).map(|(term, power)| term * power).collect();
    let s = tanh(x * horner(terms, z)) * 0.5 + 0.5;
    s + x * 2.0 * s * (1.0 - s) * horner(&derived, z)
}

#[cfg(test)]
mod tests {
    use super::super::{Activation, Shape};
    use super::*;

    fn curves() -> impl Iterator<Item = (&'static str, &'static Curve)> {
        Activation::EACH.iter().filter_map(|each| match each.shape() {
            Shape::Curve(curve) => Some((each.word(), curve)),
            Shape::Hinge { .. } => None,
        })
    }

    /// Points of a fine grid around 0 and of a coarse one far out, in order.
    fn grid() -> impl Iterator<Item = f64> {
        let near = (-4000..=4000).map(|n| f64::from(n) / 250.0);
        let far = |sign: f64| (0..60).map(move |n| sign * 17.0 * 1.9_f64.powi(n));
        let mut all: Vec<f64> = far(-1.0).chain(near).chain(far(1.0)).collect();
        all.sort_by(f64::total_cmp);
        all.into_iter()
    }

    #[test]
    fn the_value_of_a_curve_is_near_the_real_function_and_inside_its_image() {
        for (word, curve) in curves() {
            let points: Vec<f64> = grid().collect();
            for pair in points.windows(2) {
                let (low, high) = (pair[0], pair[1]);
                let (value, real) = ((curve.value)(low), (curve.real)(low));
                assert!(
                    (value - real).abs() < curve.near.at(low),
                    "{word} {low}: {value} {real}"
                );
                let image = curve.image(Interval { low, high });
                for x in [low, 0.5 * (low + high), high] {
                    let real = (curve.real)(x);
                    assert!(image.low <= real && real <= image.high, "{word} {x}: {image:?}");
                }
                if let Some(range) = curve.range {
                    assert!(range.low <= value && value <= range.high, "{word} {low}");
                }
            }
        }
    }

    #[test]
    fn a_curve_without_an_upper_end_keeps_its_distance_to_the_positive_part() {
        // further out the difference of two large numbers is their rounding
        let points: Vec<f64> = grid().filter(|x| x.abs() <= 1e3).collect();
        for (word, curve) in curves().filter(|(_, curve)| curve.range.is_none()) {
            let beside = curve.beside_relu();
            let apart: Vec<f64> = points.iter().map(|x| (curve.real)(*x) - x.max(0.0)).collect();
            let least = apart.iter().copied().fold(f64::INFINITY, f64::min);
            let largest = apart.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            // 1e-12 is the rounding of 1e3; the grid steps by 1/250, and no curve bends by more than 1 there: it misses an extreme by less
            // than 1e-5
            let low = least - beside.low;
            let high = beside.high - largest;
            assert!((-1e-12..1e-5).contains(&low), "{word}: {beside:?} {least}");
            assert!((-1e-12..1e-5).contains(&high), "{word}: {beside:?} {largest}");
        }
    }

    #[test]
    fn the_image_over_a_wide_interval_has_the_least_value_in_it() {
        for (word, curve) in curves() {
            let image = curve.image(Interval { low: -16.0, high: 16.0 });
            let values: Vec<f64> = grid().filter(|x| x.abs() <= 16.0).map(curve.real).collect();
            let least = values.iter().copied().fold(f64::INFINITY, f64::min);
            let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            assert!(
                image.low <= least && least - image.low < 2e-4,
                "{word}: {image:?} {least}"
            );
            assert!(
                image.high >= largest && image.high - largest < 2e-4,
                "{word}: {image:?} {largest}"
            );
        }
    }

    #[test]
    fn the_slope_of_a_curve_is_that_of_its_graph_and_monotone_between_its_bends() {
        for (word, curve) in curves() {
            let points: Vec<f64> = grid().filter(|x| x.abs() <= 16.0).collect();
            for pair in points.windows(2) {
                let (a, b) = (pair[0], pair[1]);
                let quotient = ((curve.real)(b) - (curve.real)(a)) / (b - a);
                let (low, high) = curve.slopes(Interval { low: a, high: b });
                assert!(
                    low - 1e-12 <= quotient && quotient <= high + 1e-12,
                    "{word} {a} {b}: {low} {quotient} {high}"
                );
                // sharp: the derivative of a function that is not this one would pass as well if the interval were wide
                let jumps = curve.bends.iter().any(|bend| a <= bend.x && bend.x <= b);
                assert!(jumps || high - low < 0.02, "{word} {a} {b}: {low} {high}");
                if let Some(of_value) = curve.slope_of_value
                    && !jumps
                {
                    let y = (curve.real)(a) as f32;
                    let apart = (f64::from(of_value(y)) - (curve.slope)(a)).abs();
                    assert!(apart < 1e-6, "{word} {a}: {apart}");
                }
            }
            // a wide interval: what its ends and bends say holds inside
            for (low, high) in [
                (-2.0, 1.0),
                (-8.0, -0.5),
                (0.25, 7.0),
                (-16.0, 16.0),
                (-3.5, -2.5),
                (2.5, 3.5),
            ] {
                let (least, largest) = curve.slopes(Interval { low, high });
                for pair in points.windows(2).filter(|pair| low <= pair[0] && pair[1] <= high) {
                    let quotient = ((curve.real)(pair[1]) - (curve.real)(pair[0])) / (pair[1] - pair[0]);
                    assert!(
                        least - 1e-12 <= quotient && quotient <= largest + 1e-12,
                        "{word} {pair:?} in {low}..{high}: {least} {quotient} {largest}"
                    );
                }
            }
        }
    }
}

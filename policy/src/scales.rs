//! Scales of the integer network (contract section 6b): powers of two, chosen from the weights over the box of
//! observations so that no 32-bit accumulator can overflow. Both the interpreter and the compiler read them from here;
//! each rounds the weights itself.
//!
//! The proof is exact: integer intervals of every activation, from the clamped inputs on, and for every output the sum
//! of all positive and of all negative terms. Whatever the order of the additions, every partial sum lies between.
//!
//! ```text
//! inputs(policy) ─► exponents, ranges of integers ─► layer ─► ... ─► layer        one pass, front to back
//! rows::balanced ─► r_o for every output ────────────┘
//! layer: finest accumulator whose sums fit in 32 bits, then the smallest shift whose outputs fit in 16 (last: 25) bits
//! ```

mod rows;

use crate::activation::{Activation, Curve, Shape};
use crate::interval::Interval;
use crate::model::{Layer, Policy};

/// Fractional bits behind a curve within +-1: 1.0 is 2^14. Of other curves the most.
// the finest exponent at which 1.0 is within 32,767
pub const CURVE_EXPONENT: i32 = 14;
/// Fractional bits of the slope of a leaky ReLU.
// the finest exponent at which a slope below 1 is within 32,767
pub const SLOPE_BITS: u32 = 15;
/// Largest magnitude of an activation.
pub const ACTIVATION_LIMIT: i64 = 32_767;
/// Largest magnitude of an output of the network: up to here an integer is a binary32 number.
pub const OUTPUT_LIMIT: i64 = 1 << 24;
/// Largest magnitude of an exponent: 2^e and its reciprocal are normal binary32 numbers.
// 126 is the last exponent of which that is true; 100 is a convention
const MAX_EXPONENT: i32 = 100;

/// How an observation becomes an integer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InputScale {
    /// Integer / 2^exponent is the observation.
    pub exponent: i32,
    /// Smallest integer over the box of observations; smaller ones are clamped.
    pub low: i32,
    /// Largest integer over the box of observations; larger ones are clamped.
    pub high: i32,
}

/// How a layer computes in integers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LayerScale {
    /// Exponent of each input: integer / 2^exponent is the activation.
    pub inputs: Vec<i32>,
    /// Exponent of each accumulator: integer / 2^exponent is the sum.
    pub accumulators: Vec<i32>,
    /// Bits that are rounded off the accumulators; 0 in front of a curve, which takes the whole sum.
    pub shift: u32,
    /// Exponent of each output: integer / 2^exponent is the activation. The same for all outputs of the last layer.
    pub outputs: Vec<i32>,
    /// Lowest and highest value that any partial sum of any output can take, over the whole box.
    pub bound: (i64, i64),
    /// Range of each output over the whole box.
    pub ranges: Vec<(i64, i64)>,
}

/// Scales of all layers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scales {
    /// Per feature.
    pub inputs: Vec<InputScale>,
    /// Per layer.
    pub layers: Vec<LayerScale>,
}

impl Scales {
    /// Largest magnitude that any partial sum of the network can take; below 2^31.
    #[must_use]
    pub fn accumulator_bound(&self) -> i64 {
        let ends = self.layers.iter().flat_map(|layer| [-layer.bound.0, layer.bound.1]);
        ends.max().unwrap_or_default()
    }
}

/// Scales of a policy in an integer format; `None` in the others.
#[must_use]
pub fn of(policy: &Policy) -> Option<Scales> {
    let limit = policy.numeric_format.weight_limit()?;
    let inputs = inputs(policy);
    let mut exponents: Vec<i32> = inputs.iter().map(|input| input.exponent).collect();
    let mut ranges: Vec<(i64, i64)> = inputs
        .iter()
        .map(|input| (i64::from(input.low), i64::from(input.high)))
        .collect();
    let rows = rows::balanced(policy, &exponents);
    let mut layers = Vec::with_capacity(policy.layers.len());
    for (index, (layer, rows)) in policy.layers.iter().zip(&rows).enumerate() {
        let output_limit = if index + 1 == policy.layers.len() {
            OUTPUT_LIMIT
        } else {
            ACTIVATION_LIMIT
        };
        let scale = self::layer(layer, rows, &exponents, &ranges, i64::from(limit), output_limit);
        exponents.clone_from(&scale.outputs);
        ranges.clone_from(&scale.ranges);
        layers.push(scale);
    }
    Some(Scales { inputs, layers })
}

/// 2^exponent, exactly; `exponent` within the normal numbers.
#[must_use]
pub fn power_of_two(exponent: i32) -> f64 {
    f64::from_bits(u64::from((1023 + exponent.clamp(-1022, 1023)).unsigned_abs()) << 52)
}

/// `floor(x + 1/2)`: round half up, for magnitudes below 2^51.
#[must_use]
pub fn round_half_up(x: f64) -> i64 {
    // `f64::round` would round halves away from 0; the contract's `hu` rounds them up, as a shift of integers does
    (x + 0.5).floor() as i64
}

/// An observation as integer, before the clamp: round half up of `o * 2^e`.
#[must_use]
pub fn quantised(observation: f32, exponent: i32) -> i32 {
    round_half_up(f64::from(observation) * power_of_two(exponent)) as i32
}

/// The finest exponent at which every observation fits in 16 bits; a feature of small range meets the coarsest one half
/// way, because its column of weights is scaled down by what the feature is scaled up.
fn inputs(policy: &Policy) -> Vec<InputScale> {
    let finest = |bound: crate::model::Interval| {
        let magnitude = bound.low.abs().max(bound.high.abs());
        let fits = |exponent: &i32| magnitude * power_of_two(*exponent) <= ACTIVATION_LIMIT as f64;
        // finest first, so that the first that fits is the answer
        (-MAX_EXPONENT..=24).rev().find(fits).unwrap_or(-MAX_EXPONENT)
    };
    let finest: Vec<i32> = policy.features.iter().map(|feature| finest(feature.bound)).collect();
    let coarsest = finest.iter().copied().min().unwrap_or_default();
    let scale = |(feature, finest): (&crate::model::Feature, &i32)| {
        // never negative, so `/` rounds down as section 6b wants it
        let exponent = coarsest + (finest - coarsest) / 2;
        InputScale {
            exponent,
            low: quantised(feature.bound.low as f32, exponent),
            high: quantised(feature.bound.high as f32, exponent),
        }
    };
    policy.features.iter().zip(&finest).map(scale).collect()
}

/// The finest accumulators at which all weights fit and no partial sum can leave 32 bits, then the smallest shift after
/// which every output fits.
fn layer(
    layer: &Layer,
    rows: &[i32],
    inputs: &[i32],
    ranges: &[(i64, i64)],
    weight_limit: i64,
    output_limit: i64,
) -> LayerScale {
    let scale = |accumulator: i32, shift: u32, curve: i32, bound: (i64, i64), ranges: Vec<(i64, i64)>| {
        let accumulators: Vec<i32> = rows.iter().map(|row| accumulator + row).collect();
        LayerScale {
            inputs: inputs.to_vec(),
            outputs: outputs(layer.activation, &accumulators, shift, curve),
            accumulators,
            shift,
            bound,
            ranges,
        }
    };
    let candidates = (-MAX_EXPONENT..=MAX_EXPONENT).rev();
    let usable = candidates.filter_map(|accumulator| {
        let sums = sums(layer, rows, inputs, ranges, accumulator, weight_limit)?;
        let shift = shift(&sums, layer.activation, output_limit);
        let low = sums.iter().map(|sum| sum.lowest).min().unwrap_or_default();
        // the half that rounds the cut is added in the same 32 bits
        let high = sums.iter().map(|sum| sum.highest).max().unwrap_or_default() + half(shift);
        let limit = i64::from(i32::MAX);
        let curve = curve_exponent(layer.activation, &sums, accumulator);
        let outputs = sums.iter().map(|sum| match layer.activation.curve() {
            Some(of) => curved(of, *sum, accumulator, curve),
            None => activated(layer.activation, *sum, shift),
        });
        (high <= limit && low >= -limit).then(|| scale(accumulator, shift, curve, (low, high), outputs.collect()))
    });
    // with a small enough exponent every weight and bias rounds to 0: there always is one
    let nothing = || scale(-MAX_EXPONENT, 0, CURVE_EXPONENT, (0, 0), vec![(0, 0); layer.outputs]);
    usable.into_iter().next().unwrap_or_else(nothing)
}

/// Extremes of one output's accumulator.
#[derive(Debug, Clone, Copy)]
struct Sum {
    /// Smallest and largest full sum.
    range: (i64, i64),
    /// Smallest and largest partial sum in any order.
    lowest: i64,
    highest: i64,
}

/// `None` if a weight does not fit or a sum is far too large.
fn sums(
    layer: &Layer,
    rows: &[i32],
    inputs: &[i32],
    ranges: &[(i64, i64)],
    accumulator: i32,
    weight_limit: i64,
) -> Option<Vec<Sum>> {
    let weights = layer.weights.chunks_exact(layer.inputs.max(1));
    let factors: Vec<f64> = inputs.iter().map(|input| power_of_two(accumulator - input)).collect();
    let sum = |((weights, bias), row): ((&[f32], &f32), &i32)| {
        let scaled = power_of_two(*row);
        let bias = f64::from(*bias) * power_of_two(accumulator + row);
        // before it becomes an integer: the conversion would saturate and look as if it fitted
        if bias.abs() >= f64::from(i32::MAX) {
            return None;
        }
        let bias = round_half_up(bias);
        let mut sum = Sum {
            range: (bias, bias),
            // "in any order" includes sums that have not met the bias yet, and those begin at 0
            lowest: bias.min(0),
            highest: bias.max(0),
        };
        for ((weight, factor), (low, high)) in weights.iter().zip(&factors).zip(ranges) {
            let weight = f64::from(*weight) * factor * scaled;
            // before the rounding, whose integer would saturate; behind it 32767.4 has become one that fits
            if weight.abs() > (weight_limit + 1) as f64 {
                return None;
            }
            let weight = round_half_up(weight);
            if weight.abs() > weight_limit {
                return None;
            }
            let (a, b) = (weight * low, weight * high);
            sum.range = (sum.range.0 + a.min(b), sum.range.1 + a.max(b));
            sum.lowest += a.min(b).min(0);
            sum.highest += a.max(b).max(0);
        }
        Some(sum)
    };
    weights.zip(&layer.bias).zip(rows).map(sum).collect()
}

/// What is added before `shift` bits are cut off: half of the last bit kept.
#[must_use]
pub fn half(shift: u32) -> i64 {
    (1_i64 << shift) >> 1
}

fn shift(sums: &[Sum], activation: Activation, limit: i64) -> u32 {
    // a curve takes the whole sum as a binary32 number
    if activation.curve().is_some() {
        return 0;
    }
    let fits = |shift: &u32| {
        let rounded = |x: i64| (x + half(*shift)) >> shift;
        sums.iter().all(|sum| {
            // what is below 0 becomes 0 and needs no bits
            let low_fits = activation.is_rectifier() || rounded(sum.range.0) >= -limit;
            low_fits && rounded(sum.range.1) <= limit
        })
    };
    // 1024 products of 15 and 15 bits have 40: no sum of a network within its limits needs more
    (0..40).find(fits).unwrap_or(40)
}

/// Exponents of the outputs: what the shift leaves of the sums', or that of the curve.
fn outputs(activation: Activation, accumulators: &[i32], shift: u32, curve: i32) -> Vec<i32> {
    let output = |exponent: &i32| match activation.shape() {
        Shape::Curve(_) => curve,
        Shape::Hinge { .. } => exponent - shift.cast_signed(),
    };
    accumulators.iter().map(output).collect()
}

/// Exponent behind a curve: the largest at which no value leaves 16 bits.
fn curve_exponent(activation: Activation, sums: &[Sum], accumulator: i32) -> i32 {
    if activation.range().is_some() {
        return CURVE_EXPONENT;
    }
    let highest = sums.iter().map(|sum| sum.range.1).max().unwrap_or_default();
    // no value of a curve is above max(x, 0) + 0.75 (that of a softplus at 0 is 0.69) or below -1.01 (an ELU)
    let most = (highest as f64 * power_of_two(-accumulator) + 0.75).max(1.01);
    // one below the limit is room for the half that rounds
    let fits = |exponent: &i32| most * power_of_two(*exponent) <= (ACTIVATION_LIMIT - 1) as f64;
    // no sum fits in less than 32 bits of the finest accumulator
    (-MAX_EXPONENT..=CURVE_EXPONENT)
        .rev()
        .find(fits)
        .unwrap_or(-MAX_EXPONENT)
}

/// Smallest and largest integer behind a curve.
fn curved(curve: &Curve, sum: Sum, accumulator: i32, exponent: i32) -> (i64, i64) {
    let unit = power_of_two(exponent);
    let image = match curve.range {
        Some(range) => range,
        None => {
            let number = |integer: i64| integer as f64 * power_of_two(-accumulator);
            // the sum becomes a binary32 number, rounded once: half a unit of its last place at most
            let wider = |x: f64, sign: f64| x + sign * x.abs() * power_of_two(-23);
            curve.image(Interval {
                low: wider(number(sum.range.0), -1.0),
                high: wider(number(sum.range.1), 1.0),
            })
        }
    };
    // `trunc(fl(y + 32768.5))`: beside the half at most half of the last bit below 2^16
    (
        (image.low * unit + 0.49).floor() as i64,
        (image.high * unit + 0.51).floor() as i64,
    )
}

fn activated(activation: Activation, sum: Sum, shift: u32) -> (i64, i64) {
    let rounded = |x: i64| (x + half(shift)) >> shift;
    let (low, high) = (rounded(sum.range.0), rounded(sum.range.1));
    match activation.shape() {
        Shape::Hinge { below } if !activation.is_identity() => {
            // 0 for a rectifier, whose slope is 0 as an integer, too
            let slope = slope_integer(below);
            let one = |x: i64| if x > 0 { x } else { leaky(x, slope) };
            (one(low), one(high))
        }
        _ => (low, high),
    }
}

/// Slope of a leaky ReLU as integer: round half up of slope * 2^15, below 2^15.
#[must_use]
pub fn slope_integer(slope: f64) -> i64 {
    // a slope just below 1 would round to 2^15, which 16 bits do not hold
    round_half_up(slope * power_of_two(SLOPE_BITS.cast_signed())).min(ACTIVATION_LIMIT)
}

fn leaky(x: i64, slope: i64) -> i64 {
    (x * slope + half(SLOPE_BITS)) >> SLOPE_BITS
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slope_has_fifteen_fractional_bits_and_stays_below_one() {
        // 0.01 2^15 = 327.68; half up; 2^15 itself is one more than 16 bits hold
        for (slope, integer) in [
            (0.0, 0),
            (0.01, 328),
            (0.5, 16_384),
            (1.5 / 32_768.0, 2),
            (0.999_999, 32_767),
        ] {
            assert_eq!(slope_integer(slope), integer, "{slope}");
        }
    }

    #[test]
    fn integers_behind_a_curve_without_ends_follow_from_the_sum() {
        let elu = Activation::find("elu").and_then(Activation::curve).unwrap();
        let sum = Sum {
            range: (-(1 << 16), 1 << 16),
            lowest: 0,
            highest: 0,
        };
        // 16 fractional bits: -1 to 1, where ELU is e^-1 - 1 to 1; with 10 bits -647.3 and 1024
        let expected = ((-1.0_f64).exp_m1() * 1024.0, 1024);
        let (low, high) = curved(elu, sum, 16, 10);
        assert_eq!((low, high), (expected.0.round() as i64, expected.1));
    }
}

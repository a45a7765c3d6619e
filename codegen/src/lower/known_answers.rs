//! Known answers for `self_test`: what the contract's arithmetic gives on pseudo-random observations of the box.
//!
//! They catch a compiler, flag or byte order that changes the arithmetic on the target; that the lowering itself is
//! right is shown elsewhere, against the interpreter.

use std::ops::{Add, Div, Mul};

use policy::scales::{power_of_two, round_half_up};
use policy::{Policy, Scalar};

use crate::crc::crc32_words;
use crate::lower::network::{TANH_DENOMINATOR, TANH_NUMERATOR, TANH_RANGE};
use crate::program::{ActivationCode, IntegerLayer, IntegerNetwork, LayerCode, Literal, NetworkCode, SelfTest, words};

/// Number of vectors.
pub const VECTORS: usize = 16;
/// Seed of the generator in `self_test`.
pub const SEED: u32 = 0x2545_F491;
/// Multiplier and increment of the generator (Numerical Recipes' LCG).
pub const LCG: (u32, u32) = (1_664_525, 1_013_904_223);
/// Scale from the generator's upper 24 bits to 0..1, exact.
pub const UNIT: f64 = 1.0 / 16_777_216.0;

/// Draws the observations as `self_test` will and computes the answers.
pub fn lower(policy: &Policy, network: &NetworkCode) -> SelfTest {
    let scalar = policy.numeric_format.scalar();
    let observation_box: Vec<(Literal, Literal)> = policy
        .features
        .iter()
        .map(|feature| {
            // a bound is a binary32 number
            let width = Literal::nearest(scalar, feature.bound.high - feature.bound.low);
            (Literal::nearest(scalar, feature.bound.low), width)
        })
        .collect();
    let answers = match network {
        NetworkCode::Real {
            scalar: Scalar::F64,
            layers,
            ..
        } => answers(&observation_box, |x: Vec<f64>| real_q(layers, false, x)),
        NetworkCode::Real { fused, layers, .. } => answers(&observation_box, |x: Vec<f32>| real_q(layers, *fused, x)),
        NetworkCode::Integer(network) => answers(&observation_box, |x: Vec<f32>| integer_q(network, &x)),
    };
    SelfTest {
        observation_box,
        answers,
    }
}

/// The format in which the answers are computed: `f32` or `f64`.
trait Number: Copy + PartialOrd + Add<Output = Self> + Mul<Output = Self> + Div<Output = Self> {
    const SCALAR: Scalar;
    fn nearest(value: f64) -> Self;
    fn fused(self, by: Self, plus: Self) -> Self;
    fn wide(self) -> f64;
}

impl Number for f32 {
    const SCALAR: Scalar = Scalar::F32;
    fn nearest(value: f64) -> Self {
        value as f32
    }
    fn fused(self, by: Self, plus: Self) -> Self {
        self.mul_add(by, plus)
    }
    fn wide(self) -> f64 {
        self.into()
    }
}

impl Number for f64 {
    const SCALAR: Scalar = Scalar::F64;
    fn nearest(value: f64) -> Self {
        value
    }
    fn fused(self, by: Self, plus: Self) -> Self {
        self.mul_add(by, plus)
    }
    fn wide(self) -> f64 {
        self
    }
}

fn answers<T: Number>(observation_box: &[(Literal, Literal)], q_values: impl Fn(Vec<T>) -> Vec<T>) -> Vec<u32> {
    let mut random = SEED;
    let mut answers = Vec::with_capacity(VECTORS);
    for _ in 0..VECTORS {
        let mut values: Vec<T> = Vec::with_capacity(observation_box.len());
        for (low, width) in observation_box {
            random = random.wrapping_mul(LCG.0).wrapping_add(LCG.1);
            // 24 bits are exact
            let share = T::nearest(f64::from(random >> 8) * UNIT);
            values.push(T::nearest(low.value()) + T::nearest(width.value()) * share);
        }
        let q = q_values(values).into_iter();
        answers.push(crc32_words(q.flat_map(|q| words(T::SCALAR, q.wide()))));
    }
    answers
}

fn real_q<T: Number>(layers: &[LayerCode], fused: bool, observation: Vec<T>) -> Vec<T> {
    layers.iter().fold(observation, |x, layer| dense(layer, &x, fused))
}

fn dense<T: Number>(layer: &LayerCode, x: &[T], fused: bool) -> Vec<T> {
    let mut y: Vec<T> = layer.bias.iter().map(|b| T::nearest((*b).into())).collect();
    let mut table = layer.table.iter();
    for x in x.chunks(layer.chunk) {
        for block in y.chunks_mut(layer.block_rows) {
            for input in x {
                for accumulator in block.iter_mut() {
                    let weight = T::nearest(table.next().copied().unwrap_or_default().into());
                    *accumulator = if fused {
                        weight.fused(*input, *accumulator)
                    } else {
                        *accumulator + weight * *input
                    };
                }
            }
        }
    }
    for value in &mut y {
        *value = activate(layer.activation, *value);
    }
    y
}

/// The network in integers; sums wrap nowhere, as the scales prove.
fn integer_q(network: &IntegerNetwork, observation: &[f32]) -> Vec<f32> {
    let inputs = network.inputs.iter().zip(observation);
    let mut values: Vec<i32> = inputs
        .map(|(input, o)| {
            let exponent = 150 - input.unshifted;
            let integer = round_half_up(f64::from(*o) * power_of_two(exponent)) as i32;
            integer.clamp(input.low, input.high)
        })
        .collect();
    for layer in &network.layers {
        values.resize(network.padded(layer.inputs), 0);
        values = integer_dense(network, layer, &values);
    }
    values.iter().map(|q| *q as f32 * network.q_unit.single()).collect()
}

fn integer_dense(network: &IntegerNetwork, layer: &IntegerLayer, x: &[i32]) -> Vec<i32> {
    let mut y = layer.bias.clone();
    let mut table = layer.table.iter();
    for x in x.chunks(network.padded(layer.chunk)) {
        for block in y.chunks_mut(layer.block_rows) {
            for group in x.chunks(network.lanes.len()) {
                for sum in block.iter_mut() {
                    for lane in &network.lanes {
                        let weight = i32::from(table.next().copied().unwrap_or_default());
                        *sum = sum.wrapping_add(weight.wrapping_mul(group[*lane]));
                    }
                }
            }
        }
    }
    for value in &mut y {
        *value = match layer.activation {
            ActivationCode::Identity => *value >> layer.shift,
            ActivationCode::Relu => (*value >> layer.shift).max(0),
            ActivationCode::LeakyRelu(_) => {
                let shifted = *value >> layer.shift;
                if shifted > 0 {
                    shifted
                } else {
                    (shifted * layer.slope + (1 << 14)) >> 15
                }
            }
            ActivationCode::Tanh => (tanh(*value as f32 * layer.unit.single()) * 16_384.0 + 32_768.5) as i32 - 32_768,
        };
    }
    y
}

fn activate<T: Number>(activation: ActivationCode, x: T) -> T {
    let zero = T::nearest(0.0);
    match activation {
        ActivationCode::Identity => x,
        ActivationCode::Relu if x > zero => x,
        ActivationCode::Relu => zero,
        ActivationCode::LeakyRelu(_) if x > zero => x,
        ActivationCode::LeakyRelu(slope) => T::nearest(slope.value()) * x,
        ActivationCode::Tanh => tanh(x),
    }
}

fn tanh<T: Number>(x: T) -> T {
    let limited = |x: T, limit: f64| T::nearest(x.wide().clamp(-limit, limit));
    let t = limited(x, TANH_RANGE);
    let z = t * t;
    let polynomial = |terms: &[f64; 5]| {
        let [lower @ .., highest] = terms.map(T::nearest);
        lower.into_iter().rev().fold(highest, |sum, term| sum * z + term)
    };
    limited(polynomial(&TANH_NUMERATOR) * t / polynomial(&TANH_DENOMINATOR), 1.0)
}

//! Known answers for `self_test`: what the contract's arithmetic gives on pseudo-random observations of the box.
//!
//! They catch a compiler, flag or byte order that changes the arithmetic on the target; that the lowering itself is
//! right is shown elsewhere, against the interpreter.

use policy::Policy;
use policy::scales::{power_of_two, round_half_up};

use crate::crc::crc32_words;
use crate::lower::network::{TANH_DENOMINATOR, TANH_NUMERATOR, TANH_RANGE};
use crate::program::{ActivationCode, IntegerLayer, IntegerNetwork, LayerCode, Literal, NetworkCode, SelfTest};

/// Number of vectors.
pub const VECTORS: usize = 16;
/// Seed of the generator in `self_test`.
pub const SEED: u32 = 0x2545_F491;
/// Multiplier and increment of the generator (Numerical Recipes' LCG).
pub const LCG: (u32, u32) = (1_664_525, 1_013_904_223);
/// Scale from the generator's upper 24 bits to 0..1, exact.
pub const UNIT: f32 = 1.0 / 16_777_216.0;

/// Draws the observations as `self_test` will and computes the answers.
pub fn lower(policy: &Policy, network: &NetworkCode) -> SelfTest {
    let observation_box: Vec<(Literal, Literal)> = policy
        .features
        .iter()
        .map(|feature| {
            let low = feature.bound.low as f32;
            (low.into(), (feature.bound.high as f32 - low).into())
        })
        .collect();
    let mut random = SEED;
    let mut answers = Vec::with_capacity(VECTORS);
    for _ in 0..VECTORS {
        let mut values: Vec<f32> = Vec::with_capacity(observation_box.len());
        for (low, width) in &observation_box {
            random = random.wrapping_mul(LCG.0).wrapping_add(LCG.1);
            values.push(low.value() + width.value() * ((random >> 8) as f32 * UNIT));
        }
        values = match network {
            NetworkCode::Real { fused, layers } => layers.iter().fold(values, |x, layer| dense(layer, &x, *fused)),
            NetworkCode::Integer(network) => integer_q(network, &values),
        };
        answers.push(crc32_words(values.iter().map(|q| q.to_bits())));
    }
    SelfTest {
        observation_box,
        answers,
    }
}

fn dense(layer: &LayerCode, x: &[f32], fused: bool) -> Vec<f32> {
    let mut y = layer.bias.clone();
    let mut table = layer.table.iter();
    for x in x.chunks(layer.chunk) {
        for block in y.chunks_mut(layer.block_rows) {
            for input in x {
                for accumulator in block.iter_mut() {
                    let weight = table.next().copied().unwrap_or_default();
                    *accumulator = if fused {
                        weight.mul_add(*input, *accumulator)
                    } else {
                        *accumulator + weight * input
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
    values.iter().map(|q| *q as f32 * network.q_unit.value()).collect()
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
            ActivationCode::Tanh => (tanh(*value as f32 * layer.unit.value()) * 16_384.0 + 32_768.5) as i32 - 32_768,
        };
    }
    y
}

fn activate(activation: ActivationCode, x: f32) -> f32 {
    match activation {
        ActivationCode::Identity => x,
        ActivationCode::Relu if x > 0.0 => x,
        ActivationCode::Relu => 0.0,
        ActivationCode::LeakyRelu(_) if x > 0.0 => x,
        ActivationCode::LeakyRelu(slope) => slope.value() * x,
        ActivationCode::Tanh => tanh(x),
    }
}

fn tanh(x: f32) -> f32 {
    let t = x.clamp(-TANH_RANGE, TANH_RANGE);
    let z = t * t;
    let polynomial = |terms: &[f32; 5]| terms.iter().rev().skip(1).fold(terms[4], |sum, term| sum * z + term);
    (polynomial(&TANH_NUMERATOR) * t / polynomial(&TANH_DENOMINATOR)).clamp(-1.0, 1.0)
}

//! Known answers for `self_test`: what the contract's arithmetic gives on pseudo-random observations of the box.
//!
//! They catch a compiler, flag or byte order that changes the arithmetic on the target; that the lowering itself is
//! right is shown elsewhere, against the interpreter.

use policy::Policy;

use crate::crc::crc32_words;
use crate::lower::network::{TANH_DENOMINATOR, TANH_NUMERATOR, TANH_RANGE};
use crate::program::{ActivationCode, LayerCode, Literal, SelfTest};

/// Number of vectors.
pub const VECTORS: usize = 16;
/// Seed of the generator in `self_test`.
pub const SEED: u32 = 0x2545_F491;
/// Multiplier and increment of the generator (Numerical Recipes' LCG).
pub const LCG: (u32, u32) = (1_664_525, 1_013_904_223);
/// Scale from the generator's upper 24 bits to 0..1, exact.
pub const UNIT: f32 = 1.0 / 16_777_216.0;

/// Draws the observations as `self_test` will and computes the answers.
pub fn lower(policy: &Policy, layers: &[LayerCode]) -> SelfTest {
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
        for layer in layers {
            values = dense(layer, &values);
        }
        answers.push(crc32_words(values.iter().map(|q| q.to_bits())));
    }
    SelfTest {
        observation_box,
        answers,
    }
}

fn dense(layer: &LayerCode, x: &[f32]) -> Vec<f32> {
    let mut y = layer.bias.clone();
    let mut table = layer.table.iter();
    for block in y.chunks_mut(layer.block_rows) {
        for input in x {
            for accumulator in block.iter_mut() {
                *accumulator += table.next().copied().unwrap_or_default() * input;
            }
        }
    }
    for value in &mut y {
        *value = activate(layer.activation, *value);
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

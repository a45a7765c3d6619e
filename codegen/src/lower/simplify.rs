//! Leaves out neurons that are proven dead, without changing one bit of any Q value.
//!
//! A dead neuron is +0 behind its ReLU, so each sum of the next layer adds `w * (+0)`, a zero of the sign of w. Adding -0 changes
//! nothing. Adding +0 changes -0 alone, to +0. A sum is -0 only if its bias is -0 and so are all products
//! so far: in binary32 a sum of two numbers is -0 only if both are, and a sum that is exactly 0 is +0 otherwise. A fused
//! sum can also be -0 because a tiny negative product vanishes in it. Behind a ReLU both zeros give +0.
//! So a neuron may go if, for every output of the next layer, the next activation is a ReLU, or w is negative (-0
//! included), or the sums are not fused and the bias is not -0. Integers have one zero.

use std::borrow::Cow;

use certify::{Certifier, Neurons};
use policy::scales::{self, Scales};
use policy::{Layer, NumericFormat, Policy};

/// A policy whose layers lack neurons that do nothing, and the scales of the whole one in the same shape.
pub struct Simplified<'a> {
    /// What is lowered.
    pub policy: Cow<'a, Policy>,
    /// Of an integer network.
    pub scales: Option<Scales>,
}

/// Loops take outputs and inputs in groups; a group that is not full costs more than what it lacks.
// four is the most that a loop takes at once: lanes of 8-bit weights in a word, rows of the smallest blocks
const GROUP: usize = 4;

/// Neurons that [`simplified`] leaves out, per layer. None in `f64`: the box in which a neuron is proven dead is that of the
/// observations in binary32, and one in binary64 may lie a rounding beside it.
pub fn removable(policy: &Policy) -> Vec<Vec<usize>> {
    if policy.numeric_format == NumericFormat::F64 {
        return vec![Vec::new(); policy.layers.len()];
    }
    let neurons = Certifier::new(policy).neurons(policy);
    let layers = policy.layers.iter().zip(neurons).enumerate();
    layers
        .map(|(index, (layer, Neurons { mut dead, .. }))| {
            let Some(next) = policy.layers.get(index + 1) else {
                return Vec::new();
            };
            dead.retain(|neuron| goes_unnoticed(policy.numeric_format, next, *neuron));
            // one stays where all are dead, for a layer needs an output; which of them go makes no difference to a bit
            let kept = (layer.outputs - dead.len()).max(1).next_multiple_of(GROUP);
            dead.truncate(layer.outputs.saturating_sub(kept));
            dead
        })
        .collect()
}

/// Whether adding a zero from this input changes no sum of the layer that can be told apart.
fn goes_unnoticed(format: NumericFormat, next: &Layer, input: usize) -> bool {
    if format.is_integer() || next.activation.is_rectifier() {
        return true;
    }
    let is_fused = format == NumericFormat::F32Fma;
    let rows = next.weights.chunks_exact(next.inputs.max(1)).zip(&next.bias);
    rows.into_iter().all(|(row, bias)| {
        let is_minus_zero = bias.to_bits() == (-0.0_f32).to_bits();
        row[input].is_sign_negative() || !(is_fused || is_minus_zero)
    })
}

/// The network to lower.
pub fn simplified(policy: &Policy) -> Simplified<'_> {
    // of the whole network, because the interpreter leaves nothing out: scales of the rest could be finer
    let mut scales = scales::of(policy);
    let removable = removable(policy);
    if removable.iter().all(Vec::is_empty) {
        return Simplified {
            policy: Cow::Borrowed(policy),
            scales,
        };
    }
    let mut smaller = policy.clone();
    let mut gone: &[usize] = &[];
    for (index, outputs) in removable.iter().enumerate() {
        without(&mut smaller.layers[index], gone, outputs);
        if let Some(scale) = scales.as_mut().and_then(|scales| scales.layers.get_mut(index)) {
            retain(&mut scale.inputs, gone);
            retain(&mut scale.accumulators, outputs);
            retain(&mut scale.outputs, outputs);
            retain(&mut scale.ranges, outputs);
        }
        gone = outputs;
    }
    Simplified {
        policy: Cow::Owned(smaller),
        scales,
    }
}

fn without(layer: &mut Layer, inputs: &[usize], outputs: &[usize]) {
    let (width, mut place) = (layer.inputs.max(1), 0);
    layer.weights.retain(|_| {
        let (output, input) = (place / width, place % width);
        place += 1;
        !outputs.contains(&output) && !inputs.contains(&input)
    });
    retain(&mut layer.bias, outputs);
    retain(&mut layer.bounds, outputs);
    layer.inputs -= inputs.len();
    layer.outputs -= outputs.len();
}

fn retain<T>(values: &mut Vec<T>, gone: &[usize]) {
    let mut index = 0;
    values.retain(|_| {
        index += 1;
        !gone.contains(&(index - 1))
    });
}

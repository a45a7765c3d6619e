//! Contract section 6b: integer layers with their tables in reading order.

use policy::scales::{self, LayerScale, Scales, power_of_two, round_half_up};
use policy::{Activation, Layer, NumericFormat, Policy, Scalar};
use targets::IntegerBlock;

use super::network::activation;
use crate::program::{ActivationCode, IntegerInput, IntegerLayer, IntegerNetwork, Literal};

/// Two 16-bit weights of a word, in memory order.
const PAIR: [usize; 2] = [0, 1];
/// Four 8-bit weights of a word: the even bytes, then the odd ones, widen to two pairs (ARM `SXTB16`).
const QUAD: [usize; 4] = [0, 2, 1, 3];

/// Exponent field of binary32 of a number whose mantissa of 24 bits is an integer.
const MANTISSA_FIELD: i32 = 150;

/// Rounds weights and biases and orders them in the blocks in which the generated code reads them.
pub fn lower(policy: &Policy, scales: &Scales, block: IntegerBlock) -> IntegerNetwork {
    let lanes: &[usize] = if policy.numeric_format == NumericFormat::I8 {
        &QUAD
    } else {
        &PAIR
    };
    let input = |input: &scales::InputScale| IntegerInput {
        unshifted: MANTISSA_FIELD - input.exponent,
        low: input.low,
        high: input.high,
    };
    let q_exponent = scales.layers.last().and_then(|layer| layer.outputs.first());
    let q_exponent = q_exponent.copied().unwrap_or_default();
    let layers = policy.layers.iter().zip(&scales.layers);
    let split = |(index, (layer, scale))| {
        let split = split(policy, index, lanes.len(), block);
        self::layer(layer, scale, lanes, split)
    };
    IntegerNetwork {
        weight_bytes: 4 / lanes.len(),
        block,
        lanes: lanes.to_vec(),
        inputs: scales.inputs.iter().map(input).collect(),
        layers: layers.enumerate().map(split).collect(),
        q_unit: Literal::nearest(Scalar::F32, power_of_two(-q_exponent)),
        q_field: MANTISSA_FIELD + 1 - q_exponent,
        accumulator_bound: scales.accumulator_bound(),
    }
}

/// Outputs side by side and inputs at a time of a layer. A last layer that is streamed takes blocks of the layer before.
fn split(policy: &Policy, index: usize, lanes: usize, block: IntegerBlock) -> (usize, usize) {
    let layer = &policy.layers[index];
    let is_plain_last = index + 1 == policy.layers.len() && layer.activation == Activation::Identity;
    // a group of inputs must not lie in two blocks
    let streams = block.streams && is_plain_last && index > 0 && block.rows.is_multiple_of(lanes);
    if streams && block.rows < layer.inputs {
        (1, block.rows)
    } else {
        (block.rows.clamp(1, layer.outputs), layer.inputs)
    }
}

fn layer(layer: &Layer, scale: &LayerScale, lanes: &[usize], (block_rows, chunk): (usize, usize)) -> IntegerLayer {
    // the scales were chosen so that every weight fits
    let weight = |output: usize, input: usize| match scale.inputs.get(input) {
        Some(exponent) => {
            let weight = f64::from(layer.weights[output * layer.inputs + input]);
            round_half_up(weight * power_of_two(scale.accumulators[output] - exponent)) as i16
        }
        None => 0,
    };
    let mut table = Vec::with_capacity(layer.weights.len());
    for input in (0..layer.inputs).step_by(chunk) {
        for first in (0..layer.outputs).step_by(block_rows) {
            let last = (first + block_rows).min(layer.outputs);
            for group in (input..(input + chunk).min(layer.inputs)).step_by(lanes.len()) {
                for output in first..last {
                    table.extend(lanes.iter().map(|lane| weight(output, group + lane)));
                }
            }
        }
    }
    let bias = |(bias, exponent): (&f32, &i32)| {
        let integer = round_half_up(f64::from(*bias) * power_of_two(*exponent));
        (integer + scales::half(scale.shift)) as i32
    };
    let activation = activation(Scalar::F32, layer);
    IntegerLayer {
        name: layer.name.clone(),
        inputs: layer.inputs,
        outputs: layer.outputs,
        block_rows,
        chunk,
        table,
        bias: layer.bias.iter().zip(&scale.accumulators).map(bias).collect(),
        shift: scale.shift,
        // of a layer with tanh and of the last: there all rows have one exponent
        unit: Literal::nearest(
            Scalar::F32,
            power_of_two(-scale.accumulators.first().copied().unwrap_or_default()),
        ),
        slope: match (activation, layer.activation) {
            (ActivationCode::LeakyRelu(_), Activation::LeakyRelu { slope }) => scales::slope_integer(slope) as i32,
            _ => 0,
        },
        activation,
    }
}

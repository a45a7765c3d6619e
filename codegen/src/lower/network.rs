//! Contract section 6: layers with their tables in reading order.

use policy::{Activation, Layer, NumericFormat, Policy};
use targets::{IntegerBlock, RowBlock};

use super::integer;
use super::simplify::{self, Simplified};
use crate::program::{ActivationCode, LayerCode, Literal, NetworkCode};

/// Numerator of the tanh approximation, lowest power first (contract section 6).
pub const TANH_NUMERATOR: [f32; 5] = [
    0.999_999_9,
    0.133_732_08,
    0.003_486_593_3,
    2.047_200_7e-5,
    1.318_444_4e-8,
];
/// Denominator of the tanh approximation, lowest power first (contract section 6).
pub const TANH_DENOMINATOR: [f32; 5] = [1.0, 0.467_065_04, 0.025_842_024, 0.000_327_140_35, 7.702_759e-7];
/// Beyond this magnitude the approximation is evaluated at the end of its range.
pub const TANH_RANGE: f32 = 9.0;

/// Loops of a network in floats that suit target and language.
#[derive(Debug, Clone, Copy)]
pub struct FloatLoops {
    /// Outputs side by side.
    pub row_block: RowBlock,
    /// Bytes to which weights are aligned, if to more than a float.
    pub alignment: Option<u32>,
    /// Whether there are loops in assembly.
    pub has_assembly: bool,
}

/// The network in the policy's numeric format.
pub fn lower(policy: &Policy, loops: FloatLoops, integer_block: IntegerBlock) -> NetworkCode {
    let Simplified { policy, scales } = simplify::simplified(policy);
    match scales {
        Some(scales) => NetworkCode::Integer(integer::lower(&policy, &scales, integer_block)),
        None => NetworkCode::Real {
            fused: policy.numeric_format == NumericFormat::F32Fma,
            layers: layers(&policy, loops),
        },
    }
}

/// The last layer takes the outputs of the one before block by block where blocks are variables: half of the stack.
fn layers(policy: &Policy, mut loops: FloatLoops) -> Vec<LayerCode> {
    if let (RowBlock::Vectors(_), NumericFormat::F32Fma) = (loops.row_block, policy.numeric_format) {
        // the fused operation is a function of scalars
        loops.row_block = RowBlock::All;
    }
    let last = policy.layers.len().saturating_sub(1);
    let chunk = |index: usize, layer: &Layer| match loops.row_block {
        RowBlock::Rows(rows) if index == last && index > 0 => rows.clamp(1, layer.inputs),
        _ => layer.inputs,
    };
    let layers = policy.layers.iter().enumerate();
    layers
        .map(|(index, layer)| real(layer, loops, chunk(index, layer)))
        .collect()
}

/// Orders the weights in the blocks in which the generated code reads them.
fn real(layer: &Layer, loops: FloatLoops, chunk: usize) -> LayerCode {
    let block_rows = match loops.row_block {
        RowBlock::All => layer.outputs,
        RowBlock::Rows(rows) | RowBlock::Vectors(rows) => rows.clamp(1, layer.outputs),
    };
    let mut table = Vec::with_capacity(layer.weights.len());
    let inputs: Vec<usize> = (0..layer.inputs).collect();
    for inputs in inputs.chunks(chunk) {
        for first in (0..layer.outputs).step_by(block_rows) {
            let last = (first + block_rows).min(layer.outputs);
            for input in inputs {
                table.extend((first..last).map(|output| layer.weights[output * layer.inputs + input]));
            }
        }
    }
    LayerCode {
        name: layer.name.clone(),
        inputs: layer.inputs,
        outputs: layer.outputs,
        block_rows,
        chunk,
        alignment: loops.alignment,
        in_memory: !matches!(loops.row_block, RowBlock::Rows(_)),
        has_vectors: matches!(loops.row_block, RowBlock::Vectors(_)),
        has_assembly: loops.has_assembly,
        table,
        bias: layer.bias.clone(),
        activation: activation(layer),
    }
}

/// Activation with its literals.
pub fn activation(layer: &Layer) -> ActivationCode {
    match layer.activation {
        Activation::Identity => ActivationCode::Identity,
        Activation::Relu => ActivationCode::Relu,
        Activation::LeakyRelu { slope } => ActivationCode::LeakyRelu(Literal::nearest(slope)),
        Activation::Tanh => ActivationCode::Tanh,
    }
}

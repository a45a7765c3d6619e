//! Contract section 6: layers with their tables in reading order.

use policy::{Activation, Layer, NumericFormat, Policy};
use targets::RowBlock;

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

/// The network in the policy's numeric format.
pub fn lower(policy: &Policy, row_block: RowBlock) -> NetworkCode {
    let Simplified { policy, scales } = simplify::simplified(policy);
    match scales {
        Some(scales) => NetworkCode::Integer(integer::lower(&policy, &scales)),
        None => NetworkCode::Real {
            fused: policy.numeric_format == NumericFormat::F32Fma,
            layers: policy.layers.iter().map(|layer| real(layer, row_block)).collect(),
        },
    }
}

/// Orders the weights in the blocks in which the generated code reads them.
fn real(layer: &Layer, row_block: RowBlock) -> LayerCode {
    let block_rows = match row_block {
        RowBlock::All => layer.outputs,
        RowBlock::Rows(rows) => rows.clamp(1, layer.outputs),
    };
    let mut table = Vec::with_capacity(layer.weights.len());
    for first in (0..layer.outputs).step_by(block_rows) {
        let last = (first + block_rows).min(layer.outputs);
        for input in 0..layer.inputs {
            table.extend((first..last).map(|output| layer.weights[output * layer.inputs + input]));
        }
    }
    LayerCode {
        name: layer.name.clone(),
        inputs: layer.inputs,
        outputs: layer.outputs,
        block_rows,
        in_memory: row_block == RowBlock::All,
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

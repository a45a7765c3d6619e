//! The network of a lowered controller, in its numeric format.

use targets::IntegerBlock;

use super::Literal;

/// Activation with its literals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActivationCode {
    /// None.
    Identity,
    /// Clears negative values by their sign bit.
    Relu,
    /// Multiplies negative values.
    LeakyRelu(Literal),
    /// The contract's rational function.
    Tanh,
}

/// Dense layer with its table in the order in which it is read.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerCode {
    /// Tensor name, for the comment.
    pub name: String,
    /// Inputs.
    pub inputs: usize,
    /// Outputs.
    pub outputs: usize,
    /// Outputs accumulated side by side, `1..=outputs`.
    pub block_rows: usize,
    /// Whether the accumulators are the output buffer (axpy form), not registers.
    pub in_memory: bool,
    /// Whether vectors of the compiler are taken where it has them; else what `in_memory` says.
    pub has_vectors: bool,
    /// Whether the target has the sums of a block in assembly.
    pub has_assembly: bool,
    /// Bytes to which the table of weights is aligned, if to more than its elements.
    pub alignment: Option<u32>,
    /// Inputs taken at a time: all, or the block of outputs that the layer before has just made. Then the sums stand in the
    /// output buffer in between.
    pub chunk: usize,
    /// Weights: chunks of inputs (the last may be shorter), within a chunk blocks of `block_rows` outputs (the last may be
    /// shorter), within a block by input, then by output.
    pub table: Vec<f32>,
    /// `[outputs]`.
    pub bias: Vec<f32>,
    /// Behind the layer.
    pub activation: ActivationCode,
}

impl LayerCode {
    /// Whether the layer takes the outputs of the one before block by block, so that those are never there all at once.
    #[must_use]
    pub fn is_streamed(&self) -> bool {
        self.chunk < self.inputs
    }

    /// Number of full blocks.
    #[must_use]
    pub fn full_blocks(&self) -> usize {
        self.outputs / self.block_rows
    }

    /// Outputs in the shorter last block, 0 if there is none.
    #[must_use]
    pub fn tail_rows(&self) -> usize {
        self.outputs % self.block_rows
    }
}

/// The network in the numeric format of the policy.
#[derive(Debug, Clone, PartialEq)]
pub enum NetworkCode {
    /// In binary32.
    Real {
        /// Products are added with one rounding.
        fused: bool,
        /// First to last.
        layers: Vec<LayerCode>,
    },
    /// In integers.
    Integer(IntegerNetwork),
}

impl NetworkCode {
    /// Name, inputs and outputs of each layer.
    #[must_use]
    pub fn shape(&self) -> Vec<(&str, usize, usize)> {
        match self {
            NetworkCode::Real { layers, .. } => layers.iter().map(|l| (l.name.as_str(), l.inputs, l.outputs)).collect(),
            NetworkCode::Integer(network) => {
                let layers = network.layers.iter();
                layers.map(|l| (l.name.as_str(), l.inputs, l.outputs)).collect()
            }
        }
    }

    /// Whether a layer has this activation.
    #[must_use]
    pub fn activates(&self, wanted: fn(ActivationCode) -> bool) -> bool {
        match self {
            NetworkCode::Real { layers, .. } => layers.iter().any(|layer| wanted(layer.activation)),
            NetworkCode::Integer(network) => network.layers.iter().any(|layer| wanted(layer.activation)),
        }
    }

    /// Words of the tables in the order of the integrity check.
    pub(super) fn table_words(&self) -> Vec<u32> {
        match self {
            NetworkCode::Real { layers, .. } => layers
                .iter()
                .flat_map(|layer| layer.table.iter().chain(&layer.bias).map(|w| w.to_bits()))
                .collect(),
            NetworkCode::Integer(network) => network
                .layers
                .iter()
                .flat_map(|layer| {
                    layer
                        .table
                        .iter()
                        .map(|w| i32::from(*w))
                        .chain(layer.bias.iter().copied())
                })
                .map(i32::cast_unsigned)
                .collect(),
        }
    }

    pub(super) fn table_bytes(&self) -> usize {
        match self {
            NetworkCode::Real { layers, .. } => layers.iter().map(|l| 4 * (l.table.len() + l.bias.len())).sum(),
            NetworkCode::Integer(network) => {
                let layers = network.layers.iter();
                layers
                    .map(|l| l.table.len() * network.weight_bytes + 4 * l.bias.len())
                    .sum()
            }
        }
    }
}

/// How an observation becomes an integer: its mantissa shifted and rounded, then clamped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IntegerInput {
    /// Exponent field of the binary32 number whose mantissa, as an integer, needs no shift.
    pub unshifted: i32,
    /// Lower end of the clamp.
    pub low: i32,
    /// Upper end of the clamp.
    pub high: i32,
}

/// Dense layer in integers. Every partial sum fits in 32 bits, in any order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IntegerLayer {
    /// Tensor name, for the comment.
    pub name: String,
    /// Inputs.
    pub inputs: usize,
    /// Outputs.
    pub outputs: usize,
    /// Outputs accumulated side by side, `1..=outputs`; 1 if the layer is streamed.
    pub block_rows: usize,
    /// Inputs taken at a time: all, or the block of outputs that the layer before has just made.
    pub chunk: usize,
    /// Weights: chunks of inputs (the last may be shorter), within a chunk blocks of outputs (the last may be shorter), within
    /// a block by group of inputs, then by output; within a group in the order of [`IntegerNetwork::lanes`]. Inputs that the
    /// last group lacks have weight 0.
    pub table: Vec<i16>,
    /// `[outputs]`, half of the last bit kept included.
    pub bias: Vec<i32>,
    /// Bits cut off the sum; 0 behind a tanh.
    pub shift: u32,
    /// Power of two that makes the sum a number, for tanh and the output.
    pub unit: Literal,
    /// Behind the layer.
    pub activation: ActivationCode,
    /// Slope of a leaky ReLU in 2^-15.
    pub slope: i32,
}

impl IntegerLayer {
    /// Whether the layer takes the outputs of the one before block by block, so that those are never there all at once.
    #[must_use]
    pub fn is_streamed(&self) -> bool {
        self.chunk < self.inputs
    }

    /// Count and height of the blocks of outputs, full ones first.
    #[must_use]
    pub fn blocks(&self) -> Vec<(usize, usize)> {
        let (full, tail) = (self.outputs / self.block_rows, self.outputs % self.block_rows);
        std::iter::once((full, self.block_rows))
            .chain((tail > 0).then_some((1, tail)))
            .collect()
    }
}

/// A network in integers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IntegerNetwork {
    /// Bytes of a weight in the tables: 2 or 1.
    pub weight_bytes: usize,
    /// Blocks and inner loop that suit the target.
    pub block: IntegerBlock,
    /// Inputs of a group in the order of the table: a group is one 32-bit word.
    pub lanes: Vec<usize>,
    /// Per feature.
    pub inputs: Vec<IntegerInput>,
    /// First to last.
    pub layers: Vec<IntegerLayer>,
    /// Power of two that makes an output of the network a Q value.
    pub q_unit: Literal,
    /// Exponent field of an output with 25 significant bits as a Q value.
    pub q_field: i32,
    /// Largest magnitude of any partial sum.
    pub accumulator_bound: i64,
}

impl IntegerNetwork {
    /// Groups of inputs of a layer with `inputs` inputs.
    #[must_use]
    pub fn groups(&self, inputs: usize) -> usize {
        inputs.div_ceil(self.lanes.len())
    }

    /// The layers computed one after the other, and the last two where the very last is streamed.
    #[must_use]
    pub fn pieces(&self) -> (&[IntegerLayer], Option<(&IntegerLayer, &IntegerLayer)>) {
        match self.layers.as_slice() {
            [before @ .., block, last] if last.is_streamed() => (before, Some((block, last))),
            layers => (layers, None),
        }
    }

    /// Integers that hold an activation vector: inputs, rounded up to whole groups.
    #[must_use]
    pub fn padded(&self, inputs: usize) -> usize {
        self.groups(inputs) * self.lanes.len()
    }
}

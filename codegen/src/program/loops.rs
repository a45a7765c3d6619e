//! The network as a tree of loops over tables and buffers.
//!
//! ```text
//!  layer by layer                                     the last layer streamed
//!
//!  Layer 0   input ─► hidden0                         Begin     q = biases of layer 2
//!    Repeat  full blocks                              Repeat    full blocks of layer 1
//!      Sums  rows side by side, from their biases       Layer 1   hidden0 ─► part      one block of its outputs
//!      Store activation, to hidden0                     Layer 2   part ─► q            what they add to every sum
//!    Repeat  the shorter rest ...                     Repeat    the shorter rest ...
//!  Layer 1   hidden0 ─► output ...
//! ```
//!
//! What comes in: an observation (or, in integers, its rounded mantissas). What goes out: one Q value per action. The one
//! invariant: whatever the nesting, a sum starts with its bias and takes its inputs in index order, so every tree of a layer
//! gives the same bits; and each table is read from its first value to its last, once.
//!
//! Lowering builds the tree (`lower::loops`), backends print its nodes, `lower::known_answers` computes on it.

use policy::{Activation, Scalar};

use super::literal::Literal;

/// A node.
#[derive(Debug, Clone, PartialEq)]
pub enum Loop {
    /// A layer or a piece of one: a function of its own where the language wants one.
    Layer(Layer),
    /// The body several times. Tables and outputs move on by what the body reads and writes.
    Repeat {
        /// Which blocks.
        blocks: Part,
        /// How often; a single block is a repetition, too.
        count: usize,
        /// What is done.
        body: Vec<Loop>,
    },
    /// The sums of the last layer, of that number, become its biases: it is streamed.
    Begin(usize),
    /// Sums of some outputs side by side.
    Sums(Sums),
    /// What becomes of the sums made last.
    Store(Store),
    /// The outputs made last go into all sums of the last layer.
    Add(Add),
    /// Zeros behind the outputs in a buffer, so that it has whole groups.
    Pad {
        /// Where.
        buffer: Buffer,
        /// First place.
        from: usize,
        /// Behind the last place.
        to: usize,
    },
}

/// The blocks of outputs, or of inputs, that a loop takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Those of full height.
    Full,
    /// The shorter last one.
    Rest,
}

/// Where activations are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Buffer {
    /// The observation.
    Input,
    /// The outputs of the layer of that number.
    Hidden(usize),
    /// A block of outputs of the last layer but one.
    Block,
    /// The outputs of the network.
    Output,
}

/// A layer or a piece of one.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Number, from 0.
    pub index: usize,
    /// Set if it is a piece.
    pub piece: Option<Piece>,
    /// Inputs of the piece.
    pub inputs: usize,
    /// Outputs of the piece.
    pub outputs: usize,
    /// Where it reads.
    pub from: Buffer,
    /// Where it writes.
    pub to: Buffer,
    /// Number of the last layer, if every block goes into its sums at once.
    pub next: Option<usize>,
    /// Whether its blocks are there in assembly, too.
    pub has_assembly: bool,
    /// Its loops.
    pub body: Vec<Loop>,
}

/// A block of outputs of the last layer but one, or what it adds to the sums of the last layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece {
    /// Outputs in the block.
    pub rows: usize,
    /// Weights of the layer that belong to a full block.
    pub weights: usize,
    /// Biases of the layer that belong to a full block.
    pub biases: usize,
}

/// Sums of some outputs side by side.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sums {
    /// Number of the layer whose tables are read.
    pub layer: usize,
    /// Outputs.
    pub rows: usize,
    /// Inputs.
    pub inputs: usize,
    /// What the sums start from.
    pub from: From,
    /// Where they are kept.
    pub kept: Kept,
    /// The loops over groups of inputs.
    pub turns: Vec<Turns>,
}

/// A loop whose body is written out for some groups of inputs, or for some sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turns {
    /// How often.
    pub count: usize,
    /// Groups, or sums, in one turn.
    pub width: usize,
}

/// What sums start from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum From {
    /// Their biases.
    Bias,
    /// The sums that stand in the buffer they are written to.
    Sums,
}

/// Where sums are kept while inputs are added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kept {
    /// In variables.
    Registers,
    /// In the buffer they are written to (axpy form).
    Memory,
    /// In vectors of the compiler where machine and compiler (GNU) have them, else in memory.
    Vectors,
}

/// What becomes of sums.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Store {
    /// Outputs.
    pub rows: usize,
    /// Behind the sum.
    pub activation: Activation,
    /// What is kept of a sum of integers; `None` in floats.
    pub cut: Option<Cut>,
    /// Where the outputs go.
    pub to: Sink,
}

/// What is kept of a sum of integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cut {
    /// Bits cut off the sum; 0 where the activation takes it as a number.
    pub shift: u32,
    /// Power of two that makes the sum a number, for an activation that takes one.
    pub unit: Literal,
    /// Power of two that makes its value an integer.
    pub scale: Literal,
}

/// Where outputs go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sink {
    /// Into the buffer, as wide as the sums.
    Sums,
    /// Into the buffer, 16 bits wide.
    Halves,
    /// They stay where they are, for [`Loop::Add`].
    Registers,
    /// The sums stand in the buffer already and become outputs there.
    InPlace,
}

/// What a block of outputs adds to all sums of the last layer, which takes them as its inputs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Add {
    /// Number of the last layer.
    pub layer: usize,
    /// Outputs in the block.
    pub inputs: usize,
    /// Whether none of them is negative.
    pub is_positive: bool,
    /// The loops over the sums.
    pub turns: Vec<Turns>,
}

/// A network: what it computes in, its layers and its loops.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Floats or integers.
    pub arithmetic: Arithmetic,
    /// Inputs of a group in the order of their weights; a group of integers is one 32-bit word of weights.
    pub lanes: Vec<usize>,
    /// First to last.
    pub layers: Vec<Shape>,
    /// Length of every buffer.
    pub buffers: Vec<(Buffer, usize)>,
    /// In execution order.
    pub loops: Vec<Loop>,
    /// Whether the build may ask for assembly: some layer has it, or would if it were not streamed.
    pub has_assembly: bool,
}

/// A layer, for comments and counts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shape {
    /// Tensor name.
    pub name: String,
    /// Inputs.
    pub inputs: usize,
    /// Outputs.
    pub outputs: usize,
    /// Bits cut off its sums, in integers.
    pub shift: u32,
}

/// What a network computes in.
#[derive(Debug, Clone, PartialEq)]
pub enum Arithmetic {
    /// Floats. The weights are binary32 in either format.
    Real {
        /// Format of sums and values.
        scalar: Scalar,
        /// Products are added with one rounding.
        fused: bool,
    },
    /// Integers: every partial sum fits in 32 bits, in any order.
    Integer(IntegerCode),
}

/// A network in integers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IntegerCode {
    /// Bytes of a weight in the tables: 2 or 1.
    pub weight_bytes: usize,
    /// Inner loops that suit the target.
    pub inner: Inner,
    /// Per feature.
    pub inputs: Vec<IntegerInput>,
    /// Whether all inputs have been read before the first output is written, so that both may share their memory.
    pub shares: bool,
    /// Bits that are cut off an output where it is read; the last layer is streamed and leaves its sums.
    pub output_shift: u32,
    /// Power of two that makes an output of the network a Q value.
    pub q_unit: Literal,
    /// Exponent field of an output with 25 significant bits as a Q value.
    pub q_field: i32,
    /// Largest magnitude of any partial sum.
    pub accumulator_bound: i64,
}

/// Inner loops over integers besides the portable ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Inner {
    /// Two products and their sum in one instruction, where the compiled core has it (Arm `SMLAD`).
    Dual,
    /// Weights of 16 bits are loaded by words and split.
    Halves,
    /// None.
    Plain,
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

impl Layer {
    /// The blocks of its outputs: which, how many, and what is done for each.
    pub fn blocks(&self) -> impl Iterator<Item = (Part, usize, &[Loop])> {
        self.body.iter().filter_map(|node| match node {
            Loop::Repeat { blocks, count, body } => Some((*blocks, *count, body.as_slice())),
            _ => None,
        })
    }

    /// Whether some blocks take a loop.
    #[must_use]
    pub fn loops_over_blocks(&self) -> bool {
        self.blocks().any(|(_, count, _)| count > 1)
    }
}

impl Network {
    /// Format of sums, or of what integers stand for.
    #[must_use]
    pub fn integer(&self) -> Option<&IntegerCode> {
        match &self.arithmetic {
            Arithmetic::Real { .. } => None,
            Arithmetic::Integer(code) => Some(code),
        }
    }

    /// Groups of so many inputs.
    #[must_use]
    pub fn groups(&self, inputs: usize) -> usize {
        inputs.div_ceil(self.lanes.len())
    }

    /// Length of a buffer of so many numbers: whole groups.
    #[must_use]
    pub fn padded(&self, inputs: usize) -> usize {
        self.groups(inputs) * self.lanes.len()
    }

    /// Length of a buffer, 0 if there is none.
    #[must_use]
    pub fn length(&self, buffer: Buffer) -> usize {
        let found = self.buffers.iter().find(|(other, _)| *other == buffer);
        found.map_or(0, |(_, length)| *length)
    }

    /// All nodes, each before its body.
    #[must_use]
    pub fn nodes(&self) -> Vec<&Loop> {
        let mut nodes = Vec::new();
        // a stack gives back the last first, so nodes go in the wrong way round
        let mut open: Vec<&Loop> = self.loops.iter().rev().collect();
        while let Some(node) = open.pop() {
            nodes.push(node);
            if let Loop::Layer(Layer { body, .. }) | Loop::Repeat { body, .. } = node {
                open.extend(body.iter().rev());
            }
        }
        nodes
    }

    /// All layers and pieces, in execution order.
    pub fn pieces(&self) -> impl Iterator<Item = &Layer> {
        self.nodes().into_iter().filter_map(|node| match node {
            Loop::Layer(layer) => Some(layer),
            _ => None,
        })
    }

    /// Whether a layer has an activation of this kind.
    #[must_use]
    pub fn activates(&self, wanted: impl Fn(Activation) -> bool) -> bool {
        let nodes = self.nodes();
        let mut stores = nodes.iter().filter_map(|node| match node {
            Loop::Store(store) => Some(store.activation),
            _ => None,
        });
        stores.any(wanted)
    }
}

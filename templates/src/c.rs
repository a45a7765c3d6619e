//! Views of the C99 backend.

use askama::Template;

/// A declaration with a trailing comment.
#[derive(Debug, Clone)]
pub struct Member {
    /// Declaration without the semicolon.
    pub declaration: String,
    /// Text of the comment.
    pub comment: String,
}

/// A macro `<PREFIX>_<name>` with its value.
#[derive(Debug, Clone)]
pub struct Constant {
    /// Name without the prefix.
    pub name: String,
    /// Value as C text.
    pub value: String,
}

/// A constant table.
#[derive(Debug, Clone)]
pub struct Table {
    /// C type of an element.
    pub element: &'static str,
    /// Name without the prefix.
    pub name: String,
    /// Number of elements.
    pub length: usize,
    /// Lines of comma-separated literals.
    pub lines: Vec<String>,
    /// Whether it is aligned to more than its elements are.
    pub aligned: bool,
}

/// The network in floats.
#[derive(Debug, Clone)]
pub struct RealView {
    /// Functions, in the order of the layers.
    pub layers: Vec<LayerView>,
    /// Statements of `q_values`.
    pub calls: Vec<String>,
}

/// A dense layer, or a piece of one.
#[derive(Debug, Clone)]
pub struct LayerView {
    /// Number, from 0.
    pub index: usize,
    /// Name of the function without the prefix.
    pub function: String,
    /// Whether the function is given its weights and first sums: a block of outputs, or the sums over a chunk of inputs.
    pub is_piece: bool,
    /// Tensor name and shape for the comment.
    pub comment: String,
    /// Inputs.
    pub inputs: usize,
    /// Outputs.
    pub outputs: usize,
    /// Loops over blocks of outputs, in order.
    pub blocks: Vec<BlockView>,
    /// Whether the sums stand in the output array (axpy form) instead of in variables.
    pub in_memory: bool,
    /// Whether the accumulators are vectors where the compiler has them.
    pub has_vectors: bool,
    /// Whether a block is repeated.
    pub has_loop: bool,
    /// Whether every block has a form in assembly.
    pub has_assembly: bool,
    /// Sum after the first input.
    pub first: String,
    /// Sum after each further input.
    pub next: String,
    /// Expression of the activation over `y[o]`; empty for none.
    pub activation: String,
}

/// Blocks of equal height within a layer.
#[derive(Debug, Clone)]
pub struct BlockView {
    /// Number of blocks.
    pub count: usize,
    /// Outputs per block.
    pub rows: usize,
    /// The whole block in assembly; empty if there is none.
    pub assembly: Vec<String>,
    /// One entry per output of the block.
    pub row_views: Vec<RealRowView>,
    /// The block in vectors, per width of the machine's; empty without.
    pub vectors: Vec<VectorView>,
}

/// One output of a block in binary32.
#[derive(Debug, Clone)]
pub struct RealRowView {
    /// Number within the block.
    pub index: usize,
    /// Sum after the next input.
    pub next: String,
    /// Output from the sum.
    pub result: String,
}

/// A block of outputs whose sums are vectors.
#[derive(Debug, Clone)]
pub struct VectorView {
    /// Floats in the machine's vector.
    pub lanes: usize,
    /// Declarations of the sums, from the biases.
    pub start: Vec<String>,
    /// Sums after the next input.
    pub turn: Vec<String>,
    /// Stores.
    pub end: Vec<String>,
}

/// The network in its numeric format.
#[derive(Debug, Clone)]
pub enum NetworkView {
    /// Layers in binary32.
    Real(RealView),
    /// Layers in integers.
    Integer(IntegerView),
}

/// A network in integers.
#[derive(Debug, Clone)]
pub struct IntegerView {
    /// Largest magnitude of a sum.
    pub bound: i64,
    /// C type of a weight.
    pub weight: &'static str,
    /// Whether a group has four inputs.
    pub is_quad: bool,
    /// Integers in the input vector, padded to whole groups.
    pub input_length: usize,
    /// Whether the input has been read before the first output is written.
    pub shares: bool,
    /// Statements that fill the padding of the input vector.
    pub padding: Vec<String>,
    /// Output `i` of `integers` as the contract has it, where the network leaves the last shift to its callers.
    pub output: String,
    /// What one integer of the output is worth.
    pub q_unit: String,
    /// Layers in order.
    pub layers: Vec<IntegerLayerView>,
    /// Macro under which the special form is taken: `DSP`, `HALVES`, or none.
    pub special: &'static str,
    /// Whether there are functions in assembly.
    pub has_assembly: bool,
    /// Whether Q values are made of integers by floats in hardware.
    pub has_fpu: bool,
    /// Exponent field of an output with 25 significant bits as a Q value.
    pub q_field: i32,
    /// Which activations occur.
    pub relu: bool,
    /// A leaky ReLU occurs.
    pub leaky_relu: bool,
    /// A tanh occurs.
    pub tanh: bool,
}

/// A dense layer in integers.
#[derive(Debug, Clone)]
pub struct IntegerLayerView {
    /// Number, from 0.
    pub index: usize,
    /// Tensor name, shape and shift for the comment.
    pub comment: String,
    /// Whether its blocks are there in assembly, too.
    pub has_assembly: bool,
    /// Loops over blocks of outputs, in order.
    pub blocks: Vec<IntegerBlockView>,
    /// Whether a block is repeated.
    pub has_loop: bool,
    /// Whether a part of a block is repeated.
    pub has_turns: bool,
    /// Name of the input array.
    pub source: String,
    /// Name of the output array.
    pub sink: String,
    /// Type of an output.
    pub sink_element: &'static str,
    /// Length of the output array, padded to whole groups.
    pub sink_length: usize,
    /// Statements that fill the padding.
    pub padding: Vec<String>,
    /// Whether `sink` is a local buffer.
    pub is_hidden: bool,
    /// The last layer, if it takes the outputs of this one block by block.
    pub next: Option<NextView>,
}

/// The last layer where it takes the outputs of the one before block by block.
#[derive(Debug, Clone)]
pub struct NextView {
    /// Number, from 0.
    pub index: usize,
    /// Outputs.
    pub outputs: usize,
    /// Whether a stretch of its outputs is repeated.
    pub has_turns: bool,
}

/// Blocks of equal height within an integer layer.
#[derive(Debug, Clone)]
pub struct IntegerBlockView {
    /// Number of blocks.
    pub count: usize,
    /// Outputs per block.
    pub height: usize,
    /// First output and first weight of the blocks.
    pub first: (usize, usize),
    /// All blocks as the body of a function in assembly.
    pub assembly: Vec<String>,
    /// Stretches of inputs in the form that suits the target, if it has one of its own.
    pub special: Vec<IntegerPartView>,
    /// Stretches of inputs in portable C.
    pub portable: Vec<IntegerPartView>,
    /// One entry per output of the block.
    pub rows: Vec<RowView>,
    /// What the block adds to the sums of the last layer, if that takes it.
    pub added: Option<AddedView>,
}

/// What a block of outputs adds to the sums of the last layer.
#[derive(Debug, Clone)]
pub struct AddedView {
    /// First weight.
    pub first: usize,
    /// Declarations of the special form: pairs of outputs as words.
    pub pairs: Vec<String>,
    /// Stretches of sums in the form that suits the target, if it has one of its own.
    pub special: Vec<IntegerPartView>,
    /// Stretches of sums in portable C.
    pub portable: Vec<IntegerPartView>,
}

/// A stretch of inputs of a block, or of sums: some groups, taken several times.
#[derive(Debug, Clone)]
pub struct IntegerPartView {
    /// Times.
    pub turns: usize,
    /// Statements.
    pub lines: Vec<String>,
}

/// One output of a block.
#[derive(Debug, Clone)]
pub struct RowView {
    /// Number within the block.
    pub index: usize,
    /// Output from the sum.
    pub result: String,
}

/// A CRC function over one type of table.
#[derive(Debug, Clone)]
pub struct CrcKind {
    /// Name without the prefix.
    pub name: &'static str,
    /// C type of an element.
    pub element: &'static str,
    /// Element `i` as words, the low one first.
    pub words: Vec<String>,
}

/// A table of the integrity check.
#[derive(Debug, Clone)]
pub struct CrcItem {
    /// CRC function, without the prefix.
    pub function: &'static str,
    /// Table, without the prefix.
    pub table: String,
    /// Elements.
    pub length: usize,
}

/// How the greedy action is found.
#[derive(Debug, Clone)]
pub struct Argmax {
    /// C type of an output of the network.
    pub element: &'static str,
    /// Below every output.
    pub lowest: &'static str,
    /// Declarations, then calls that give the outputs of a measurement.
    pub declarations: Vec<String>,
    /// The calls.
    pub calls: Vec<String>,
    /// Output `action` of the network.
    pub output: String,
    /// Whether cores with dual products may occur, and their conditional moves.
    pub dual: bool,
    /// The larger of `best` and `output`, by the flag `above`.
    pub select: String,
}

/// A line of filter memory that `commit` pushes into.
#[derive(Debug, Clone)]
pub struct PushView {
    /// First word.
    pub word: usize,
    /// Last word.
    pub last: usize,
    /// Index into `front->push`.
    pub index: usize,
}

/// The C type of the numbers and what goes with its width.
#[derive(Debug, Clone, Copy)]
pub struct NumberType {
    /// `float` or `double`.
    pub name: &'static str,
    /// What IEEE 754 calls it.
    pub format: &'static str,
    /// Whether it has 64 bits.
    pub is_wide: bool,
    /// Of its literals and of the functions that take it.
    pub suffix: &'static str,
    /// Unsigned integer of its width.
    pub word: &'static str,
    /// All bits but the sign.
    pub magnitude: &'static str,
    /// The sign alone.
    pub sign: &'static str,
    /// Number of the sign bit.
    pub top: u32,
    /// Bits of 9.
    pub nine: &'static str,
    /// Bits of 1.
    pub one: &'static str,
}

/// What both files need.
#[derive(Debug, Clone)]
pub struct Common {
    /// Prefix of functions and types.
    pub name: String,
    /// Prefix of macros.
    pub upper: String,
    /// Lines of the banner.
    pub banner: Vec<String>,
    /// Parameters of `set_mapping` after the state; empty without a mapping.
    pub mapping_parameters: String,
    /// Type of the numbers.
    pub number: NumberType,
}

/// Widths of a processor without 8-bit types, asserted when the core is compiled.
#[derive(Debug, Clone, Copy)]
pub struct WideChar {
    /// Bits of `char`.
    pub char_bits: u8,
    /// Bits of `int`.
    pub int_bits: u8,
    /// `INT_MAX` of that width.
    pub int_max: u64,
}

/// `<name>.h`
#[derive(Debug, Template)]
#[template(path = "c/header.h.jinja", escape = "none")]
pub struct Header {
    /// Names and banner.
    pub common: Common,
    /// Counts and limits.
    pub constants: Vec<Constant>,
    /// Status bits.
    pub status: Vec<Constant>,
    /// Members of the measurement.
    pub measurement: Vec<Member>,
    /// Members of the state, in contract order.
    pub state: Vec<Member>,
    /// One comment line per feature.
    pub features: Vec<String>,
}

/// `<name>.c`
#[derive(Debug, Template)]
#[template(path = "c/source.c.jinja", escape = "none")]
pub struct Source {
    /// Names and banner.
    pub common: Common,
    /// Set where `char` has other than 8 bits.
    pub wide_char: Option<WideChar>,
    /// Weights, biases, duties, CRC steps, self-test data.
    pub tables: Vec<Table>,
    /// Layers in order.
    pub network: NetworkView,
    /// Whether a step senses its measurement again after the network instead of keeping it on the stack.
    pub senses_again: bool,
    /// Greedy action.
    pub argmax: Argmax,
    /// CRC functions, the one for floats first.
    pub crc_kinds: Vec<CrcKind>,
    /// Which helper functions are used.
    pub helpers: Helpers,
    /// Numerator and denominator of tanh, highest power first.
    pub tanh: Vec<Member>,
    /// Members of the front struct that depend on the policy.
    pub front_members: Vec<Member>,
    /// Declarations of `sense`.
    pub sense: Vec<String>,
    /// Assignments at the end of `sense`.
    pub sense_results: Vec<String>,
    /// Declarations of `decide`.
    pub decide: Vec<String>,
    /// Value of the duty in a usable step.
    pub duty: String,
    /// Terms of the status word.
    pub status_terms: Vec<String>,
    /// Declarations of `advance`.
    pub advance: Vec<String>,
    /// Next soft-start limit; empty without.
    pub soft_cap: String,
    /// Number of sanitised signals.
    pub signal_count: usize,
    /// Filter memory updates.
    pub pushes: Vec<PushView>,
    /// Statements of `init`.
    pub init: Vec<String>,
    /// Statements of `reset`.
    pub reset: Vec<String>,
    /// Words of filter memory.
    pub memory_words: usize,
    /// Conditions of `set_mapping`.
    pub mapping_conditions: Vec<String>,
    /// Assignments of `set_mapping`.
    pub mapping_assignments: Vec<String>,
    /// Hold count.
    pub hold: String,
    /// Fallback duty.
    pub fallback: String,
    /// Tables of the integrity check.
    pub integrity: Vec<CrcItem>,
    /// Expected CRC-32.
    pub crc: String,
    /// Self test: number of vectors, seed, multiplier, increment, unit.
    pub self_test: SelfTestView,
}

/// Which helpers the source needs.
#[derive(Debug, Clone, Copy, Default)]
pub struct Helpers {
    /// `within`
    pub within: bool,
    /// `outside`
    pub outside: bool,
    /// `clamp`
    pub clamp: bool,
    /// `line_sum`
    pub line_sum: bool,
    /// `relu`
    pub relu: bool,
    /// `relu` from a sum and a product, for processors that have them
    pub relu_by_sum: bool,
    /// `leaky_relu`
    pub leaky_relu: bool,
    /// `tanh`
    pub tanh: bool,
    /// `fma`
    pub fused: bool,
    /// Loops in assembly
    pub assembly: bool,
    /// Vectors of the compiler
    pub vectors: bool,
    /// Bytes to which tables are aligned that are so to more than their elements.
    pub alignment: Option<u32>,
}

/// Numbers of the self test.
#[derive(Debug, Clone)]
pub struct SelfTestView {
    /// Number of vectors.
    pub vectors: usize,
    /// Seed.
    pub seed: String,
    /// Multiplier.
    pub multiplier: String,
    /// Increment.
    pub increment: String,
    /// Scale to 0..1.
    pub unit: String,
}

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

/// A bit of the status word.
#[derive(Debug, Clone)]
pub struct StatusBit {
    /// Name without the prefix.
    pub name: &'static str,
    /// Value as C text.
    pub value: String,
    /// One sentence for the reader of the header.
    pub meaning: &'static str,
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
    /// Lines of the functions, in the order of the layers.
    pub functions: Vec<String>,
    /// Statements of `q_values`.
    pub calls: Vec<String>,
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
    /// Bits that callers of the network cut off its outputs.
    pub shift: u32,
    /// What one integer of the output is worth.
    pub q_unit: String,
    /// Lines of the functions, in the order of the layers.
    pub functions: Vec<String>,
    /// Statements of `network`.
    pub calls: Vec<String>,
    /// Macro under which the special form is taken: `DSP`, `HALVES`, or none.
    pub special: &'static str,
    /// Whether there are functions in assembly.
    pub has_assembly: bool,
    /// Whether Q values are made of integers by floats in hardware.
    pub has_fpu: bool,
    /// Exponent field of an output with 25 significant bits as a Q value.
    pub q_field: i32,
    /// Functions of the activations that occur.
    pub activations: Vec<String>,
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

/// What the outputs of the network become.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeadView {
    /// The greedy action of argmax.
    Choice,
    /// One output, a duty.
    Output,
    /// All outputs, gains of a law.
    Gains,
    /// All outputs, from which several duties are decided.
    Several,
}

/// A function that sets the mapping of one of several outputs.
#[derive(Debug, Clone)]
pub struct SetMapping {
    /// Name without the prefix.
    pub function: String,
    /// Parameters after the state.
    pub parameters: String,
}

/// A duty of the command.
#[derive(Debug, Clone)]
pub struct DutyView {
    /// Its place in the arrays of the command; empty where there is one duty.
    pub place: String,
    /// Value in a usable step.
    pub duty: String,
    /// Value before the mapping in a usable step.
    pub duty_sim: String,
    /// Value in any other step.
    pub fallback: String,
    /// Action index.
    pub index: String,
    /// Member of the state that remembers it before the mapping.
    pub previous_duty: String,
    /// Member of the state that remembers it.
    pub previous_command: String,
}

/// A mapping.
#[derive(Debug, Clone)]
pub struct MappingView {
    /// Function that sets it, without the prefix.
    pub function: String,
    /// Function that sees flipped bits, without the prefix.
    pub flips: String,
    /// Parameters after the state.
    pub parameters: String,
    /// Conditions under which they are taken.
    pub conditions: Vec<String>,
    /// Members of the state and the parameters that set them.
    pub members: Vec<(String, &'static str)>,
    /// Member of the check word.
    pub check: String,
    /// Check word of the coefficients in the state.
    pub held: String,
    /// The same of those that are given.
    pub given: String,
}

/// `<name>.h`
#[derive(Debug, Template)]
#[template(path = "c/header.h.jinja", escape = "none")]
pub struct Header {
    /// Names and banner.
    pub common: Common,
    /// Counts and limits: names without the prefix, and their values.
    pub constants: Vec<(String, String)>,
    /// Declarator behind what each of several outputs has; empty where there is one.
    pub places: String,
    /// Functions of several outputs that set a mapping.
    pub mappings: Vec<SetMapping>,
    /// Status bits.
    pub status: Vec<StatusBit>,
    /// Members of the measurement.
    pub measurement: Vec<Member>,
    /// Members of the state, in contract order.
    pub state: Vec<Member>,
    /// What the outputs become.
    pub head: HeadView,
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
    /// CRC functions, the one for floats first.
    pub crc_kinds: Vec<CrcKind>,
    /// Which helper functions are used.
    pub helpers: Helpers,
    /// Functions for floats of the activations that occur.
    pub activations: Vec<String>,
    /// Outputs of the network.
    pub actions: usize,
    /// What the outputs become.
    pub head: HeadView,
    /// Type of what the network hands on to the command.
    pub answer: &'static str,
    /// Its name.
    pub answered: &'static str,
    /// A number below every Q value.
    pub lowest: &'static str,
    /// Declarations of `sense`.
    pub sense: Vec<String>,
    /// Sanitised signals.
    pub signals: Vec<String>,
    /// Observation.
    pub observation: Vec<String>,
    /// What the filters will remember.
    pub pushed: Vec<String>,
    /// Flag that all signals are valid.
    pub valid: String,
    /// Flag that an observation was clipped, if one can be.
    pub clipped: Option<String>,
    /// What the law of a residual head says.
    pub base: Option<String>,
    /// What gains are multiplied with.
    pub factors: Vec<String>,
    /// Flag that nothing is added to it, if it has a dead zone.
    pub still: Option<String>,
    /// Declarations of `decide`.
    pub decide: Vec<String>,
    /// Whether all outputs of the network are handed on to the command.
    pub takes_outputs: bool,
    /// Declarations of what argmax chose.
    pub chosen: Vec<String>,
    /// Whether argmax is a function over some of the outputs.
    pub greedy: bool,
    /// The duties of the command.
    pub duties: Vec<DutyView>,
    /// Word whose sign bit is set if one is not within its limits.
    pub duty_stray: String,
    /// Whether mapping or soft start read the state.
    pub reads_state: bool,
    /// Terms of a word whose sign bit is set if the state is not sound.
    pub guard: Vec<String>,
    /// The mappings.
    pub mappings: Vec<MappingView>,
    /// Largest count of bad steps.
    pub most_bad: String,
    /// Terms of the status word.
    pub status_terms: Vec<String>,
    /// Declarations of `advance`.
    pub advance: Vec<String>,
    /// Members of the state that hold a soft-start limit, and their next values.
    pub soft_caps: Vec<(String, String)>,
    /// Filter memory updates.
    pub pushes: Vec<PushView>,
    /// Statements of `init`.
    pub init: Vec<String>,
    /// Statements of `reset`.
    pub reset: Vec<String>,
    /// Words of filter memory.
    pub memory_words: usize,
    /// Hold count.
    pub hold: String,
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

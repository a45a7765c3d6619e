//! What there is to say of a target.

use serde::Serialize;

use crate::boards::Board;

/// Byte order of a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Endianness {
    /// Least significant byte first.
    Little,
    /// Most significant byte first.
    Big,
    /// Decided by the machine the code is compiled for.
    Native,
}

/// How many outputs of a dense layer are accumulated side by side.
///
/// The choice moves work *across* outputs only; the order of additions within one output is the contract's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RowBlock {
    /// All outputs of the layer: the accumulators are the output buffer (axpy form).
    All,
    /// At most this many; a shorter last block, no padding.
    Rows(usize),
    /// At most this many, as vectors of the compiler where machine and compiler (GNU) have them, else as [`RowBlock::All`]
    /// within a block.
    Vectors(usize),
}

/// How the loops of an integer layer are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum IntegerLoop {
    /// Two products and their sum in one instruction where the compiled core has it (Arm `SMLAD`), else plain.
    Dual,
    /// Weights of 16 bits are loaded by words and split, where the core loads halves of a word with an index only.
    Halves,
    /// One product after the other.
    Plain,
}

/// Blocks of an integer layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct IntegerBlock {
    /// Outputs accumulated side by side at most; [`IntegerLoop::Dual`] has registers for 4.
    pub rows: usize,
    /// Groups of inputs (one word of weights each) in one turn of the loop.
    pub unrolled: usize,
    /// Inner loop.
    pub inner: IntegerLoop,
    /// Whether the last layer takes the outputs of the one before block by block, so that those are never in memory: less
    /// stack and, where a block and its sums fit into registers, no more instructions.
    pub streams: bool,
    /// In Rust instead of `rows`, with 16-bit and with 8-bit weights: LLVM unrolls the loops over a block and spills sooner or
    /// later than C compilers do.
    pub rust_rows: (usize, usize),
}

impl IntegerBlock {
    /// Where nothing is known of the core, and on those with `SMLAD`: four sums, four weights, an input, four pointers.
    pub const DUAL: IntegerBlock = IntegerBlock {
        rows: 4,
        unrolled: 4,
        inner: IntegerLoop::Dual,
        streams: true,
        rust_rows: (4, 4),
    };
}

/// Widths of C's types in bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Widths {
    /// `char`, the smallest addressable unit.
    pub char_bits: u8,
    /// `int`.
    pub int_bits: u8,
    /// A data pointer.
    pub pointer_bits: u8,
}

/// Floating point in hardware.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fpu {
    /// None: floats are library calls whose instruction count depends on the data.
    None,
    /// binary32.
    Single,
    /// binary32 and binary64.
    Double,
    /// Decided by the machine the code is compiled for: both, on every usual one.
    Native,
}

impl Fpu {
    /// Whether binary32, or binary64 if `double`, is computed in hardware.
    #[must_use]
    pub fn has(self, double: bool) -> bool {
        match self {
            Fpu::None => false,
            Fpu::Single => !double,
            Fpu::Double | Fpu::Native => true,
        }
    }
}

/// Fused multiply-add in hardware, as cycles from which the next dependent-free operation can issue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fma {
    /// The processor has none.
    Absent,
    /// It has one, its cost is not documented.
    Unrated,
    /// Cycles of the fused operation, and of product and sum apart.
    Cycles {
        /// Fused.
        fused: u8,
        /// Product, then sum.
        apart: u8,
    },
}

/// Cycles beyond one per instruction, at 0 wait states, from the processor's timing table: least and most.
///
/// A model, not a measurement. Divisions and fused operations are not in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct CycleModel {
    /// Per access to memory; the least where loads follow each other in the pipeline.
    pub access: (u8, u8),
    /// Per jump taken: refill of the pipeline.
    pub jump: (u8, u8),
}

/// Where compilers of the target put things unless told otherwise, and where fast memory usually is.
///
/// The generated C takes other places through its macros `<NAME>_TABLE` and `<NAME>_CODE`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Sections {
    /// Constant tables.
    pub tables: &'static str,
    /// Code.
    pub code: &'static str,
    /// Usual name for code in fast memory, if that is common practice on the target.
    pub fast_code: Option<&'static str>,
}

/// A C compiler of a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct CCompiler {
    /// Program name, also the name in filters.
    pub program: &'static str,
    /// Debian package that has it; empty where no distribution has it.
    pub package: &'static str,
    /// Flags that choose the processor.
    pub machine_flags: &'static [&'static str],
}

/// Rust on a target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct RustTarget {
    /// Target triple; empty for the machine of the compiler.
    pub triple: &'static str,
    /// Flags that choose the processor.
    pub machine_flags: &'static [&'static str],
}

impl RustTarget {
    /// The processor, as its flag names it.
    #[must_use]
    pub fn processor(&self) -> Option<&'static str> {
        let flags = self.machine_flags.iter();
        flags.filter_map(|flag| flag.strip_prefix("-Ctarget-cpu=")).next()
    }
}

/// Where a build of the target runs under `policyc verify`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Runner {
    /// On this machine.
    Native,
    /// Under an emulator.
    Emulated(Board),
    /// Nowhere here; why.
    None(&'static str),
}

/// A deployment target.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TargetSpec {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for people.
    pub description: &'static str,
    /// Byte order.
    pub endianness: Endianness,
    /// Widths of C's types.
    pub widths: Widths,
    /// Floats in hardware.
    pub fpu: Fpu,
    /// Fused multiply-add.
    pub fma: Fma,
    /// Whether the FPU takes subnormal numbers for zero, operands and results.
    pub flushes_subnormals: bool,
    /// Numeric format that suits the processor, as `policy.toml` names it; the policy decides, not the target.
    pub suitable_format: &'static str,
    /// Cycles of an instruction mix, where the processor's table is simple enough to say so.
    pub cycles: Option<CycleModel>,
    /// Instructions that the processor begins in a cycle at most, where its manual says so and there is no cycle model.
    pub most_per_cycle: Option<u32>,
    /// Where things lie.
    pub sections: Sections,
    /// Clock in Hz of a usual device, for shares of the control period.
    pub clock_hz: Option<u32>,
    /// Row block of the generated C, chosen for the C compilers of the target.
    pub c_row_block: RowBlock,
    /// Row block of the generated Rust, chosen for LLVM.
    pub rust_row_block: RowBlock,
    /// Bytes to a multiple of which the weights of a network in floats are aligned, where loads of whole vectors gain by it.
    pub weights_alignment: Option<u32>,
    /// Whether a network in binary32 has loops in assembly: ARM cores with binary32 in hardware.
    pub has_float_assembly: bool,
    /// Blocks of the integer formats.
    pub integer_block: IntegerBlock,
    /// C compilers in the order in which they are tried. The first also links what the others compile.
    pub c_compilers: &'static [CCompiler],
    /// Flags under which the bits hold, besides the processor and the optimisation level.
    pub c_flags: &'static [&'static str],
    /// Rust, where the target has it.
    pub rust: Option<RustTarget>,
    /// rustc flags under which the bits hold, besides the optimisation level.
    pub rust_flags: &'static [&'static str],
    /// Where `policyc verify` runs a build.
    pub runner: Runner,
}

/// C flags under which the bits hold with every compiler that knows them.
// gcc fuses products and sums wherever the processor can, unless told otherwise (decision 1)
pub(crate) const EXACT_C99: &[&str] = &["-std=c99", "-ffp-contract=off"];

/// rustc never contracts and has no fast-math switch.
pub(crate) const EXACT_RUST: &[&str] = &["--edition=2021"];

/// Widths of a 32-bit processor.
pub(crate) const ILP32: Widths = Widths {
    char_bits: 8,
    int_bits: 32,
    pointer_bits: 32,
};

/// What GNU compilers do.
pub(crate) const GNU_SECTIONS: Sections = Sections {
    tables: ".rodata",
    code: ".text",
    fast_code: None,
};

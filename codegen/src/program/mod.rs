//! The lowered controller: order, loops, tables, buffers and literals explicit, no decision left to a backend.
//!
//! ```text
//!  measurement ─► front ─► observation ─► network ─► chosen duty ─► decide ─► command
//!                 [`Block`]               [`Loop`]s                 [`Block`]    │
//!                                         over [`Table`]s          advance ◄─────┘   what `commit` remembers
//! ```
//!
//! A block is straight-line code: a backend prints its values one after the other. The network is a tree of a few kinds of
//! loops which walk the tables from end to end; a backend prints the nodes, and the known answers are computed on them.

mod guard;
mod head;
mod literal;
mod loops;
mod ops;
mod tables;

use policy::{Digests, NumericFormat, Scalar};
use targets::Widths;

pub use guard::{Guard, Guarded, Place, Within};
pub use head::{Head, HeadPart};
pub use literal::Literal;
pub(crate) use literal::{bits, words};
pub use loops::{Add, Arithmetic, Buffer, Cut, From, Inner, IntegerCode, IntegerInput, Kept, Layer, Loop};
pub use loops::{Network, Part, Piece, Shape, Sink, Store, Sums, Turns};
pub use ops::{
    Advance, Block, Coefficient, Conversion, Decide, Duty, Front, Op, Push, SignalPort, StateMember, StateValue,
    ValueId,
};
pub use tables::{Element, Slice, Strip, Table};

/// Coefficients, their run-time intervals and the condition that keeps the mapping increasing, and what vouches for them.
#[derive(Debug, Clone, PartialEq)]
pub struct MappingCode {
    /// Coefficient, value after `init`, lowest and highest value accepted at run time; `R` in the four-term form only.
    pub coefficients: Vec<(Coefficient, Literal, Literal, Literal)>,
    /// Validity range of the load current.
    pub valid_i_out: (Literal, Literal),
    /// What the bits of all coefficients are combined with, by exclusive or, into their check word.
    pub check_constant: u64,
}

/// A duty that leaves the controller.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputCode {
    /// Name; `None` where there is one output.
    pub name: Option<String>,
    /// Its mapping, if any.
    pub mapping: Option<MappingCode>,
    /// Duty without a usable measurement.
    pub fallback: Literal,
}

impl OutputCode {
    /// A name of generated code: `stem` where there is one output, `stem_left` of the output `left`.
    #[must_use]
    pub fn named(&self, stem: &str) -> String {
        self.name
            .as_ref()
            .map_or(stem.to_owned(), |name| format!("{stem}_{name}"))
    }
}

/// Where the program comes from and under which conditions its bits hold.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Provenance {
    /// Tool version.
    pub tool: String,
    /// Digests of the inputs.
    pub digests: Digests,
    /// Target name.
    pub target: &'static str,
    /// Widths of the target's C types.
    pub widths: Widths,
    /// C flags of the target.
    pub c_flags: &'static [&'static str],
    /// rustc flags of the target.
    pub rust_flags: &'static [&'static str],
}

/// A whole controller, lowered for one target and language family.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// Prefix of all names.
    pub name: String,
    /// Control period in s.
    pub sample_period: f64,
    /// Format of all arithmetic.
    pub numeric_format: NumericFormat,
    /// Whether the target has the floats of the format in hardware.
    pub has_fpu: bool,
    /// Whether a step senses its measurement again after the network, instead of keeping it on the stack: that is a few per
    /// cent of the network where floats are hardware, and a tenth of it where they are a library.
    pub senses_again: bool,
    /// The target's processor, as assemblers name it.
    pub processor: Option<&'static str>,
    /// Origin.
    pub provenance: Provenance,
    /// Measurement fields.
    pub signals: Vec<SignalPort>,
    /// Name and formula of each feature, for comments.
    pub features: Vec<(String, String)>,
    /// Words of filter memory.
    pub memory_words: usize,
    /// Measurement to observation.
    pub front: Front,
    /// Network.
    pub network: Network,
    /// What the outputs of the network mean.
    pub head: Head,
    /// The duties, at least one.
    pub outputs: Vec<OutputCode>,
    /// Chosen duty to command.
    pub decide: Decide,
    /// What a sound state lies within.
    pub guard: Guard,
    /// Memory of the command path.
    pub advance: Advance,
    /// State, in contract order.
    pub state: Vec<StateMember>,
    /// K of the contract.
    pub hold: u32,
    /// All constant tables; the integrity check takes those it covers in this order.
    pub tables: Vec<Table>,
    /// CRC-32 of the tables that the integrity check covers.
    pub crc: u32,
}

impl Program {
    /// Format of the numbers around the network, and of a network that is not in integers.
    #[must_use]
    pub fn scalar(&self) -> Scalar {
        self.numeric_format.scalar()
    }

    /// Whether there are several duties, each with a name.
    #[must_use]
    pub fn has_several(&self) -> bool {
        self.outputs.len() > 1
    }

    /// A name of generated code that belongs to the output of that index.
    #[must_use]
    pub fn named(&self, stem: &str, output: usize) -> String {
        self.outputs.get(output).map_or(stem.to_owned(), |own| own.named(stem))
    }

    /// Mapping of the one output, if any.
    #[must_use]
    pub fn mapping(&self) -> Option<&MappingCode> {
        self.outputs.first()?.mapping.as_ref()
    }

    /// Duty of the one output without a usable measurement.
    #[must_use]
    pub fn fallback_duty(&self) -> Literal {
        // there is at least one output
        self.outputs.first().map_or(Literal::exact(0.0), |own| own.fallback)
    }

    /// Number of features.
    #[must_use]
    pub fn feature_count(&self) -> usize {
        self.features.len()
    }

    /// Words of 32 bits in the state struct (contract section 1).
    #[must_use]
    pub fn state_words(&self) -> usize {
        let words = self.scalar().words();
        self.state.iter().map(|member| member.value.words(words)).sum()
    }

    /// Multiply-accumulates of the network.
    #[must_use]
    pub fn macs(&self) -> usize {
        self.network
            .layers
            .iter()
            .map(|layer| layer.inputs * layer.outputs)
            .sum()
    }

    /// The table of that name.
    #[must_use]
    pub fn table(&self, name: &str) -> Option<&Table> {
        self.tables.iter().find(|table| table.name == name)
    }

    /// The tables that the integrity check covers, in its order.
    pub fn checked_tables(&self) -> impl Iterator<Item = &Table> {
        self.tables.iter().filter(|table| table.is_checked)
    }

    /// Bytes to which tables are aligned, if some are to more than their elements.
    #[must_use]
    pub fn alignment(&self) -> Option<u32> {
        self.tables.iter().find_map(|table| table.alignment)
    }

    /// Bytes of the checked tables.
    #[must_use]
    pub fn table_bytes(&self) -> usize {
        let bytes = |table: &Table| table.values.len() * table.element.bytes();
        self.checked_tables().map(bytes).sum()
    }

    /// Numbers in the checked tables.
    #[must_use]
    pub fn table_numbers(&self) -> usize {
        self.checked_tables().map(|table| table.values.len()).sum()
    }
}

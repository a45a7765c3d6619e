//! The lowered controller: order, blocks, buffers and literals explicit, no decision left to a backend.
//!
//! A step is three straight-line [`Block`]s around the network: `front` (measurement to observation), `decide`
//! (chosen duty to command) and `advance` (what `commit` remembers). A backend prints values one after the other.

mod network;

use policy::{Digests, NumericFormat};
use targets::Widths;

pub use network::{ActivationCode, IntegerInput, IntegerLayer, IntegerNetwork, LayerCode, NetworkCode};

/// A binary32 constant by its bits, so that -0 and +0 differ and programs can be compared and ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Literal(pub u32);

impl Literal {
    /// The constant rounded to nearest.
    #[must_use]
    pub fn nearest(value: f64) -> Self {
        Self((value as f32).to_bits())
    }

    /// The constant itself.
    #[must_use]
    pub fn value(self) -> f32 {
        f32::from_bits(self.0)
    }
}

impl From<f32> for Literal {
    fn from(value: f32) -> Self {
        Self(value.to_bits())
    }
}

/// Index of a value within its block.
pub type ValueId = usize;

/// Run-time replaceable coefficient of the mapping.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Coefficient {
    /// Gain on d_sim.
    A,
    /// Per ampere of load current.
    B,
    /// Constant.
    C,
    /// Product term.
    R,
}

impl Coefficient {
    /// Name of the parameter that sets it; the state member is `mapping_<name>`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Coefficient::A => "a",
            Coefficient::B => "b",
            Coefficient::C => "c",
            Coefficient::R => "r",
        }
    }
}

/// One operation; its result is a number of the format or, where the name says so, a flag (0 or 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Op {
    /// Measured physical sample of a signal.
    Measured(usize),
    /// ADC code of a signal, converted to the format.
    Code(usize),
    /// Last good sample of a signal.
    Held(usize),
    /// Sanitised sample of a signal, as `front` left it.
    Sanitised(usize),
    /// Word of the filter memory.
    Memory(usize),
    /// State: duty of the last chosen action.
    PreviousDuty,
    /// State: last command.
    PreviousCommand,
    /// State: rising upper limit.
    SoftCap,
    /// State: coefficient of the mapping.
    Coefficient(Coefficient),
    /// Duty of the action that argmax chose.
    ChosenDuty,
    /// Constant.
    Constant(Literal),
    /// Sign change, exact.
    Neg(ValueId),
    /// Sum, rounded once.
    Add(ValueId, ValueId),
    /// Difference, rounded once.
    Sub(ValueId, ValueId),
    /// Product, rounded once.
    Mul(ValueId, ValueId),
    /// `then` if `flag` else `otherwise`, without a branch.
    Select {
        /// Flag.
        flag: ValueId,
        /// Value if 1.
        then: ValueId,
        /// Value if 0.
        otherwise: ValueId,
    },
    /// Contract section 4: `t = low if x < low else x; high if t > high else t`.
    Clamp {
        /// Value.
        x: ValueId,
        /// Lower end.
        low: ValueId,
        /// Upper end.
        high: ValueId,
    },
    /// Sum over a line of memory, oldest first, then `newest`; every word reads as `newest` if not primed.
    LineSum {
        /// First word of the line.
        word: usize,
        /// Words in the line.
        length: usize,
        /// Value added last.
        newest: ValueId,
        /// Flag: state is primed.
        primed: ValueId,
    },
    /// Flag of the state: filters are primed.
    Primed,
    /// Flag from `front`: this step's measurement can be used.
    Usable,
    /// Flag from `front`: an observation was clipped.
    Clipped,
    /// Flag from `front`: held samples bridge an invalid measurement.
    HeldSample,
    /// Flag from `front`: this step primes the filters.
    PrimedNow,
    /// Flag: `low <= x <= high`; 0 for NaN.
    Within {
        /// Value.
        x: ValueId,
        /// Lower end.
        low: ValueId,
        /// Upper end.
        high: ValueId,
    },
    /// Flag: `x < low or x > high`.
    Outside {
        /// Value.
        x: ValueId,
        /// Lower end.
        low: ValueId,
        /// Upper end.
        high: ValueId,
    },
    /// Word: the bits in which two numbers differ. Of a number and what a clamp has made of it: 0 if it was inside.
    Difference(ValueId, ValueId),
    /// Flag: a word is not 0.
    NotZero(ValueId),
    /// Flag: `x > limit`.
    Above(ValueId, ValueId),
    /// Flag: both.
    And(ValueId, ValueId),
    /// Flag: either. Of words, bit by bit.
    Or(ValueId, ValueId),
}

impl Op {
    /// Whether the result is a flag or a word.
    #[must_use]
    pub fn is_flag(&self) -> bool {
        matches!(
            self,
            Op::Primed
                | Op::Usable
                | Op::Clipped
                | Op::HeldSample
                | Op::PrimedNow
                | Op::Within { .. }
                | Op::Outside { .. }
                | Op::Difference(..)
                | Op::NotZero(..)
                | Op::Above(..)
                | Op::And(..)
                | Op::Or(..)
        )
    }
}

/// Straight-line code: value `i` is `ops[i]` and uses smaller indices only.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Block {
    /// Operations in execution order.
    pub ops: Vec<Op>,
}

impl Block {
    /// Value of `op`, computed once however often it is asked for.
    pub fn value(&mut self, op: Op) -> ValueId {
        match self.ops.iter().position(|known| *known == op) {
            Some(id) => id,
            None => {
                self.ops.push(op);
                self.ops.len() - 1
            }
        }
    }

    /// A constant.
    pub fn constant(&mut self, literal: impl Into<Literal>) -> ValueId {
        self.value(Op::Constant(literal.into()))
    }
}

/// A measured signal as the generated code sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalPort {
    /// Field name.
    pub name: String,
    /// Unit for the comment.
    pub unit: String,
    /// Whether the field is an integer ADC code.
    pub is_code: bool,
    /// Plausible range in the format, for the comment and the check.
    pub range: (Literal, Literal),
    /// `held` after init.
    pub initial: Literal,
}

/// What `commit` writes into one line of the filter memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Push {
    /// First word.
    pub word: usize,
    /// Words in the line.
    pub length: usize,
    /// Value of `front` appended.
    pub value: ValueId,
}

/// Measurement to observation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Front {
    /// Straight-line code.
    pub block: Block,
    /// Sanitised signals.
    pub signals: Vec<ValueId>,
    /// Flag: all signals valid.
    pub all_valid: ValueId,
    /// Flag: an observation was clipped; `None` if nothing can be.
    pub clipped: Option<ValueId>,
    /// Observation in network order.
    pub observation: Vec<ValueId>,
    /// Filter memory updates.
    pub pushes: Vec<Push>,
}

/// Chosen duty to command.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Decide {
    /// Straight-line code.
    pub block: Block,
    /// Commanded duty if usable.
    pub duty: ValueId,
    /// Duty before the mapping if usable.
    pub duty_sim: ValueId,
    /// Status bit number and its flag, for usable steps.
    pub status: Vec<(u32, ValueId)>,
}

/// What `commit` remembers besides filters and duties.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Advance {
    /// Straight-line code.
    pub block: Block,
    /// Next soft-start limit; `None` without a soft start.
    pub soft_cap: Option<ValueId>,
}

/// Coefficients, their run-time intervals and the condition that keeps the mapping increasing.
#[derive(Debug, Clone, PartialEq)]
pub struct MappingCode {
    /// Coefficient, value after `init`, lowest and highest value accepted at run time; `R` in the four-term form only.
    pub coefficients: Vec<(Coefficient, Literal, Literal, Literal)>,
    /// Validity range of the load current.
    pub valid_i_out: (Literal, Literal),
}

/// Known answers: a pseudo-random observation within the box, and the CRC-32 of the Q bits it must give.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SelfTest {
    /// Per feature lower end and width of the box.
    pub observation_box: Vec<(Literal, Literal)>,
    /// CRC-32 of the little-endian Q words, one per vector.
    pub answers: Vec<u32>,
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
    /// Whether the target has floats in hardware.
    pub has_fpu: bool,
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
    pub network: NetworkCode,
    /// Duty per action.
    pub duties: Vec<Literal>,
    /// Mapping, if any.
    pub mapping: Option<MappingCode>,
    /// Chosen duty to command.
    pub decide: Decide,
    /// Memory of the command path.
    pub advance: Advance,
    /// Duty before the first step.
    pub initial_duty: Literal,
    /// Soft-start limit before the first step.
    pub soft_start_from: Option<Literal>,
    /// Duty without a usable measurement.
    pub fallback_duty: Literal,
    /// K of the contract.
    pub hold: u32,
    /// Known answers.
    pub self_test: SelfTest,
    /// CRC-32 of all tables.
    pub crc: u32,
}

impl Program {
    /// Number of features.
    #[must_use]
    pub fn feature_count(&self) -> usize {
        self.features.len()
    }

    /// Words of the state struct (contract section 1).
    #[must_use]
    pub fn state_words(&self) -> usize {
        let soft_cap = usize::from(self.soft_start_from.is_some());
        let coefficients = self.mapping.as_ref().map_or(0, |m| m.coefficients.len());
        self.signals.len() + self.memory_words + 2 + soft_cap + coefficients + 2
    }

    /// Multiply-accumulates of the network.
    #[must_use]
    pub fn macs(&self) -> usize {
        let layers = self.network.shape();
        layers.iter().map(|(_, inputs, outputs)| inputs * outputs).sum()
    }

    /// Bytes of constant tables.
    #[must_use]
    pub fn table_bytes(&self) -> usize {
        self.network.table_bytes() + 4 * self.duties.len()
    }

    /// All table words in the order of the integrity check.
    pub fn table_words(&self) -> impl Iterator<Item = u32> + '_ {
        let network = self.network.table_words().into_iter();
        network.chain(self.duties.iter().map(|duty| duty.0))
    }
}

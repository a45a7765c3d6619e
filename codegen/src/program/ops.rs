//! The straight-line part of a step: operations, and the three blocks around the network.

use policy::Scalar;

use super::guard::Within;
use super::literal::Literal;

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
    /// State: duty of the last chosen action, of the output of that index.
    PreviousDuty(usize),
    /// State: last command, of the output of that index.
    PreviousCommand(usize),
    /// State: rising upper limit, of the output of that index.
    SoftCap(usize),
    /// State: coefficient of the mapping of the output of that index.
    Coefficient(usize, Coefficient),
    /// Duty, or offset, of the action that argmax chose for the output of that index.
    ChosenDuty(usize),
    /// From `front`: what the law of a residual head or the base of a gain schedule says.
    Base,
    /// Flag from `front`: the dead zone of a residual head or a gain schedule.
    Still,
    /// From `front`: what a gain is multiplied with, counted over those that are multiplied.
    Factor(usize),
    /// The one output of a continuous head.
    Output,
    /// An output of the network where all are handed on: those of a gain schedule, or of several duties.
    Gain(usize),
    /// A value behind the curve that the program's head has for the output of that index.
    Squash(ValueId, usize),
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
                | Op::Still
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
        // sound, because no operation has an effect: in straight-line code a value stays what it was
        match self.ops.iter().position(|known| *known == op) {
            Some(id) => id,
            None => {
                self.ops.push(op);
                self.ops.len() - 1
            }
        }
    }

    /// A constant.
    pub fn constant(&mut self, literal: Literal) -> ValueId {
        self.value(Op::Constant(literal))
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
    /// What a code means; `None` where the field is a number.
    pub conversion: Option<Conversion>,
    /// Plausible range in the format, for the comment and the check.
    pub range: (Literal, Literal),
    /// `held` after init.
    pub initial: Literal,
}

/// `gain * code + offset`, for the comment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conversion {
    /// Unit per code.
    pub gain: Literal,
    /// Value at code 0.
    pub offset: Literal,
    /// Bits of the converter, if they are known.
    pub bits: Option<u32>,
}

impl SignalPort {
    /// What the field holds, in the words of every comment: how a code is converted, and the plausible range.
    #[must_use]
    pub fn meaning(&self, scalar: Scalar) -> String {
        let [unit, within] = match self.unit.as_str() {
            "" => [String::new(), String::new()],
            unit => [format!(" {unit}"), format!(" in {unit}")],
        };
        let (low, high) = (self.range.0.shortest(scalar), self.range.1.shortest(scalar));
        let plausible = format!("plausible {low} to {high}{unit}");
        let Some(Conversion { gain, offset, bits }) = self.conversion else {
            return plausible;
        };
        let bits = bits.map_or_else(String::new, |bits| format!(" of {bits} bits"));
        let gain = gain.shortest(scalar);
        let offset = match offset.value() {
            0.0 => String::new(),
            below if below < 0.0 => format!(" - {}", Literal::nearest(scalar, -below).shortest(scalar)),
            _ => format!(" + {}", offset.shortest(scalar)),
        };
        format!("ADC code{bits}: {gain} * code{offset}{within}, {plausible}")
    }
}

/// A member of the controller's state (contract section 1).
#[derive(Debug, Clone, PartialEq)]
pub struct StateMember {
    /// Name.
    pub name: String,
    /// What it holds, for the comment.
    pub meaning: &'static str,
    /// Shape and value before the first step.
    pub value: StateValue,
}

/// Shape of a member of the state, and its value before the first step.
#[derive(Debug, Clone, PartialEq)]
pub enum StateValue {
    /// An array.
    Numbers(Vec<Literal>),
    /// A number.
    Number(Literal),
    /// A number that is set at run time and that a reset keeps.
    Coefficient(Literal),
    /// The check word of the coefficients, as wide as a number, with these bits before the first step; a reset keeps it.
    Check(u64),
    /// A word, 0 before the first step.
    Word,
}

impl StateValue {
    /// Words of 32 bits where a number has `number` of them.
    #[must_use]
    pub fn words(&self, number: usize) -> usize {
        match self {
            StateValue::Numbers(values) => number * values.len(),
            StateValue::Number(_) | StateValue::Coefficient(_) | StateValue::Check(_) => number,
            StateValue::Word => 1,
        }
    }
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
    /// What the law of a residual head or the base of a gain schedule says; `None` of another head.
    pub base: Option<ValueId>,
    /// What the gains of a gain schedule are multiplied with, in their order.
    pub factors: Vec<ValueId>,
    /// Flag: nothing is added to it; `None` where there is no dead zone.
    pub still: Option<ValueId>,
    /// Observation in network order.
    pub observation: Vec<ValueId>,
    /// Filter memory updates.
    pub pushes: Vec<Push>,
}

/// Chosen duty to command.
#[derive(Debug, Clone, PartialEq)]
pub struct Decide {
    /// Straight-line code.
    pub block: Block,
    /// What each output commands if usable, at least one.
    pub duties: Vec<Duty>,
    /// What a commanded duty lies within, if it is a number.
    pub within: Within,
    /// Status bit number and its flag, for usable steps.
    pub status: Vec<(u32, ValueId)>,
}

/// The duty of an output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Duty {
    /// Behind the limits.
    pub duty: ValueId,
    /// Before the mapping.
    pub duty_sim: ValueId,
}

/// What `commit` remembers besides filters and duties.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Advance {
    /// Straight-line code.
    pub block: Block,
    /// Next soft-start limit of each output; `None` without a soft start.
    pub soft_caps: Vec<Option<ValueId>>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meaning(unit: &str, conversion: Option<(f64, f64, Option<u32>)>) -> String {
        let literal = |x: f64| Literal::nearest(Scalar::F32, x);
        let port = SignalPort {
            name: "v_out".to_owned(),
            unit: unit.to_owned(),
            is_code: conversion.is_some(),
            conversion: conversion.map(|(gain, offset, bits)| Conversion {
                gain: literal(gain),
                offset: literal(offset),
                bits,
            }),
            range: (literal(0.0), literal(250.0)),
            initial: literal(0.0),
        };
        port.meaning(Scalar::F32)
    }

    #[test]
    fn a_measurement_says_how_its_code_is_converted() {
        assert_eq!(meaning("V", None), "plausible 0.0 to 250.0 V");
        assert_eq!(
            meaning("V", Some((0.0625, -2.0, Some(12)))),
            "ADC code of 12 bits: 0.0625 * code - 2.0 in V, plausible 0.0 to 250.0 V"
        );
        assert_eq!(
            meaning("", Some((-0.5, 0.1, None))),
            "ADC code: -0.5 * code + 0.1, plausible 0.0 to 250.0"
        );
        assert_eq!(
            meaning("V", Some((0.0625, 0.0, None))),
            "ADC code: 0.0625 * code in V, plausible 0.0 to 250.0 V"
        );
    }
}

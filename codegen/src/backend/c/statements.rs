//! Straight-line blocks as C declarations.

use policy::Scalar;

use super::number;
use crate::backend::literal::decimal;
use crate::program::{Block, Op, Program, ValueId};

/// A float literal.
pub fn float(value: f32) -> String {
    format!("{}f", decimal(value))
}

/// An unsigned 32-bit literal.
pub fn unsigned(value: u32) -> String {
    if value < 1 << 15 {
        format!("{value}u")
    } else {
        format!("0x{value:08X}u")
    }
}

/// Prints one block; leaves stand where they are used, everything computed gets a name.
pub struct Printer<'p> {
    prefix: &'p str,
    program: &'p Program,
    operands: Vec<String>,
    ops: Vec<Op>,
    named: usize,
    /// Declarations in execution order.
    pub lines: Vec<String>,
}

impl<'p> Printer<'p> {
    /// For functions whose names start with `prefix`.
    pub fn new(prefix: &'p str, program: &'p Program) -> Self {
        Self {
            prefix,
            program,
            operands: Vec::new(),
            named: 0,
            lines: Vec::new(),
            ops: Vec::new(),
        }
    }

    /// Text of a value of the block printed last.
    pub fn operand(&self, id: ValueId) -> String {
        self.operands[id].clone()
    }

    /// Prints a block.
    pub fn block(&mut self, block: &Block) {
        for op in &block.ops {
            let text = match self.leaf(op) {
                Some(leaf) => leaf,
                None => self.named(op),
            };
            self.operands.push(text);
            self.ops.push(*op);
        }
    }

    fn named(&mut self, op: &Op) -> String {
        let (kind, letter) = if op.is_flag() {
            ("uint32_t", 'f')
        } else {
            (number::kind(self.program.scalar()).name, 'v')
        };
        let name = format!("{letter}{}", self.named);
        self.named += 1;
        let line = |value: String| format!("const {kind} {name} = {value};");
        let computed = line(self.computed(op));
        match self.branch(op) {
            Some(branch) => {
                let lines = ["#if defined(__FRAMAC__)".to_owned(), line(branch), "#else".to_owned()];
                self.lines.extend(lines);
                self.lines.extend([computed, "#endif".to_owned()]);
            }
            None => self.lines.push(computed),
        }
        name
    }

    /// A selection by a comparison of the value that it selects, as a branch: only of that do the intervals of Frama-C see that
    /// what is selected lies where it was compared.
    fn branch(&self, op: &Op) -> Option<String> {
        let Op::Select { flag, then, otherwise } = op else {
            return None;
        };
        let v = |id: &ValueId| self.operands[*id].as_str();
        let selected = |condition: String| format!("({condition}) ? {} : {}", v(then), v(otherwise));
        match self.ops.get(*flag)? {
            Op::Within { x, low, high } => {
                let (x, low, high) = (v(x), v(low), v(high));
                // numbers and NaN are parted by the first of the three alone
                Some(selected(format!("({x} == {x}) && ({x} >= {low}) && ({x} <= {high})")))
            }
            Op::Above(x, limit) => Some(selected(format!("{} > {}", v(x), v(limit)))),
            _ => None,
        }
    }

    fn leaf(&self, op: &Op) -> Option<String> {
        Some(match op {
            Op::Measured(i) => format!("measured->{}", self.program.signals[*i].name),
            Op::Code(i) => format!(
                "({})measured->{}",
                number::kind(self.program.scalar()).name,
                self.program.signals[*i].name
            ),
            Op::Held(i) => format!("state->held[{i}]"),
            Op::Sanitised(i) => format!("front->signal[{i}]"),
            Op::Memory(i) => format!("state->memory[{i}]"),
            Op::PreviousDuty(output) => self.remembered("previous_duty", *output),
            Op::PreviousCommand(output) => self.remembered("previous_command", *output),
            Op::SoftCap(output) => self.remembered("soft_cap", *output),
            Op::Coefficient(output, name) => self.remembered(&format!("mapping_{}", name.name()), *output),
            Op::ChosenDuty(output) if self.program.has_several() => format!("chosen{output}"),
            Op::ChosenDuty(_) => "chosen".into(),
            Op::Output => "output".into(),
            Op::Gain(i) => format!("outputs[{i}]"),
            Op::Factor(i) => format!("front->factor[{i}]"),
            Op::Constant(literal) => number::number(self.program.scalar(), *literal),
            // a flag behind its barrier: of what is known to be 0 or 1 clang makes a branch on RISC-V
            Op::Primed => format!("{}_flag((int)(state->primed & 1u))", self.program.name),
            Op::Usable => "front->usable".into(),
            Op::Clipped => "front->clipped".into(),
            Op::Base => "front->base".into(),
            Op::Still => "front->still".into(),
            Op::HeldSample => "front->held".into(),
            Op::PrimedNow => "front->primed_now".into(),
            _ => return None,
        })
    }

    /// A member of the state that belongs to an output.
    fn remembered(&self, stem: &str, output: usize) -> String {
        format!("state->{}", self.program.named(stem, output))
    }

    fn computed(&self, op: &Op) -> String {
        let p = self.prefix;
        let v = |id: &ValueId| self.operands[*id].as_str();
        match op {
            Op::Neg(x) => format!("-({})", v(x)),
            Op::Add(x, y) => format!("{} + {}", v(x), v(y)),
            Op::Sub(x, y) => format!("{} - {}", v(x), parenthesised(v(y))),
            Op::Mul(x, y) => format!("{} * {}", v(x), v(y)),
            Op::Select { flag, then, otherwise } => {
                format!("{p}_select({}, {}, {})", v(flag), v(then), v(otherwise))
            }
            Op::Clamp { x, low, high } => format!("{p}_clamp({}, {}, {})", v(x), v(low), v(high)),
            Op::LineSum {
                word,
                length,
                newest,
                primed,
            } => {
                format!(
                    "{p}_line_sum(&state->memory[{word}], {length}u, {}, {})",
                    v(newest),
                    v(primed)
                )
            }
            Op::Within { x, low, high } => format!("{p}_within({}, {}, {})", v(x), v(low), v(high)),
            Op::Outside { x, low, high } => format!("{p}_outside({}, {}, {})", v(x), v(low), v(high)),
            Op::Squash(x, output) => {
                let curve = self.program.head.curve(*output).map_or("", policy::Activation::word);
                format!("{p}_{curve}({})", v(x))
            }
            Op::Difference(x, y) => match self.program.scalar() {
                Scalar::F32 => format!("{p}_bits({}) ^ {p}_bits({})", v(x), v(y)),
                Scalar::F64 => format!("{p}_differing({}, {})", v(x), v(y)),
            },
            Op::NotZero(x) => format!("{p}_flag({} != 0u)", v(x)),
            Op::Above(x, limit) => format!("{p}_flag({} > {})", v(x), v(limit)),
            Op::And(x, y) => format!("{} & {}", v(x), v(y)),
            Op::Or(x, y) => format!("{} | {}", v(x), v(y)),
            leaf => self.leaf(leaf).unwrap_or_default(),
        }
    }
}

/// A negative literal after a minus sign would read as a decrement.
fn parenthesised(text: &str) -> String {
    if text.starts_with('-') {
        format!("({text})")
    } else {
        text.to_owned()
    }
}

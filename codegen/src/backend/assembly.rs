//! Inner loops in ARM assembly (Armv7E-M), the same text for C and Rust.

/// The integer sums of one block: `LDM` for the weights, `SMLAD` for two products at a time.
///
/// Operands: sums `s0..`, pointers `w` and `input`, the counter `turns`, temporaries `x01` and, for 8-bit weights, `x23` and
/// `even`; weights go through the fixed `registers`, which `LDM` needs in ascending order.
pub struct Kernel {
    /// 8-bit weights, four inputs a group, instead of 16-bit ones, two inputs a group.
    pub is_quad: bool,
    /// Groups of inputs.
    pub groups: usize,
    /// Outputs, 1 to 4.
    pub height: usize,
    /// Registers of the weights.
    pub registers: [&'static str; 4],
}

/// Groups per turn of the loop at most.
const UNROLL: usize = 8;

impl Kernel {
    /// Groups per turn: the largest divisor that is not too large.
    fn unrolled(&self) -> usize {
        (1..=UNROLL).rev().find(|n| self.groups.is_multiple_of(*n)).unwrap_or(1)
    }

    /// Turns of the loop.
    pub fn turns(&self) -> usize {
        self.groups / self.unrolled()
    }

    /// Weights that one `LDM` loads: two at a time leave registers for widening bytes.
    fn loaded(&self) -> usize {
        if self.is_quad { 2 } else { 4 }
    }

    /// Registers that are overwritten.
    pub fn clobbered(&self) -> &[&'static str] {
        &self.registers[..self.loaded().min(self.height)]
    }

    /// Lines, with `operand` giving the text of a named operand.
    pub fn text(&self, operand: &dyn Fn(&str) -> String) -> Vec<String> {
        let (w, input, turns) = (operand("w"), operand("input"), operand("turns"));
        let (x01, x23, even) = (operand("x01"), operand("x23"), operand("even"));
        let mut lines = vec!["2:".to_owned()];
        for _ in 0..self.unrolled() {
            lines.push(if self.is_quad {
                format!("ldrd {x01}, {x23}, [{input}], #8")
            } else {
                format!("ldr {x01}, [{input}], #4")
            });
            let rows: Vec<usize> = (0..self.height).collect();
            for rows in rows.chunks(self.loaded()) {
                let registers = &self.registers[..rows.len()];
                lines.push(match registers {
                    [one] => format!("ldr {one}, [{w}], #4"),
                    several => format!("ldmia {w}!, {{{}}}", several.join(", ")),
                });
                for (row, weight) in rows.iter().zip(registers) {
                    let sum = operand(&format!("s{row}"));
                    if self.is_quad {
                        lines.push(format!("sxtb16 {even}, {weight}"));
                        lines.push(format!("sxtb16 {weight}, {weight}, ror #8"));
                        lines.push(format!("smlad {sum}, {even}, {x01}, {sum}"));
                        lines.push(format!("smlad {sum}, {weight}, {x23}, {sum}"));
                    } else {
                        lines.push(format!("smlad {sum}, {weight}, {x01}, {sum}"));
                    }
                }
            }
        }
        if self.turns() > 1 {
            lines.push(format!("subs {turns}, {turns}, #1"));
            lines.push("bne 2b".to_owned());
        }
        lines
    }
}

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

/// The binary32 sums of one block: `VLDM`, then products and sums apart, so every operation is rounded as the contract
/// says. Cheaper than `VFMA` on a Cortex-M4, where that takes three cycles.
///
/// Operands: pointers `w`, `input`, `bias`, `out` and the counter `turns`, all advanced; `low` and `high` for the
/// rectified outputs; registers s0 to s27 are overwritten.
#[cfg(feature = "c")]
pub struct RealKernel {
    /// Inputs.
    pub inputs: usize,
    /// Outputs, 1 to 16.
    pub height: usize,
    /// Clears negative outputs.
    pub relu: bool,
}

#[cfg(feature = "c")]
impl RealKernel {
    /// Most outputs whose sums fit beside the weights in flight.
    pub const MAX_HEIGHT: usize = 16;
    /// First register of the weights, number of weights in flight, first register of the inputs.
    const WEIGHTS: (usize, usize, usize) = (16, 8, 24);

    fn unrolled(&self) -> usize {
        (1..=4).rev().find(|n| self.inputs.is_multiple_of(*n)).unwrap_or(1)
    }

    /// Turns of the loop.
    pub fn turns(&self) -> usize {
        self.inputs / self.unrolled()
    }

    /// Registers that are overwritten.
    pub fn clobbered() -> Vec<String> {
        (0..28).map(|register| format!("s{register}")).collect()
    }

    /// Lines, with `operand` giving the text of a named operand and `list` that of a register list.
    pub fn text(&self, operand: &dyn Fn(&str) -> String, list: &dyn Fn(&str) -> String) -> Vec<String> {
        let (weights, in_flight, inputs) = Self::WEIGHTS;
        let (w, input, turns, out) = (operand("w"), operand("input"), operand("turns"), operand("out"));
        let registers = |first: usize, count: usize| match count {
            1 => list(&format!("s{first}")),
            _ => list(&format!("s{first}-s{}", first + count - 1)),
        };
        let mut lines = vec![
            format!("vldmia {}!, {}", operand("bias"), registers(0, self.height)),
            "2:".to_owned(),
            format!("vldmia {input}!, {}", registers(inputs, self.unrolled())),
        ];
        for x in (0..self.unrolled()).map(|step| inputs + step) {
            for first in (0..self.height).step_by(in_flight) {
                let count = in_flight.min(self.height - first);
                lines.push(format!("vldmia {w}!, {}", registers(weights, count)));
                let rows = || (0..count).map(|row| (first + row, weights + row));
                lines.extend(rows().map(|(_, weight)| format!("vmul.f32 s{weight}, s{weight}, s{x}")));
                lines.extend(rows().map(|(sum, weight)| format!("vadd.f32 s{sum}, s{sum}, s{weight}")));
            }
        }
        if self.turns() > 1 {
            lines.push(format!("subs {turns}, {turns}, #1"));
            lines.push("bne 2b".to_owned());
        }
        if !self.relu {
            lines.push(format!("vstmia {out}!, {}", registers(0, self.height)));
            return lines;
        }
        let (low, high) = (operand("low"), operand("high"));
        for row in (0..self.height).step_by(2) {
            let clear = |register: &str| format!("bic {register}, {register}, {register}, asr #31");
            if row + 1 < self.height {
                lines.push(format!("vmov {low}, {high}, s{row}, s{}", row + 1));
                lines.extend([clear(&low), clear(&high), format!("strd {low}, {high}, [{out}], #8")]);
            } else {
                lines.push(format!("vmov {low}, s{row}"));
                lines.extend([clear(&low), format!("str {low}, [{out}], #4")]);
            }
        }
        lines
    }
}

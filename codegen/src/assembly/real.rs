//! Blocks of a layer in binary32.
//!
//! ```text
//!  s0..s15 biases                            VLDM, once a block
//!  s24..s27 inputs                           every turn: up to four inputs written out
//!    s16..s23 weights ─► VMUL ─► VADD s0..   eight at a time, all outputs of the block
//!  outputs                                   VSTM, or through two integer registers, where the sign clears them (ReLU)
//! ```
//!
//! The one invariant: a sum takes its inputs in index order, product and sum rounded apart, so the bits are those of the loops.

use std::collections::BTreeSet;

use crate::program::{Loop, Network};

/// The kernels of all blocks of a network that have one.
pub fn kernels(network: &Network) -> BTreeSet<RealKernel> {
    let assembled = network.pieces().filter(|layer| layer.has_assembly);
    let kernel = |node: &Loop| match node {
        Loop::Repeat { body, .. } => RealKernel::of(body),
        _ => None,
    };
    assembled
        .flat_map(|layer| layer.body.iter().filter_map(kernel))
        .collect()
}

/// The binary32 sums of one block: `VLDM`, then products and sums apart, so every operation is rounded as the contract
/// says. Cheaper than `VFMA` on a Cortex-M4, where that takes three cycles.
///
/// Operands: pointers `w`, `input`, `bias`, `out` and the counter `turns`, all advanced; `low` and `high` for the
/// rectified outputs; registers s0 to s27 are overwritten.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct RealKernel {
    /// Inputs.
    pub inputs: usize,
    /// Outputs, 1 to 16.
    pub height: usize,
    /// Clears negative outputs.
    pub relu: bool,
}

impl RealKernel {
    /// First register of the weights, number of weights in flight, first register of the inputs.
    // s0 to s15 are the sums; s28 to s31 are left to the compiler
    const WEIGHTS: (usize, usize, usize) = (16, 8, 24);

    /// The kernel of a repeated `body`, which makes sums and stores them.
    pub fn of(body: &[Loop]) -> Option<Self> {
        let [Loop::Sums(sums), Loop::Store(store)] = body else {
            return None;
        };
        Some(Self {
            inputs: sums.inputs,
            height: sums.rows,
            relu: store.activation.is_rectifier(),
        })
    }

    fn unrolled(&self) -> usize {
        // four registers hold inputs; a divisor, so that no turn is left over
        (1..=4).rev().find(|n| self.inputs.is_multiple_of(*n)).unwrap_or(1)
    }

    /// Turns of the loop.
    pub fn turns(&self) -> usize {
        self.inputs / self.unrolled()
    }

    /// Registers that are overwritten.
    #[cfg(feature = "c")]
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
            // a number, because the same text may stand in a file several times
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
        // in integer registers, by the sign: a comparison of floats would have to bring its flags over first
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

#[cfg(test)]
mod tests {
    use super::*;

    fn text(inputs: usize, height: usize, relu: bool) -> Vec<String> {
        let kernel = RealKernel { inputs, height, relu };
        kernel.text(&str::to_owned, &|list| format!("{{{list}}}"))
    }

    #[test]
    fn outputs_of_a_rectifier_go_in_pairs_and_the_last_one_alone() {
        let expected = [
            "vldmia bias!, {s0-s2}",
            "2:",
            "vldmia input!, {s24-s25}",
            "vldmia w!, {s16-s18}",
            "vmul.f32 s16, s16, s24",
            "vmul.f32 s17, s17, s24",
            "vmul.f32 s18, s18, s24",
            "vadd.f32 s0, s0, s16",
            "vadd.f32 s1, s1, s17",
            "vadd.f32 s2, s2, s18",
            "vldmia w!, {s16-s18}",
            "vmul.f32 s16, s16, s25",
            "vmul.f32 s17, s17, s25",
            "vmul.f32 s18, s18, s25",
            "vadd.f32 s0, s0, s16",
            "vadd.f32 s1, s1, s17",
            "vadd.f32 s2, s2, s18",
            "vmov low, high, s0, s1",
            "bic low, low, low, asr #31",
            "bic high, high, high, asr #31",
            "strd low, high, [out], #8",
            "vmov low, s2",
            "bic low, low, low, asr #31",
            "str low, [out], #4",
        ];
        assert_eq!(text(2, 3, true), expected);
    }

    /// Five inputs have no divisor of at most four: one at a time.
    #[test]
    fn one_output_without_a_rectifier_is_stored_as_it_is() {
        let expected = [
            "vldmia bias!, {s0}",
            "2:",
            "vldmia input!, {s24}",
            "vldmia w!, {s16}",
            "vmul.f32 s16, s16, s24",
            "vadd.f32 s0, s0, s16",
            "subs turns, turns, #1",
            "bne 2b",
            "vstmia out!, {s0}",
        ];
        assert_eq!(text(5, 1, false), expected);
    }

    #[test]
    fn eight_weights_are_in_flight_and_up_to_four_inputs_are_written_out() {
        let lines = text(8, 10, false);
        let loads: Vec<&String> = lines.iter().filter(|line| line.starts_with("vldmia w")).collect();
        assert_eq!(loads, ["vldmia w!, {s16-s23}", "vldmia w!, {s16-s17}"].repeat(4));
        assert!(lines.contains(&"vldmia input!, {s24-s27}".to_owned()));
        // each sum takes each of the four inputs of a turn once, the last sums those behind the eighth
        let sums = |sum: usize| {
            lines
                .iter()
                .filter(|line| line.starts_with(&format!("vadd.f32 s{sum}, s{sum}, ")))
                .count()
        };
        assert_eq!((0..10).map(sums).collect::<Vec<_>>(), [4; 10]);
        assert!(lines.contains(&"vadd.f32 s9, s9, s17".to_owned()));
        assert!(lines.ends_with(&["bne 2b".to_owned(), "vstmia out!, {s0-s9}".to_owned()]));
        let turns = |inputs| {
            RealKernel {
                inputs,
                height: 4,
                relu: true,
            }
            .turns()
        };
        assert_eq!(
            [1, 2, 3, 4, 5, 6, 7, 8, 9, 10].map(turns),
            [1, 1, 1, 1, 5, 2, 7, 2, 3, 5]
        );
    }

    #[cfg(feature = "c")]
    #[test]
    fn the_sums_inputs_and_weights_are_all_that_is_overwritten() {
        let registers: BTreeSet<String> = (0..28).map(|n| format!("s{n}")).collect();
        assert_eq!(RealKernel::clobbered().into_iter().collect::<BTreeSet<_>>(), registers);
    }
}

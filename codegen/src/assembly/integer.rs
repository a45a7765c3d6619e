//! Blocks of an integer layer with `SMLAD`.
//!
//! ```text
//!  r0 input   r1 output   r2 weights   r3 bias   lr turns     four sums, four loaded words, r12 for the input
//!
//!  3: sums = biases               every block
//!  2:   word of inputs, word of weights a sum, SMLAD ...      every turn, groups written out
//!     cut, activation ─► y        or, streamed: pairs ─► SMLAD into every sum of the last layer (4:)
//!     input back to its start
//! ```
//!
//! The one invariant: weights and biases only ever move on, through all blocks; the input goes back behind each.

use crate::program::{Loop, Network, Sink};

/// What a kernel leaves of a sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Store {
    /// Shifted and rectified, 16 bits.
    Rectified,
    /// Shifted, 16 bits.
    Half,
    /// Shifted, 32 bits.
    Word,
}

/// The integer blocks of one height of a layer (Armv7E-M, Armv8-M with DSP): `LDM` for the weights, `SMLAD` for two
/// products at a time, shift and rectifier in one `USAT`.
///
/// The body of a naked function `(inputs, outputs, weights, biases)` of four pointers to words, which none of them may
/// leave: it uses every register, so no compiler could place the loop among its own code. Where the last layer takes the
/// outputs block by block, the outputs are its sums, and a fifth pointer is to its weights.
pub struct Kernel {
    /// 8-bit weights, four inputs a group, instead of 16-bit ones, two inputs a group.
    pub is_quad: bool,
    /// Groups of inputs.
    pub groups: usize,
    /// Blocks.
    pub count: usize,
    /// Outputs of a block, 1 to 4.
    pub height: usize,
    /// Bits cut off a sum.
    pub shift: u32,
    /// What is stored.
    pub store: Store,
    /// Sums of the last layer that each block goes into, instead of being stored.
    pub sums: Option<usize>,
}

/// Groups per turn of the loop at most.
// against code size: with 4 the bench network in 16 bits takes 4949 instructions on Cortex-M4F, with 8 it takes 4821
const UNROLL: usize = 8;
const SUMS: [&str; 4] = ["r4", "r5", "r6", "r7"];
const LOADED: [&str; 4] = ["r8", "r9", "r10", "r11"];
const INPUT: &str = "r0";
const OUTPUT: &str = "r1";
const WEIGHTS: &str = "r2";
const BIAS: &str = "r3";
const COUNTER: &str = "lr";
/// A block's outputs as pairs, the weights of the sums that they go into, and two such sums.
const PAIRS: [&str; 2] = ["r4", "r6"];
// the pairs leave two of the four sums' registers free: for these
const NEXT: &str = "r5";
const TAKEN: [&str; 2] = ["r7", "r12"];

impl Kernel {
    /// The kernel of the repeated `body`, which makes sums, stores them, and adds them if the last layer is streamed.
    pub fn of(network: &Network, count: usize, body: &[Loop]) -> Option<Self> {
        let [Loop::Sums(sums), Loop::Store(stored), added @ ..] = body else {
            return None;
        };
        let store = match (stored.activation.is_rectifier(), stored.to) {
            (true, _) => Store::Rectified,
            (false, Sink::Sums) => Store::Word,
            (false, _) => Store::Half,
        };
        let next = added.first().and_then(|_| network.layers.last());
        Some(Self {
            is_quad: network.lanes.len() == 4,
            groups: network.groups(sums.inputs),
            count,
            height: sums.rows,
            shift: stored.cut?.shift,
            store,
            sums: next.map(|last| last.outputs),
        })
    }

    /// Groups per turn: the largest divisor that is not too large.
    fn unrolled(&self) -> usize {
        (1..=UNROLL).rev().find(|n| self.groups.is_multiple_of(*n)).unwrap_or(1)
    }

    fn turns(&self) -> usize {
        self.groups / self.unrolled()
    }

    /// Lines, with `list` giving the text of a register list. On the stack: the end of the outputs or the number of blocks to
    /// come, then, where bytes are widened in the registers of their pointers, outputs and biases.
    pub fn text(&self, list: &dyn Fn(&str) -> String) -> Vec<String> {
        // no register is free for a frame, and nothing is called: the stack need not be aligned to 8 bytes
        let mut lines = vec![format!("push {}", list("r4-r11, lr"))];
        let is_repeated = self.count > 1;
        if self.is_quad {
            lines.push(format!("push {}", list(&format!("{OUTPUT}, {BIAS}"))));
        }
        if self.sums.is_some() {
            lines.push(format!("movw {COUNTER}, #{}", self.count));
        } else {
            let bytes = if self.store == Store::Word { 4 } else { 2 };
            // at most 1024 outputs: the number fits 16 bits
            lines.push(format!("movw {COUNTER}, #{}", bytes * self.count * self.height));
            lines.push(format!("add {COUNTER}, {COUNTER}, {OUTPUT}"));
        }
        lines.push(format!("push {}", list(COUNTER)));
        if is_repeated {
            lines.push("3:".to_owned());
            lines.extend(self.kept(format!("ldr {BIAS}, [sp, #8]")));
        }
        lines.push(self.several("ldmia", "ldr", BIAS, &SUMS[..self.height], list));
        lines.extend(self.kept(format!("str {BIAS}, [sp, #8]")));
        if self.turns() > 1 {
            lines.push(format!("mov {COUNTER}, #{}", self.turns()));
            lines.push("2:".to_owned());
        }
        for _ in 0..self.unrolled() {
            self.group(&mut lines, list);
        }
        if self.turns() > 1 {
            lines.push(format!("subs {COUNTER}, {COUNTER}, #1"));
            lines.push("bne 2b".to_owned());
        }
        lines.extend(self.kept(format!("ldr {OUTPUT}, [sp, #4]")));
        self.cut(&mut lines);
        match self.sums {
            Some(sums) => self.added(sums, &mut lines, list),
            None => self.stored(&mut lines, list),
        }
        if is_repeated {
            // at most 1024 inputs, which are 2048 bytes: within the 12 bits of `subw`
            let bytes = self.groups * if self.is_quad { 8 } else { 4 };
            lines.push(format!("subw {INPUT}, {INPUT}, #{bytes}"));
            lines.push(format!("ldr {COUNTER}, [sp]"));
            if self.sums.is_some() {
                lines.push(format!("subs {COUNTER}, {COUNTER}, #1"));
                lines.push(format!("str {COUNTER}, [sp]"));
            } else {
                lines.extend(self.kept(format!("str {OUTPUT}, [sp, #4]")));
                lines.push(format!("cmp {OUTPUT}, {COUNTER}"));
            }
            lines.push("bne 3b".to_owned());
        }
        lines.push(format!("add sp, sp, #{}", self.kept_bytes()));
        // the return address goes where `lr` was saved: no jump of its own
        lines.push(format!("pop {}", list("r4-r11, pc")));
        lines
    }

    /// Bytes on the stack below the registers.
    fn kept_bytes(&self) -> usize {
        if self.is_quad { 12 } else { 4 }
    }

    /// A line that only bytes need.
    fn kept(&self, line: String) -> Option<String> {
        self.is_quad.then_some(line)
    }

    /// Moves several registers, or one.
    fn several(&self, many: &str, one: &str, pointer: &str, names: &[&str], list: &dyn Fn(&str) -> String) -> String {
        match names {
            [name] => format!("{one} {name}, [{pointer}], #4"),
            _ => format!("{many} {pointer}!, {}", list(&names.join(", "))),
        }
    }

    /// One group of inputs.
    fn group(&self, lines: &mut Vec<String>, list: &dyn Fn(&str) -> String) {
        let loaded = &LOADED[..self.height];
        let load = self.several("ldmia", "ldr", WEIGHTS, loaded, list);
        let rows = || SUMS.iter().zip(loaded);
        if !self.is_quad {
            lines.extend([format!("ldr r12, [{INPUT}], #4"), load]);
            lines.extend(rows().map(|(sum, weight)| format!("smlad {sum}, {weight}, r12, {sum}")));
            return;
        }
        lines.extend([format!("ldrd {OUTPUT}, r12, [{INPUT}], #8"), load]);
        for (sum, weight) in rows() {
            // even bytes, then odd ones: tables of bytes have that order (`QUAD`)
            lines.push(format!("sxtb16 {BIAS}, {weight}"));
            lines.push(format!("sxtb16 {weight}, {weight}, ror #8"));
            lines.push(format!("smlad {sum}, {BIAS}, {OUTPUT}, {sum}"));
            lines.push(format!("smlad {sum}, {weight}, r12, {sum}"));
        }
    }

    /// Shift and rectifier.
    fn cut(&self, lines: &mut Vec<String>) {
        for sum in &SUMS[..self.height] {
            match (self.store, self.shift) {
                // half of the last bit kept is in the biases: a plain shift rounds half up
                (Store::Rectified, 0) => lines.push(format!("usat {sum}, #15, {sum}")),
                (Store::Rectified, shift) => lines.push(format!("usat {sum}, #15, {sum}, asr #{shift}")),
                (_, 0) => {}
                (_, shift) => lines.push(format!("asr {sum}, {sum}, #{shift}")),
            }
        }
    }

    fn stored(&self, lines: &mut Vec<String>, list: &dyn Fn(&str) -> String) {
        let sums = &SUMS[..self.height];
        if self.store == Store::Word {
            lines.push(self.several("stmia", "str", OUTPUT, sums, list));
            return;
        }
        for pair in sums.chunks(2) {
            match pair {
                // two outputs with one store; the buffer is aligned to words
                [low, high] => {
                    lines.push(format!("pkhbt {low}, {low}, {high}, lsl #16"));
                    lines.push(format!("str {low}, [{OUTPUT}], #4"));
                }
                _ => lines.extend(pair.iter().map(|one| format!("strh {one}, [{OUTPUT}], #2"))),
            }
        }
    }
}

impl Kernel {
    /// What a block adds to the sums of the last layer. The upper half of an output without a partner meets weights of 0.
    fn added(&self, sums: usize, lines: &mut Vec<String>, list: &dyn Fn(&str) -> String) {
        for pair in SUMS[..self.height].chunks_exact(2) {
            lines.push(format!("pkhbt {}, {}, {}, lsl #16", pair[0], pair[0], pair[1]));
        }
        // the fifth argument, behind nine registers
        let argument = format!("[sp, #{}]", self.kept_bytes() + 36);
        lines.push(format!("ldr {NEXT}, {argument}"));
        // as few turns as possible, each of an even number of sums
        let least = sums.div_ceil(UNROLL + 1).max(1);
        let width = sums / least / 2 * 2;
        let turns = sums.checked_div(width).unwrap_or_default();
        let rest = sums - turns * width;
        if turns > 1 {
            lines.push(format!("mov {COUNTER}, #{turns}"));
            lines.push("4:".to_owned());
        }
        if turns > 0 {
            self.some_added(width, lines, list);
        }
        if turns > 1 {
            lines.push(format!("subs {COUNTER}, {COUNTER}, #1"));
            lines.push("bne 4b".to_owned());
        }
        self.some_added(rest, lines, list);
        lines.push(format!("str {NEXT}, {argument}"));
        if !self.is_quad {
            lines.push(format!("subw {OUTPUT}, {OUTPUT}, #{}", 4 * sums));
        }
    }

    /// The same for the next few sums, two at a time.
    fn some_added(&self, sums: usize, lines: &mut Vec<String>, list: &dyn Fn(&str) -> String) {
        let words = if self.is_quad { 1 } else { self.height.div_ceil(2) };
        for first in (0..sums).step_by(2) {
            let taken = &TAKEN[..2.min(sums - first)];
            let weights = &LOADED[..words * taken.len()];
            lines.push(self.several("ldmia", "ldr", NEXT, weights, list));
            let is_pair = taken.len() == 2;
            lines.push(match taken {
                [low, high] => format!("ldrd {low}, {high}, [{OUTPUT}]"),
                _ => format!("ldr {}, [{OUTPUT}]", TAKEN[0]),
            });
            for (sum, weights) in taken.iter().zip(weights.chunks(words)) {
                if self.is_quad {
                    let weight = weights[0];
                    lines.push(format!("sxtb16 {BIAS}, {weight}"));
                    lines.push(format!("sxtb16 {weight}, {weight}, ror #8"));
                    lines.push(format!("smlad {sum}, {BIAS}, {}, {sum}", PAIRS[0]));
                    lines.push(format!("smlad {sum}, {weight}, {}, {sum}", PAIRS[1]));
                    continue;
                }
                let products = weights.iter().zip(PAIRS);
                lines.extend(products.map(|(weight, pair)| format!("smlad {sum}, {weight}, {pair}, {sum}")));
            }
            lines.push(if is_pair {
                format!("strd {}, {}, [{OUTPUT}], #8", TAKEN[0], TAKEN[1])
            } else {
                format!("str {}, [{OUTPUT}], #4", TAKEN[0])
            });
        }
    }
}

#[cfg(test)]
mod tests;

//! Comparisons of the state with its ranges, by bits.

use policy::Scalar;

use super::number;
use super::statements::unsigned;
use crate::program::{Guarded, MappingCode, Place, Program, Within};

/// Terms of a word whose sign bit is set if a number of the state is outside.
pub fn terms(program: &Program) -> Vec<String> {
    let n = &program.name;
    let terms = program.guard.numbers.iter().map(|guarded| term(program, guarded));
    let flips = program.outputs.iter().filter(|output| output.mapping.is_some());
    terms
        .chain(flips.map(|output| format!("{n}_any({n}_{}(state))", output.named("mapping_flips"))))
        .collect()
}

/// The same of one number.
pub fn stray(program: &Program, x: &str, within: Within) -> String {
    let n = &program.name;
    let word = |bits| word(program.scalar(), bits);
    match within {
        Within::Magnitude { bound } => format!("{n}_far({x}, {})", word(bound)),
        Within::Around { low, high } => format!("{n}_aside({x}, {}, {})", word(low), word(high)),
        Within::Beyond { low, width, negated } => {
            let x = if negated { format!("-({x})") } else { x.to_owned() };
            format!("{n}_beyond({x}, {}, {})", word(low), word(width))
        }
    }
}

/// The check word of coefficients, each of which `place` names.
pub fn check_word(program: &Program, mapping: &MappingCode, place: impl Fn(&str) -> String) -> String {
    let n = &program.name;
    let bits = mapping.coefficients.iter();
    let bits = bits.map(|(name, ..)| format!(" ^ {n}_bits({})", place(name.name())));
    word(program.scalar(), mapping.check_constant) + &bits.collect::<String>()
}

fn term(program: &Program, guarded: &Guarded) -> String {
    let n = &program.name;
    let place = match guarded.place {
        Place::Held(index) => format!("state->held[{index}]"),
        Place::Memory { first, count: 1 } => format!("state->memory[{first}]"),
        Place::Memory { first, count } => {
            // memories are bounded by a magnitude and nothing else (contract section 1)
            let Within::Magnitude { bound } = guarded.within else {
                return String::new();
            };
            let bound = word(program.scalar(), bound);
            return format!("{n}_line_far(&state->memory[{first}], {count}u, {bound})");
        }
        Place::PreviousDuty(output) => format!("state->{}", program.named("previous_duty", output)),
        Place::PreviousCommand(output) => format!("state->{}", program.named("previous_command", output)),
        Place::SoftCap(output) => format!("state->{}", program.named("soft_cap", output)),
    };
    stray(program, &place, guarded.within)
}

/// Bits as an unsigned literal; C90 has none of 64 bits.
pub fn word(scalar: Scalar, bits: u64) -> String {
    match scalar {
        Scalar::F32 => unsigned(bits as u32),
        Scalar::F64 => {
            let kind = number::kind(scalar).word;
            let [high, low] = [(bits >> 32) as u32, bits as u32].map(|half| format!("0x{half:08X}u"));
            format!("((({kind}){high} << 32) | {low})")
        }
    }
}

//! The duties of a command: one as plain members, several as arrays with a name for each place.

use templates::c::{DutyView, MappingView, SetMapping};

use super::guard;
use super::number::{self, number};
use super::statements::Printer;
use crate::program::{Coefficient, HeadPart, Literal, MappingCode, OutputCode, Program};

/// Parameters of `set_mapping` after the state; empty without a mapping.
pub fn parameters(program: &Program, mapping: Option<&MappingCode>) -> String {
    let kind = number::kind(program.scalar()).name;
    let coefficients = mapping.iter().flat_map(|mapping| &mapping.coefficients);
    let all: Vec<String> = coefficients
        .map(|(name, ..)| format!("{kind} {}", name.name()))
        .collect();
    all.join(", ")
}

/// Names and values of the places of several duties, behind their number.
pub fn places(program: &Program) -> Vec<(String, String)> {
    if !program.has_several() {
        return Vec::new();
    }
    let names = program.outputs.iter().filter_map(|output| output.name.as_ref());
    let place = |(index, name): (usize, &String)| (format!("OUTPUT_{}", name.to_uppercase()), format!("{index}u"));
    std::iter::once(("OUTPUTS".to_owned(), format!("{}u", program.outputs.len())))
        .chain(names.enumerate().map(place))
        .collect()
}

/// Declarator behind a member that each output has.
pub fn length(program: &Program) -> String {
    match program.outputs.len() {
        1 => String::new(),
        count => format!("[{count}]"),
    }
}

/// Subscript of a member that each output has.
pub fn place(program: &Program, index: usize) -> String {
    match program.has_several() {
        true => format!("[{index}]"),
        false => String::new(),
    }
}

/// Functions of several outputs that set a mapping, and their parameters.
pub fn settable(program: &Program) -> Vec<SetMapping> {
    let view = |output: &OutputCode| {
        let mapping = output.mapping.as_ref()?;
        Some(SetMapping {
            function: output.named("set_mapping"),
            parameters: parameters(program, Some(mapping)),
        })
    };
    match program.has_several() {
        true => program.outputs.iter().filter_map(view).collect(),
        false => Vec::new(),
    }
}

/// Declarations of what argmax chose.
pub fn chosen(program: &Program) -> Vec<String> {
    let (n, kind) = (&program.name, number::kind(program.scalar()).name);
    if program.head.is_choice() {
        return vec![format!("const {kind} chosen = {n}_duties[index];")];
    }
    let parts = program.head.parts().iter().enumerate();
    let lines = parts.filter(|(_, part)| part.is_choice()).flat_map(|(index, part)| {
        let (column, count) = (part.column, part.duties.len());
        let table = HeadPart::table(index);
        [
            format!("const uint32_t index{index} = {n}_greedy(&outputs[{column}], {count}u);"),
            format!("const {kind} chosen{index} = {n}_{table}[index{index}];"),
        ]
    });
    lines.collect()
}

/// What is written into the command, and what of it is remembered.
pub fn commanded(program: &Program, decide: &Printer<'_>) -> Vec<DutyView> {
    let trusted = |index: &str| format!("{index} & ((uint32_t)0 - trusted)");
    let index = |output: usize| match program.head.parts().get(output) {
        Some(part) if part.is_choice() => trusted(&format!("index{output}")),
        None if program.head.is_choice() => trusted("index"),
        _ => "0u".to_owned(),
    };
    let view = |(output, (code, duty)): (usize, (&OutputCode, &crate::program::Duty))| DutyView {
        place: place(program, output),
        duty: decide.operand(duty.duty),
        duty_sim: decide.operand(duty.duty_sim),
        fallback: number(program.scalar(), code.fallback),
        index: index(output),
        previous_duty: code.named("previous_duty"),
        previous_command: code.named("previous_command"),
    };
    let both = program.outputs.iter().zip(&program.decide.duties);
    both.enumerate().map(view).collect()
}

/// The word whose sign bit is set if a duty is no number.
pub fn stray(program: &Program, decide: &Printer<'_>) -> String {
    let terms = program.decide.duties.iter();
    let terms: Vec<String> = terms
        .map(|duty| guard::stray(program, &decide.operand(duty.duty), program.decide.within))
        .collect();
    terms.join(" | ")
}

/// Whether the mapping or a soft start reads the state: a parameter that nothing reads is a warning.
pub fn reads_state(program: &Program) -> bool {
    let mapped = program.outputs.iter().any(|output| output.mapping.is_some());
    mapped || program.advance.soft_caps.iter().any(Option::is_some)
}

/// Members of the state that hold a rising limit, and their next values.
pub fn soft_caps(program: &Program, advance: &Printer<'_>) -> Vec<(String, String)> {
    let caps = program.outputs.iter().zip(&program.advance.soft_caps);
    let caps = caps.filter_map(|(output, cap)| Some((output.named("soft_cap"), advance.operand((*cap)?))));
    caps.collect()
}

/// The mappings: how each is set, and how a flipped bit of it is seen.
pub fn mappings(program: &Program) -> Vec<MappingView> {
    let view = |output: &OutputCode| {
        let mapping = output.mapping.as_ref()?;
        let member = |name: &str| output.named(&format!("mapping_{name}"));
        let names = mapping.coefficients.iter().map(|(name, ..)| name.name());
        Some(MappingView {
            function: output.named("set_mapping"),
            flips: output.named("mapping_flips"),
            parameters: parameters(program, Some(mapping)),
            conditions: conditions(program, mapping),
            members: names.map(|name| (member(name), name)).collect(),
            check: member("check"),
            held: guard::check_word(program, mapping, |name| format!("state->{}", member(name))),
            given: guard::check_word(program, mapping, str::to_owned),
        })
    };
    program.outputs.iter().filter_map(view).collect()
}

fn conditions(program: &Program, mapping: &MappingCode) -> Vec<String> {
    let (scalar, p) = (program.scalar(), &program.name);
    let within = |(name, _, low, high): &(Coefficient, _, Literal, Literal)| {
        let (name, low, high) = (name.name(), number(scalar, *low), number(scalar, *high));
        format!("{p}_within({name}, {low}, {high})")
    };
    let mut conditions: Vec<String> = mapping.coefficients.iter().map(within).collect();
    if mapping.coefficients.iter().any(|(name, ..)| *name == Coefficient::R) {
        let (low, high) = mapping.valid_i_out;
        for end in [low, high] {
            let zero = number(scalar, Literal::nearest(scalar, 0.0));
            conditions.push(format!("{p}_flag((a + (r * {})) > {zero})", number(scalar, end)));
        }
    }
    conditions
}

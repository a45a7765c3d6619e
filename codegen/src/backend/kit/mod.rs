//! Back-to-back kit: a C program with measurements and expected bits inside, for the user's compiler and board.
//!
//! Three parts: the arithmetic the contract rests on (`probes`), a construct suite (small controllers that together use
//! everything the C backend can print), and the policy itself. Expected values come from outside as [`Material`].

mod probes;
mod slices;
mod texts;
mod trace;

use std::collections::BTreeMap;

use templates::c::Common;
use templates::kit::{Kit, Settable, Subject};

use super::c::number::{kind, number};
use super::c::statements::unsigned;
use super::c::tables::view as table;
use super::c::{self, render};
use crate::backend::banner;
use crate::files::{CodegenError, GeneratedFiles};
use crate::program::{Element, Literal, OutputCode, Program, Table, words as number_words};

use texts::Texts;
pub use trace::Trace;

/// What the kit compares with; computed by the reference interpreter.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Moves of the policy's controller and the answers expected to them.
    pub policy: Trace,
    /// The construct suite: lowered controllers with their moves.
    pub suite: Vec<(Program, Trace)>,
    /// Control steps that were asked for; `policy` may have more.
    pub asked: u32,
}

/// `<name>_kit.c`; it is built together with `<name>.c`.
///
/// # Errors
/// Only for a fault in the compiler itself.
pub fn emit(program: &Program, material: &Material) -> Result<GeneratedFiles, CodegenError> {
    let name = format!("{}_kit", program.name);
    let title = format!("Back-to-back kit of controller {}", program.name);
    let suite = material.suite.iter().map(|(program, _)| core(program));
    let suite = suite.collect::<Result<Vec<_>, _>>()?;
    let controllers = material
        .suite
        .iter()
        .map(|(program, trace)| subject(&name, program, trace));
    let scalar = program.scalar();
    let probes = probes::of(scalar);
    let literals = probes::literals(scalar);
    let literal_bits: Vec<u32> = literals
        .iter()
        .flat_map(|literal| number_words(scalar, literal.value()))
        .collect();
    let view = Kit {
        common: Common {
            upper: name.to_uppercase(),
            banner: banner(program, &title, program.provenance.c_flags),
            mapping_parameters: String::new(),
            number: kind(scalar),
            name: name.clone(),
        },
        controller: program.name.clone(),
        probe_lines: probes.iter().map(|probe| probe.row(scalar)).collect(),
        probe_count: probes.len(),
        third: number(scalar, Literal::nearest(scalar, 1.0 / 3.0)),
        literals: table(&Table::plain("literals", Element::Float(scalar), literals)),
        literal_bits: table(&Table::words("literal_bits", &literal_bits)),
        suite,
        // the policy comes last: a difference in what it is made of is told first
        suite_subjects: controllers.collect(),
        policy_subject: [subject(&name, program, &material.policy)],
    };
    Ok(GeneratedFiles {
        files: BTreeMap::from([(format!("{name}.c"), render(&view)?)]),
    })
}

/// Header and source of a controller of the suite as one text.
fn core(program: &Program) -> Result<String, CodegenError> {
    let files = c::emit(program)?.files;
    let part = |extension: &str| files.get(&format!("{}.{extension}", program.name));
    let (Some(header), Some(source)) = (part("h"), part("c")) else {
        return Err(CodegenError::Output("the C backend gave no header or no source"));
    };
    // one file for the user's build: the header stands in front of the source, not beside it
    Ok(header.clone() + &source.replace(&format!("#include \"{}.h\"\n", program.name), ""))
}

fn subject(kit: &str, program: &Program, trace: &Trace) -> Subject {
    let texts = Texts { kit, program };
    let (measurement, measurement_words) = texts.measurement();
    Subject {
        name: program.name.clone(),
        upper: program.name.to_uppercase(),
        events: table(&Table::words("events", trace.words())),
        event_count: unsigned(trace.events()),
        steps: trace.steps(),
        measurement,
        measurement_words,
        answer: texts.answer(),
        rest: texts.rest(),
        network: texts.network(),
        state_crc: texts.state_crc("0xFFFFFFFFu", "state."),
        state_numbers: unsigned(((program.state_words() - 2) / program.scalar().words()) as u32),
        mappings: settable(&texts),
        slices: slices::of(program),
        slice_weight: unsigned(slices::WEIGHT),
    }
}

/// The functions that set a mapping, and how the kit calls them.
fn settable(texts: &Texts<'_>) -> Vec<Settable> {
    let view = |(index, output): (usize, &OutputCode)| {
        let coefficients = output.mapping.as_ref()?.coefficients.iter();
        let coefficients: Vec<&str> = coefficients.map(|(name, ..)| name.name()).collect();
        let of = output.name.as_ref().map_or(String::new(), |name| format!(" of {name}"));
        Some(Settable {
            kind: unsigned(trace::mapping_kind(index)),
            function: output.named("set_mapping"),
            what: format!("mapping{of} accepted"),
            words: texts.program.scalar().words() * coefficients.len(),
            locals: texts.coefficients(&coefficients),
            arguments: coefficients.join(", "),
        })
    };
    let outputs = texts.program.outputs.iter().enumerate();
    outputs.filter_map(view).collect()
}

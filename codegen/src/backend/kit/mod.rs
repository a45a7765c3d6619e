//! Back-to-back kit: a C program with measurements and expected bits inside, for the user's compiler and board.
//!
//! Three parts: the arithmetic the contract rests on (`probes`), a construct suite (small controllers that together use
//! everything the C backend can print), and the policy itself. Expected values come from outside as [`Material`].

mod probes;
mod trace;

use std::collections::BTreeMap;

use templates::c::{Common, Table};
use templates::kit::{Kit, Subject};

use super::c99::statements::{float, unsigned};
use super::c99::tables::{floats, words};
use super::c99::{C99, render};
use crate::backend::{Backend, banner};
use crate::{CodegenError, GeneratedFiles, Program};

pub use trace::Trace;

/// What the kit compares with; computed by the reference interpreter.
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Moves of the policy's controller and the answers expected to them.
    pub policy: Trace,
    /// The construct suite: lowered controllers with their moves.
    pub suite: Vec<(Program, Trace)>,
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
    let controllers = material.suite.iter().map(|(program, trace)| subject(program, trace));
    let probes = probes::probes();
    let literals = probes::literals();
    let view = Kit {
        common: Common {
            upper: name.to_uppercase(),
            banner: banner(program, &title, program.provenance.c_flags),
            mapping_parameters: String::new(),
            number: super::c99::number::kind(program.scalar()),
            name: name.clone(),
        },
        controller: program.name.clone(),
        probe_lines: probes.iter().map(probes::Probe::row).collect(),
        probe_count: probes.len(),
        third: float(1.0 / 3.0),
        literals: floats("literals".into(), &literals),
        literal_bits: words("literal_bits", &literals.map(f32::to_bits)),
        suite,
        subjects: controllers.chain([subject(program, &material.policy)]).collect(),
    };
    Ok(GeneratedFiles {
        files: BTreeMap::from([(format!("{name}.c"), render(&view)?)]),
    })
}

/// Header and source of a controller of the suite as one text.
fn core(program: &Program) -> Result<String, CodegenError> {
    let files = C99.emit(program)?.files;
    let part = |extension: &str| files.get(&format!("{}.{extension}", program.name));
    let (Some(header), Some(source)) = (part("h"), part("c")) else {
        return Err(CodegenError::Door("the C backend gave no header or no source"));
    };
    Ok(header.clone() + &source.replace(&format!("#include \"{}.h\"\n", program.name), ""))
}

fn subject(program: &Program, trace: &Trace) -> Subject {
    let coefficients = program.mapping.iter().flat_map(|mapping| &mapping.coefficients);
    let coefficients: Vec<&str> = coefficients.map(|(name, ..)| name.name()).collect();
    Subject {
        name: program.name.clone(),
        upper: program.name.to_uppercase(),
        events: Table {
            element: "uint32_t",
            ..words("events", trace.words())
        },
        event_count: unsigned(trace.events()),
        steps: trace.steps(),
        signals: program.signals.iter().map(|signal| signal.name.clone()).collect(),
        coefficients: coefficients.len(),
        coefficient_locals: coefficients.iter().map(|name| format!("const float {name}")).collect(),
        mapping_arguments: coefficients.join(", "),
    }
}

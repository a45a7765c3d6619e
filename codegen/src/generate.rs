//! From a policy to files: one list of outputs, one program a language.

use policy::{NumericFormat, Policy};
use targets::TargetSpec;

use crate::backend::fmu::Fmi;
use crate::backend::kit::Material;
use crate::files::{CodegenError, GeneratedFiles};
use crate::output::Output;
use crate::program::{Block, Element, Literal, Op, Program};
use crate::stamp::stamp;
use crate::{backend, lower, manifest, output};

/// Everything that `policyc compile` writes for these outputs: their files, the cores that they call, and the manifest.
/// `expected` is what [`Output::Kit`] compares with.
///
/// # Errors
/// If the target has no type for the numeric format; else only for a fault in the compiler itself.
pub fn generate(
    policy: &Policy,
    target: &TargetSpec,
    outputs: &[Output],
    expected: Option<&Material>,
) -> Result<GeneratedFiles, CodegenError> {
    let mut all = sources(policy, target, outputs, expected)?;
    let manifest = manifest::manifest(policy, target, outputs, expected, &all);
    let text = serde_json::to_string_pretty(&manifest).map_err(|error| CodegenError::Manifest(error.to_string()))?;
    all.files.insert(manifest::FILE.to_owned(), text + "\n");
    Ok(all)
}

/// [`generate`] without the manifest, for a caller who keeps the files to itself, such as a build script.
///
/// # Errors
/// As [`generate`].
pub fn sources(
    policy: &Policy,
    target: &TargetSpec,
    outputs: &[Output],
    expected: Option<&Material>,
) -> Result<GeneratedFiles, CodegenError> {
    check_types(policy, target)?;
    let outputs = output::with_cores(outputs);
    let mut all = GeneratedFiles::default();
    for language in output::languages(&outputs) {
        // one program a language, whatever calls it: all outputs share the core
        let program = lower(policy, target, language);
        check_subnormals(&program, target)?;
        for output in outputs.iter().filter(|output| output.language() == language) {
            all.files.extend(emit(*output, &program, expected)?.files);
        }
    }
    // last, and before the manifest: its checksums are those of the files as they are written
    stamp(&mut all, policy, target);
    Ok(all)
}

/// No constant of the program is one that the processor takes for zero: the code would compute another policy.
fn check_subnormals(program: &Program, target: &TargetSpec) -> Result<(), CodegenError> {
    if !target.flushes_subnormals {
        return Ok(());
    }
    // refused and not rounded to 0 here: that would be another policy than the one the trainer exported
    let is_flushed = |value: &Literal| (value.value() as f32).is_subnormal();
    let floats = program
        .checked_tables()
        .filter(|table| matches!(table.element, Element::Float(_)));
    let in_tables = floats.flat_map(|table| {
        let found = table.values.iter().filter(|value| is_flushed(value));
        found.map(|value| (format!("the table `{}`", table.name), value.value()))
    });
    let constants = |block: &Block, place: &str| {
        let constant = |op: &Op| match op {
            Op::Constant(value) => Some((place.to_owned(), *value)),
            _ => None,
        };
        block.ops.iter().filter_map(constant).collect::<Vec<_>>().into_iter()
    };
    let in_features = constants(&program.front.block, "the features");
    let in_command = constants(&program.decide.block, "the continuous head, the mapping or the limits");
    let in_duties = program
        .head
        .duties()
        .iter()
        .map(|value| ("the duties".to_owned(), *value));
    let elsewhere = in_features
        .chain(in_command)
        .chain(in_duties)
        .filter(|(_, value)| is_flushed(value))
        .map(|(place, value)| (place, value.value()));
    match in_tables.chain(elsewhere).next() {
        None => Ok(()),
        Some((place, value)) => Err(CodegenError::Flushed {
            place,
            value,
            target: target.name,
        }),
    }
}

fn check_types(policy: &Policy, target: &TargetSpec) -> Result<(), CodegenError> {
    // binary64 because the width of `double` is a setting of those compilers
    let needs_bytes = matches!(policy.numeric_format, NumericFormat::I8 | NumericFormat::F64);
    if needs_bytes && target.widths.char_bits > 8 {
        return Err(CodegenError::NoType {
            format: policy.numeric_format,
            target: target.name,
        });
    }
    Ok(())
}

/// The files of one output, from the program in its language.
fn emit(output: Output, program: &Program, expected: Option<&Material>) -> Result<GeneratedFiles, CodegenError> {
    match output {
        Output::C => backend::c::emit(program),
        Output::Rust => backend::rust::emit(program),
        Output::RustOverC => backend::rust::bindings::emit(program),
        Output::Kit => match expected {
            Some(expected) => backend::kit::emit(program, expected),
            None => Err(CodegenError::Output("the kit has no expected values")),
        },
        Output::Sfunction => backend::sfunction::emit(program),
        Output::Fmu2 => backend::fmu::emit(program, Fmi::Two),
        Output::Fmu3 => backend::fmu::emit(program, Fmi::Three),
    }
}

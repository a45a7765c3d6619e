//! The core behind ports of `double`: what the integrations into block diagrams share.

use policy::Scalar;
use templates::block::{
    AdjustView, BlockHeader, BlockSource, BlockView, DutyPort, InputView, OutputView, ParameterView,
};
use templates::c::Common;

use super::c::duties::place;
use super::c::render;
use crate::backend::banner;
use crate::backend::literal::number;
use crate::files::{CodegenError, GeneratedFiles};
use crate::program::{Coefficient, Literal, OutputCode, Program, SignalPort};

/// `<name>_block.h` and `<name>_block.c`.
///
/// # Errors
/// Only for a fault in the compiler itself.
pub fn emit(program: &Program) -> Result<GeneratedFiles, CodegenError> {
    let title = format!("Controller {} behind ports of double", program.name);
    let header = BlockHeader {
        b: view(program, &title),
    };
    let source = BlockSource {
        b: view(program, &title),
    };
    Ok(GeneratedFiles {
        files: [
            (format!("{}_block.h", program.name), render(&header)?),
            (format!("{}_block.c", program.name), render(&source)?),
        ]
        .into(),
    })
}

/// The view of a file of that title.
pub fn view(program: &Program, title: &str) -> BlockView {
    let scalar = program.scalar();
    BlockView {
        common: Common {
            name: program.name.clone(),
            upper: program.name.to_uppercase(),
            banner: banner(program, title, program.provenance.c_flags),
            mapping_parameters: String::new(),
            number: super::c::number::kind(scalar),
        },
        inputs: program.signals.iter().map(|signal| input(scalar, signal)).collect(),
        has_codes: program.signals.iter().any(|signal| signal.is_code),
        // and `enable`
        input_count: program.signals.len() + 1,
        parameters: parameters(program),
        mappings: program.outputs.iter().filter_map(adjusted).collect(),
        duties: program
            .outputs
            .iter()
            .enumerate()
            .map(|own| duty(program, own))
            .collect(),
        outputs: outputs(program),
        sample_period: format!("{:?}", program.sample_period),
        // the state and one word
        // in doubles, which hold two words each
        work: (program.state_words() + 1).div_ceil(2),
        features: program.feature_count(),
        actions: program.head.outputs(),
    }
}

/// The coefficients of each mapping, `a_left` of the output `left`.
fn parameters(program: &Program) -> Vec<ParameterView> {
    let scalar = program.scalar();
    let own = |output: &OutputCode| -> Vec<ParameterView> {
        let coefficients = output.mapping.iter().flat_map(|mapping| &mapping.coefficients);
        let view = |(name, value, low, high): &(Coefficient, Literal, Literal, Literal)| ParameterView {
            name: output.named(name.name()),
            value: number(scalar, *value),
            low: number(scalar, *low),
            high: number(scalar, *high),
        };
        coefficients.map(view).collect()
    };
    program.outputs.iter().flat_map(own).collect()
}

fn adjusted(output: &OutputCode) -> Option<AdjustView> {
    let names = output.mapping.as_ref()?.coefficients.iter();
    let names: Vec<String> = names.map(|(name, ..)| output.named(name.name())).collect();
    Some(AdjustView {
        function: output.named("set_mapping"),
        arguments: names.join(", "),
    })
}

fn duty(program: &Program, (index, output): (usize, &OutputCode)) -> DutyPort {
    let suffix = output.named("");
    DutyPort {
        place: place(program, index),
        upper: suffix.to_uppercase(),
        suffix,
        fallback: number(program.scalar(), output.fallback),
    }
}

/// Scalars and no arrays: a block diagram wires a leg by its name.
fn outputs(program: &Program) -> Vec<OutputView> {
    let each = |stem: &'static str| program.outputs.iter().map(move |output| output.named(stem));
    let of = |meaning: &'static str| move |name: String| (name, meaning.to_owned());
    let status = format!("{}_STATUS_...", program.name.to_uppercase());
    let all: Vec<(String, String)> = each("duty")
        .map(of("commanded duty, 0..1"))
        .chain(each("action").map(of("index of the greedy action, from 0")))
        .chain([("status".to_owned(), status)])
        .collect();
    // and the semicolon
    let width = 1 + all.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let view = |(name, meaning): (String, String)| OutputView {
        declarator: format!("{:width$}", format!("{name};")),
        name,
        meaning,
    };
    all.into_iter().map(view).collect()
}

fn input(scalar: Scalar, signal: &SignalPort) -> InputView {
    InputView {
        name: signal.name.clone(),
        meaning: signal.meaning(scalar),
        is_code: signal.is_code,
    }
}

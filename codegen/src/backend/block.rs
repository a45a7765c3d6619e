//! The core behind ports of `double`: what the integrations into block diagrams share.

use policy::Scalar;
use templates::block::{BlockHeader, BlockSource, BlockView, InputView, ParameterView};
use templates::c::Common;

use super::c::render;
use crate::backend::banner;
use crate::backend::literal::number;
use crate::files::{CodegenError, GeneratedFiles};
use crate::program::{Coefficient, Literal, Program, SignalPort};

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
    let mapping = program.mapping();
    let coefficients = || mapping.iter().flat_map(|mapping| &mapping.coefficients);
    let parameter = |(name, value, low, high): &(Coefficient, Literal, Literal, Literal)| ParameterView {
        name: name.name().to_owned(),
        value: number(scalar, *value),
        low: number(scalar, *low),
        high: number(scalar, *high),
    };
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
        parameters: coefficients().map(parameter).collect(),
        mapping_arguments: coefficients()
            .map(|(name, ..)| name.name())
            .collect::<Vec<_>>()
            .join(", "),
        fallback: number(scalar, program.fallback_duty()),
        sample_period: format!("{:?}", program.sample_period),
        // the state and one word
        // in doubles, which hold two words each
        work: (program.state_words() + 1).div_ceil(2),
        features: program.feature_count(),
        actions: program.head.outputs(),
    }
}

fn input(scalar: Scalar, signal: &SignalPort) -> InputView {
    InputView {
        name: signal.name.clone(),
        meaning: signal.meaning(scalar),
        is_code: signal.is_code,
    }
}

//! Policy + target -> program. Each part of the contract has its file.

pub mod command;
mod front;
mod integer;
pub mod known_answers;
pub mod network;
pub mod simplify;

pub use command::STATUS;
use policy::rounding::{down_f32, nearest_f32, up_f32};
use policy::{NumericFormat, Policy};
use targets::{Fpu, TargetSpec};

use crate::crc::crc32_words;
use crate::program::{Coefficient, Literal, MappingCode, Program, Provenance, SignalPort};
use crate::{Language, TOOL};

/// Lowers a policy for a target; the row block of the layers is the target's for that language.
#[must_use]
pub fn lower(policy: &Policy, target: &TargetSpec, language: Language) -> Program {
    let mut integer_block = target.integer_block;
    let row_block = match language {
        Language::C => target.c_row_block,
        Language::Rust => {
            let (of_16, of_8) = integer_block.rust_rows;
            integer_block.rows = if policy.numeric_format == NumericFormat::I8 {
                of_8
            } else {
                of_16
            };
            target.rust_row_block
        }
    };
    let (front, memory_words) = front::lower(policy);
    let loops = network::FloatLoops {
        row_block,
        alignment: target.weights_alignment,
        has_assembly: target.has_float_assembly && policy.numeric_format == NumericFormat::F32,
    };
    let network = network::lower(policy, loops, integer_block);
    let duties: Vec<_> = policy
        .actions
        .iter()
        .map(|action| Literal::nearest(action.duty))
        .collect();
    let mut program = Program {
        name: policy.name.clone(),
        sample_period: policy.sample_period,
        numeric_format: policy.numeric_format,
        has_fpu: target.fpu != Fpu::None,
        processor: target.rust.and_then(|rust| rust.processor()),
        provenance: Provenance {
            tool: TOOL.to_owned(),
            digests: policy.digests.clone(),
            target: target.name,
            widths: target.widths,
            c_flags: target.c_flags,
            rust_flags: target.rust_flags,
        },
        signals: policy.signals.iter().map(signal_port).collect(),
        features: policy
            .features
            .iter()
            .map(|feature| {
                (
                    feature.name.clone(),
                    policy::describe::formula(feature, &policy.signals),
                )
            })
            .collect(),
        memory_words,
        front,
        self_test: known_answers::lower(policy, &network),
        network,
        duties,
        mapping: policy.mapping.as_ref().map(mapping),
        decide: command::decide(policy),
        advance: command::advance(policy),
        initial_duty: nearest_f32(policy.limits.initial_duty).into(),
        soft_start_from: policy.limits.soft_start.map(|soft| Literal::nearest(soft.from)),
        fallback_duty: nearest_f32(policy.fallback.duty).into(),
        hold: policy.fallback.hold,
        crc: 0,
    };
    program.crc = crc32_words(program.table_words());
    program
}

/// Interval rounded inwards.
fn inward(interval: policy::Interval) -> (Literal, Literal) {
    (up_f32(interval.low).into(), down_f32(interval.high).into())
}

fn signal_port(signal: &policy::Signal) -> SignalPort {
    let range = inward(signal.range);
    SignalPort {
        name: signal.name.clone(),
        unit: signal.unit.clone(),
        is_code: signal.adc.is_some(),
        range,
        initial: 0.0_f32.max(range.0.value()).min(range.1.value()).into(),
    }
}

fn mapping(mapping: &policy::Mapping) -> MappingCode {
    let values = mapping.coefficients;
    let mut coefficients = vec![
        (Coefficient::A, values.a, mapping.adjust_a),
        (Coefficient::B, values.b, mapping.adjust_b),
        (Coefficient::C, values.c, mapping.adjust_c),
    ];
    if let Some(r) = values.r {
        coefficients.push((Coefficient::R, r, mapping.adjust_r));
    }
    let lowered = |(name, value, adjust): (Coefficient, f64, policy::Interval)| {
        let (low, high) = inward(adjust);
        (name, Literal::nearest(value), low, high)
    };
    MappingCode {
        coefficients: coefficients.into_iter().map(lowered).collect(),
        valid_i_out: (
            Literal::nearest(mapping.valid_i_out.low),
            Literal::nearest(mapping.valid_i_out.high),
        ),
    }
}

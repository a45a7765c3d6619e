//! Policy + target -> program. Each part of the contract has its file.

pub mod command;
mod front;
mod guard;
mod head;
mod integer;
pub mod known_answers;
mod loops;
mod network;
mod observer;
mod real;
pub mod simplify;
mod state;
mod tables;

pub use command::STATUS;
use policy::{Policy, Scalar};
use targets::TargetSpec;

use crate::crc::{crc32_words, nibble_table};
use crate::files::TOOL;
use crate::output::Language;
use crate::program::{
    Coefficient, Conversion, Element, Head, HeadPart, Literal, MappingCode, OutputCode, Program, Provenance,
    SignalPort, Table,
};

/// Lowers a policy for a target; the loops of its network are those that suit the language's compilers.
#[must_use]
pub fn lower(policy: &Policy, target: &TargetSpec, language: Language) -> Program {
    let scalar = policy.numeric_format.scalar();
    let (front, memory_words) = front::lower(policy);
    let (network, mut tables) = network::lower(policy, target, language);
    let head = head::lower(policy);
    // on the finished tables: the answers are those of what is printed, not of the policy a second time
    let answers = known_answers::lower(policy, &network, &tables);
    let duties = |name: &str, duties: &[Literal]| Table {
        // a flipped duty would be commanded as it is
        is_checked: true,
        ..Table::plain(name, Element::Float(scalar), duties.iter().copied())
    };
    if let Head::Choice(own) = &head {
        tables.push(duties("duties", own));
    }
    let choices = head.parts().iter().enumerate().filter(|(_, part)| part.is_choice());
    tables.extend(choices.map(|(index, part)| duties(&HeadPart::table(index), &part.duties)));
    // what follows needs no check: a wrong step gives another checksum, a wrong answer fails the self test
    tables.push(Table::words("crc_steps", &nibble_table()));
    tables.extend(answers);
    let checked = tables.iter().filter(|table| table.is_checked);
    let crc = crc32_words(checked.flat_map(Table::checked_words));
    let has_fpu = target.fpu.has(scalar == Scalar::F64);
    let signals: Vec<SignalPort> = (policy.signals.iter())
        .map(|signal| signal_port(scalar, signal))
        .collect();
    let outputs = outputs(policy);
    let guard = guard::lower(policy, &signals);
    let state = state::members(policy, &signals, memory_words, &outputs);
    Program {
        name: policy.name.clone(),
        sample_period: policy.sample_period,
        numeric_format: policy.numeric_format,
        has_fpu,
        senses_again: has_fpu,
        processor: target.rust.and_then(|rust| rust.processor()),
        provenance: Provenance {
            tool: TOOL.to_owned(),
            digests: policy.digests.clone(),
            target: target.name,
            widths: target.widths,
            c_flags: target.c_flags,
            rust_flags: target.rust_flags,
        },
        signals,
        features: policy
            .features
            .iter()
            .map(|feature| (feature.name.clone(), policy::describe::formula(feature, policy)))
            .collect(),
        memory_words,
        front,
        network,
        head,
        outputs,
        decide: command::decide(policy),
        guard,
        advance: command::advance(policy),
        state,
        hold: policy.fallback.hold,
        tables,
        crc,
    }
}

fn outputs(policy: &Policy) -> Vec<OutputCode> {
    let scalar = policy.numeric_format.scalar();
    let output = |path: policy::DutyPath<'_>| OutputCode {
        name: path.name.map(str::to_owned),
        mapping: path.mapping.map(|map| mapping(scalar, map)),
        fallback: Literal::nearest(scalar, path.fallback),
    };
    policy.paths().into_iter().map(output).collect()
}

fn signal_port(scalar: Scalar, signal: &policy::Signal) -> SignalPort {
    let range = Literal::inward(scalar, signal.range);
    SignalPort {
        name: signal.name.clone(),
        unit: signal.unit.clone(),
        is_code: signal.adc.is_some(),
        conversion: signal.adc.map(|adc| Conversion {
            gain: Literal::nearest(scalar, adc.gain),
            offset: Literal::nearest(scalar, adc.offset),
            bits: adc.bits,
        }),
        range,
        // held before the first good sample: a plausible one, so that the state is sound from the start
        initial: Literal::nearest(scalar, 0.0_f64.max(range.0.value()).min(range.1.value())),
    }
}

fn mapping(scalar: Scalar, mapping: &policy::Mapping) -> MappingCode {
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
        let (low, high) = Literal::inward(scalar, adjust);
        (name, Literal::nearest(scalar, value), low, high)
    };
    MappingCode {
        coefficients: coefficients.into_iter().map(lowered).collect(),
        valid_i_out: (
            // to nearest and not inwards, as section 8 has it: the end of the range is inside
            Literal::nearest(scalar, mapping.valid_i_out.low),
            Literal::nearest(scalar, mapping.valid_i_out.high),
        ),
        check_constant: match scalar {
            Scalar::F32 => 0x4B4B_4B4B,
            Scalar::F64 => 0x4B4B_4B4B_4B4B_4B4B,
        },
    }
}

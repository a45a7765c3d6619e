//! What a lowered network computes, against the interpreter: loops and tables give the bits of the contract, whatever the target,
//! the language and the format.
#![allow(clippy::unwrap_used)]

mod common;
use codegen::crc::crc32_words;
use codegen::{Language, Program};
use common::*;
use interp::Controller;
use ndarray::aview1;
use policy::{Activation, NumericFormat, Policy};
use targets::TargetSpec;

/// The observations of `self_test`: 24 bits of a generator between the ends of each bound, in the format of the policy.
fn observations(policy: &Policy) -> Vec<Vec<f64>> {
    let mut random: u32 = 0x2545_F491;
    let mut share = || {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(random >> 8) / 16_777_216.0
    };
    let of = |share: f64, low: f64, width: f64| match policy.numeric_format {
        NumericFormat::F64 => low + width * share,
        _ => f64::from(low as f32 + width as f32 * share as f32),
    };
    let bounds = || policy.features.iter().map(|feature| feature.bound);
    let row = |_| {
        bounds()
            .map(|bound| of(share(), bound.low, bound.high - bound.low))
            .collect()
    };
    (0..16).map(row).collect()
}

/// Checksums of the interpreter's Q values.
fn expected(policy: &Policy) -> Vec<u32> {
    let wide = Controller::<f64>::new(policy);
    let single = Controller::<f32>::new(policy);
    let of = |observation: Vec<f64>| {
        if policy.numeric_format == NumericFormat::F64 {
            let q = wide.q_values(&aview1(&observation)).unwrap();
            return crc32_words(q.iter().flat_map(|q| [q.to_bits() as u32, (q.to_bits() >> 32) as u32]));
        }
        let observation: Vec<f32> = observation.into_iter().map(|x| x as f32).collect();
        crc32_words(
            single
                .q_values(&aview1(&observation))
                .unwrap()
                .iter()
                .map(|q| q.to_bits()),
        )
    };
    observations(policy).into_iter().map(of).collect()
}

fn answers(program: &Program) -> Vec<u32> {
    let table = program.table("answers").unwrap();
    table.values.iter().map(|value| value.value() as u32).collect()
}

fn languages(target: &TargetSpec) -> Vec<Language> {
    let rust = target.rust.map(|_| Language::Rust);
    std::iter::once(Language::C).chain(rust).collect()
}

#[track_caller]
fn assert_equal(policy: &Policy, target: &TargetSpec, expected: &[u32]) {
    for language in languages(target) {
        let program = codegen::lower(policy, target, language);
        let what = (&policy.name, policy.numeric_format, target.name, language);
        assert_eq!(answers(&program), expected, "{what:?}");
    }
}

#[test]
fn every_case_gives_the_answers_of_the_interpreter_in_every_format() {
    for policy in cases() {
        for format in NumericFormat::ALL {
            let policy = policy.clone().with_format(format);
            assert_equal(&policy, target("host"), &expected(&policy));
        }
    }
}

/// Loops of every height, pairs and groups of inputs, streamed last layers.
#[test]
fn loops_of_every_target_give_the_answers_of_the_interpreter() {
    for name in ["tail_blocks", "residual", "minimal", "scheduled"] {
        for format in NumericFormat::ALL {
            let policy = case(name).with_format(format);
            let expected = expected(&policy);
            for target in targets::TARGETS {
                assert_equal(&policy, target, &expected);
            }
        }
    }
}

/// On the sum itself and with bits cut off it.
#[test]
fn every_activation_gives_the_answers_of_the_interpreter_in_integers() {
    for activation in Activation::EACH {
        let mut policy = case("tail_blocks");
        policy.layers[0].activation = *activation;
        for format in [NumericFormat::I16, NumericFormat::I8] {
            let policy = policy.clone().with_format(format);
            assert_equal(&policy, target("host"), &expected(&policy));
            assert_equal(&policy, target("cortex-m4f"), &expected(&policy));
        }
    }
}

/// A network that chooses nothing tells nothing: the answers of a row differ from those of another.
#[test]
fn answers_differ_from_row_to_row() {
    let policy = case("tail_blocks");
    let mut rows = expected(&policy);
    rows.sort_unstable();
    rows.dedup();
    assert_eq!(rows.len(), 16);
}

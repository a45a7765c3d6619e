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

/// Inner loops load whole words of weights; sums may take the place of the observation where two layers or more have read it; an
/// output of 25 bits is an integer at the exponent field 127 + 24 less its fractional bits.
#[test]
fn the_frame_of_an_integer_network_follows_from_its_layers_and_scales() {
    for (name, shares) in [
        ("linear", false),
        ("tail_blocks", false),
        ("paper", true),
        ("activations", true),
    ] {
        for format in [NumericFormat::I16, NumericFormat::I8] {
            let policy = case(name).with_format(format);
            let scales = policy::scales::of(&policy).unwrap();
            let exponent = scales.layers.last().unwrap().outputs[0];
            let program = codegen::lower(&policy, target("host"), Language::C);
            let code = program.network.integer().unwrap();
            assert_eq!(
                (code.shares, code.q_field),
                (shares, 151 - exponent),
                "{name} {format:?}"
            );
            assert_eq!(program.alignment(), Some(4), "{name} {format:?}");
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

/// Neurons of the hidden layer of `tail_blocks` that no observation brings above 0, in columns of weights of this sign.
fn with_dead(neurons: &[usize], weight: f32, bias: f32) -> Policy {
    let mut policy = case("tail_blocks");
    for neuron in neurons {
        policy.layers[0].bias[*neuron] = -1e9;
        for row in policy.layers[1].weights.chunks_exact_mut(33) {
            row[*neuron] = weight;
        }
    }
    policy.layers[1].bias[0] = bias;
    policy
}

#[track_caller]
fn assert_removed(policy: &Policy, removed: &[usize]) {
    let found = codegen::manifest::sizes(policy, target("host")).removed_neurons;
    assert_eq!(found, removed, "{:?}", policy.numeric_format);
    for name in ["host", "cortex-m4f"] {
        assert_equal(policy, target(name), &expected(policy));
    }
}

/// 28 of 33 are a multiple of four. A zero that is added tells -0 from +0, and in a fused sum a product that vanished from +0.
#[test]
fn dead_neurons_are_left_out_where_their_zero_changes_nothing() {
    let five = [0, 7, 11, 30, 32];
    for format in [NumericFormat::F32, NumericFormat::I16, NumericFormat::I8] {
        assert_removed(&with_dead(&five, 1.0, 0.5).with_format(format), &[5, 0]);
        assert_removed(&with_dead(&five, 1.0, 0.0).with_format(format), &[5, 0]);
    }
    let no_one: &[usize] = &[];
    assert_removed(&with_dead(&five, 1.0, -0.0), no_one);
    assert_removed(&with_dead(&five, 1.0, -0.0).with_format(NumericFormat::I16), &[5, 0]);
    for weight in [-1.0, -0.0] {
        assert_removed(&with_dead(&five, weight, -0.0), &[5, 0]);
        assert_removed(
            &with_dead(&five, weight, -0.0).with_format(NumericFormat::F32Fma),
            &[5, 0],
        );
    }
    assert_removed(&with_dead(&five, 1.0, 0.5).with_format(NumericFormat::F32Fma), no_one);
    assert_removed(&with_dead(&five, -1.0, 0.5).with_format(NumericFormat::F64), no_one);
}

/// Groups of four: 31 neurons cost what 32 do, and where all are dead four stay.
#[test]
fn no_more_neurons_are_left_out_than_make_whole_groups() {
    assert_removed(&with_dead(&[4], 1.0, 0.5), &[1, 0]);
    assert_removed(&with_dead(&[4, 9], 1.0, 0.5), &[1, 0]);
    assert_removed(&with_dead(&[4, 9, 20, 21, 22, 23], 1.0, 0.5), &[5, 0]);
    let all: Vec<usize> = (0..33).collect();
    assert_removed(&with_dead(&all, 1.0, 0.5), &[29, 0]);
}

/// A layer behind one that lost outputs loses the inputs, and outputs of its own.
#[test]
fn dead_neurons_of_layers_one_behind_the_other_are_left_out_of_both() {
    let mut policy =
        policy::load(&std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/buck12/policy.toml")).unwrap();
    policy.golden = None;
    for (layer, neurons, bias) in [(0, [0, 5, 17, 63], -500.0), (1, [1, 2, 40, 41], -5000.0)] {
        for neuron in neurons {
            policy.layers[layer].bias[neuron] = bias;
        }
    }
    for format in [NumericFormat::F32, NumericFormat::I16, NumericFormat::I8] {
        assert_removed(&policy.clone().with_format(format), &[4, 4, 0]);
    }
}

//! What is told of generated code and of what cannot be generated, word by word.
#![allow(clippy::unwrap_used)]

mod common;
use std::path::Path;

use codegen::manifest::{Sizes, sizes};
use codegen::{CodegenError, Output, notes};
use common::*;
use policy::{NumericFormat, Policy};
use toml_input::Faults;

/// Sizes of a policy of which nothing is to be told.
fn plain() -> Sizes {
    Sizes {
        macs: 1312,
        table_bytes: 9_999,
        state_bytes: 12_340,
        accumulator_bound: None,
        removed_neurons: Vec::new(),
        q_error_bound: None,
        duty_error_bound: None,
        ..sizes(&case("minimal"), target("host"))
    }
}

fn told(sizes: &Sizes) -> Vec<String> {
    notes(&case("minimal"), target("host"), sizes, [Path::new("minimal.rs")])
}

#[test]
fn of_a_plain_network_nothing_is_told() {
    assert!(told(&plain()).is_empty());
    assert_eq!(
        plain().to_string(),
        "1,312 MACs per step, 9999 B of tables, 12.3 kB of state"
    );
}

#[test]
fn an_integer_network_tells_its_largest_sum_and_its_error() {
    let mut sizes = plain();
    sizes.accumulator_bound = Some(1_234_567);
    sizes.q_error_bound = Some(0.012_345);
    let golden = "golden answers would tell what it changes where the converter lives (`policyc replay --golden` makes them of a log)";
    let expected = [
        "integer network: no 32-bit sum can overflow, the largest is 1,234,567 of 2,147,483,647 over the whole box of observations".to_owned(),
        format!(
            "no Q value is further than {} from real arithmetic, for every observation the clips let through, however rare; {golden}, and \
             `policyc certify` says more",
            report::quantity(0.0123, "", 3)
        ),
    ];
    assert_eq!(told(&sizes), expected);
    let mut sizes = plain();
    sizes.duty_error_bound = Some(0.5);
    let told = told(&sizes);
    assert!(
        told.len() == 1 && told[0].starts_with("no duty of the actor is further than "),
        "{told:?}"
    );
}

/// Of a contract with golden answers, those of `legs`, it is said where their decisions stand.
#[test]
fn the_error_of_a_network_with_golden_answers_names_the_place_of_their_decisions() {
    let mut sizes = plain();
    sizes.q_error_bound = Some(0.5);
    let told = notes(&case("legs"), target("host"), &sizes, []);
    assert!(
        told.len() == 1 && told[0].contains("stands below `decisions` in `policyc inspect`"),
        "{told:?}"
    );
}

#[test]
fn neurons_that_are_left_out_are_summed_over_the_layers() {
    let mut sizes = plain();
    sizes.removed_neurons = vec![2, 1, 0];
    sizes.macs = 5;
    let whole: usize = case("minimal").layers.iter().map(|layer| layer.weights.len()).sum();
    let expected = format!("3 neurons are 0 for every observation and left out: 5 of {whole} MACs, the same bits");
    assert_eq!(told(&sizes), [expected]);
}

#[test]
fn fused_operations_are_told_where_they_are_no_gain() {
    let policy = case("minimal").with_format(NumericFormat::F32Fma);
    let of = |name: &str, files: &[&str]| notes(&policy, target(name), &plain(), files.iter().map(Path::new));
    let rust = "Rust has no fused multiply-add in `core`: the module computes it in software, many times slower than f32; take C";
    assert_eq!(of("host", &["minimal.c", "minimal.h"]), [""; 0]);
    assert_eq!(of("host", &["minimal.c", "minimal.rs"]), [rust]);
    // three cycles fused, two apart
    let slower = "on cortex-m4f a fused multiply-add takes 3 cycles, a product and a sum 2: f32 is faster";
    assert_eq!(of("cortex-m4f", &["minimal.rs"]), [slower, rust]);
    assert_eq!(of("cortex-m7", &["minimal.c"]), [""; 0]);
    let absent = "cortex-m0plus has no fused multiply-add; a library computes it, many times slower than f32";
    assert_eq!(of("cortex-m0plus", &["minimal.c"]), [absent]);
    // in binary32 nothing is fused
    let single = case("minimal");
    assert!(notes(&single, target("cortex-m4f"), &plain(), [Path::new("minimal.rs")]).is_empty());
}

fn refused(policy: &Policy, name: &str) -> CodegenError {
    codegen::generate(policy, target(name), &[Output::C], None).unwrap_err()
}

fn fault(error: CodegenError) -> [String; 4] {
    let faults = Faults::from(error);
    let fault = faults.list.first().unwrap().clone();
    [Some(fault.problem), fault.found, fault.expected, fault.hint].map(Option::unwrap_or_default)
}

#[test]
fn a_processor_without_bytes_takes_neither_bytes_nor_binary64() {
    let policy = |format| case("minimal").with_format(format);
    let problem = "the processor has no type for the numeric format";
    assert_eq!(
        fault(refused(&policy(NumericFormat::I8), "c2000-c28x")),
        [
            problem,
            "i8, whose weights have 8 bits, for c2000-c28x",
            "a format of 16 bits or more",
            "--format i16"
        ]
    );
    assert_eq!(
        fault(refused(&policy(NumericFormat::F64), "c2000-c28x")),
        [
            problem,
            "f64, whose numbers are a double of 64 bits, which there depends on the compiler's settings, for c2000-c28x",
            "f32 or i16",
            "--format i16"
        ]
    );
    for format in [NumericFormat::F32, NumericFormat::I16] {
        assert!(codegen::generate(&policy(format), target("c2000-c28x"), &[Output::C], None).is_ok());
    }
}

#[test]
fn code_for_a_processor_without_bytes_stops_where_an_int_has_other_bits() {
    let files = codegen::sources(&case("minimal"), target("c2000-c28x"), &[Output::C], None).unwrap();
    let text: String = files.files.into_values().collect();
    // the largest of 16 bits in two's complement
    assert!(text.contains("(INT_MAX == 32767)"), "{text}");
}

#[test]
fn a_subnormal_constant_is_refused_where_the_processor_takes_it_for_0() {
    let with = |change: fn(&mut Policy)| {
        let mut policy = case("minimal");
        change(&mut policy);
        policy
    };
    let hint = "round it to 0 where the policy is exported, or take --format i16";
    let expected = "0, or a magnitude of at least 1.1754944e-38";
    let problem = "the processor would take a constant of the policy for zero";
    let weight = with(|policy| policy.layers[0].weights[1] = 1e-40);
    let found = fault(refused(&weight, "c2000-c28x"));
    assert_eq!(found[..1], [problem]);
    assert!(
        found[1].contains(" in the table `weights0`; the FPU of c2000-c28x has no subnormal numbers"),
        "{found:?}"
    );
    assert_eq!(found[2..], [expected, hint]);
    let feature = with(|policy| policy.features[0].scale = -1e-40);
    assert!(fault(refused(&feature, "c2000-c28x"))[1].contains(" in the features; "));
    let limit = with(|policy| policy.limits.duty.low = 1e-40);
    assert!(fault(refused(&limit, "c2000-c28x"))[1].contains(" in the continuous head, the mapping or the limits; "));
    let duty = with(|policy| policy.actions_mut()[0].duty = 1e-40);
    let found = fault(refused(&duty, "c2000-c28x"));
    assert!(found[1].contains("duties"), "{found:?}");
    // others have them
    for policy in [weight, feature, limit, duty] {
        assert!(codegen::generate(&policy, target("host"), &[Output::C], None).is_ok());
    }
    assert!(codegen::generate(&case("minimal"), target("c2000-c28x"), &[Output::C], None).is_ok());
}

#[test]
fn a_kit_without_expected_values_is_a_fault_of_the_compiler() {
    let error = codegen::generate(&case("minimal"), target("host"), &[Output::Kit], None).unwrap_err();
    let text = "internal fault: output: the kit has no expected values";
    assert_eq!(error.to_string(), text);
    assert_eq!(fault(error), [text, "", "", ""]);
}

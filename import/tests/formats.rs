//! MAT, Keras and ONNX files against what their own runtimes answer: tests/fixtures/trainers/formats.py.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::disallowed_methods)]

mod common;

use common::library::{assert_equals_library, fixture, policy_of, refusal};
use import::Options;
use policy::Activation;

fn relu(x: f64) -> f64 {
    x.max(0.0)
}

#[test]
fn variables_structs_and_cells_of_mat_files_are_read() {
    for (file, first) in [
        ("flat.mat", "layer_1"),
        ("struct.mat", "net.layer_1"),
        ("cells.mat", "p.1"),
    ] {
        let (_folder, new, policy) = policy_of(file, &Options::default());
        assert!(
            new.contract.contains(&format!("# layers, first to last: {first} > ")),
            "{}",
            new.contract
        );
        assert!(new.contract.contains("hidden_activation = \"TODO\""), "{file}");
        assert_equals_library(&policy, "state_dict", relu, false);
    }
}

/// RLlib's checkpoints hold a `module_state.pkl` of this kind.
#[test]
fn numpy_arrays_in_a_pickle_are_read() {
    for file in ["arrays_2.pkl", "arrays_5.pkl"] {
        let (_folder, _, policy) = policy_of(file, &Options::default());
        assert_equals_library(&policy, "state_dict", relu, false);
    }
}

#[test]
fn a_mat_file_of_version_7_3_is_refused_with_the_line_that_saves_an_older_one() {
    let faults = refusal(&fixture("new.mat"));
    assert!(faults.contains("version 7.3"), "{faults}");
    assert!(faults.contains("'-v7')"), "{faults}");
}

#[test]
fn files_of_keras_are_refused_with_its_export() {
    for (file, found) in [
        ("keras.weights.h5", ".weights.h5 of Keras 3"),
        ("keras_model.keras", ".keras file"),
    ] {
        let faults = refusal(&fixture(file));
        assert!(
            faults.contains(found) && faults.contains("format=\"onnx\""),
            "{file}: {faults}"
        );
    }
}

#[test]
fn exports_of_keras_are_read() {
    for name in ["keras", "tf_style"] {
        let (_folder, new, policy) = policy_of(&format!("{name}.onnx"), &Options::default());
        assert!(
            new.contract.contains("hidden_activation = \"relu\""),
            "{}",
            new.contract
        );
        assert_equals_library(&policy, name, relu, false);
    }
}

#[test]
fn what_is_no_chain_is_refused_by_its_node() {
    for (file, node) in [
        ("lstm", "LSTM `memory`"),
        ("conv", "Conv `window`"),
        ("residual", "Add `shortcut`"),
        ("dynamic", "Shape `shape_of`"),
        ("transposed", "Transpose `turn`"),
        ("branch", "If `choice`"),
        ("quantised", "QuantizeLinear `to_bytes`"),
    ] {
        let faults = refusal(&fixture(&format!("{file}.onnx")));
        assert!(faults.contains(node), "{file}: {faults}");
        assert!(faults.contains("hint:"), "{file} has no way out: {faults}");
    }
}

/// A function of the library's page, and not of this project's code.
fn of_library(word: &str) -> fn(f64) -> f64 {
    match word {
        "elu" => |x| if x > 0.0 { x } else { x.exp() - 1.0 },
        "silu" => |x| x / (1.0 + (-x).exp()),
        // erf by its page in the library of C
        "gelu" => |x| 0.5 * x * (1.0 + libm::erf(x / 2.0_f64.sqrt())),
        "gelu_tanh" => |x| 0.5 * x * (1.0 + ((2.0 / std::f64::consts::PI).sqrt() * (x + 0.044715 * x.powi(3))).tanh()),
        "sigmoid" => |x| 1.0 / (1.0 + (-x).exp()),
        "softplus" => |x| (1.0 + x.exp()).ln(),
        "hard_sigmoid" => |x| (x / 6.0 + 0.5).clamp(0.0, 1.0),
        "hard_swish" => |x| x * (x / 6.0 + 0.5).clamp(0.0, 1.0),
        "leaky_relu" => |x| if x > 0.0 { x } else { 0.2 * x },
        other => panic!("{other}"),
    }
}

/// From modules and from the graphs of both exporters; those that the contract has no word for are refused by name.
#[test]
fn an_activation_is_read_by_its_word_or_refused_by_name() {
    for word in [
        "elu",
        "silu",
        "gelu",
        "gelu_tanh",
        "sigmoid",
        "softplus",
        "hard_sigmoid",
        "hard_swish",
        "leaky_relu",
    ] {
        let is_compiled = Activation::EACH.iter().any(|each| each.word() == word);
        for kind in ["script.onnx", "dynamo.onnx", "pt"] {
            let file = format!("activations/{word}.{kind}");
            if !is_compiled {
                let faults = refusal(&fixture(&file));
                let is_named = faults.contains(&format!("this activation is not compiled: {word}"));
                assert!(is_named && faults.contains("leaky_relu"), "{file}: {faults}");
                continue;
            }
            let (_folder, new, policy) = policy_of(&file, &Options::default());
            let said = if word == "leaky_relu" {
                "hidden_activation = { leaky_relu = 0.2"
            } else {
                word
            };
            assert!(new.contract.contains(said), "{file}: {}", new.contract);
            assert_equals_library(&policy, &format!("activations/{word}"), of_library(word), false);
        }
    }
}

//! MAT, Keras and ONNX files against what their own runtimes answer: tests/fixtures/trainers/formats.py.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::disallowed_methods)]

mod common;

use std::time::{Duration, Instant};

use common::library::{assert_equals_library, fixture, policy_of, refusal};
use common::write;
use import::Options;
use policy::Activation;

// the longest that a file may keep a user waiting for a refusal
const AT_ONCE: Duration = Duration::from_millis(200);

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

/// Every prefix and every changed byte is read or refused, and soon.
#[test]
fn damaged_files_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    for name in [
        "flat.mat",
        "struct.mat",
        "cells.mat",
        "keras.onnx",
        "activations/silu.dynamo.onnx",
    ] {
        let whole = std::fs::read(fixture(name)).unwrap();
        let file = folder.path().join("damaged");
        let mut longest = Duration::ZERO;
        let mut read = |bytes: &[u8]| {
            write(&file, bytes);
            let begun = Instant::now();
            let new = import::new_policy(&file, &folder.path().join("policy.toml"), &Options::default());
            longest = longest.max(begun.elapsed());
            new.is_ok()
        };
        for cut in (0..whole.len() - 1).step_by(23) {
            assert!(!read(&whole[..cut]), "{name} cut off at {cut}");
        }
        for at in (0..whole.len()).step_by(5) {
            let mut damaged = whole.clone();
            damaged[at] ^= [0xff, 0x01, 0x80][at % 3];
            read(&damaged);
        }
        assert!(longest < AT_ONCE, "{name}: {longest:?}");
    }
}

/// A header of a MAT file, and elements.
fn mat(elements: &[&[u8]]) -> Vec<u8> {
    let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
    bytes.resize(124, b' ');
    bytes.extend(b"\0\x01IM");
    bytes.extend(elements.concat());
    bytes
}

fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let size = u32::try_from(data.len()).unwrap();
    let mut bytes = [kind.to_le_bytes(), size.to_le_bytes()].concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

fn matrix(class: u32, axes: &[i32], inner: &[u8]) -> Vec<u8> {
    let axes: Vec<u8> = axes.iter().flat_map(|size| size.to_le_bytes()).collect();
    let flags = [class.to_le_bytes(), [0; 4]].concat();
    element(
        14,
        &[element(6, &flags), element(5, &axes), element(1, b"p"), inner.to_vec()].concat(),
    )
}

#[test]
fn hostile_mat_files_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("hostile.mat");
    let mut deep = matrix(6, &[1, 1], &element(9, &[0; 8]));
    for _ in 0..2000 {
        deep = matrix(1, &[1, 1], &deep);
    }
    // 64 MiB of zeros in a few thousand bytes
    let zeros = miniz_oxide::deflate::compress_to_vec_zlib(&vec![0; 64 << 20], 6);
    for (name, elements, reason) in [
        ("deep", deep, "nested deeper"),
        (
            "a claim of axes",
            matrix(6, &[i32::MAX, i32::MAX], &element(9, &[0; 8])),
            "do not hold together",
        ),
        (
            "negative axes",
            matrix(6, &[-1, 2], &element(9, &[0; 8])),
            "do not hold together",
        ),
        ("a claim of cells", matrix(1, &[i32::MAX, 1], &[]), "more parts"),
        ("a bomb", element(15, &zeros), "hold more than"),
        ("a sparse matrix", matrix(5, &[2, 2], &[]), "sparse"),
        (
            "a complex matrix",
            matrix(6 | 0x800, &[1, 1], &element(9, &[0; 8])),
            "complex",
        ),
        (
            "not a number",
            matrix(6, &[1, 1], &element(9, &f64::NAN.to_le_bytes())),
            "not finite",
        ),
        ("text alone", matrix(4, &[1, 1], &element(4, b"a\0")), "no matrices"),
    ] {
        write(&file, &mat(&[&elements]));
        let begun = Instant::now();
        let faults = refusal(&file);
        assert!(begun.elapsed() < AT_ONCE, "{name}: {:?}", begun.elapsed());
        assert!(faults.contains(reason), "{name}: {faults}");
    }
    // of the objects of MATLAB only the name is in its place
    let opaque = [element(6, &[17, 0, 0, 0, 0, 0, 0, 0]), element(1, b"agent")].concat();
    write(&file, &mat(&[&element(14, &opaque)]));
    let faults = refusal(&file);
    assert!(
        faults.contains("`agent` is an object") && faults.contains("extractdata"),
        "{faults}"
    );
}

#[test]
fn a_huge_graph_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("huge.onnx");
    // a field of a length that the file does not have, and 2 million nodes that take nothing
    let claim = b"\x08\x08\x3a\xff\xff\xff\xff\x0f".to_vec();
    let nodes = b"\x0a\x00".repeat(2_000_000);
    let size = u32::try_from(nodes.len()).unwrap();
    let varint = |mut number: u32| {
        let mut bytes = Vec::new();
        while number >= 128 {
            bytes.push((number & 127) as u8 | 128);
            number >>= 7;
        }
        bytes.push(number as u8);
        bytes
    };
    let many = [&b"\x08\x08\x3a"[..], &varint(size), &nodes].concat();
    for bytes in [claim, many] {
        write(&file, &bytes);
        let begun = Instant::now();
        let faults = refusal(&file);
        assert!(begun.elapsed() < AT_ONCE, "{:?} {faults}", begun.elapsed());
    }
}

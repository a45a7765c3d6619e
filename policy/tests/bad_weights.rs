//! Faults of safetensors files, each with its tensor.

#![allow(clippy::disallowed_methods)]

mod common;
use common::*;
use safetensors::Dtype;

const FILE: &str = "weights.safetensors";

fn weights_fault(tensors: &[Tensor]) -> policy::Fault {
    Folder::new().tensors(tensors).fault()
}

fn file_fault(bytes: &[u8], expected: &[&str]) {
    assert_whole_file(&Folder::new().file(FILE, bytes).fault(), FILE, expected);
}

fn without(name: &str) -> Vec<Tensor> {
    network().into_iter().filter(|tensor| tensor.name != name).collect()
}

fn replaced(with: Tensor) -> Vec<Tensor> {
    network()
        .into_iter()
        .map(|tensor| if tensor.name == with.name { with.clone() } else { tensor })
        .collect()
}

#[test]
fn a_file_beyond_64_mib_is_refused_unread() {
    let folder = Folder::new();
    let file = std::fs::File::create(folder.path().join(FILE)).unwrap();
    file.set_len((64 << 20) + 1).unwrap();
    assert_says(&folder.fault(), &["too large", "67108865 bytes", "at most 67108864"]);
}

#[test]
fn more_than_64_tensors_are_refused() {
    let many: Vec<_> = (0..65).map(|i| tensor(&format!("t{i}.bias"), &[1])).collect();
    assert_whole_file(&weights_fault(&many), FILE, &["too many tensors", "65", "at most 64"]);
}

#[test]
fn a_missing_tensor_is_named() {
    assert_tensor(
        &weights_fault(&without("net.0.bias")),
        FILE,
        "net.0.bias",
        &["`net.0.bias` is missing", "bias = false"],
    );
    assert_tensor(
        &weights_fault(&without("net.2.weight")),
        FILE,
        "net.2.weight",
        &["`net.2.weight` is missing", "no weight beside it"],
    );
    let only_last: Vec<_> = network().into_iter().skip(2).collect();
    assert_tensor(
        &weights_fault(&only_last),
        FILE,
        "net.2.weight",
        &["shape [3, 4]", "shape [3, 2]", "takes 4 inputs", "2 features"],
    );
}

#[test]
fn an_extra_bias_is_refused() {
    let fault = Folder::new()
        .replace("hidden_activation", "bias = false\nhidden_activation")
        .faults();
    assert_tensor(
        &fault.faults.list[0],
        FILE,
        "net.0.bias",
        &["although the contract says `bias = false`"],
    );
}

#[test]
fn a_network_without_biases_gets_zeros() {
    let weights: Vec<_> = network().into_iter().filter(|t| t.name.ends_with("weight")).collect();
    let policy = Folder::new()
        .replace("hidden_activation", "bias = false\nhidden_activation")
        .tensors(&weights)
        .policy();
    assert!(
        policy
            .layers
            .iter()
            .all(|layer| layer.bias.iter().all(|b| b.to_bits() == 0))
    );
}

#[test]
fn a_transposed_tensor_is_recognised() {
    let fault = weights_fault(&replaced(tensor("net.2.weight", &[4, 3])));
    assert_tensor(
        &fault,
        FILE,
        "net.2.weight",
        &["shape [4, 3]", "shape [3, 4]", "this tensor alone is transposed"],
    );
    let fault = weights_fault(&replaced(tensor("net.0.weight", &[2, 4])));
    assert_tensor(
        &fault,
        FILE,
        "net.0.weight",
        &["shape [2, 4]", "shape [4, 2]", "this tensor alone is transposed"],
    );
}

#[test]
fn a_transposed_network_is_told_about_the_setting() {
    let tensors = [
        tensor("net.0.weight", &[2, 4]),
        tensor("net.0.bias", &[4]),
        tensor("net.2.weight", &[4, 3]),
        tensor("net.2.bias", &[3]),
    ];
    assert_tensor(
        &weights_fault(&tensors),
        FILE,
        "net.0.weight",
        &["the other way round", "transpose = true"],
    );
    let policy = Folder::new()
        .replace("hidden_activation", "transpose = true\nhidden_activation")
        .tensors(&tensors)
        .policy();
    let stored: Vec<f32> = tensors[0]
        .data
        .chunks(4)
        .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
        .collect();
    assert_eq!(policy.layers[0].weights[..2], [stored[0], stored[4]]);
}

#[test]
fn a_wrong_number_of_inputs_or_outputs_is_explained() {
    let fault = weights_fault(&[dense("net.0", 4, 3), dense("net.2", 3, 4)].concat());
    assert_tensor(
        &fault,
        FILE,
        "net.0.weight",
        &[
            "shape [4, 3]",
            "shape [4, 2]",
            "takes 3 inputs, the contract lists 2 features",
        ],
    );
    let fault = weights_fault(&[dense("net.0", 4, 2), dense("net.2", 1, 4)].concat());
    assert_tensor(
        &fault,
        FILE,
        "net.2.weight",
        &[
            "shape [1, 4]",
            "shape [3, 4]",
            "has 1 outputs, the contract lists 3 actions",
        ],
    );
    let fault = weights_fault(&[dense("net.0", 4, 2), dense("net.2", 3, 5)].concat());
    assert_tensor(&fault, FILE, "net.2.weight", &["shape [3, 5]", "shape [3, 4]"]);
    // the other way round the first layer takes 2 inputs, too, but then gives 4 to a layer that takes 5
    let fault = weights_fault(&[dense("net.0", 2, 4), dense("net.2", 3, 5)].concat());
    assert_tensor(&fault, FILE, "net.0.weight", &["shape [2, 4]", "shape [2, 2]"]);
    let fault = weights_fault(&replaced(tensor("net.2.bias", &[4])));
    assert_tensor(
        &fault,
        FILE,
        "net.2.bias",
        &["bias of layer `net.2`", "shape [4]", "shape [3]"],
    );
}

/// Two layers of one row are a row: one that stands alone before them is not what is explained.
#[test]
fn a_mismatch_in_the_longest_row_is_told() {
    let tensors = [dense("alone.0", 7, 9), dense("net.0", 4, 2), dense("net.2", 3, 5)].concat();
    let fault = weights_fault(&tensors);
    assert_tensor(&fault, "weights.safetensors", "net.2.weight", &["[3, 5]", "[3, 4]"]);
}

#[test]
fn a_convolution_is_refused() {
    let fault = weights_fault(&replaced(tensor("net.0.weight", &[4, 2, 1])));
    // its bias then stands alone
    assert_says(&fault, &["net.0.weight"]);
    let tensors = [tensor("net.0.weight", &[4, 2, 1]), tensor("net.2.weight", &[3, 4])];
    assert_tensor(
        &weights_fault(&tensors),
        FILE,
        "net.0.weight",
        &["shape [4, 2, 1]", "two axes: [out, in]"],
    );
}

#[test]
fn a_wrong_dtype_is_refused() {
    let fault = weights_fault(&replaced(raw_tensor("net.2.weight", Dtype::I8, &[3, 4], vec![1; 12])));
    assert_tensor(
        &fault,
        FILE,
        "net.2.weight",
        &["I8", "F32, F64, F16 or BF16", "quantised"],
    );
}

#[test]
fn half_and_double_weights_are_converted_and_noted() {
    let half: Vec<u8> = (0..12)
        .flat_map(|i| half::f16::from_f32(i as f32 * 0.25).to_le_bytes())
        .collect();
    let double: Vec<u8> = (0..8).flat_map(|i| (f64::from(i) * 0.1).to_le_bytes()).collect();
    let tensors = replaced(raw_tensor("net.2.weight", Dtype::F16, &[3, 4], half));
    let tensors: Vec<_> = tensors
        .into_iter()
        .map(|t| {
            if t.name == "net.0.weight" {
                raw_tensor(&t.name, Dtype::F64, &[4, 2], double.clone())
            } else {
                t
            }
        })
        .collect();
    let policy = Folder::new().tensors(&tensors).policy();
    assert_eq!(policy.layers[0].weights[3], (3.0f64 * 0.1) as f32);
    assert_eq!(policy.layers[1].weights[5], 1.25);
    let notes = policy.notes.join("\n");
    assert!(
        notes.contains("rounded to f32: net.0.weight") && notes.contains("without loss: net.2.weight"),
        "{notes}"
    );
    let huge = raw_tensor(
        "net.0.bias",
        Dtype::F64,
        &[4],
        [0.0, 0.0, 1e300, 0.0f64].iter().flat_map(|v| v.to_le_bytes()).collect(),
    );
    assert_tensor(
        &weights_fault(&replaced(huge)),
        FILE,
        "net.0.bias",
        &["too large for f32", "1e300 at index 2"],
    );
}

#[test]
fn weights_that_are_not_finite_are_refused_with_their_index() {
    let fault = weights_fault(&replaced(f32_tensor("net.0.bias", &[4], &[0.0, 1.0, f32::NAN, 0.0])));
    assert_tensor(&fault, FILE, "net.0.bias", &["nan at index 2", "diverged"]);
    let fault = weights_fault(&replaced(f32_tensor(
        "net.2.bias",
        &[3],
        &[f32::NEG_INFINITY, 1.0, 0.0],
    )));
    assert_tensor(&fault, FILE, "net.2.bias", &["not finite", "-inf at index 0"]);
}

#[test]
fn weights_that_could_overflow_are_refused() {
    let fault = weights_fault(&replaced(f32_tensor("net.2.bias", &[3], &[0.0, 3e38, 0.0])));
    assert_says(&fault, &["output 1 of layer `net.2` could leave the range of f32"]);
}

#[test]
fn duplicate_keys_in_the_header_are_refused() {
    let one = r#""net.0.bias":{"dtype":"F32","shape":[4],"data_offsets":[0,16]}"#;
    let bytes = with_header(&format!("{{{one},{one}}}"), &[0; 16]);
    assert_tensor(
        &Folder::new().file(FILE, &bytes).fault(),
        FILE,
        "net.0.bias",
        &["stands twice", "each key once"],
    );
    let inner = r#"{"w.bias":{"dtype":"F32","shape":[4],"shape":[4],"data_offsets":[0,16]}}"#;
    let fault = Folder::new().file(FILE, &with_header(inner, &[0; 16])).fault();
    assert_tensor(&fault, FILE, "w.bias", &["`shape` twice"]);
}

#[test]
fn scalars_and_empty_tensors_are_refused() {
    let fault = weights_fault(&[network(), vec![tensor("step", &[])]].concat());
    assert_tensor(&fault, FILE, "step", &["no elements or no shape", "shape []"]);
    let fault = weights_fault(&[network(), vec![tensor("none", &[0, 3])]].concat());
    assert_tensor(&fault, FILE, "none", &["shape [0, 3]"]);
    file_fault(&encode(&[]), &["holds no tensors"]);
}

#[test]
fn odd_tensor_names_are_refused() {
    for name in [
        "../net",
        "a\0b",
        "a\nb",
        "a*/b",
        "",
        "a b",
        "a//b",
        "é",
        &"x".repeat(129),
    ] {
        let fault = weights_fault(&[network(), vec![tensor(name, &[1])]].concat());
        assert_tensor(&fault, FILE, name, &["not safe to print", "without `..`"]);
        assert!(!fault.to_string().trim_end().contains('\0'));
    }
    // the leaves of a pytree of JAX: one answer, and what to do
    let leaves = ["[0][0]", "[0][1]", "[1][0]"].map(|name| tensor(name, &[1]));
    let fault = weights_fault(&[network(), leaves.to_vec()].concat());
    assert_tensor(&fault, FILE, "[0][0]", &["and 2 more", "l0.weight"]);
}

#[test]
fn files_of_other_kinds_get_a_hint_how_to_export() {
    file_fault(b"PK\x03\x04 and so on and on", &["zip archive", "policyc new"]);
    file_fault(b"\x80\x04\x95 and so on", &["pickle", "never opened", "save_file"]);
    // protocol 1 has no mark, so this is none
    file_fault(b"\x80\x01\x95 and so on", &["a header of", "bytes, more than"]);
    file_fault(b"\x89HDF\r\n\x1a\n and so on", &["HDF5"]);
    file_fault(
        b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n",
        &["git-lfs pointer", "git lfs pull"],
    );
    file_fault(b"\x08\x07\x12\x07pytorch\x1a\x052.0.0:\x80", &["ONNX", "policyc new"]);
}

#[test]
fn a_header_whose_length_begins_like_a_pickle_is_a_header() {
    // 0x280 bytes, and the file ends with them: there are no tensors
    let header = format!("{:<width$}", r#"{"__metadata__":{"a":"b"}}"#, width = 0x280);
    let fault = Folder::new().file(FILE, &with_header(&header, &[])).fault().to_string();
    assert!(!fault.contains("pickle"), "{fault}");
    // one byte less than it says: then it is none
    let cut = &with_header(&header, &[])[..0x280 + 7];
    file_fault(cut, &["pickle"]);
}

#[test]
fn malformed_files_say_what_is_wrong() {
    file_fault(b"", &["not a sound safetensors file", "0 bytes"]);
    file_fault(b"1234567", &["only 7 bytes"]);
    file_fault(&[0xff; 32], &["header of 18446744073709551615 bytes"]);
    let whole = encode(&network());
    file_fault(&[&whole[..], &[0]].concat(), &["not a sound"]);
    file_fault(&whole[..40], &["cut off", "copy or download"]);
    file_fault(&with_header("{not json", &[]), &["JSON"]);
    file_fault(
        &with_header(
            r#"{"w.bias":{"dtype":"F32","shape":[9],"data_offsets":[0,16]}}"#,
            &[0; 16],
        ),
        &["not a sound"],
    );
    file_fault(&[5u64.to_le_bytes().as_slice(), &[0xff; 5]].concat(), &["not UTF-8"]);
}

#[test]
fn a_file_that_ends_early_says_by_how_much() {
    let folder = Folder::new();
    let whole = std::fs::read(folder.path().join(FILE)).unwrap();
    let header = u64::from_le_bytes(*whole.first_chunk().unwrap()) as usize;
    let data = whole.len() - 8 - header;
    let mut folder = folder;
    for missing in [10, 1] {
        folder = folder.file(FILE, &whole[..whole.len() - missing]);
        let found = format!("{} bytes of data", data - missing);
        let expected = format!("{data} bytes of data, as the header says");
        assert_whole_file(
            &folder.fault(),
            FILE,
            &["cut off", &found, &expected, "copy or download"],
        );
    }
    // with the header at its end it is a file all the same
    assert_whole_file(
        &folder.file(FILE, &with_header("{}", &[])).fault(),
        FILE,
        &["holds no tensors"],
    );
}

#[test]
fn weights_in_the_place_of_the_contract_are_told_apart() {
    let folder = Folder::new();
    let faults = policy::load(&folder.path().join(FILE)).unwrap_err();
    assert_whole_file(
        &faults.faults.list[0],
        FILE,
        &["a file of weights, not a contract", "policyc new"],
    );
    std::fs::write(folder.path().join("model.zip"), b"PK\x03\x04....").unwrap();
    let faults = policy::load(&folder.path().join("model.zip")).unwrap_err();
    assert_whole_file(&faults.faults.list[0], "model.zip", &["zip archive"]);
}

#[test]
fn golden_vectors_are_no_second_fault_where_the_network_does_not_fit() {
    let obs = tensor("obs", &[2, 2]);
    let folder = Folder::new().tensors(&replaced(tensor("net.2.weight", &[5, 4])));
    let list = folder.golden(&[obs, tensor("q", &[2, 5])]).faults().faults.list;
    assert!(
        !list.is_empty() && list.iter().all(|fault| fault.file.ends_with(FILE)),
        "{list:?}"
    );
}

//! A small valid policy in a temporary folder, and ways to spoil it.
#![allow(dead_code)] // each test file uses its part
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::disallowed_methods)] // helpers of tests fail as tests do

use std::path::PathBuf;

use policy::{Fault, Faults, Place, Policy};
use random::{Random, SplitMix};
use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize};

/// Two features, one hidden layer of four, three actions.
pub const CONTRACT: &str = r#"# a comment
name = "buck"
sample_period = 1e-4

[parameters]
v_ref = 100.0

[[signal]]
name = "v_out"
unit = "V"
range = [0.0, 250.0]

[[signal]]
name = "i_out"
unit = "A"
range = [-1.0, 40.0]

[[feature]]
name = "e"
source = "v_ref - v_out"
scale = 0.2
clip = [-20.0, 20.0]

[[feature]]
name = "e_del"
source = "v_ref - v_out"
filters = [{ delay = 1 }]

[network]
weights = "weights.safetensors"
hidden_activation = "relu"

[actions]
duties = [0.44, 0.50, 0.56]

[mapping]
file = "drm.toml"
load_current = "i_out"

[limits]
duty = [0.40, 0.60]
initial_duty = 0.5

[fallback]
duty = 0.0
hold = 3
"#;

/// Identity mapping.
pub const MAPPING: &str = r#"a = 1.0
b = 0.0
c = 0.0

[valid]
i_out = [0.0, 12.0]
d_sim = [0.40, 0.60]

[adjust]
a = [0.8, 1.25]
"#;

/// A tensor to be written.
#[derive(Clone)]
pub struct Tensor {
    pub name: String,
    pub dtype: Dtype,
    pub shape: Vec<usize>,
    pub data: Vec<u8>,
}

/// f32 tensor with small values that differ from each other.
pub fn tensor(name: &str, shape: &[usize]) -> Tensor {
    let count: usize = shape.iter().product();
    f32_tensor(
        name,
        shape,
        &(0..count).map(|i| (i as f32 * 0.37).sin()).collect::<Vec<_>>(),
    )
}

pub fn f32_tensor(name: &str, shape: &[usize], values: &[f32]) -> Tensor {
    let data = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    Tensor {
        name: name.to_owned(),
        dtype: Dtype::F32,
        shape: shape.to_vec(),
        data,
    }
}

pub fn raw_tensor(name: &str, dtype: Dtype, shape: &[usize], data: Vec<u8>) -> Tensor {
    Tensor {
        name: name.to_owned(),
        dtype,
        shape: shape.to_vec(),
        data,
    }
}

/// `<stem>.weight` [out, in] and `<stem>.bias` [out].
pub fn dense(stem: &str, outputs: usize, inputs: usize) -> Vec<Tensor> {
    vec![
        tensor(&format!("{stem}.weight"), &[outputs, inputs]),
        tensor(&format!("{stem}.bias"), &[outputs]),
    ]
}

pub fn network() -> Vec<Tensor> {
    [dense("net.0", 4, 2), dense("net.2", 3, 4)].concat()
}

pub fn encode(tensors: &[Tensor]) -> Vec<u8> {
    let views = tensors.iter().map(|t| {
        (
            t.name.as_str(),
            TensorView::new(t.dtype, t.shape.clone(), &t.data).unwrap(),
        )
    });
    serialize(views.collect::<Vec<_>>(), None).unwrap()
}

/// A safetensors file with this header text, whatever it says.
pub fn with_header(header: &str, data: &[u8]) -> Vec<u8> {
    [&(header.len() as u64).to_le_bytes(), header.as_bytes(), data].concat()
}

/// A temporary policy folder, removed at the end.
pub struct Folder {
    dir: tempfile::TempDir,
    contract: String,
}

impl Folder {
    pub fn new() -> Self {
        let folder = Folder {
            dir: tempfile::tempdir().unwrap(),
            contract: String::new(),
        }
        .contract(CONTRACT);
        folder.file("drm.toml", MAPPING.as_bytes()).tensors(&network())
    }

    pub fn path(&self) -> PathBuf {
        self.dir.path().to_path_buf()
    }

    pub fn file(self, name: &str, bytes: &[u8]) -> Self {
        std::fs::write(self.dir.path().join(name), bytes).unwrap();
        self
    }

    pub fn contract(mut self, text: &str) -> Self {
        text.clone_into(&mut self.contract);
        self.file("policy.toml", text.as_bytes())
    }

    /// Replaces the only occurrence of `from` in the contract.
    pub fn replace(self, from: &str, to: &str) -> Self {
        assert_eq!(
            self.contract.matches(from).count(),
            1,
            "`{from}` must stand once in the contract"
        );
        let text = self.contract.replace(from, to);
        self.contract(&text)
    }

    pub fn tensors(self, tensors: &[Tensor]) -> Self {
        self.file("weights.safetensors", &encode(tensors))
    }

    /// Golden vectors in the file the contract then names.
    pub fn golden(self, tensors: &[Tensor]) -> Self {
        let folder = self.file("golden.safetensors", &encode(tensors));
        folder.replace(
            "hidden_activation",
            "golden = \"golden.safetensors\"\nhidden_activation",
        )
    }

    pub fn load(&self) -> Result<Policy, Faults> {
        policy::load(&self.dir.path().join("policy.toml"))
    }

    pub fn policy(&self) -> Policy {
        self.load().unwrap_or_else(|faults| panic!("{faults}"))
    }

    pub fn faults(&self) -> Faults {
        match self.load() {
            Ok(policy) => panic!("accepted: {:?}", policy.notes),
            Err(faults) => faults,
        }
    }

    /// The one fault; more than one would be noise.
    pub fn fault(&self) -> Fault {
        let faults = self.faults();
        assert_eq!(faults.faults.list.len(), 1, "{faults}");
        faults.faults.list[0].clone()
    }
}

/// Everything a fault says.
pub fn words(fault: &Fault) -> String {
    let parts = [
        Some(&fault.problem),
        fault.found.as_ref(),
        fault.expected.as_ref(),
        fault.hint.as_ref(),
    ];
    parts.into_iter().flatten().cloned().collect::<Vec<_>>().join(" | ")
}

#[track_caller]
pub fn assert_says(fault: &Fault, expected: &[&str]) {
    for word in expected {
        assert!(words(fault).contains(word), "`{word}` is not in: {}", words(fault));
    }
}

#[track_caller]
pub fn assert_file(fault: &Fault, file: &str) {
    assert_eq!(fault.file.file_name().unwrap().to_str().unwrap(), file, "{fault}");
}

#[track_caller]
pub fn assert_tensor(fault: &Fault, file: &str, tensor: &str, expected: &[&str]) {
    assert_file(fault, file);
    assert_eq!(fault.place, Place::Tensor(tensor.to_owned()), "{fault}");
    assert_says(fault, expected);
}

#[track_caller]
pub fn assert_whole_file(fault: &Fault, file: &str, expected: &[&str]) {
    assert_file(fault, file);
    assert_eq!(fault.place, Place::File, "{fault}");
    assert_says(fault, expected);
}

/// Line and column of the mark `¦` and the text without it.
pub fn unmark(text: &str) -> (String, (usize, usize)) {
    let at = text.find('¦').expect("a mark");
    let line = text[..at].matches('\n').count() + 1;
    let column = text[..at].rsplit('\n').next().unwrap().chars().count() + 1;
    (text.replacen('¦', "", 1), (line, column))
}

/// Spoils the contract: `to` replaces `from` and marks with `¦` where the only fault must be.
#[track_caller]
pub fn contract_fault(from: &str, to: &str, expected: &[&str]) -> Fault {
    assert_eq!(CONTRACT.matches(from).count(), 1, "`{from}` must stand once");
    marked_fault(&CONTRACT.replace(from, to), expected)
}

#[track_caller]
pub fn marked_fault(contract: &str, expected: &[&str]) -> Fault {
    let (text, place) = unmark(contract);
    let fault = Folder::new().contract(&text).fault();
    assert_file(&fault, "policy.toml");
    assert_eq!(fault.line_column(), Some(place), "{fault}");
    assert_says(&fault, expected);
    fault
}

/// Spoils the mapping in the same way.
#[track_caller]
pub fn mapping_fault(from: &str, to: &str, expected: &[&str]) -> Fault {
    assert_eq!(MAPPING.matches(from).count(), 1, "`{from}` must stand once");
    let (text, place) = unmark(&MAPPING.replace(from, to));
    let fault = Folder::new().file("drm.toml", text.as_bytes()).fault();
    assert_file(&fault, "drm.toml");
    assert_eq!(fault.line_column(), Some(place), "{fault}");
    assert_says(&fault, expected);
    fault
}

/// Draws that suit contracts.
pub struct Draws(pub SplitMix);

impl Draws {
    pub fn new(seed: u64) -> Self {
        Self(SplitMix::new(seed))
    }

    pub fn next(&mut self) -> u64 {
        self.0.bits()
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// Within `[low, high]`, the ends included often.
    pub fn within(&mut self, low: f32, high: f32) -> f32 {
        match self.below(6) {
            0 => low,
            1 => high,
            _ => (low + (high - low) * (self.next() >> 40) as f32 / (1u64 << 24) as f32).clamp(low, high),
        }
    }
}

/// The contract that `new` writes beside the weights.
pub fn scaffold(weights: &std::path::Path) -> Result<String, policy::Faults> {
    policy::new_contract(weights, &weights.with_file_name("policy.toml"))
}

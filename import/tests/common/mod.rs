//! Files of weights and the policies that come of them.
#![allow(dead_code, reason = "each test uses its own part")]

pub mod library;

use std::collections::BTreeMap;
use std::path::PathBuf;

use random::{Random, SplitMix};
use safetensors::Dtype;
use safetensors::tensor::TensorView;

pub fn named(name: &str, shape: &[usize]) -> (String, Vec<usize>) {
    (name.to_owned(), shape.to_vec())
}

pub fn dense(stem: &str, outputs: usize, inputs: usize) -> Vec<(String, Vec<usize>)> {
    vec![
        named(&format!("{stem}.weight"), &[outputs, inputs]),
        named(&format!("{stem}.bias"), &[outputs]),
    ]
}

/// A folder with a file of drawn weights.
pub struct Saved {
    folder: tempfile::TempDir,
    tensors: BTreeMap<String, (Vec<usize>, Vec<f32>)>,
}

impl Saved {
    pub fn new(tensors: &[(String, Vec<usize>)]) -> Self {
        let mut draws = SplitMix::new(5);
        // within (0, 1], for some are variances
        let mut draw = |count: usize| {
            (0..count)
                .map(|_| ((draws.bits() >> 40) as f32 + 1.0) / 16_777_216.0)
                .collect()
        };
        let tensors: BTreeMap<_, _> = tensors
            .iter()
            .map(|(name, shape)| (name.clone(), (shape.clone(), draw(shape.iter().product()))))
            .collect();
        let bytes: Vec<(String, Vec<usize>, Vec<u8>)> = tensors
            .iter()
            .map(|(name, (shape, values)): (_, &(Vec<usize>, Vec<f32>))| {
                (
                    name.clone(),
                    shape.clone(),
                    values.iter().flat_map(|v| v.to_le_bytes()).collect(),
                )
            })
            .collect();
        let views = bytes
            .iter()
            .map(|(name, shape, bytes)| (name, TensorView::new(Dtype::F32, shape.clone(), bytes).unwrap()));
        let folder = tempfile::tempdir().unwrap();
        let saved = safetensors::serialize(views, None).unwrap();
        write(&folder.path().join("saved.safetensors"), &saved);
        Saved { folder, tensors }
    }

    pub fn weights(&self) -> PathBuf {
        self.folder.path().join("saved.safetensors")
    }

    pub fn contract(&self) -> PathBuf {
        self.folder.path().join("policy.toml")
    }

    pub fn values(&self, name: &str) -> Vec<f32> {
        self.tensors[name].1.clone()
    }

    /// `W x + b` of a torch layer as saved.
    pub fn apply(&self, stem: &str, x: &[f64]) -> Vec<f64> {
        let (weight, bias) = (
            self.values(&format!("{stem}.weight")),
            self.values(&format!("{stem}.bias")),
        );
        let row = |o: usize| {
            weight[o * x.len()..(o + 1) * x.len()]
                .iter()
                .zip(x)
                .map(|(w, x)| f64::from(*w) * x)
        };
        (0..bias.len())
            .map(|o| row(o).sum::<f64>() + f64::from(bias[o]))
            .collect()
    }

    /// The policy of a new contract, every TODO filled in.
    pub fn filled(&self, new: &import::NewPolicy) -> policy::Policy {
        filled(self.folder.path(), new)
    }

    /// Q values of a checked policy with relu between, by the plain product.
    pub fn run(&self, policy: &policy::Policy, x: &[f64]) -> Vec<f64> {
        run(policy, x, |v| v.max(0.0))
    }

    /// Whether `layer` holds the tensors of `stem`, in whichever order they are stored.
    pub fn is(&self, layer: &policy::Layer, stem: &str) -> bool {
        let find = |leaves: &[&str]| {
            let names = leaves.iter().flat_map(|leaf| {
                [
                    format!("{stem}.{leaf}"),
                    format!("{stem}/{leaf}"),
                    stem.replace('W', leaf),
                ]
            });
            names.into_iter().find_map(|name| self.tensors.get(&name))
        };
        let (shape, values) = find(&["weight", "weight_mu", "mu_W", "kernel", "vars/0", "Weights", "W"]).unwrap();
        let bias = find(&["bias", "bias_mu", "mu_bias", "vars/1", "Bias", "b"]).unwrap();
        // of a mean and its deviation the mean alone is read
        let values = &values[..layer.weights.len().min(values.len())];
        let same = *values == layer.weights;
        let flipped = |o: usize| values.iter().skip(o).step_by(shape[1]).copied();
        let is_flipped =
            || shape[0] == layer.inputs && (0..layer.outputs).flat_map(flipped).collect::<Vec<_>>() == layer.weights;
        (same || is_flipped()) && bias.1[..layer.bias.len().min(bias.1.len())] == layer.bias
    }
}

pub fn write(path: &std::path::Path, bytes: &[u8]) {
    std::fs::write(path, bytes).unwrap();
}

/// Writes a new contract and what lies beside it, fills in every TODO, and checks it.
pub fn filled(folder: &std::path::Path, new: &import::NewPolicy) -> policy::Policy {
    for (name, bytes) in &new.beside {
        write(&folder.join(name), bytes);
    }
    let mut text = new
        .contract
        .replacen("name = \"TODO\"", "name = \"v_out\"", 1)
        .replace("range = [\"TODO\", \"TODO\"]", "range = [-1e4, 1e4]")
        .replace("source = \"TODO\"", "source = \"v_out\"")
        .replace("unit = \"TODO\"", "unit = \"V\"")
        .replace("hidden_activation = \"TODO\"", "hidden_activation = \"relu\"")
        .replace("sample_period = \"TODO\"", "sample_period = 1e-4")
        .replace("[\"TODO\", \"TODO\"]", "[0.25, 0.75]")
        .replace("squash = \"TODO\"", "squash = \"tanh\"")
        .replace("hold = \"TODO\"", "hold = 2");
    for feature in 0.. {
        let next = text.replacen("name = \"TODO\"", &format!("name = \"f{feature}\""), 1);
        if next == text {
            break;
        }
        text = next;
    }
    write(&folder.join("policy.toml"), text.replace("\"TODO\"", "0.5").as_bytes());
    let options = policy::ReadOptions {
        several_outputs: true,
        ..policy::ReadOptions::default()
    };
    policy::load_with(&folder.join("policy.toml"), &options).unwrap_or_else(|faults| panic!("{text}\n{faults}"))
}

/// Outputs of a checked policy in f64, by the plain product.
pub fn run(policy: &policy::Policy, x: &[f64], activation: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut values = x.to_vec();
    for (index, layer) in policy.layers.iter().enumerate() {
        let row = |o: usize| layer.weights[o * layer.inputs..(o + 1) * layer.inputs].iter();
        let sum =
            |o: usize| row(o).zip(&values).map(|(w, x)| f64::from(*w) * x).sum::<f64>() + f64::from(layer.bias[o]);
        let next: Vec<f64> = (0..layer.outputs).map(sum).collect();
        let last = index + 1 == policy.layers.len();
        values = if last {
            next
        } else {
            next.into_iter().map(&activation).collect()
        };
    }
    values
}

//! Policies for tests: written to a temporary folder and loaded like a user's.

#![allow(clippy::unwrap_used, clippy::panic, clippy::disallowed_methods)]

use std::fs;
use std::path::Path;

use policy::{Golden, Policy};
use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize_to_file};

/// Dense layer: weights row-major `[outputs][inputs]`, bias `[outputs]`.
pub struct Dense<'a> {
    pub inputs: usize,
    pub outputs: usize,
    pub weights: &'a [f32],
    pub bias: &'a [f32],
}

/// Loads a contract with the weights `layers` in `weights.safetensors` and more files beside it.
pub fn load(contract: &str, files: &[(&str, &str)], layers: &[Dense<'_>]) -> Policy {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("policy.toml"), contract).unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    write_weights(&folder.path().join("weights.safetensors"), layers);
    policy::load(&folder.path().join("policy.toml")).unwrap_or_else(|faults| panic!("{faults:#?}"))
}

fn write_weights(path: &Path, layers: &[Dense<'_>]) {
    let bytes = |values: &[f32]| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let data: Vec<(String, Vec<usize>, Vec<u8>)> = layers
        .iter()
        .enumerate()
        .flat_map(|(n, layer)| {
            let n = 2 * n;
            [
                (
                    format!("q_net.{n}.weight"),
                    vec![layer.outputs, layer.inputs],
                    bytes(layer.weights),
                ),
                (format!("q_net.{n}.bias"), vec![layer.outputs], bytes(layer.bias)),
            ]
        })
        .collect();
    let views: Vec<(&str, TensorView<'_>)> = data
        .iter()
        .map(|(name, shape, data)| (name.as_str(), TensorView::new(Dtype::F32, shape.clone(), data).unwrap()))
        .collect();
    serialize_to_file(views, None, path).unwrap();
}

/// Contract of a controller that reads `u` (0..10) and `i` (-5..5) and takes action 1 (duty 0.75) if the observation
/// is above 5, action 0 (duty 0.25) otherwise. `feature` are keys of the only feature; `rest` is the text from
/// `[limits]` on.
pub fn threshold(feature: &str, rest: &str, files: &[(&str, &str)]) -> Policy {
    let contract = format!(
        r#"
name = "threshold"
sample_period = 0.25

[[signal]]
name = "u"
unit = "V"
range = [0.0, 10.0]

[[signal]]
name = "i"
unit = "A"
range = [-5.0, 5.0]

[[feature]]
name = "f"
{feature}

[network]
weights = "weights.safetensors"

[actions]
duties = [0.25, 0.75]

{rest}
"#
    );
    load(
        &contract,
        files,
        &[Dense {
            inputs: 1,
            outputs: 2,
            weights: &[0.0, 1.0],
            bias: &[5.0, 0.0],
        }],
    )
}

/// Limits and fallback without anything special.
pub const PLAIN: &str = r#"
[limits]
duty = [0.125, 0.875]
initial_duty = 0.5

[fallback]
duty = 0.0625
hold = 2
"#;

/// So many golden vectors with these observations and no answer yet; the tolerance is that of a contract.
#[allow(dead_code)] // each file of tests uses its part
pub fn vectors(count: usize, observations: &[f32]) -> Golden {
    Golden {
        count,
        outside: 0,
        observations: observations.to_vec(),
        q_values: Vec::new(),
        action_indices: Vec::new(),
        duties: Vec::new(),
        law: Vec::new(),
        outputs: Vec::new(),
        tolerance: 1e-4,
        decisions: None,
        duty_error: None,
    }
}

/// y = x, clipped to 0.25 and 0.75: the head spans half of the duty.
#[allow(dead_code)] // each file of tests uses its part
pub fn actor() -> Policy {
    let contract = format!(
        "name = \"actor\"\nsample_period = 0.25\n[[signal]]\nname = \"u\"\nrange = [0.0, 1.0]\n[[feature]]\nname = \"x\"\n\
         source = \"u\"\n[network]\nweights = \"weights.safetensors\"\n[actions]\ncontinuous = {{ clip = [0.25, 0.75] }}\n{PLAIN}"
    );
    let network = Dense {
        inputs: 1,
        outputs: 1,
        weights: &[1.0],
        bias: &[0.0],
    };
    load(&contract, &[], &[network])
}

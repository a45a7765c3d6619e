//! Tensor names to dense layers and batch norms, by the conventions of the libraries.

use std::collections::BTreeMap;

use policy::NamedTensor;
use toml_input::Message;

use super::{Known, Refusal};
use crate::network::Layer;

/// A batch norm in inference: `y = gamma (x - mean) / sqrt(var + epsilon) + beta`.
#[derive(Debug)]
pub(crate) struct Norm {
    pub stem: String,
    pub gamma: Vec<f64>,
    pub beta: Vec<f64>,
    pub mean: Vec<f64>,
    pub var: Vec<f64>,
    pub epsilon: f64,
}

/// The layers of a file without those of target networks, and what was seen on the way.
#[derive(Debug, Default)]
pub(crate) struct Parsed {
    pub layers: Vec<Layer>,
    /// Name, inputs and outputs of every dense layer of the file.
    pub all: Vec<(String, usize, usize)>,
    pub norms: Vec<Norm>,
    /// Tensors of floats without a part in either.
    pub strangers: Vec<String>,
    /// Whether the contract's own reader would read the same layers.
    pub plain: bool,
    pub choice_only: bool,
    pub said: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    /// `[out, in]`, as torch and MATLAB store it.
    Weight,
    /// `[in, out]`, as Keras and Flax store it.
    Kernel,
    Bias,
    /// Of a noisy layer: what is 0 in evaluation.
    Noise,
    Mean,
    Variance,
    Gamma,
    Beta,
}

/// The dense layers that torch names, in the order of the file, without any inference.
pub(crate) fn only_dense(tensors: &[NamedTensor]) -> Vec<Layer> {
    let find = |name: String| tensors.iter().find(|tensor| tensor.name == name);
    let layer = |tensor: &NamedTensor| {
        let stem = tensor.name.strip_suffix(".weight")?;
        let bias = find(format!("{stem}.bias"))?;
        dense(stem, tensor, Some(bias), false).ok()
    };
    tensors.iter().filter_map(layer).collect()
}

/// The parts of a tensor's name.
pub(crate) fn parts(name: &str) -> impl DoubleEndedIterator<Item = &str> {
    name.strip_suffix(":0").unwrap_or(name).split(['.', '/'])
}

/// Whether the path names a target network, which training keeps beside the one in use.
pub(crate) fn is_target(name: &str) -> bool {
    is_plain_target(name) || parts(name).any(|part| part.starts_with("_target_") || part.ends_with("_old"))
}

/// Whether the contract's own reader knows it for a target network, too.
fn is_plain_target(name: &str) -> bool {
    parts(name).any(|part| part == "target" || part.starts_with("target_") || part.ends_with("_target"))
}

/// What no output depends on: RLlib keeps the bound of a deviation beside every head, also where there is no deviation,
pub(crate) fn is_unused(name: &str) -> bool {
    // and torch counts the batches of a norm
    matches!(
        parts(name).next_back(),
        Some("log_std_clip_param_const" | "num_batches_tracked")
    )
}

/// Layer, role, and whether the contract's own reader knows the name.
fn role(name: &str, rank: usize) -> Option<(String, Role, bool)> {
    let name = name.strip_suffix(":0").unwrap_or(name);
    let Some((stem, leaf)) = name.rsplit_once(['.', '/']) else {
        return numbered(name).map(|(stem, role)| (stem, role, false));
    };
    let (role, known) = match leaf {
        "weight" => (Role::Weight, true),
        "kernel" => (Role::Kernel, true),
        "bias" => (Role::Bias, true),
        "weight_mu" | "mu_W" | "Weights" | "W" | "w" => (Role::Weight, false),
        "bias_mu" | "mu_bias" | "Bias" | "b" => (Role::Bias, false),
        "weight_sigma" | "bias_sigma" | "sigma_W" | "sigma_bias" => (Role::Noise, false),
        "weight_epsilon" | "bias_epsilon" | "eps_p" | "eps_q" => (Role::Noise, false),
        "running_mean" | "moving_mean" => (Role::Mean, false),
        "running_var" | "moving_variance" => (Role::Variance, false),
        "gamma" => (Role::Gamma, false),
        "beta" => (Role::Beta, false),
        // Keras 3 numbers the variables of a layer
        "0" | "1" => {
            let stem = stem.strip_suffix("/vars").or_else(|| stem.strip_suffix(".vars"))?;
            let role = if leaf == "0" && rank == 2 {
                Role::Kernel
            } else {
                Role::Bias
            };
            return Some((stem.to_owned(), role, false));
        }
        // a struct of MATLAB
        _ => {
            let (layer, role) = numbered(leaf)?;
            return Some((format!("{stem}.{layer}"), role, false));
        }
    };
    (!stem.is_empty()).then(|| (stem.to_owned(), role, known))
}

/// MATLAB's `W1` and `b1`.
fn numbered(name: &str) -> Option<(String, Role)> {
    let (letter, number) = name.split_at_checked(1)?;
    let number: u32 = number.trim_start_matches('_').parse().ok()?;
    let role = match letter {
        "W" | "w" => Role::Weight,
        "b" | "B" => Role::Bias,
        _ => return None,
    };
    Some((format!("layer_{number}"), role))
}

/// What belongs to one stem.
#[derive(Default)]
struct Group<'a> {
    matrix: Option<(&'a NamedTensor, Role)>,
    vectors: Vec<(&'a NamedTensor, Role)>,
    plain: bool,
}

/// Sorts the tensors into layers.
pub(crate) fn parse(tensors: &[&NamedTensor], known: &Known) -> Result<Parsed, Refusal> {
    let own: Vec<&NamedTensor> = tensors
        .iter()
        .filter(|tensor| !is_target(&tensor.name))
        .copied()
        .collect();
    let targets_only = own.is_empty();
    let used = if targets_only { tensors.to_vec() } else { own };
    let mut parsed = Parsed {
        plain: !tensors
            .iter()
            .any(|tensor| is_target(&tensor.name) && !is_plain_target(&tensor.name)),
        ..Parsed::default()
    };
    let mut groups: BTreeMap<String, Group<'_>> = BTreeMap::new();
    let mut noise = false;
    for tensor in used {
        // counters, such as those of a batch norm
        if tensor.values.is_none() {
            continue;
        }
        let Some((stem, role, plain)) = role(&tensor.name, tensor.shape.len()) else {
            parsed.strangers.push(tensor.name.clone());
            continue;
        };
        if role == Role::Noise {
            noise = true;
            parsed.plain = false;
            continue;
        }
        let group = groups.entry(stem).or_insert_with(|| Group {
            plain: true,
            ..Group::default()
        });
        group.plain &= plain;
        match (role, tensor.shape.len()) {
            (Role::Weight | Role::Kernel, 2) => group.matrix = Some((tensor, role)),
            _ => group.vectors.push((tensor, role)),
        }
    }
    if noise {
        let text = "noisy layers (NoisyNet): their means alone are read, as in evaluation";
        parsed.said.push(text.to_owned());
    }
    let flipped = flipped(&groups)?;
    if let Some(true) = flipped {
        parsed.plain = false;
        parsed
            .said
            .push("matrices are stored the other way round, by the lengths of their biases: transposed".to_owned());
    }
    for (stem, group) in groups {
        take(&mut parsed, &stem, group, flipped.unwrap_or(false), known)?;
    }
    if !parsed.strangers.is_empty() {
        parsed.plain = false;
    }
    let biased = parsed.layers.iter().filter(|layer| !layer.bias.is_empty()).count();
    if biased != parsed.layers.len() {
        parsed.plain &= biased == 0;
        for layer in &mut parsed.layers {
            layer.bias.resize(layer.outputs, 0.0);
        }
    }
    Ok(parsed)
}

/// Puts one group into `parsed`.
fn take(parsed: &mut Parsed, stem: &str, group: Group<'_>, flipped: bool, known: &Known) -> Result<(), Refusal> {
    let is = |role: Role| {
        group
            .vectors
            .iter()
            .find(|(_, found)| *found == role)
            .map(|(tensor, _)| *tensor)
    };
    if let Some((tensor, role)) = group.matrix {
        let layer = dense(stem, tensor, is(Role::Bias), (role == Role::Kernel) != flipped)?;
        parsed.plain &=
            group.plain && group.vectors.len() <= 1 && group.vectors.iter().all(|(v, _)| v.shape.len() == 1);
        parsed.all.push((layer.name.clone(), layer.inputs, layer.outputs));
        parsed.layers.push(layer);
        return Ok(());
    }
    let (Some(mean), Some(variance)) = (is(Role::Mean), is(Role::Variance)) else {
        // a policy's own rules explain a bias without its weight
        parsed
            .strangers
            .extend(group.vectors.iter().map(|(tensor, _)| tensor.name.clone()));
        return Ok(());
    };
    parsed.plain = false;
    let keras = is(Role::Gamma).is_some() || is(Role::Beta).is_some();
    let width = mean.shape.iter().product();
    let values = |tensor: Option<&NamedTensor>, otherwise: f64| {
        let given = tensor.and_then(|tensor| tensor.values.clone());
        given.unwrap_or_else(|| vec![otherwise; width])
    };
    let said = known
        .epsilons
        .iter()
        .find(|(name, _)| name == stem)
        .map(|(_, epsilon)| *epsilon);
    // torch.nn.BatchNorm1d and keras.layers.BatchNormalization: their defaults
    let epsilon = said.unwrap_or(if keras { 1e-3 } else { 1e-5 });
    if said.is_none() {
        parsed.said.push(format!(
            "batch norm `{stem}`: epsilon {epsilon:e}, the library's default, for the file does not hold it"
        ));
    }
    let norm = Norm {
        stem: stem.to_owned(),
        gamma: values(is(Role::Weight).or(is(Role::Gamma)), 1.0),
        beta: values(is(Role::Bias).or(is(Role::Beta)), 0.0),
        mean: values(Some(mean), 0.0),
        var: values(Some(variance), 1.0),
        epsilon,
    };
    let lengths = [&norm.gamma, &norm.beta, &norm.mean, &norm.var].map(Vec::len);
    if lengths.iter().any(|length| *length != width) || norm.var.iter().any(|var| *var + epsilon <= 0.0) {
        let message = Message::new("this batch norm does not hold together")
            .found(format!("lengths {lengths:?} of scale, shift, mean and variance"))
            .expected("four of the same length, and no negative variance");
        return Err(Refusal::of(&mean.name, message));
    }
    parsed.norms.push(norm);
    Ok(())
}

/// Whether matrices are stored the other way round than their names say, by the lengths of the biases beside them;
/// `None` where no bias tells.
fn flipped(groups: &BTreeMap<String, Group<'_>>) -> Result<Option<bool>, Refusal> {
    let mut found: Option<bool> = None;
    for group in groups.values() {
        let bias = group.vectors.iter().find(|(_, role)| *role == Role::Bias);
        let (Some((matrix, role)), Some((bias, _))) = (group.matrix, bias) else {
            continue;
        };
        let [rows, columns] = matrix.shape[..] else { continue };
        let length: usize = bias.shape.iter().product();
        let (outputs, inputs) = if role == Role::Kernel {
            (columns, rows)
        } else {
            (rows, columns)
        };
        if outputs == inputs {
            continue;
        }
        let this = match length {
            n if n == outputs => false,
            n if n == inputs => true,
            _ => {
                let message = Message::new("the bias does not fit the weight")
                    .found(format!("{length} values for shape {:?}", matrix.shape))
                    .expected("one for each output");
                return Err(Refusal::of(&bias.name, message));
            }
        };
        if found.is_some_and(|before| before != this) {
            let message = Message::new("some matrices are stored as [outputs, inputs], others as [inputs, outputs]")
                .found(format!("shape {:?} with a bias of {length}", matrix.shape))
                .expected("all the same way round")
                .hint("this tensor differs from those before it: save it again");
            return Err(Refusal::of(&matrix.name, message));
        }
        found = Some(this);
    }
    Ok(found)
}

/// A layer without bias has an empty one until all are known.
fn dense(stem: &str, matrix: &NamedTensor, bias: Option<&NamedTensor>, transposed: bool) -> Result<Layer, Refusal> {
    let [rows, columns] = matrix.shape[..] else {
        return Err(super::refused::stranger(&matrix.name));
    };
    let values = matrix.values.as_deref().unwrap_or_default();
    let (inputs, outputs, weights) = if transposed {
        let column = |output: usize| values.iter().skip(output).step_by(columns).copied();
        (rows, columns, (0..columns).flat_map(column).collect())
    } else {
        (columns, rows, values.to_vec())
    };
    let bias = bias.and_then(|bias| bias.values.clone()).unwrap_or_default();
    if !bias.is_empty() && bias.len() != outputs {
        let message = Message::new("the bias does not fit the weight")
            .found(format!("{} values", bias.len()))
            .expected(format!("{outputs}, one for each output"));
        return Err(Refusal::of(&matrix.name, message));
    }
    Ok(Layer {
        name: stem.to_owned(),
        inputs,
        outputs,
        weights,
        bias,
    })
}

//! Weights from a safetensors file: read, checked, and put in order.

mod catalogue;
pub(crate) mod chain;
mod explain;
pub(crate) mod golden;
mod golden_file;
pub(crate) mod header;
pub(crate) mod layers;
pub(crate) mod tensors;
mod told;

use toml_input::{Fault, FileName, Sink};

use crate::activation::Activation;
use crate::contract::network::Network;
use crate::limits::{MAX_LAYERS, MAX_WIDTH};
use crate::model::Layer;
use crate::raw::Binary;
use chain::{Chain, Ends};
use explain::Scene;
pub use golden::{OutputShape, golden_fits};
pub use golden_file::golden_file;
use layers::{Dense, Layers};
pub use tensors::NamedTensor;
use tensors::Tensors;
pub use told::law_told;

/// The layers of the network, without bounds, and what was converted or left out.
pub(crate) struct Weights {
    pub layers: Vec<Layer>,
    pub notes: Vec<String>,
}

/// Reads the network; with unknown sizes of a faulty contract only the file itself is checked.
pub(crate) fn read(
    file: &Binary,
    network: &Network<'_>,
    sizes: Option<(usize, usize)>,
    faults: &mut Sink,
) -> Option<Weights> {
    let opened = header::open(file, faults)?;
    let tensors = tensors::convert(file, &opened, faults)?;
    let (inputs, outputs) = sizes?;
    let grouped = layers::group(&tensors.list, network.transpose);
    let ends = Ends {
        inputs: Some(inputs),
        outputs: Some(outputs),
    };
    let scene = Scene {
        file: &file.name,
        tensors: &tensors.list,
        layers: &grouped,
        ends,
    };
    let (chain, targets) = match &network.layers {
        Some(_) => (listed(&scene, network, faults)?, Vec::new()),
        None => inferred(&scene, network, faults)?,
    };
    // listed layers have not passed the limit of a group
    if chain.len() > MAX_LAYERS {
        faults.push(file.name.fault(catalogue::too_deep(chain.len())));
        return None;
    }
    let activations = network.activations(chain.len(), faults);
    let layers: Vec<Option<Layer>> = chain
        .iter()
        .map(|&index| layer(file, &tensors, &grouped.dense[index], network.bias, faults))
        .collect();
    // who lists the layers has said what belongs to the network
    if network.layers.is_none() {
        faults.extend(strangers(file, &tensors, &grouped, network));
    }
    let layers: Option<Vec<Layer>> = layers.into_iter().collect();
    let (mut layers, activations) = (layers?, activations?);
    for (layer, activation) in layers.iter_mut().zip(activations) {
        layer.activation = activation;
    }
    let notes = notes(tensors, &grouped, &chain, &targets);
    Some(Weights { layers, notes })
}

/// All tensors of a safetensors file that somebody saved, whatever they mean.
///
/// # Errors
/// If `bytes` are no sound safetensors file, or a tensor has an unfit name or holds a number that is not finite. `file` only
/// names it in messages.
pub fn named_tensors(file: &FileName, bytes: Vec<u8>) -> Result<Vec<NamedTensor>, toml_input::Faults> {
    let file = Binary {
        name: file.clone(),
        bytes,
    };
    let mut faults = Sink::new();
    let tensors = header::open(&file, &mut faults).map(|opened| tensors::named(&file, &opened, &mut faults));
    faults.conclude(tensors, || file.name.fault(crate::catalogue::incomplete()))
}

/// Chains of dense layers that could be meant, as indices into `layers`: name, inputs and outputs of each.
#[must_use]
pub fn chains(layers: &[(String, usize, usize)]) -> Vec<Vec<usize>> {
    let dense = |(index, (stem, inputs, outputs)): (usize, &(String, usize, usize))| Dense {
        stem: stem.clone(),
        weight: index,
        bias: None,
        transposed: false,
        inputs: *inputs,
        outputs: *outputs,
    };
    let mut dense: Vec<Dense> = layers.iter().enumerate().map(dense).collect();
    dense.sort_by(|a, b| layers::Place::of(&a.stem).cmp(&layers::Place::of(&b.stem)));
    let back = |chain: Chain| chain.into_iter().map(|index| dense[index].weight).collect();
    whole_chains(&dense).into_iter().map(back).collect()
}

/// What a file of weights says about a network when there is no contract yet.
pub(crate) struct Outline {
    pub inputs: usize,
    pub outputs: usize,
    /// Whether there is a hidden layer.
    pub hidden: bool,
    /// Whether any layer has a bias.
    pub bias: bool,
    /// Layer names, first to last, of each chain that could be meant.
    pub chains: Vec<String>,
}

/// The chains that could be meant where nothing is known of the ends.
fn whole_chains(layers: &[Dense]) -> Vec<Chain> {
    let ends = Ends {
        inputs: None,
        outputs: None,
    };
    let (mut found, _) = chain::candidates(layers, ends);
    if found.is_empty() {
        // nothing chooses: then one output is what there is, a continuous actor
        let outputs = Some(1);
        (found, _) = chain::candidates(layers, Ends { outputs, ..ends });
    }
    // with open ends a part of a chain fits as well as the whole
    let part_of = |a: &Chain, b: &Chain| a.len() < b.len() && a.iter().all(|layer| b.contains(layer));
    let is_whole = |chain: &&Chain| !found.iter().any(|other| part_of(chain, other));
    found.iter().filter(is_whole).cloned().collect()
}

/// The network in `file`, if all chains that could be meant have the same ends.
pub(crate) fn outline(file: &Binary, faults: &mut Sink) -> Option<Outline> {
    let opened = header::open(file, faults)?;
    let tensors = tensors::convert(file, &opened, faults)?;
    let grouped = layers::group(&tensors.list, None);
    let ends = Ends {
        inputs: None,
        outputs: None,
    };
    let chains = whole_chains(&grouped.dense);
    let dense = |index: usize| &grouped.dense[index];
    let sizes = |chain: &Chain| Some((dense(*chain.first()?).inputs, dense(*chain.last()?).outputs));
    let names: Vec<String> = chains.iter().map(|chain| chain_names(&grouped.dense, chain)).collect();
    let Some((inputs, outputs)) = chains.first().and_then(sizes) else {
        let scene = Scene {
            file: &file.name,
            tensors: &tensors.list,
            layers: &grouped,
            ends,
        };
        faults.extend(scene.explain(&(0..grouped.dense.len()).collect::<Vec<_>>()));
        return None;
    };
    if chains.iter().any(|chain| sizes(chain) != Some((inputs, outputs))) {
        faults.push(file.name.fault(catalogue::several_chains(&names.join("; "))));
        return None;
    }
    let hidden = chains.iter().any(|chain| chain.len() > 1);
    let bias = chains
        .iter()
        .any(|chain| chain.iter().any(|&index| dense(index).bias.is_some()));
    Some(Outline {
        inputs,
        outputs,
        hidden,
        bias,
        chains: names,
    })
}

fn chain_names(layers: &[Dense], chain: &[usize]) -> String {
    chain
        .iter()
        .map(|&index| layers[index].stem.as_str())
        .collect::<Vec<_>>()
        .join(" > ")
}

/// The chain the contract lists by name.
fn listed(scene: &Scene<'_>, network: &Network<'_>, faults: &mut Sink) -> Option<Chain> {
    let stems = || scene.layers.dense.iter().map(|layer| layer.stem.as_str());
    let mut chain = Chain::new();
    let before = faults.count();
    for name in network.layers.iter().flatten() {
        match stems().position(|stem| stem == name.value) {
            Some(index) if chain.contains(&index) => {
                faults.push(network.fault(name, catalogue::repeated_layer(&name.value)));
            }
            Some(index) => chain.push(index),
            None => {
                let all = stems().collect::<Vec<_>>().join(", ");
                faults.push(network.fault(
                    name,
                    catalogue::unknown_layer(&name.value, &all).did_you_mean(&name.value, stems()),
                ));
            }
        }
    }
    if faults.count() > before {
        return None;
    }
    match scene.mismatch(&chain) {
        Some(fault) => {
            faults.push(fault);
            None
        }
        None => Some(chain),
    }
}

/// The only chain that fits, and the target networks passed over.
fn inferred(scene: &Scene<'_>, network: &Network<'_>, faults: &mut Sink) -> Option<(Chain, Vec<usize>)> {
    let dense = &scene.layers.dense;
    let prefix = network.prefix.as_ref();
    let under = |index: &usize| prefix.is_none_or(|prefix| layers::is_under(&dense[*index].stem, &prefix.value));
    let members: Vec<usize> = (0..dense.len()).filter(under).collect();
    if let (Some(prefix), true) = (prefix, members.is_empty()) {
        let all = dense
            .iter()
            .map(|layer| layer.stem.as_str())
            .collect::<Vec<_>>()
            .join(", ");
        faults.push(network.fault(prefix, catalogue::unknown_prefix(&prefix.value, &all)));
        return None;
    }
    // the search counts within the subset; `back` leads to the file's numbers again
    let subset: Vec<Dense> = members.iter().map(|&index| dense[index].clone()).collect();
    let (chains, passed) = chain::candidates(&subset, scene.ends);
    match chains.as_slice() {
        [only] => {
            // a prefix is a choice: what it passes over was not passed over by us
            let passed = if prefix.is_some() { Vec::new() } else { passed };
            let back = |list: &[usize]| list.iter().map(|&i| members[i]).collect();
            Some((back(only), back(&passed)))
        }
        [] => {
            faults.extend(scene.explain(&members));
            None
        }
        several => {
            let list = several
                .iter()
                .map(|chain| chain_names(&subset, chain))
                .collect::<Vec<_>>()
                .join("; ");
            faults.push(scene.file.fault(catalogue::several_chains(&list)));
            None
        }
    }
}

fn layer(file: &Binary, tensors: &Tensors, dense: &Dense, bias: bool, faults: &mut Sink) -> Option<Layer> {
    let weight = &tensors.list[dense.weight];
    let before = faults.count();
    if dense.outputs > MAX_WIDTH {
        faults.push(file.name.tensor_fault(&weight.name, catalogue::too_wide(dense.outputs)));
    }
    let stored = dense.bias.map(|index| &tensors.list[index]);
    match stored {
        None if bias => {
            let name = weight.name.replace("kernel", "bias");
            let name = name
                .strip_suffix("weight")
                .map_or(name.clone(), |stem| format!("{stem}bias"));
            let hint = "a network without biases says `bias = false` in [network]";
            faults.push(file.name.tensor_fault(&name, catalogue::missing_tensor(&name, hint)));
        }
        Some(tensor) if !bias => faults.push(
            file.name
                .tensor_fault(&tensor.name, catalogue::extra_bias(&tensor.name)),
        ),
        Some(tensor) if tensor.shape != [dense.outputs] => {
            let what = format!("the bias of layer `{}`", dense.stem);
            let message = catalogue::wrong_shape(&what, &tensor.shape, &[dense.outputs], None);
            faults.push(file.name.tensor_fault(&tensor.name, message));
        }
        _ => {}
    }
    (faults.count() == before).then(|| Layer {
        name: dense.stem.clone(),
        inputs: dense.inputs,
        outputs: dense.outputs,
        weights: if dense.transposed {
            transposed(&weight.values, dense.outputs)
        } else {
            weight.values.clone()
        },
        // +0: the contract starts such a sum from it
        bias: stored.map_or_else(|| vec![0.0; dense.outputs], |tensor| tensor.values.clone()),
        activation: Activation::Identity,
        bounds: Vec::new(),
    })
}

/// Tensors of the network's folder that belong to no dense layer, such as a norm layer's: without them the network
/// computes something else.
fn strangers(file: &Binary, tensors: &Tensors, layers: &Layers, network: &Network<'_>) -> Vec<Fault> {
    let known = |index: usize| {
        layers
            .dense
            .iter()
            .any(|layer| layer.weight == index || layer.bias == Some(index))
    };
    let prefix = network.prefix.as_ref().map(|prefix| prefix.value.as_str());
    let part = |name: &str| prefix.is_none_or(|prefix| layers::is_under(name, prefix)) && !layers::is_target(name);
    let strange = tensors
        .list
        .iter()
        .enumerate()
        .filter(|(index, tensor)| !known(*index) && part(&tensor.name));
    strange
        .map(|(_, tensor)| {
            file.name
                .tensor_fault(&tensor.name, catalogue::no_dense_layer(&tensor.shape))
        })
        .collect()
}

/// `[inputs][outputs]` to `[outputs][inputs]`.
fn transposed(values: &[f32], outputs: usize) -> Vec<f32> {
    (0..outputs)
        .flat_map(|o| values.iter().skip(o).step_by(outputs).copied())
        .collect()
}

fn notes(tensors: Tensors, layers: &Layers, chain: &[usize], targets: &[usize]) -> Vec<String> {
    let stem = |&i: &usize| layers.dense[i].stem.as_str();
    let mut notes = tensors.notes;
    let names: Vec<_> = chain.iter().map(stem).collect();
    notes.push(format!("layers, first to last: {}", names.join(", ")));
    if !targets.is_empty() {
        let names: Vec<_> = targets.iter().map(stem).collect();
        notes.push(format!("passed over as a target network: {}", names.join(", ")));
    }
    let used = |index: usize| {
        let of = |i: &usize| layers.dense[*i].weight == index || layers.dense[*i].bias == Some(index);
        chain.iter().any(of) || targets.iter().any(of)
    };
    let left = tensors
        .list
        .iter()
        .enumerate()
        .filter(|(index, _)| !used(*index))
        .map(|(_, t)| t.name.as_str());
    let left: Vec<_> = left.chain(tensors.set_aside.iter().map(String::as_str)).collect();
    if !left.is_empty() {
        notes.push(format!("tensors left unused: {}", left.join(", ")));
    }
    notes
}

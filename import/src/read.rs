//! Which reader a file is for, by its content and not by its name.

use policy::{Activation, NamedTensor};
use toml_input::{Faults, FileName, Message};

use crate::activations::Parameters;
use crate::actor::{Actor, Duty};
use crate::network::{Layer, Network};
use crate::recognise::{self, Known};
use crate::zip::Archive;
use crate::{Options, activations, arrays, hdf5, mat, onnx, sb3, torch, zip};

/// What a reader found.
#[derive(Debug, Default)]
pub(crate) struct Loaded {
    pub tensors: Vec<NamedTensor>,
    pub is_safetensors: bool,
    pub known: Known,
    pub activation: Option<Activation>,
    /// Bounds of the observations, infinite where there are none; empty if the file says nothing.
    pub bounds: Vec<(f64, f64)>,
    /// The layers by the names of the library alone, and how many quantiles are averaged behind them.
    pub original: Option<(Vec<Layer>, usize)>,
    pub about: Vec<String>,
    /// Each command of a model whose outputs are gains.
    pub commands: Vec<Actor>,
    /// What each of several duties is; the network is that of `original`, or of the graph.
    pub several: Vec<Duty>,
    /// The command is a number; the network is that of `original`, or of the graph.
    pub actor: Option<Actor>,
    /// A graph needs no recognition: its network, activations and features.
    pub graph: Option<onnx::Model>,
}

impl Loaded {
    /// The layers of an actor that a library names.
    pub fn actor_network(&self) -> Option<Network> {
        let (layers, _) = self.original.as_ref()?;
        let names: Vec<&str> = layers.iter().map(|layer| layer.name.as_str()).collect();
        Some(Network {
            said: vec![format!("layers, first to last: {}", names.join(" > "))],
            layers: layers.clone(),
            plain: false,
            choice_only: false,
            definition: None,
        })
    }
}

/// Reads a file of any format.
pub(crate) fn read(name: &FileName, bytes: Vec<u8>, options: &Options) -> Result<Loaded, Faults> {
    let fault = |message: Message| Faults::from(name.fault(message));
    if torch::is_bare_pickle(&bytes) {
        let tensors = arrays::read(&bytes)
            .map_err(fault)?
            .ok_or_else(|| fault(torch::legacy()))?;
        return Ok(Loaded {
            tensors,
            known: known(options),
            ..Loaded::default()
        });
    }
    if onnx::is_model(&bytes) {
        let graph = onnx::read(name, &bytes, (options.output, options.gains)).map_err(fault)?;
        return Ok(Loaded {
            actor: graph.actor,
            commands: graph.commands.clone(),
            several: graph.several.clone(),
            graph: Some(graph),
            ..Loaded::default()
        });
    }
    if hdf5::is_file(&bytes) {
        return Err(fault(hdf5::refused(&bytes)));
    }
    if !zip::is_archive(&bytes) {
        let is_mat = mat::is_mat(&bytes);
        return Ok(Loaded {
            tensors: if is_mat {
                mat::read(&bytes).map_err(fault)?
            } else {
                policy::named_tensors(name, bytes)?
            },
            is_safetensors: !is_mat,
            known: known(options),
            ..Loaded::default()
        });
    }
    let archive = Archive::open(&bytes).map_err(fault)?;
    if sb3::is_model(&archive) {
        return model(&archive, options).map_err(fault);
    }
    if torch::root(&archive).is_none() {
        return Err(fault(no_model(&archive)));
    }
    let torch = torch::read(&archive, options.inside.as_deref()).map_err(fault)?;
    let mut about = torch.said;
    norms(&torch.modules).map_err(fault)?;
    let activation = activation(&torch.modules).map_err(fault)?;
    if let Some(activation) = activation {
        about.push(format!(
            "the only activation in the module that was saved: {}",
            activation.label()
        ));
    }
    Ok(Loaded {
        tensors: torch.tensors,
        known: Known {
            epsilons: torch.epsilons,
            ..known(options)
        },
        activation,
        about,
        ..Loaded::default()
    })
}

/// What the caller knows beside the tensors.
fn known(options: &Options) -> Known {
    Known {
        actions: options.actions,
        output: options.output,
        gains: options.gains,
        are_commands: !options.outputs.is_empty() && options.outputs.iter().all(|width| *width == 1),
        epsilons: Vec::new(),
    }
}

/// Norms over the values of a step, by their classes: without a scale of their own they leave no tensor.
fn norms(modules: &[torch::Module]) -> Result<(), Message> {
    let folder = "torch.nn.modules.normalization.";
    let mut norms = modules.iter().filter_map(|module| module.class.strip_prefix(folder));
    match norms.next() {
        Some("LayerNorm") => Err(recognise::layer_norm().found("a module of the class LayerNorm")),
        Some(other) => {
            let message = Message::new("this norm is not compiled").found(other.escape_debug().to_string());
            Err(message
                .expected("dense layers, or batch norms, whose statistics are constants")
                .hint("it divides by what the values of each step are; train without it, or with BatchNorm1d"))
        }
        None => Ok(()),
    }
}

fn model(archive: &Archive<'_>, options: &Options) -> Result<Loaded, Message> {
    let model = sb3::read(archive, options)?;
    if let Some(said) = options.actions.filter(|said| *said != model.actions) {
        return Err(Message::new("--actions is not the number of actions of this model")
            .found(said.to_string())
            .expected(format!("{}, as its action space says", model.actions)));
    }
    if !options.outputs.is_empty() && model.several.is_empty() {
        return Err(Message::new("--outputs says something else than the file")
            .found(format!(
                "--outputs, and an action space with {} outputs for one duty",
                model.actions
            ))
            .expected("no --outputs")
            .hint("what the outputs are stands in the action space"));
    }
    Ok(Loaded {
        tensors: model.tensors,
        is_safetensors: false,
        known: Known {
            actions: Some(model.actions),
            ..Known::default()
        },
        activation: Some(model.activation),
        bounds: model.bounds,
        original: model.original,
        about: model.about,
        commands: model.commands,
        several: model.several,
        actor: model.actor,
        graph: None,
    })
}

/// The activation of a module that holds one kind alone.
fn activation(modules: &[torch::Module]) -> Result<Option<Activation>, Message> {
    let folder = "torch.nn.modules.activation.";
    let mut kinds = Vec::new();
    for module in modules {
        let Some(class) = module.class.strip_prefix(folder) else {
            continue;
        };
        // behind the last layer it keeps the order of the outputs
        if ["Softmax", "LogSoftmax"].contains(&class) {
            continue;
        }
        let parameters = Parameters {
            number: module.number,
            approximate: module.approximate.as_deref(),
        };
        kinds.push(
            activations::of_torch(class, parameters).ok_or_else(|| activations::not_compiled(class, parameters))?,
        );
    }
    let is_one = kinds.iter().all(|kind| kinds.first() == Some(kind));
    Ok(kinds.first().copied().filter(|_| is_one))
}

fn no_model(archive: &Archive<'_>) -> Message {
    let names: Vec<String> = archive
        .members
        .keys()
        .take(6)
        .map(|name| name.escape_debug().to_string())
        .collect();
    if archive.get("model.weights.h5").is_some() {
        return Message::new("a .keras file is not read")
            .found("a .keras file: its weights are HDF5")
            .expected("ONNX, safetensors, a torch file, or a model of stable-baselines3")
            .hint(hdf5::KERAS);
    }
    Message::new("this archive holds no model that is read")
        .found(format!("{} members: {}", archive.members.len(), names.join(", ")))
        .expected("`data.pkl` of torch.save, or `data` and `policy.pth` of stable-baselines3")
}

//! What a trainer saved, read without running it: a file to a contract to fill in, and the weights it names.
//!
//! ```text
//!   file ──► reader ──► named tensors ──► recognise ──► Network: a plain chain, and what was folded, in words
//!            safetensors, torch, SB3, │                     │
//!            MAT, numpy               │                     │
//!                                     └──► golden ──┐       └──► Draft ──► policy.toml
//!                                                   └──► golden.safetensors     weights.safetensors
//! ```
//!
//! A file is data here: nothing that it names is called, imported or executed. Every size that it claims is held against its
//! own length before anything is allocated. What users see: docs/reference/saved-models.md.

mod activations;
mod actor;
mod arrays;
mod duties;
mod golden;
mod hdf5;
mod mat;
mod network;
mod numpy;
mod onnx;
mod pickle;
mod read;
mod recognise;
mod sb3;
mod torch;
mod vecnormalize;
mod zip;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use policy::limits::{MAX_GAINS, MAX_WEIGHT_BYTES};
use policy::{Draft, DraftFeature, seen_from};
use toml_input::{Faults, FileName, Message, Origin};

use actor::Duty;
pub use network::{Layer, Network};
use read::Loaded;
use recognise::{Recognised, Refusal, recognise};

/// What the caller says beside the file.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// How many actions there are, where the tensors do not say it.
    pub actions: Option<usize>,
    /// The entry of a checkpoint that holds the network.
    pub inside: Option<String>,
    /// Which output of several is the duty, or which dimension of a MultiDiscrete; the others are left out. Without it all are
    /// kept, where the file says what each is.
    pub output: Option<usize>,
    /// Columns of each of several outputs, where the file does not say what they are: 1 is a duty as a number, N a choice among N.
    pub outputs: Vec<usize>,
    /// The outputs are the gains of a law: all of them are kept.
    pub gains: bool,
    /// What VecNormalize saved; without it a `vecnormalize.pkl` beside the file is taken.
    pub vecnormalize: Option<PathBuf>,
}

/// Files to write, by name, into the contract's folder, and what to tell the user.
#[derive(Debug, Clone)]
pub struct NewPolicy {
    /// Text of the contract.
    pub contract: String,
    /// What lies beside it: weights, golden answers. Empty where the contract names the file itself.
    pub beside: BTreeMap<String, Vec<u8>>,
    /// What was recognised, a sentence each.
    pub said: Vec<String>,
}

/// The names of what is written beside a contract.
const WEIGHTS: &str = "weights.safetensors";
/// Where the file that is read has the first name.
const CHAIN: &str = "chain.safetensors";
const GOLDEN: &str = "golden.safetensors";
/// What VecNormalize's page calls its file.
const STATISTICS: &str = "vecnormalize.pkl";

/// A contract for the network in `file`, to be written to `contract`; nothing is written here.
///
/// # Errors
/// If the file is not sound, holds what is not compiled, or does not say which of its networks is the policy.
pub fn new_policy(file: impl Into<FileName>, contract: &Path, options: &Options) -> Result<NewPolicy, Faults> {
    let name: FileName = file.into();
    let bytes = name.read(MAX_WEIGHT_BYTES).map_err(|message| name.fault(message))?;
    let loaded = read::read(&name, bytes, options)?;
    if let Some(graph) = &loaded.graph {
        // one output that nothing squashes is a command whose way to a duty the contract leaves open
        let is_command = graph.network.layers.last().is_some_and(|layer| layer.outputs == 1);
        if !is_command && !options.gains {
            recognise::fits(&graph.network, options.actions).map_err(|refusal| placed(&name, refusal))?;
        }
        let own = statistics(&name, options)?;
        if !own.is_empty() && !graph.features.is_empty() {
            let message = Message::new("the graph normalises its observations already")
                .hint("leave out the statistics of VecNormalize");
            return Err(name.fault(message).into());
        }
        let features = if own.is_empty() { graph.features.clone() } else { own };
        return written(&name, contract, &loaded, &graph.network, &features, options);
    }
    if let (false, Some(network)) = (loaded.several.is_empty(), loaded.actor_network()) {
        let statistics = statistics(&name, options)?;
        return written(&name, contract, &loaded, &network, &statistics, options);
    }
    if let (Some(_), Some(network)) = (loaded.actor, loaded.actor_network()) {
        let outputs = network.layers.last().map_or(0, |layer| layer.outputs);
        if outputs != 1 && !options.gains {
            return Err(name.fault(actor::several(outputs)).into());
        }
        return written(
            &name,
            contract,
            &loaded,
            &network,
            &statistics(&name, options)?,
            options,
        );
    }
    let network = match recognise(&loaded.tensors, &loaded.known).map_err(|refusal| placed(&name, refusal))? {
        Recognised::Network(network) => Some(network),
        Recognised::Undecided => None,
    };
    let statistics = statistics(&name, options)?;
    match network {
        Some(network)
            if !network.plain || !loaded.is_safetensors || !statistics.is_empty() || !options.outputs.is_empty() =>
        {
            written(&name, contract, &loaded, &network, &statistics, options)
        }
        // several chains side by side, or none: the contract's own reader explains, or asks for the prefix
        None if !loaded.is_safetensors => Err(name.fault(recognise::undecided_message(&loaded.tensors)).into()),
        plain => Ok(NewPolicy {
            contract: policy::new_contract(name, contract)?,
            beside: BTreeMap::new(),
            said: plain.map_or_else(Vec::new, |network| network.said),
        }),
    }
}

/// Normalisation of the observations, if any was saved.
fn statistics(file: &FileName, options: &Options) -> Result<Vec<DraftFeature>, Faults> {
    let beside = FileName {
        origin: Origin::Caller,
        ..file.with_file_name(STATISTICS)
    };
    let name = match &options.vecnormalize {
        Some(path) => FileName::new(path).among(file.held.as_ref()),
        None if beside.is_file() => beside,
        None => return Ok(Vec::new()),
    };
    let bytes = name.read(MAX_WEIGHT_BYTES).map_err(|message| name.fault(message))?;
    vecnormalize::read(&bytes).map_err(|message| name.fault(message).into())
}

/// The bytes of a file of golden answers, if there is one.
type GoldenFile = Option<Vec<u8>>;

/// The trainer's golden answers that lie beside the model, or those of the tensors as saved.
fn answers(
    name: &FileName,
    loaded: &Loaded,
    network: &Network,
    statistics: &[DraftFeature],
    (inputs, actions, several): (usize, Option<usize>, &[Duty]),
) -> Result<(GoldenFile, GoldenFile), Faults> {
    let given = given_answers(name, inputs, actions, several)?;
    let golden = match given {
        Some(_) => None,
        None => golden_answers(loaded, network, statistics, several).map_err(|message| name.fault(message))?,
    };
    Ok((given, golden))
}

/// A contract that names weights of its own.
fn written(
    name: &FileName,
    contract: &Path,
    loaded: &Loaded,
    network: &Network,
    statistics: &[DraftFeature],
    options: &Options,
) -> Result<NewPolicy, Faults> {
    let inputs = network.layers.first().map_or(0, |layer| layer.inputs);
    if !statistics.is_empty() && statistics.len() != inputs {
        let message = Message::new("the statistics of VecNormalize are of another observation")
            .found(format!("{} values", statistics.len()))
            .expected(format!("{inputs}, one for each network input"));
        return Err(name.fault(message).into());
    }
    let outputs = network.layers.last().map_or(0, |layer| layer.outputs);
    // gains and one command are answered with other tensors than the values of actions
    let actions = (outputs > 1 && !options.gains).then_some(outputs);
    let several = duties::of(loaded, network, options).map_err(|message| name.fault(message))?;
    let (given, golden) = answers(name, loaded, network, statistics, (inputs, actions, &several))?;
    let mut said = loaded.about.clone();
    said.extend(network.said.iter().cloned());
    let definition = network.definition.as_ref();
    let actor = definition.map(|definition| definition.actor).or(loaded.actor);
    let actor = actor.filter(|_| several.is_empty());
    let gains = match options.gains {
        true => gains(loaded, actor, outputs).map_err(|message| name.fault(message))?,
        false => Vec::new(),
    };
    said.extend(actor.filter(|_| gains.is_empty()).map(actor::Actor::said));
    said.extend(said_of(&several));
    said.extend(definition.iter().flat_map(|definition| definition.said.iter().cloned()));
    if !statistics.is_empty() && loaded.graph.as_ref().is_none_or(|graph| graph.features.is_empty()) {
        said.push("VecNormalize: scale = 1/sqrt(var + epsilon), offset = -mean/sqrt(var + epsilon), then clip, all computed in f64".to_owned());
    }
    said.extend(of_golden(given.is_some(), golden.is_some()));
    let own = FileName::new(&contract.with_file_name(WEIGHTS)).among(name.held.as_ref());
    let is_taken = own.is_same(name);
    let file = if is_taken { CHAIN } else { WEIGHTS };
    let weights = seen_from(contract, &contract.with_file_name(file)).map_err(|message| name.fault(message))?;
    let draft = Draft {
        weights,
        inputs,
        outputs,
        chains: vec![chain(network)],
        hidden: network.layers.len() > 1,
        bias: true,
        activation: activation(loaded, network),
        golden: golden.is_some() || given.is_some(),
        is_drawn: golden.is_some(),
        continuous: actor.map(actor::Actor::entry),
        duties: actor.filter(|_| gains.is_empty()).and_then(actor::Actor::duties),
        gains,
        several: several.iter().map(|duty| duty.draft()).collect(),
        about: said.clone(),
        features: match definition {
            _ if !statistics.is_empty() => statistics.to_vec(),
            Some(definition) if definition.is_normalised => vec![open(); inputs],
            _ => of_bounds(&loaded.bounds),
        },
    };
    let mut beside = BTreeMap::from([(file.to_owned(), network.to_safetensors(name)?)]);
    // a contract names no file of another folder unless its user says so with every command
    let beside_contract = FileName::new(&contract.with_file_name(GOLDEN)).among(name.held.as_ref());
    let answers = given.filter(|_| !beside_contract.is_same(&name.with_file_name(GOLDEN)));
    beside.extend(golden.or(answers).map(|bytes| (GOLDEN.to_owned(), bytes)));
    Ok(NewPolicy {
        contract: policy::draft(&draft),
        beside,
        said,
    })
}

/// Whose golden answers lie beside the contract.
fn of_golden(is_given: bool, is_computed: bool) -> Option<String> {
    match (is_given, is_computed) {
        (true, _) => Some(format!(
            "{GOLDEN} beside the model is taken as the trainer's: its obs are what the network sees, after scale, offset and clip"
        )),
        (false, true) => Some(format!(
            "{GOLDEN} was computed from the tensors as saved, in f64; the trainer's own answers check more"
        )),
        (false, false) => None,
    }
}

/// That every output is kept, and how one is picked.
fn said_of(several: &[Duty]) -> Option<String> {
    let count = several.len();
    (count > 0).then(|| {
        format!("{count} outputs, each a duty of its own; `policyc new MODEL --output N` makes a contract for one of them alone")
    })
}

/// The entries of `gains`, one for each output, as far as the file says how a command becomes one.
fn gains(loaded: &Loaded, actor: Option<actor::Actor>, outputs: usize) -> Result<Vec<String>, Message> {
    if !(1..=MAX_GAINS).contains(&outputs) {
        return Err(Message::new("the outputs are no gains of a law")
            .found(format!("{outputs} outputs"))
            .expected(format!("1 to {MAX_GAINS}"))
            .hint("leave out --gains if the network chooses among actions"));
    }
    if loaded.commands.len() == outputs {
        return Ok(loaded.commands.iter().map(|own| own.gain()).collect());
    }
    let actor = actor.unwrap_or(actor::Actor {
        squash: actor::Squash::Unknown,
        affine: None,
    });
    Ok(vec![actor.gain(); outputs])
}

/// The trainer's own answers beside its model, which check more than what can be computed here; `None` without them, and of those
/// that an earlier call computed.
///
/// # Errors
/// Of answers that no network with so many inputs and actions gives: a contract that names them is refused.
fn given_answers(
    model: &FileName,
    inputs: usize,
    actions: Option<usize>,
    several: &[Duty],
) -> Result<Option<Vec<u8>>, Faults> {
    let name = FileName {
        origin: Origin::Caller,
        ..model.with_file_name(GOLDEN)
    };
    if !name.is_file() {
        return Ok(None);
    }
    let bytes = name.read(MAX_WEIGHT_BYTES).map_err(|message| name.fault(message))?;
    if golden::is_computed(&bytes) {
        return Ok(None);
    }
    if let Some(actions) = actions {
        let names = duties::names(several);
        policy::golden_fits(&name, bytes.clone(), inputs, actions, &duties::shapes(several, &names))?;
    }
    Ok(Some(bytes))
}

/// The activations behind the hidden layers, as TOML.
fn activation(loaded: &Loaded, network: &Network) -> Option<String> {
    let Some(graph) = &loaded.graph else {
        let defined = || network.definition.as_ref()?.activation.clone();
        return loaded
            .activation
            .map(|activation| activation.written())
            .or_else(defined);
    };
    let written: Vec<String> = graph
        .activations
        .iter()
        .map(|activation| activation.written())
        .collect();
    match written.split_first() {
        Some((first, rest)) if rest.iter().all(|other| other == first) => Some(first.clone()),
        _ => Some(format!("[{}]", written.join(", "))),
    }
}

/// Golden answers where the file says of what and through which layers.
fn golden_answers(
    loaded: &Loaded,
    network: &Network,
    statistics: &[DraftFeature],
    several: &[Duty],
) -> Result<GoldenFile, Message> {
    let (Some((layers, quantiles)), Some(activation)) = (&loaded.original, loaded.activation) else {
        return Ok(None);
    };
    // within a deviation of the mean, where the training has been; never beyond the clip
    let normal = |feature: &DraftFeature| {
        let clip = feature.clip.as_ref().map_or(1.0, |(_, high, _)| high.min(1.0));
        (-clip, clip)
    };
    let bounds: Vec<(f64, f64)> = if statistics.is_empty() {
        loaded.bounds.clone()
    } else {
        statistics.iter().map(normal).collect()
    };
    let inputs = network.layers.first().map_or(0, |layer| layer.inputs);
    if bounds.len() != inputs || !bounds.iter().all(is_range) {
        return Ok(None);
    }
    golden::answers(&golden::Oracle {
        bounds: &bounds,
        layers,
        quantiles: *quantiles,
        activation,
        is_actor: loaded.actor.is_some(),
        several: &several.iter().map(|duty| duty.columns()).collect::<Vec<_>>(),
    })
}

// beyond it a bound stands for none: gymnasium's spaces end at the largest float
const LARGEST_BOUND: f64 = 1e30;

fn is_range((low, high): &(f64, f64)) -> bool {
    low < high && low.abs() < LARGEST_BOUND && high.abs() < LARGEST_BOUND
}

/// A feature of a training that normalised it, with numbers that are not here.
fn open() -> DraftFeature {
    DraftFeature {
        is_open: true,
        ..DraftFeature::default()
    }
}

/// A clip for each bounded observation.
fn of_bounds(bounds: &[(f64, f64)]) -> Vec<DraftFeature> {
    let feature = |bound: &(f64, f64)| DraftFeature {
        clip: is_range(bound).then(|| {
            (
                bound.0,
                bound.1,
                "bounds of the observation space; check that the training clips there".to_owned(),
            )
        }),
        ..DraftFeature::default()
    };
    bounds.iter().map(feature).collect()
}

/// The layers as they are called in the weights that are written.
fn chain(network: &Network) -> String {
    let names: Vec<String> = (0..network.layers.len())
        .map(|index| format!("layer_{index}"))
        .collect();
    names.join(" > ")
}

fn placed(file: &FileName, refusal: Refusal) -> Faults {
    let message: Message = *refusal.message;
    match refusal.tensor {
        Some(tensor) => file.tensor_fault(&tensor, message).into(),
        None => file.fault(message).into(),
    }
}

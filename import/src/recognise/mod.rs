//! Named tensors to one plain chain of dense layers.
//!
//! ```text
//!   actors::find     whose definition a continuous actor follows, by its names
//!   refused::check   what no chain computes is refused by name: recurrence, convolution, LayerNorm, heads nobody defines
//!   names::parse     tensors to dense layers and batch norms, by the names of a dozen libraries
//!   heads            value networks are left out; of a dueling pair the advantage stays
//!   norm             batch norms go into the dense layer beside them
//!   order            the one path through all that is left
//!   heads::quantiles the mean over quantiles goes into the last layer
//! ```
//!
//! The invariant: a layer is left out only for a reason that is told. A chain that fits by accident computes something
//! else.

mod actors;
pub(crate) mod heads;
pub(crate) mod names;
mod norm;
mod refused;

pub(crate) use refused::continuous as refused_continuous;
pub(crate) use refused::layer_norm;

use policy::NamedTensor;
use policy::limits::{MAX_ACTIONS, MAX_FEATURES, MAX_LAYERS, MAX_WIDTH, MIN_ACTIONS};
use toml_input::Message;

use crate::network::{Layer, Network};
pub(crate) use actors::{Definition, is_mean};

/// A refusal, and the tensor that it is about.
#[derive(Debug)]
pub(crate) struct Refusal {
    pub tensor: Option<String>,
    pub message: Box<Message>,
}

impl Refusal {
    pub fn of(tensor: &str, message: Message) -> Self {
        Refusal {
            tensor: Some(tensor.to_owned()),
            message: Box::new(message),
        }
    }
}

impl From<Message> for Refusal {
    fn from(message: Message) -> Self {
        Refusal {
            tensor: None,
            message: Box::new(message),
        }
    }
}

/// What the caller knows beside the tensors.
#[derive(Debug, Clone, Default)]
pub(crate) struct Known {
    /// How many actions there are.
    pub actions: Option<usize>,
    /// Which output is the duty.
    pub output: Option<usize>,
    /// The outputs are gains.
    pub gains: bool,
    /// Each output is a command of its own.
    pub are_commands: bool,
    /// Epsilon of the batch norms by their names, where the file says it.
    pub epsilons: Vec<(String, f64)>,
}

impl Known {
    /// Whether somebody said what the outputs are.
    fn is_said(&self) -> bool {
        self.output.is_some() || self.gains || self.are_commands
    }
}

/// What a set of tensors is.
pub(crate) enum Recognised {
    Network(Network),
    /// Several chains of the same ends, or none: plain names that the contract's own rules must explain.
    Undecided,
}

/// The network in `tensors`.
pub(crate) fn recognise(tensors: &[NamedTensor], known: &Known) -> Result<Recognised, Refusal> {
    let used: Vec<&NamedTensor> = tensors
        .iter()
        .filter(|tensor| !names::is_unused(&tensor.name))
        .collect();
    let own: Vec<&NamedTensor> = used
        .iter()
        .filter(|tensor| !names::is_target(&tensor.name))
        .copied()
        .collect();
    if let Some(definition) = actors::find(&own, known)? {
        return actor(&own, known, definition).map(Recognised::Network);
    }
    refused::check(&used, false)?;
    let mut parsed = names::parse(&used, known)?;
    parsed.plain &= used.len() == tensors.len();
    heads::leave_out_values(&mut parsed)?;
    norm::fold(&mut parsed)?;
    let Some(mut network) = order(parsed)? else {
        return Ok(Recognised::Undecided);
    };
    heads::quantiles(&mut network, known)?;
    network.said.extend(actors::doubt(&own, known));
    fits(&network, known.actions)?;
    Ok(Recognised::Network(network))
}

/// Trunk and mean of an actor, as its definition has them.
fn actor(own: &[&NamedTensor], known: &Known, definition: Definition) -> Result<Network, Refusal> {
    let used: Vec<&NamedTensor> = own
        .iter()
        .filter(|tensor| !actors::is_beside(&tensor.name))
        .copied()
        .collect();
    refused::check(&used, true)?;
    let mut parsed = names::parse(&used, known)?;
    parsed.plain = false;
    heads::leave_out_values(&mut parsed)?;
    norm::fold(&mut parsed)?;
    let all = parsed.layers.clone();
    let mut network = order(parsed)?.ok_or_else(|| refused::more_than_a_chain(&all))?;
    if let Some(last) = network
        .layers
        .last_mut()
        .filter(|last| definition.is_mean_of_two && last.outputs == 2)
    {
        last.weights.truncate(last.inputs);
        last.bias.truncate(1);
        last.outputs = 1;
        let text = format!(
            "of `{}` the first output is read, the mean; the second is the deviation",
            last.name
        );
        network.said.push(text);
    }
    if let Some(output) = known.output {
        network.keep_output(output)?;
    }
    let outputs = network.layers.last().map_or(0, |layer| layer.outputs);
    if !known.gains {
        // means and deviations side by side would otherwise pass for as many commands
        if let (Some(said), true) = (known.actions, outputs > 1) {
            crate::duties::as_many(outputs, said)?;
        }
        crate::duties::fits(outputs)?;
    }
    sizes(&network)?;
    network.definition = Some(definition);
    Ok(network)
}

/// Whether a contract can hold the network; `said` is the number of actions, if somebody said it.
pub(crate) fn fits(network: &Network, said: Option<usize>) -> Result<(), Refusal> {
    let actions = network.layers.last().map_or(0, |layer| layer.outputs);
    if !(MIN_ACTIONS..=MAX_ACTIONS).contains(&actions) {
        return Err(refused::too_many_actions(actions).into());
    }
    sizes(network)?;
    if let Some(said) = said.filter(|said| *said != actions) {
        return Err(
            Message::new("the network has another number of outputs than there are actions")
                .found(format!("{actions} outputs"))
                .expected(format!("{said} actions"))
                .into(),
        );
    }
    Ok(())
}

/// Whether a contract can hold the inputs and the layers.
fn sizes(network: &Network) -> Result<(), Refusal> {
    let inputs = network.layers.first().map_or(0, |layer| layer.inputs);
    if inputs > MAX_FEATURES {
        return Err(
            Message::new("the network takes more inputs than a contract has features")
                .found(format!("{inputs} inputs"))
                .expected(format!("at most {MAX_FEATURES}"))
                .into(),
        );
    }
    if let Some(layer) = network.layers.iter().find(|layer| layer.outputs > MAX_WIDTH) {
        let message = Message::new("the layer is too wide")
            .found(format!("{} outputs", layer.outputs))
            .expected(format!("at most {MAX_WIDTH}"));
        return Err(Refusal::of(&layer.name, message));
    }
    if network.layers.len() > MAX_LAYERS {
        return Err(Message::new("the network has too many layers")
            .found(network.layers.len().to_string())
            .expected(format!("at most {MAX_LAYERS}"))
            .into());
    }
    Ok(())
}

/// What to say of tensors in which no rule finds one chain.
pub(crate) fn undecided_message(tensors: &[NamedTensor]) -> Message {
    refused::more_than_a_chain(&names::only_dense(tensors))
}

/// The path through all layers, if there is exactly one.
fn order(parsed: names::Parsed) -> Result<Option<Network>, Refusal> {
    let chains = |least: usize| {
        let shapes = |layer: &Layer| (layer.name.clone(), layer.inputs, layer.outputs.max(least));
        policy::chains(&parsed.layers.iter().map(shapes).collect::<Vec<_>>())
    };
    let whole = |found: &[Vec<usize>]| {
        let mut whole = found.iter().filter(|chain| chain.len() == parsed.layers.len()).cloned();
        whole.next().filter(|_| whole.next().is_none())
    };
    let found = chains(0);
    // where nothing else is known a chain ends in two outputs or more: a single one is looked for as if it were two
    let Some(chain) = whole(&found).or_else(|| whole(&chains(MIN_ACTIONS))) else {
        return undecided(&parsed, &found);
    };
    if let Some(name) = parsed.strangers.first() {
        return Err(refused::stranger(name));
    }
    let mut said = parsed.said;
    let layers: Vec<Layer> = chain
        .iter()
        .filter_map(|&index| parsed.layers.get(index).cloned())
        .collect();
    if !parsed.plain {
        let names: Vec<&str> = layers.iter().map(|layer| layer.name.as_str()).collect();
        said.insert(0, format!("layers, first to last: {}", names.join(" > ")));
    }
    Ok(Some(Network {
        layers,
        plain: parsed.plain,
        choice_only: parsed.choice_only,
        said,
        definition: None,
    }))
}

/// Several networks side by side are a question that a contract answers with `prefix`; a layer that could stand behind a
/// chain is not: the chain would be a part, taken for the whole.
fn undecided(parsed: &names::Parsed, found: &[Vec<usize>]) -> Result<Option<Network>, Refusal> {
    let inside = |index: usize| found.iter().any(|chain| chain.contains(&index));
    let ends: Vec<usize> = found
        .iter()
        .filter_map(|chain| Some(parsed.layers.get(*chain.last()?)?.outputs))
        .collect();
    let behind = parsed
        .layers
        .iter()
        .enumerate()
        .find(|(index, layer)| !inside(*index) && ends.contains(&layer.inputs));
    if let Some((_, layer)) = behind {
        return Err(Refusal::of(&layer.name, refused::more_than_a_chain(&parsed.layers)));
    }
    if parsed.plain || parsed.layers.is_empty() {
        return Ok(None);
    }
    Err(refused::more_than_a_chain(&parsed.layers).into())
}

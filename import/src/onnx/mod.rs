//! An ONNX graph to a chain of dense layers: one path from the input to the output, node by node.
//!
//! ```text
//!   obs ─ Sub, Div, Clip ─ Gemm or MatMul + Add ─ Relu ─ ... ─ Gemm ─ ArgMax
//!         scale, offset,   layer                  activation   last
//!         clip of features
//! ```
//!
//! A node that no rule knows, or a value that two nodes take, is refused by the node's name.

mod bent;
mod command;
mod model;
mod norm;
mod wire;
mod words;

use policy::{Activation, DraftFeature};
use toml_input::{FileName, Message};

use crate::actor::{self, Actor, Duty, Squash};
use crate::network::{Layer, Network};
use command::Commands;
use model::{Constant, Graph, Node};
use words::{EXPORT, is_sixth, named, not_compiled, other, unknown, word};

/// What a graph computes.
#[derive(Debug)]
pub(crate) struct Model {
    pub network: Network,
    /// Behind each hidden layer.
    pub activations: Vec<Activation>,
    /// What stands before the first layer; empty if nothing does.
    pub features: Vec<DraftFeature>,
    /// Where it ends in a tanh: the command is a number.
    pub actor: Option<Actor>,
    /// Each command, where the outputs are gains.
    pub commands: Vec<Actor>,
    /// Each command, where each is a duty of its own.
    pub several: Vec<Duty>,
}

/// Whether `bytes` begin as a model does: field 1, the version of the format, and no header of safetensors.
pub(crate) fn is_model(bytes: &[u8]) -> bool {
    bytes.first() == Some(&8) && bytes.get(8) != Some(&b'{')
}

/// Reads a model, of which one output may be picked, or all may be gains.
pub(crate) fn read(file: &FileName, bytes: &[u8], (picked, gains): (Option<usize>, bool)) -> Result<Model, Message> {
    let graph = model::read(file, bytes)?;
    let mut walk = Walk {
        graph: &graph,
        picked,
        gains,
        affine: None,
        clip: None,
        layers: Vec::new(),
        activations: Vec::new(),
        cut: None,
        scaled: None,
        ended: None,
        said: Vec::new(),
    };
    let [input] = graph.inputs.as_slice() else {
        return Err(other(
            "the graph takes more than one input",
            &graph.inputs.join(", "),
            "one observation",
        ));
    };
    let mut value = input.clone();
    // each node is passed once, for it makes a value of its own
    for _ in 0..=graph.nodes.len() {
        if graph.outputs.contains(&value) {
            return walk.finish();
        }
        let takers: Vec<&Node> = graph.nodes.iter().filter(|node| node.inputs.contains(&value)).collect();
        if let Some(bent) = bent::find(&graph, &value, &takers) {
            let activation = Activation::find(bent.word);
            walk.activation(bent.node, activation.ok_or_else(|| not_compiled(bent.node, bent.word))?)?;
            bent.value.clone_into(&mut value);
            continue;
        }
        if let Some(refusal) = norm::refusal(&takers) {
            return Err(refusal);
        }
        if takers.is_empty() {
            let nodes: Vec<String> = graph.nodes.iter().take(4).map(named).collect();
            return Err(other(
                &format!("no node takes the value `{}`", value.escape_debug()),
                &nodes.join(", "),
                "one node behind another",
            )
            .hint(EXPORT));
        }
        let [node] = takers.as_slice() else {
            let names: Vec<String> = takers.iter().map(|node| named(node)).collect();
            return Err(other(
                "the graph branches, and is no chain",
                &names.join(", "),
                "one node behind another",
            )
            .hint(EXPORT));
        };
        walk.pass(node, &value)?;
        value = node.outputs.first().cloned().unwrap_or_default();
    }
    Err(other(
        "the graph does not lead to its output",
        &graph.outputs.join(", "),
        "one node behind another",
    ))
}

struct Walk<'a> {
    graph: &'a Graph,
    /// The output that is the duty.
    picked: Option<usize>,
    /// The outputs are gains.
    gains: bool,
    /// `scale * x + offset` of each input, or one for all.
    affine: Option<(Vec<f64>, Vec<f64>)>,
    clip: Option<(f64, f64)>,
    layers: Vec<Layer>,
    /// Behind the layers that have one.
    activations: Vec<Option<Activation>>,
    /// Ends of a clip behind the last layer.
    cut: Option<(f64, f64)>,
    /// Scale and offset behind a tanh or a clip that ends the network: one for all outputs, or one for each.
    scaled: Option<Vec<(f64, f64)>>,
    /// The node that ended the chain.
    ended: Option<String>,
    said: Vec<String>,
}

impl Walk<'_> {
    fn pass(&mut self, node: &Node, value: &str) -> Result<(), Message> {
        let operation = node.operation.as_str();
        if matches!(
            operation,
            "Identity" | "Flatten" | "Reshape" | "Squeeze" | "Unsqueeze" | "Dropout"
        ) {
            return Ok(());
        }
        // to binary32 or binary64; a whole number would be rounded. Behind the choice there is nothing to round
        if operation == "Cast" && (self.ended.is_some() || matches!(node.integers.get("to"), Some(1 | 11))) {
            return Ok(());
        }
        if let Some(end) = &self.ended {
            return Err(other(
                &format!("something stands behind {end}"),
                &named(node),
                "the end of the graph",
            ));
        }
        match operation {
            "Gemm" | "MatMul" => self.layer(node, value),
            "Add" | "Sub" | "Mul" | "Div" => self.arithmetic(node, value),
            "Clip" if self.layers.is_empty() && self.clip.is_none() => {
                let (low, high) = self.ends(node).ok_or_else(|| unknown(node))?;
                self.clip = Some((low, high));
                Ok(())
            }
            // PPO's mean, clipped to its action space
            "Clip" if self.activations.last() == Some(&None) && self.is_few() && self.cut.is_none() => {
                self.cut = Some(self.ends(node).ok_or_else(|| unknown(node))?);
                Ok(())
            }
            "LeakyRelu" => {
                let slope = node.floats.get("alpha").copied().unwrap_or(0.01);
                self.activation(node, Activation::LeakyRelu { slope })
            }
            "ArgMax" if node.integers.get("select_last_index").is_none_or(|last| *last == 0) => self.end(node),
            "Softmax" | "LogSoftmax" => {
                self.said.push(format!(
                    "{} is left out: it keeps the order of the outputs",
                    named(node)
                ));
                self.end(node)
            }
            _ => {
                let word = word(node).ok_or_else(|| unknown(node))?;
                let activation = Activation::find(word).ok_or_else(|| not_compiled(node, word))?;
                self.activation(node, activation)
            }
        }
    }

    /// Both ends of a `Clip`.
    fn ends(&self, node: &Node) -> Option<(f64, f64)> {
        let bound = |index: usize| self.constant(node, index)?.values.first().copied();
        bound(1).zip(bound(2)).filter(|(low, high)| low < high)
    }

    fn end(&mut self, node: &Node) -> Result<(), Message> {
        self.ended = Some(named(node));
        Ok(())
    }

    fn constant(&self, node: &Node, index: usize) -> Option<&Constant> {
        self.graph.constants.get(node.inputs.get(index)?)
    }

    fn activation(&mut self, node: &Node, activation: Activation) -> Result<(), Message> {
        if self.cut.is_some() {
            return Err(unknown(node));
        }
        match self.activations.last_mut() {
            Some(free @ None) => {
                *free = Some(activation);
                Ok(())
            }
            _ => Err(unknown(node)),
        }
    }

    /// `alpha x B + beta C`, and `x B`.
    fn layer(&mut self, node: &Node, value: &str) -> Result<(), Message> {
        let flag = |name: &str| node.integers.get(name).copied().unwrap_or(0) != 0;
        let factor = |name: &str| node.floats.get(name).copied().unwrap_or(1.0);
        let weight = self
            .constant(node, 1)
            .filter(|_| node.inputs.first().is_some_and(|x| x == value));
        // a tensor of whole numbers has a shape and no values here: nothing holds the shape against the file
        let is_read = |weight: &&Constant| !flag("transA") && !weight.values.is_empty();
        let weight = weight.filter(is_read).ok_or_else(|| unknown(node))?;
        let [rows, columns] = weight.shape[..] else {
            return Err(unknown(node));
        };
        let (outputs, inputs) = if flag("transB") {
            (rows, columns)
        } else {
            (columns, rows)
        };
        let at = |output: usize, input: usize| {
            let index = if flag("transB") {
                output * columns + input
            } else {
                input * columns + output
            };
            factor("alpha") * weight.values.get(index).copied().unwrap_or_default()
        };
        let bias = match self.constant(node, 2) {
            Some(bias) => spread(&bias.values, outputs).ok_or_else(|| unknown(node))?,
            None if node.inputs.len() > 2 => return Err(unknown(node)),
            None => vec![0.0; outputs],
        };
        // behind a command there is no layer
        let is_behind = self.cut.is_some() || self.scaled.is_some();
        if is_behind || self.layers.last().is_some_and(|last| last.outputs != inputs) || outputs == 0 || inputs == 0 {
            return Err(unknown(node));
        }
        let weights = (0..outputs).flat_map(|output| (0..inputs).map(move |input| (output, input)));
        self.layers.push(Layer {
            name: node.label().to_owned(),
            inputs,
            outputs,
            weights: weights.map(|(output, input)| at(output, input)).collect(),
            bias: bias.iter().map(|bias| factor("beta") * bias).collect(),
        });
        self.activations.push(None);
        Ok(())
    }

    /// A sum, difference, product or quotient with a constant: before the first layer a feature's, behind a layer the layer's.
    fn arithmetic(&mut self, node: &Node, value: &str) -> Result<(), Message> {
        let first = node.inputs.first().is_some_and(|x| x == value);
        let constant = self.constant(node, usize::from(first)).filter(|c| !c.values.is_empty());
        let constant = constant.ok_or_else(|| unknown(node))?.values.clone();
        // scale and shift: x' = s x + t
        let step = |c: f64| match (node.operation.as_str(), first) {
            ("Add", _) => Some((1.0, c)),
            ("Sub", true) => Some((1.0, -c)),
            ("Sub", false) => Some((-1.0, c)),
            ("Mul", _) => Some((c, 0.0)),
            ("Div", true) if c != 0.0 => Some((1.0 / c, 0.0)),
            _ => None,
        };
        let steps: Option<Vec<(f64, f64)>> = constant.iter().map(|c| step(*c)).collect();
        let steps = steps.ok_or_else(|| unknown(node))?;
        if self.layers.is_empty() {
            return self.before(node, &steps);
        }
        if self.is_command() {
            return self.behind_command(node, &steps);
        }
        if self.is_bounded() {
            return Err(actor::several(self.outputs()));
        }
        let Some(layer) = self.layers.last_mut().filter(|_| self.cut.is_none()) else {
            return Err(unknown(node));
        };
        if self.activations.last() != Some(&None) || !(steps.len() == 1 || steps.len() == layer.outputs) {
            return Err(unknown(node));
        }
        let inputs = layer.inputs.max(1);
        let of = |output: usize| steps.get(output.min(steps.len() - 1)).copied().unwrap_or((1.0, 0.0));
        for (output, (row, bias)) in layer.weights.chunks_exact_mut(inputs).zip(&mut layer.bias).enumerate() {
            let (scale, shift) = of(output);
            row.iter_mut().for_each(|weight| *weight *= scale);
            *bias = *bias * scale + shift;
        }
        Ok(())
    }

    fn before(&mut self, node: &Node, steps: &[(f64, f64)]) -> Result<(), Message> {
        let (scales, offsets) = self.affine.take().unwrap_or((vec![1.0], vec![0.0]));
        let count = scales.len().max(steps.len());
        // behind a clip another affine step has no place in a feature
        let fits = self.clip.is_none() && [scales.len(), steps.len()].iter().all(|n| *n == 1 || *n == count);
        if !fits {
            return Err(unknown(node));
        }
        let mut affine = (Vec::new(), Vec::new());
        for index in 0..count {
            let at = |values: &[f64]| values.get(index.min(values.len() - 1)).copied().unwrap_or_default();
            let (scale, shift) = steps.get(index.min(steps.len() - 1)).copied().unwrap_or((1.0, 0.0));
            affine.0.push(at(&scales) * scale);
            affine.1.push(at(&offsets) * scale + shift);
        }
        self.affine = Some(affine);
        Ok(())
    }

    fn finish(mut self) -> Result<Model, Message> {
        let inputs = self.layers.first().map(|layer| layer.inputs);
        let inputs =
            inputs.ok_or_else(|| other("the graph holds no dense layer", "none", "Gemm, or MatMul and Add"))?;
        let actor = match self.activations.pop() {
            Some(Some(last)) if Squash::curve(last).is_some() => {
                if !self.is_few() {
                    return Err(actor::several(self.outputs()));
                }
                Some(Actor {
                    squash: Squash::Curve(last),
                    affine: None,
                })
            }
            Some(Some(last)) => {
                return Err(other(
                    "an activation stands behind the last layer",
                    last.word(),
                    "the values of the actions",
                ));
            }
            _ => self.cut.map(|(low, high)| Actor::clipped(low, high)),
        };
        self.no_choice_behind(actor)?;
        let Commands {
            one: actor,
            gains: commands,
            several,
        } = self.commands(actor);
        let names: Vec<&str> = self.layers.iter().map(|layer| layer.name.as_str()).collect();
        self.said
            .insert(0, format!("layers, first to last: {}", names.join(" > ")));
        let features = self.features(inputs)?;
        let mut network = Network {
            layers: self.layers,
            plain: false,
            choice_only: false,
            definition: None,
            said: self.said,
        };
        if let Some(output) = self.picked {
            network.keep_output(output)?;
        }
        Ok(Model {
            network,
            activations: self
                .activations
                .into_iter()
                .map(|each| each.unwrap_or(Activation::Identity))
                .collect(),
            features,
            actor,
            commands,
            several,
        })
    }

    /// What stands before the first layer.
    fn features(&mut self, inputs: usize) -> Result<Vec<DraftFeature>, Message> {
        if self.affine.is_none() && self.clip.is_none() {
            return Ok(Vec::new());
        }
        let (scales, offsets) = self.affine.take().unwrap_or((vec![1.0], vec![0.0]));
        let (scales, offsets) = spread(&scales, inputs).zip(spread(&offsets, inputs)).ok_or_else(|| {
            other(
                "the normalisation has another length than the observation",
                &scales.len().to_string(),
                &inputs.to_string(),
            )
        })?;
        let clip = self.clip.map(|(low, high)| (low, high, "Clip of the graph".to_owned()));
        self.said.push(
            "the normalisation of the graph is scale, offset and clip of the features, computed in f64".to_owned(),
        );
        let feature = |affine| DraftFeature {
            affine: Some(affine),
            clip: clip.clone(),
            ..DraftFeature::default()
        };
        Ok(scales.into_iter().zip(offsets).map(feature).collect())
    }
}

/// One value for all, or one for each.
fn spread(values: &[f64], count: usize) -> Option<Vec<f64>> {
    match values {
        [one] => Some(vec![*one; count]),
        _ => (values.len() == count).then(|| values.to_vec()),
    }
}

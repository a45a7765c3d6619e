//! The same controller around another network: to ask what it would cost, not what it would do.

use crate::activation::Activation;
use crate::bounds;
use crate::digests;
use crate::model::{Layer, Policy};

/// Least bias of a neuron whose cost is asked.
const ALIVE: f32 = 1e-3;

impl Policy {
    /// The widest hidden layer; 0 where there is none.
    #[must_use]
    pub fn widest_hidden(&self) -> usize {
        let hidden = self.layers.iter().rev().skip(1);
        hidden.map(|layer| layer.outputs).max().unwrap_or(0)
    }

    /// The policy with its hidden layers cut down to `width` neurons, the first of each. Its decisions mean nothing: there
    /// are no golden vectors left. `None` if the network that is left cannot be bounded.
    #[must_use]
    pub fn cut_to(&self, width: usize) -> Option<Policy> {
        let last = self.layers.len().checked_sub(1)?;
        let mut inputs = self.features.len();
        self.with_layers(self.layers.iter().enumerate().map(|(index, layer)| {
            let outputs = if index == last {
                layer.outputs
            } else {
                layer.outputs.min(width.max(1))
            };
            let cut = cut(layer, inputs, outputs);
            inputs = outputs;
            cut
        }))
    }

    /// The policy without its last hidden layer; as [`Policy::cut_to`]. `None` where it has no more than one.
    #[must_use]
    pub fn without_a_hidden_layer(&self) -> Option<Policy> {
        let [rest @ .., before, _, last] = self.layers.as_slice() else {
            return None;
        };
        let rows = last.weights.chunks_exact(last.inputs.max(1));
        let last = Layer {
            inputs: before.outputs,
            // only their number counts
            weights: rows
                .flat_map(|row| row.iter().copied().cycle().take(before.outputs))
                .collect(),
            ..last.clone()
        };
        self.with_layers(rest.iter().chain([before, &last]).cloned())
    }

    /// The policy with another activation behind every hidden layer; as [`Policy::cut_to`].
    #[must_use]
    pub fn activated_by(&self, activation: Activation) -> Option<Policy> {
        self.with_layers(self.layers.iter().cloned().map(|layer| Layer {
            activation: if layer.activation.is_identity() {
                layer.activation
            } else {
                activation
            },
            ..layer
        }))
    }

    /// The policy with these activations behind its first layers; as [`Policy::cut_to`].
    #[must_use]
    pub fn with_activations(&self, activations: &[Activation]) -> Option<Policy> {
        let mut given = activations.iter();
        self.with_layers(self.layers.iter().cloned().map(|layer| Layer {
            activation: given.next().copied().unwrap_or(layer.activation),
            ..layer
        }))
    }

    fn with_layers(&self, layers: impl Iterator<Item = Layer>) -> Option<Policy> {
        let mut policy = Policy {
            layers: layers.collect(),
            golden: None,
            ..self.clone()
        };
        let mut inputs: Vec<_> = policy.features.iter().map(|feature| feature.bound).collect();
        for layer in &mut policy.layers {
            if !layer.activation.is_identity() {
                // above nothing: a neuron that is provably 0 would be left out, and what is left would cost too little
                layer.bias.iter_mut().for_each(|bias| *bias = bias.abs().max(ALIVE));
            }
            layer.bounds = bounds::layer(&inputs, &layer.weights, &layer.bias, layer.activation).ok()?;
            inputs.clone_from(&layer.bounds);
        }
        policy.digests = digests::of(&policy);
        Some(policy)
    }
}

/// The first rows and columns of a layer.
fn cut(layer: &Layer, inputs: usize, outputs: usize) -> Layer {
    let rows = layer.weights.chunks_exact(layer.inputs.max(1)).take(outputs);
    Layer {
        inputs,
        outputs,
        weights: rows.flat_map(|row| row.iter().take(inputs).copied()).collect(),
        bias: layer.bias.iter().take(outputs).copied().collect(),
        bounds: Vec::new(),
        ..layer.clone()
    }
}

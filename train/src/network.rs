//! A chain of dense layers on ndarray: batch forward, backward of the chosen actions, one observation at a time.
//!
//! All parameters lie in one vector, layer by layer, weights `[inputs][outputs]` row-major and then the bias, so that
//! optimiser, clipping, target update and checkpoint see a plain slice.

use std::ops::Range;

use policy::{Activation, Shape};
use random::{Random, Xoshiro};

use crate::product::{Matrix, multiply, view, view_mut};

/// One layer and where its parameters lie.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Number of inputs.
    pub inputs: usize,
    /// Number of outputs.
    pub outputs: usize,
    /// Activation behind the layer.
    pub activation: Activation,
    /// `[inputs][outputs]`, row-major.
    pub weights: Range<usize>,
    /// `[outputs]`.
    pub bias: Range<usize>,
}

/// Dense layers and their parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    layers: Vec<Layer>,
    /// See the module.
    pub parameters: Vec<f32>,
}

/// Values of all layers for a batch; reused from update to update.
#[derive(Debug, Clone)]
pub struct Activations {
    /// Per layer `[rows][outputs]`, row-major, behind the activation.
    values: Vec<Vec<f32>>,
    rows: usize,
    packed: Vec<f32>,
}

/// Buffers of the backward pass.
#[derive(Debug, Clone)]
pub struct Backward {
    /// Gradient with respect to the parameters, in their order.
    pub gradient: Vec<f32>,
    deltas: [Vec<f32>; 2],
    /// Last layer's weights and their gradient as `[outputs][inputs]`: one action is one stretch of memory.
    turned: Vec<f32>,
    turned_gradient: Vec<f32>,
    packed: Vec<f32>,
}

impl Network {
    /// A network of `widths` (inputs, hidden ..., outputs) with all parameters 0; `activations` has one entry per layer.
    #[must_use]
    pub fn zeros(widths: &[usize], activations: &[Activation]) -> Self {
        let mut at = 0;
        let layers = widths
            .windows(2)
            .zip(activations)
            .map(|(pair, &activation)| {
                let (inputs, outputs) = (pair[0], pair[1]);
                let weights = at..at + inputs * outputs;
                let bias = weights.end..weights.end + outputs;
                at = bias.end;
                Layer {
                    inputs,
                    outputs,
                    activation,
                    weights,
                    bias,
                }
            })
            .collect();
        Self {
            layers,
            parameters: vec![0.0; at],
        }
    }

    /// PyTorch's default for `nn.Linear`: weights and bias uniform over +-1/sqrt(inputs).
    pub fn initialise(&mut self, rng: &mut Xoshiro) {
        for layer in &self.layers {
            let bound = 1.0 / (layer.inputs as f64).sqrt();
            for parameter in &mut self.parameters[layer.weights.start..layer.bias.end] {
                *parameter = rng.uniform(-bound, bound) as f32;
            }
        }
    }

    /// The layers, first to last.
    #[must_use]
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// Number of inputs of the first layer.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.layers.first().map_or(0, |layer| layer.inputs)
    }

    /// Number of outputs of the last layer.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.outputs)
    }

    /// Buffers for batches of `rows`.
    #[must_use]
    pub fn activations(&self, rows: usize) -> Activations {
        Activations {
            values: self
                .layers
                .iter()
                .map(|layer| vec![0.0; rows * layer.outputs])
                .collect(),
            rows,
            packed: Vec::new(),
        }
    }

    /// Buffers for [`Network::backward`] of batches of `rows`.
    #[must_use]
    pub fn backward_buffers(&self, rows: usize) -> Backward {
        let widest = self.layers.iter().map(|layer| layer.inputs).max().unwrap_or(0);
        let last = self.layers.last().map_or(0, |layer| layer.inputs * layer.outputs);
        Backward {
            gradient: vec![0.0; self.parameters.len()],
            deltas: [vec![0.0; rows * widest], vec![0.0; rows * widest]],
            turned: vec![0.0; last],
            turned_gradient: vec![0.0; last],
            packed: Vec::new(),
        }
    }

    /// Runs a batch `[rows][inputs]`; the result is [`Activations::outputs`].
    pub fn forward(&self, batch: &[f32], activations: &mut Activations) {
        let Activations { values, rows, packed } = activations;
        let rows = *rows;
        for (index, layer) in self.layers.iter().enumerate() {
            let (before, after) = values.split_at_mut(index);
            let input = before.last().map_or(batch, Vec::as_slice);
            let output = &mut after[0];
            let bias = &self.parameters[layer.bias.clone()];
            for row in output.chunks_exact_mut(layer.outputs) {
                row.copy_from_slice(bias);
            }
            let weights = Matrix::new(&self.parameters[layer.weights.clone()], layer.inputs, layer.outputs);
            // the order of these sums is that of learning; what acts is `q_values`
            multiply(Matrix::new(input, rows, layer.inputs), weights, true, output, packed);
            interp::activate(layer.activation, output.iter_mut());
        }
    }

    /// Gradient of a loss that depends, row by row, on the Q value of one action only: `slopes[r]` is its derivative
    /// with respect to `outputs[r][actions[r]]`. `activations` are those of [`Network::forward`] of this `batch`.
    pub fn backward(
        &self,
        batch: &[f32],
        activations: &Activations,
        actions: &[u32],
        slopes: &[f32],
        buffers: &mut Backward,
    ) {
        let rows = activations.rows;
        let Some((last, inner)) = self.layers.split_last() else {
            return;
        };
        let input = if inner.is_empty() {
            batch
        } else {
            &activations.values[inner.len() - 1]
        };
        self.backward_last(last, input, actions, slopes, buffers);
        for (index, layer) in inner.iter().enumerate().rev() {
            let input = if index == 0 {
                batch
            } else {
                &activations.values[index - 1]
            };
            let [delta, next] = &mut buffers.deltas;
            let delta = &mut delta[..rows * layer.outputs];
            derive(layer.activation, &activations.values[index], delta);
            let gradient = &mut buffers.gradient[layer.weights.start..layer.bias.end];
            let (weights, bias) = gradient.split_at_mut(layer.inputs * layer.outputs);
            bias.fill(0.0);
            for row in delta.chunks_exact(layer.outputs) {
                for (sum, &x) in bias.iter_mut().zip(row) {
                    *sum += x;
                }
            }
            let delta = Matrix::new(delta, rows, layer.outputs);
            let packed = &mut buffers.packed;
            multiply(
                Matrix::new(input, rows, layer.inputs).t(),
                delta,
                false,
                weights,
                packed,
            );
            // nothing lies before the first layer
            if index > 0 {
                let weights = Matrix::new(&self.parameters[layer.weights.clone()], layer.inputs, layer.outputs);
                multiply(delta, weights.t(), false, &mut next[..rows * layer.inputs], packed);
                buffers.deltas.swap(0, 1);
            }
        }
    }

    /// The last layer by rows, not by matrices: all but one of a row's output slopes are 0.
    fn backward_last(&self, layer: &Layer, input: &[f32], actions: &[u32], slopes: &[f32], buffers: &mut Backward) {
        let width = layer.inputs;
        let weights = view(&self.parameters[layer.weights.clone()], width, layer.outputs);
        view_mut(&mut buffers.turned, layer.outputs, width).assign(&weights.t());
        buffers.turned_gradient.fill(0.0);
        buffers.gradient[layer.bias.clone()].fill(0.0);
        let deltas = buffers.deltas[0].chunks_exact_mut(width);
        for (((input, delta), &action), &slope) in input.chunks_exact(width).zip(deltas).zip(actions).zip(slopes) {
            let action = action as usize;
            buffers.gradient[layer.bias.start + action] += slope;
            let stretch = action * width..(action + 1) * width;
            for (gradient, &x) in buffers.turned_gradient[stretch.clone()].iter_mut().zip(input) {
                *gradient += slope * x;
            }
            for (delta, &w) in delta.iter_mut().zip(&buffers.turned[stretch]) {
                *delta = slope * w;
            }
        }
        let turned = view(&buffers.turned_gradient, layer.outputs, width);
        view_mut(&mut buffers.gradient[layer.weights.clone()], width, layer.outputs).assign(&turned.t());
    }

    /// Q values of one observation in the order of `docs/reference/numeric-contract.md`, section 6 (from the bias, inputs in
    /// order, nothing contracted): the bits of the compiled policy. `scratch` grows once to the widest layer.
    pub fn q_values(&self, observation: &[f32], scratch: &mut [Vec<f32>; 2]) {
        wide::widest(Act {
            network: self,
            observation,
            scratch,
        });
    }

    /// Copies the parameters into the layers of a policy of the same shape (weights `[outputs][inputs]`).
    pub fn write_into(&self, policy_layers: &mut [policy::Layer]) {
        for (layer, to) in self.layers.iter().zip(policy_layers) {
            to.weights = self.weights_by_output(layer);
            to.bias = self.parameters[layer.bias.clone()].to_vec();
        }
    }

    /// Weights of a layer as `[outputs][inputs]`, row-major.
    #[must_use]
    pub fn weights_by_output(&self, layer: &Layer) -> Vec<f32> {
        let weights = view(&self.parameters[layer.weights.clone()], layer.inputs, layer.outputs);
        weights.t().iter().copied().collect()
    }
}

/// [`Network::q_values`] at work.
struct Act<'a> {
    network: &'a Network,
    observation: &'a [f32],
    scratch: &'a mut [Vec<f32>; 2],
}

impl wide::Work for Act<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let [x, y] = self.scratch;
        x.clear();
        x.extend_from_slice(self.observation);
        for layer in &self.network.layers {
            let parameters = &self.network.parameters;
            y.clear();
            y.extend_from_slice(&parameters[layer.bias.clone()]);
            let weights = &parameters[layer.weights.clone()];
            let mut at = 0;
            at = add_products::<64>(weights, x, y, at);
            at = add_products::<16>(weights, x, y, at);
            at = add_products::<8>(weights, x, y, at);
            at = add_products::<4>(weights, x, y, at);
            add_products::<1>(weights, x, y, at);
            interp::activate(layer.activation, y.iter_mut());
            std::mem::swap(x, y);
        }
    }
}

/// Adds weight times input to as many outputs from `at` on as there are whole blocks of `N`; returns where they end.
// inputs inside, a block of outputs in registers: each sum keeps the contract's order, and the compiler takes several at
// once. Rust never contracts the product and the sum to a fused operation
#[inline(always)]
fn add_products<const N: usize>(weights: &[f32], inputs: &[f32], outputs: &mut [f32], at: usize) -> usize {
    let width = outputs.len();
    let (blocks, _) = outputs[at..].as_chunks_mut::<N>();
    let mut at = at;
    for block in blocks {
        let mut sums = *block;
        for (row, &x) in weights.chunks_exact(width).zip(inputs) {
            if let Some(row) = row[at..].first_chunk::<N>() {
                for (sum, &w) in sums.iter_mut().zip(row) {
                    *sum += w * x;
                }
            }
        }
        *block = sums;
        at += N;
    }
    at
}

impl Activations {
    /// Values of the last layer, `[rows][outputs]`.
    #[must_use]
    pub fn outputs(&self) -> &[f32] {
        self.values.last().map_or(&[], Vec::as_slice)
    }
}

/// Multiplies `delta` by the derivative of the activation, taken from its value.
fn derive(activation: Activation, values: &[f32], delta: &mut [f32]) {
    let pairs = delta.iter_mut().zip(values);
    match activation.shape() {
        Shape::Hinge { .. } if activation.is_identity() => {}
        // not a product with 0, which would leave zeros of both signs
        Shape::Hinge { .. } if activation.is_rectifier() => {
            pairs.for_each(|(d, &y)| *d = if y > 0.0 { *d } else { 0.0 })
        }
        Shape::Hinge { below } => pairs.for_each(|(d, &y)| *d = if y > 0.0 { *d } else { below as f32 * *d }),
        Shape::Curve(curve) => match curve.slope_of_value {
            Some(slope) => pairs.for_each(|(d, &y)| *d *= slope(y)),
            // a contract with such a one is refused as it is read
            None => unreachable!("{} has no slope by its value", activation.word()),
        },
    }
}

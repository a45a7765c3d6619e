//! A network laid out for one observation at a time: what a look runs some ten thousand times without a change to the weights.
//!
//! ```text
//! weights [inputs][outputs] ─► [inputs][outputs, up to whole vectors]      observation ─► inputs that are not 0 ─► rows of those
//! ```
//!
//! Invariant: the bits of [`Network::q_values`], whose sums begin with the bias and take the inputs in order. An input of 0 adds nothing to
//! a sum of finite weights that is not -0, and half of a rectifier's outputs are 0.

use policy::Activation;

use crate::network::Network;

/// A network that does not learn.
#[derive(Debug)]
pub(crate) struct Quick {
    layers: Vec<Layer>,
    /// Inputs of 0 may be left out.
    skips: bool,
    widest: usize,
}

#[derive(Debug)]
struct Layer {
    inputs: usize,
    outputs: usize,
    /// Outputs up to whole vectors.
    width: usize,
    activation: Activation,
    /// `[inputs][width]`
    weights: Vec<f32>,
    /// `[width]`
    bias: Vec<f32>,
}

/// What a run needs; reused from run to run.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scratch {
    x: Vec<f32>,
    y: Vec<f32>,
    /// A bit for each input that is not 0.
    kept: Vec<u64>,
}

/// Numbers of a vector.
const VECTOR: usize = 16;
/// Inputs of a word of bits.
const WORD: usize = 64;

impl Quick {
    pub fn new(network: &Network) -> Self {
        let layer = |layer: &crate::network::Layer| {
            // a remainder of three vectors is taken as four
            let width = match layer.outputs.next_multiple_of(VECTOR) {
                width if width % (4 * VECTOR) == 3 * VECTOR => width + VECTOR,
                width => width,
            };
            let padded = |row: &[f32]| {
                let mut row = row.to_vec();
                row.resize(width, 0.0);
                row
            };
            let weights = &network.parameters[layer.weights.clone()];
            Layer {
                inputs: layer.inputs,
                outputs: layer.outputs,
                width,
                activation: layer.activation,
                weights: weights.chunks_exact(layer.outputs).flat_map(padded).collect(),
                bias: padded(&network.parameters[layer.bias.clone()]),
            }
        };
        let layers: Vec<Layer> = network.layers().iter().map(layer).collect();
        let is_minus_zero = |x: &f32| *x == 0.0 && x.is_sign_negative();
        Self {
            skips: network.parameters.iter().all(|x| x.is_finite())
                && !layers.iter().any(|layer| layer.bias.iter().any(is_minus_zero)),
            widest: layers
                .iter()
                .map(|layer| layer.width.max(layer.inputs))
                .max()
                .unwrap_or(0),
            layers,
        }
    }

    /// The Q values of an observation.
    pub fn q_values<'a>(&self, observation: &[f32], scratch: &'a mut Scratch) -> &'a [f32] {
        scratch.x.resize(self.widest, 0.0);
        scratch.y.resize(self.widest, 0.0);
        scratch.kept.resize(self.widest.div_ceil(WORD), 0);
        scratch.x[..observation.len()].copy_from_slice(observation);
        wide::widest(Run { network: self, scratch });
        let outputs = self.layers.last().map_or(0, |layer| layer.outputs);
        &scratch.x[..outputs]
    }
}

/// [`Quick::q_values`] at work, from `x` to `x`.
struct Run<'a, 'b> {
    network: &'a Quick,
    scratch: &'b mut Scratch,
}

impl wide::Work for Run<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Scratch { x, y, kept } = self.scratch;
        for layer in &self.network.layers {
            let inputs = &x[..layer.inputs];
            for (word, inputs) in kept.iter_mut().zip(inputs.chunks(WORD)) {
                *word = match self.network.skips {
                    true => not_zero(inputs),
                    false => u64::MAX >> (WORD - inputs.len()),
                };
            }
            let kept = &kept[..layer.inputs.div_ceil(WORD)];
            let mut at = 0;
            while at < layer.width {
                at += match layer.width - at {
                    VECTOR => layer.sum::<VECTOR>(x, kept, y, at),
                    left if left == 2 * VECTOR => layer.sum::<{ 2 * VECTOR }>(x, kept, y, at),
                    _ => layer.sum::<{ 4 * VECTOR }>(x, kept, y, at),
                };
            }
            interp::activate(layer.activation, y[..layer.outputs].iter_mut());
            std::mem::swap(x, y);
        }
    }
}

impl Layer {
    /// `N` sums from output `at` on; returns how many.
    #[inline(always)]
    fn sum<const N: usize>(&self, x: &[f32], kept: &[u64], y: &mut [f32], at: usize) -> usize {
        let (Some(bias), Some(y)) = (self.bias[at..].first_chunk::<N>(), y[at..].first_chunk_mut::<N>()) else {
            return N;
        };
        let mut sums = *bias;
        for (word, &kept) in kept.iter().enumerate() {
            let mut left = kept;
            while left != 0 {
                let n = word * WORD + left.trailing_zeros() as usize;
                left &= left - 1;
                if let Some(row) = self.weights[n * self.width + at..].first_chunk::<N>() {
                    for (sum, &w) in sums.iter_mut().zip(row) {
                        *sum += w * x[n];
                    }
                }
            }
        }
        *y = sums;
        N
    }
}

/// A bit for each of up to [`WORD`] numbers that is not 0.
#[inline(always)]
fn not_zero(x: &[f32]) -> u64 {
    // vector by vector: a list of indices, one after the other, took as long as the sums
    let mut bits = 0;
    let (vectors, rest) = x.as_chunks::<VECTOR>();
    for (at, vector) in vectors.iter().enumerate() {
        let mut of_vector = 0;
        for (n, x) in vector.iter().enumerate() {
            of_vector |= u32::from(*x != 0.0) << n;
        }
        bits |= u64::from(of_vector) << (at * VECTOR);
    }
    for (n, x) in rest.iter().enumerate() {
        bits |= u64::from(*x != 0.0) << (vectors.len() * VECTOR + n);
    }
    bits
}

#[cfg(test)]
mod tests {
    use random::{Random, Xoshiro};

    use super::*;

    fn hold_against_each_other(network: &Network, rng: &mut Xoshiro) {
        let quick = Quick::new(network);
        let (mut own, mut theirs) = (Scratch::default(), [Vec::new(), Vec::new()]);
        for _ in 0..50 {
            let mut observation: Vec<f32> = (0..network.inputs()).map(|_| rng.uniform(-2.0, 2.0) as f32).collect();
            observation[0] = [0.0, -0.0, 1.0][rng.below(3)];
            network.q_values(&observation, &mut theirs);
            let bits = |values: &[f32]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(quick.q_values(&observation, &mut own)), bits(&theirs[0]));
        }
    }

    #[test]
    fn the_bits_are_those_of_the_network() {
        let mut rng = Xoshiro::new(3);
        for widths in [
            [5, 64, 64, 13],
            [6, 64, 64, 17],
            [2, 40, 70, 12],
            [1, 100, 3, 130],
            [7, 16, 33, 48],
        ] {
            let mut network = Network::zeros(&widths, &[Activation::Relu, Activation::Tanh, Activation::Identity]);
            network.initialise(&mut rng);
            hold_against_each_other(&network, &mut rng);
            network.layers().to_vec().iter().for_each(|layer| {
                // sums that begin with -0, and stay so while products are -0
                network.parameters[layer.bias.clone()].fill(-0.0);
            });
            hold_against_each_other(&network, &mut rng);
            let weight = network.layers()[1].weights.start;
            network.parameters[weight] = f32::INFINITY;
            let quick = Quick::new(&network);
            assert!(!quick.skips, "0 times infinity is no number");
        }
    }
}

//! The network in integers (contract section 6b): 16- or 8-bit weights, 16-bit activations, 32-bit sums.
//!
//! Computed in 64 bits: a sum that left 32 bits would differ from the generated code and be found.

use ndarray::{Array1, Array2, ArrayView1};
use policy::scales::{LayerScale, Scales, power_of_two};
use policy::{Activation, Policy};

use crate::activation::integer;
use crate::real::Real;
use crate::trace::LayerTrace;

/// An integer network with its scales.
#[derive(Debug, Clone)]
pub(crate) struct Network {
    inputs: Vec<Input>,
    layers: Vec<Layer>,
}

#[derive(Debug, Clone, Copy)]
struct Input {
    factor: f64,
    low: i64,
    high: i64,
}

#[derive(Debug, Clone)]
struct Layer {
    /// `[inputs][outputs]`
    weights: Array2<i64>,
    bias: Array1<i64>,
    activation: Activation,
    /// Exponents `[outputs]` of the sums and behind the activation.
    accumulators: Vec<i32>,
    shift: u32,
    exponents: Vec<i32>,
}

impl Network {
    /// Rounds weights and biases; `None` unless the policy's format is an integer one.
    pub fn new(policy: &Policy) -> Option<Self> {
        let Scales { inputs, layers } = policy::scales::of(policy)?;
        let input = |input: &policy::scales::InputScale| Input {
            factor: power_of_two(input.exponent),
            low: i64::from(input.low),
            high: i64::from(input.high),
        };
        Some(Self {
            inputs: inputs.iter().map(input).collect(),
            layers: policy
                .layers
                .iter()
                .zip(&layers)
                .map(|(layer, scale)| Layer::new(layer, scale))
                .collect(),
        })
    }

    /// Outputs of each layer.
    pub fn outputs(&self) -> impl Iterator<Item = usize> + '_ {
        self.layers.iter().map(|layer| layer.bias.len())
    }

    /// Runs all layers; the traces hold the integers' values.
    pub fn run<T: Real>(&self, observation: ArrayView1<'_, T>, traces: &mut [LayerTrace<T>]) {
        // measurements of the integer formats are binary32: the way through binary64 is exact
        let inputs = self.inputs.iter().zip(observation);
        let mut x: Array1<i64> = inputs.map(|(input, o)| input.integer(o.to_f64() as f32)).collect();
        for (layer, trace) in self.layers.iter().zip(traces) {
            x = layer.run(&x, trace);
        }
    }
}

impl Input {
    /// `hu(o * 2^e)`, clamped to the box; a NaN by its sign to one end.
    fn integer(self, observation: f32) -> i64 {
        if observation.is_nan() {
            return if observation.is_sign_negative() {
                self.low
            } else {
                self.high
            };
        }
        // exact: 24 bits and a power of two; `as` saturates, far outside of the clamp
        rounded(f64::from(observation) * self.factor).clamp(self.low, self.high)
    }
}

/// Round half up.
pub(crate) fn rounded(x: f64) -> i64 {
    // not `round`, which sends -0.5 to -1: the contract rounds halves up on both sides of 0
    (x + 0.5).floor() as i64
}

/// `floor(x / 2^bits + 1/2)`.
pub(crate) fn shifted(x: i64, bits: u32) -> i64 {
    if bits == 0 {
        x
    } else {
        // `/` would round towards 0; with a positive divisor Euclid's quotient is the floor
        (x + (1 << (bits - 1))).div_euclid(1 << bits)
    }
}

impl Layer {
    fn new(layer: &policy::Layer, scale: &LayerScale) -> Self {
        let weight = |(i, o): (usize, usize)| {
            let weight = f64::from(layer.weights[o * layer.inputs + i]);
            rounded(weight * power_of_two(scale.accumulators[o] - scale.inputs[i]))
        };
        let bias = |(bias, exponent): (&f32, &i32)| rounded(f64::from(*bias) * power_of_two(*exponent));
        Self {
            weights: Array2::from_shape_fn((layer.inputs, layer.outputs), weight),
            bias: layer.bias.iter().zip(&scale.accumulators).map(bias).collect(),
            activation: layer.activation,
            accumulators: scale.accumulators.clone(),
            shift: scale.shift,
            exponents: scale.outputs.clone(),
        }
    }

    fn run<T: Real>(&self, x: &Array1<i64>, trace: &mut LayerTrace<T>) -> Array1<i64> {
        // sums of integers are exact: here the order of the inputs is free
        let mut sums = self.bias.clone();
        for (row, &x) in self.weights.rows().into_iter().zip(x) {
            sums.zip_mut_with(&row, |sum, &w| *sum += w * x);
        }
        let activated = sums.iter().zip(&self.accumulators).zip(&self.exponents);
        let y: Array1<i64> = activated
            .map(|((sum, from), to)| integer(self.activation, *sum, (*from, *to), self.shift))
            .collect();
        // a sum of 31 bits may be rounded here, in the trace alone; outputs are within 2^24, so each is exact
        let value = |(x, exponent): (&i64, &i32)| T::nearest(*x as f64 * power_of_two(-exponent));
        trace.pre_activation = sums.iter().zip(&self.accumulators).map(value).collect();
        trace.post_activation = y.iter().zip(&self.exponents).map(value).collect();
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_rounded_up_on_both_sides_of_zero() {
        let halves = [-3, -1, 1, 3].map(|x| shifted(x, 1));
        assert_eq!(halves, [-1, 0, 1, 2]);
        assert_eq!([-0.5, 0.5, 1.5, -1.5].map(rounded), [0, 1, 2, -1]);
        assert_eq!(shifted(-7, 0), -7);
    }

    #[test]
    fn an_observation_is_rounded_half_up_and_clamped() {
        let input = Input {
            factor: 16.0,
            low: -100,
            high: 100,
        };
        assert_eq!([0.0, 0.03125, -0.03125, 1.0].map(|x| input.integer(x)), [0, 1, 0, 16]);
        // one step below and above a half, where a sum in binary32 would round
        let near = [0.03125_f32.next_down(), (-0.03125_f32).next_down(), 0.03125, -0.03125];
        assert_eq!(near.map(|x| input.integer(x)), [0, -1, 1, 0]);
        let far = [1e30, -1e30, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -f32::NAN];
        assert_eq!(far.map(|x| input.integer(x)), [100, -100, 100, -100, 100, -100]);
    }
}

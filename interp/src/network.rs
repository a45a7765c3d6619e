//! Dense layers and argmax (contract sections 6 and 7).

use ndarray::{Array1, Array2, ArrayView1};
use policy::Policy;

use crate::activation::activate;
use crate::integer;
use crate::real::Real;
use crate::trace::LayerTrace;

/// A dense layer in the format.
#[derive(Debug, Clone)]
pub(crate) struct Layer<T> {
    /// `[inputs][outputs]`: transposed against the policy, so that outputs advance side by side.
    weights: Array2<T>,
    bias: Array1<T>,
    activation: policy::Activation,
    /// Products are added with one rounding (`f32-fma`).
    fused: bool,
}

impl<T: Real> Layer<T> {
    pub fn new(layer: &policy::Layer, fused: bool) -> Self {
        Self {
            weights: Array2::from_shape_fn((layer.inputs, layer.outputs), |(i, o)| {
                T::widen(layer.weights[o * layer.inputs + i])
            }),
            bias: layer.bias.iter().map(|&b| T::widen(b)).collect(),
            activation: layer.activation,
            fused,
        }
    }

    pub fn outputs(&self) -> usize {
        self.bias.len()
    }

    /// Runs the layer; the result is `trace.post_activation`.
    pub fn run(&self, input: ArrayView1<'_, T>, trace: &mut LayerTrace<T>) {
        // sums start from the bias, not with it at the end: in floats these are different bits
        trace.pre_activation.assign(&self.bias);
        let accumulate = if self.fused { T::accumulate_fused } else { T::accumulate };
        accumulate(self.weights.view(), input, trace.pre_activation.view_mut());
        trace.post_activation.assign(&trace.pre_activation);
        activate(self.activation, trace.post_activation.iter_mut());
    }
}

/// Greedy action (section 7): the lowest index among the largest values; a NaN never wins.
pub fn argmax<T: Real>(q_values: ArrayView1<'_, T>) -> usize {
    // compared one by one with `>`, not with `max_by`: equal values keep the lower index, and a NaN never wins
    let mut best = -T::MAX;
    let mut index = 0;
    for (n, &q) in q_values.iter().enumerate() {
        if q > best {
            best = q;
            index = n;
        }
    }
    index
}

/// The network in the policy's numeric format.
#[derive(Debug, Clone)]
pub(crate) enum Network<T> {
    /// In the format of the controller (section 6).
    Real(Vec<Layer<T>>),
    /// In integers (section 6b).
    Integer(integer::Network),
}

impl<T: Real> Network<T> {
    pub fn new(policy: &Policy) -> Self {
        let fused = policy.numeric_format == policy::NumericFormat::F32Fma;
        match integer::Network::new(policy) {
            Some(network) => Self::Integer(network),
            None => Self::Real(policy.layers.iter().map(|layer| Layer::new(layer, fused)).collect()),
        }
    }

    /// Traces of the right shape.
    pub fn blank(&self) -> Vec<LayerTrace<T>> {
        let blank = |outputs: usize| {
            let zeros = Array1::from_elem(outputs, T::ZERO);
            LayerTrace {
                pre_activation: zeros.clone(),
                post_activation: zeros,
            }
        };
        match self {
            Self::Real(layers) => layers.iter().map(|layer| blank(layer.outputs())).collect(),
            Self::Integer(network) => network.outputs().map(blank).collect(),
        }
    }

    pub fn run(&self, observation: ArrayView1<'_, T>, traces: &mut [LayerTrace<T>]) {
        let layers = match self {
            Self::Integer(network) => return network.run(observation, traces),
            Self::Real(layers) => layers,
        };
        let mut input = observation;
        for (layer, trace) in layers.iter().zip(traces) {
            layer.run(input, trace);
            input = trace.post_activation.view();
        }
    }
}

#[cfg(test)]
mod tests {
    use ndarray::aview1;

    use super::*;

    fn layer(inputs: usize, outputs: usize, seed: u32, activation: policy::Activation) -> policy::Layer {
        // a small linear congruential generator: weights of both signs and several magnitudes
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        };
        policy::Layer {
            name: "q_net.0".into(),
            inputs,
            outputs,
            weights: (0..inputs * outputs).map(|_| next()).collect(),
            bias: (0..outputs).map(|_| next()).collect(),
            activation,
            bounds: vec![],
        }
    }

    fn run<T: Real>(layer: &policy::Layer, input: &[T]) -> LayerTrace<T> {
        let mut trace = LayerTrace {
            pre_activation: Array1::from_elem(layer.outputs, T::ZERO),
            post_activation: Array1::from_elem(layer.outputs, T::ZERO),
        };
        Layer::<T>::new(layer, false).run(aview1(input), &mut trace);
        trace
    }

    /// Section 6 as it stands, one output after the other, straight from the policy's row-major weights.
    fn one_by_one(layer: &policy::Layer, input: &[f32]) -> Vec<u32> {
        (0..layer.outputs)
            .map(|o| {
                let row = &layer.weights[o * layer.inputs..][..layer.inputs];
                let mut acc = layer.bias[o];
                for (w, x) in row.iter().zip(input) {
                    let product = std::hint::black_box(w * x);
                    acc = std::hint::black_box(acc + product);
                }
                acc.to_bits()
            })
            .collect()
    }

    #[test]
    fn outputs_side_by_side_have_the_bits_of_outputs_one_by_one() {
        for (seed, (inputs, outputs)) in [(6, 64), (64, 64), (64, 12), (1, 1), (3, 17), (33, 5)]
            .into_iter()
            .enumerate()
        {
            let layer = layer(inputs, outputs, seed as u32, policy::Activation::Identity);
            let input: Vec<f32> = (0..inputs)
                .map(|i| ((i * 37 + seed * 11) % 41) as f32 * 0.37 - 7.0)
                .collect();
            let bits: Vec<u32> = run(&layer, &input)
                .post_activation
                .iter()
                .map(|x| x.to_bits())
                .collect();
            assert_eq!(bits, one_by_one(&layer, &input), "{inputs} x {outputs}");
        }
    }

    #[test]
    fn sum_starts_from_the_bias_and_goes_in_input_order() {
        // bias 2^24: each product of 1 vanishes, in any other order 2 would arrive
        let layer = policy::Layer {
            name: "l".into(),
            inputs: 2,
            outputs: 1,
            weights: vec![1.0, 1.0],
            bias: vec![16_777_216.0],
            activation: policy::Activation::Identity,
            bounds: vec![],
        };
        assert_eq!(run(&layer, &[1.0_f32, 1.0]).post_activation[0], 16_777_216.0);
        assert_eq!(run(&layer, &[1.0_f64, 1.0]).post_activation[0], 16_777_218.0);
    }

    #[test]
    fn product_is_rounded_before_the_sum() {
        // x^2 = 1 + 2^-11 + 2^-24 is a tie that rounds to 1 + 2^-11; a fused multiply-add would leave 2^-24
        let x = 1.0_f32 + 2.0_f32.powi(-12);
        let layer = policy::Layer {
            name: "l".into(),
            inputs: 1,
            outputs: 1,
            weights: vec![x],
            bias: vec![-(1.0 + 2.0_f32.powi(-11))],
            activation: policy::Activation::Identity,
            bounds: vec![],
        };
        assert_eq!(run(&layer, &[x]).post_activation[0], 0.0);
    }

    #[test]
    fn activation_acts_on_the_sums_and_leaves_them_in_the_trace() {
        let layer = layer(4, 9, 5, policy::Activation::LeakyRelu { slope: 0.25 });
        let trace = run(&layer, &[1.0_f32, -2.0, 0.5, 3.0]);
        assert!(trace.pre_activation.iter().any(|&x| x < 0.0));
        for (&pre, &post) in trace.pre_activation.iter().zip(&trace.post_activation) {
            assert_eq!(post, if pre > 0.0 { pre } else { 0.25 * pre });
        }
    }

    #[test]
    fn argmax_tie_takes_lowest_index() {
        assert_eq!(argmax(aview1(&[1.0_f32, 3.0, 3.0, 2.0])), 1);
        assert_eq!(argmax(aview1(&[0.0_f32, 0.0])), 0);
    }

    #[test]
    fn argmax_takes_zeros_of_both_signs_as_equal() {
        assert_eq!(argmax(aview1(&[-0.0_f32, 0.0])), 0);
        assert_eq!(argmax(aview1(&[0.0_f32, -0.0])), 0);
        assert_eq!(argmax(aview1(&[-1.0_f32, -0.0, 0.0])), 1);
    }

    #[test]
    fn argmax_never_takes_a_nan() {
        assert_eq!(argmax(aview1(&[f32::NAN, -5.0, f32::NAN])), 1);
        assert_eq!(argmax(aview1(&[f32::NAN, f32::NAN])), 0);
        assert_eq!(argmax(aview1(&[-f32::MAX, f32::MIN])), 0);
    }
}

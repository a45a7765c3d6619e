//! What is made of a network: its scales in integers, and smaller ones.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;
use policy::NumericFormat;

/// Numeric contract, section 6b: the finest exponent is the largest e <= 24 with bound * 2^e <= 32767.
#[test]
fn no_observation_has_more_than_24_fractional_bits() {
    let exponents = |clips: [f64; 2]| -> Vec<i32> {
        let [first, second] = clips.map(|clip| format!("clip = [-{clip}, {clip}]"));
        let policy = Folder::new()
            .replace("clip = [-20.0, 20.0]", &first)
            .replace(
                "filters = [{ delay = 1 }]",
                &format!("filters = [{{ delay = 1 }}]\n{second}"),
            )
            .policy()
            .with_format(NumericFormat::I16);
        let scales = policy::scales::of(&policy).unwrap();
        scales.inputs.iter().map(|input| input.exponent).collect()
    };
    // 2^-10 would fit with 24 (and with no more), 2^-12 with 26
    assert_eq!(exponents([0.000_976_562_5, 0.000_244_140_625]), [24, 24]);
    // 1 fits with 14, and 14 + floor((24 - 14) / 2) is 19
    assert_eq!(exponents([1.0, 0.000_244_140_625]), [14, 19]);
}

#[test]
fn a_network_that_is_cut_keeps_its_inputs_and_its_outputs() {
    let policy = Folder::new().policy();
    assert_eq!(policy.widest_hidden(), 4);
    let mut shallow = policy.clone();
    shallow.layers.truncate(1);
    assert_eq!(shallow.widest_hidden(), 0, "a last layer is not hidden");
    let cut = policy.cut_to(2).unwrap();
    let shapes: Vec<_> = cut.layers.iter().map(|layer| (layer.inputs, layer.outputs)).collect();
    assert_eq!(shapes, [(2, 2), (2, 3)]);
    let (before, after) = (&policy.layers[1], &cut.layers[1]);
    let first_two: Vec<f32> = before
        .weights
        .chunks_exact(4)
        .flat_map(|row| row[..2].to_vec())
        .collect();
    assert_eq!((&after.weights, &after.bias), (&first_two, &before.bias));
    // no layer is without neurons
    let one = policy.cut_to(0).unwrap();
    assert_eq!(one.layers.iter().map(|layer| layer.outputs).collect::<Vec<_>>(), [1, 3]);
}

#[test]
fn a_hidden_layer_is_left_out_where_there_are_two() {
    let policy = Folder::new().policy();
    assert_eq!(policy.without_a_hidden_layer(), None, "it has one alone");
    let mut deeper = policy.clone();
    let [first, last] = policy.layers.as_slice() else {
        panic!("two layers");
    };
    let middle = policy::model::Layer {
        inputs: 4,
        outputs: 3,
        weights: vec![0.5; 12],
        bias: vec![0.1; 3],
        ..first.clone()
    };
    let narrow = policy::model::Layer {
        inputs: 3,
        weights: vec![0.25; 9],
        ..last.clone()
    };
    deeper.layers = vec![first.clone(), middle, narrow];
    let shallow = deeper.without_a_hidden_layer().unwrap();
    let shapes: Vec<_> = shallow
        .layers
        .iter()
        .map(|layer| (layer.inputs, layer.outputs))
        .collect();
    assert_eq!(shapes, [(2, 4), (4, 3)]);
    assert_eq!(shallow.layers[1].weights, [0.25; 12]);
}

/// A neuron whose bias is below 0 might be provably 0, would be left out, and the cost of the rest would be too low.
#[test]
fn hidden_neurons_of_a_network_that_is_cut_are_alive() {
    let mut policy = Folder::new().policy();
    policy.layers[0].bias = vec![-0.5, 0.0, 1e-4, 2.0];
    policy.layers[1].bias = vec![-0.5, 0.0, 1e-4];
    let cut = policy.cut_to(4).unwrap();
    assert_eq!(cut.layers[0].bias, [0.5, 1e-3, 1e-3, 2.0]);
    assert_eq!(cut.layers[1].bias, policy.layers[1].bias, "an output may be what it is");
    assert_eq!((cut.layers[0].bounds.len(), cut.layers[1].bounds.len()), (4, 3));
    // of the first neuron the range of its sum, with the new bias: a rectifier has nothing below 0
    let weights = &policy.layers[0].weights;
    let products = [(weights[0], -20.0, 20.0), (weights[1], -150.0, 100.0)];
    let highest = products.map(|(w, low, high): (f32, f32, f32)| (w * low).max(w * high));
    let expected = f64::from(highest[0] + highest[1] + 0.5);
    let high = cut.layers[0].bounds[0].high;
    assert!((high / expected - 1.0).abs() < 1e-5, "{high}");
    assert_eq!(cut.layers[0].bounds[0].low, 0.0);
    assert_ne!(cut.digests.weights, policy.digests.weights, "it is another network");
    assert!(cut.golden.is_none());
    // sums that may leave the format have no bounds, and such a network no cost
    policy.layers[1].weights.fill(1e37);
    assert_eq!(policy.cut_to(4), None);
}

#[test]
fn another_activation_stands_behind_hidden_layers_alone() {
    use policy::Activation::{Identity, Relu, Tanh};
    let policy = Folder::new().policy();
    let of = |policy: Option<policy::Policy>| -> Vec<_> {
        let layers = policy.unwrap().layers;
        layers.iter().map(|layer| layer.activation).collect()
    };
    assert_eq!(of(policy.activated_by(Tanh)), [Tanh, Identity]);
    assert_eq!(of(policy.with_activations(&[Tanh])), [Tanh, Identity]);
    assert_eq!(of(policy.with_activations(&[])), [Relu, Identity]);
    assert_eq!(of(policy.with_activations(&[Identity, Tanh])), [Identity, Tanh]);
}

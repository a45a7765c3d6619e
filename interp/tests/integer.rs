//! A network in integers, layer by layer, against the formulas of contract section 6b in plain 64-bit arithmetic.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

#[allow(dead_code)] // another file of tests has the rest
mod common;

use common::{Dense, PLAIN, load};
use interp::Controller;
use ndarray::aview1;
use policy::scales::{self, Scales};
use policy::{NumericFormat, Policy};

const SLOPE: f64 = 0.15;

fn network(activation: &str, format: &str) -> Policy {
    let contract = format!(
        "name = \"integers\"\nsample_period = 0.25\nnumeric_format = \"{format}\"\n\
         [[signal]]\nname = \"u\"\nrange = [-2.0, 2.0]\n[[signal]]\nname = \"i\"\nrange = [-1.0, 3.0]\n\
         [[feature]]\nname = \"x\"\nsource = \"u\"\n[[feature]]\nname = \"y\"\nsource = \"i\"\n\
         [network]\nweights = \"weights.safetensors\"\nhidden_activation = {activation}\n[actions]\nduties = [0.25, 0.75]\n{PLAIN}"
    );
    let hidden = Dense {
        inputs: 2,
        outputs: 3,
        weights: &[0.7, -0.9, 1.3, 0.4, -0.55, -0.8],
        bias: &[0.1, -0.6, 0.35],
    };
    let last = Dense {
        inputs: 3,
        outputs: 2,
        weights: &[0.8, -0.3, 1.1, -0.45, 0.95, 0.2],
        bias: &[0.05, -0.15],
    };
    load(&contract, &[], &[hidden, last])
}

/// `hu`
fn half_up(x: f64) -> i64 {
    (x + 0.5).floor() as i64
}

/// `cut`
fn cut(x: i64, bits: u32) -> i64 {
    (x as f64 / 2f64.powi(bits as i32) + 0.5).floor() as i64
}

/// Item 3 of the section, for the three kinds that need no table of constants.
fn activated(kind: &str, sum: i64, accumulator: i32, shift: u32, exponent: i32) -> i64 {
    match kind {
        "relu" => cut(sum, shift).max(0),
        "leaky" => {
            let (y, slope) = (cut(sum, shift), half_up(SLOPE * 32_768.0).min(32_767));
            if y > 0 { y } else { cut(y * slope, 15) }
        }
        "softsign" => {
            let x = sum as f32 * 2f32.powi(-accumulator);
            let t = x / (1.0 + x.abs());
            (t * 2f32.powi(exponent) + 32_768.5).trunc() as i64 - 32_768
        }
        _ => cut(sum, shift),
    }
}

/// Sums and outputs of all layers.
fn layers(policy: &Policy, scales: &Scales, kind: &str, observation: [f32; 2]) -> Vec<(Vec<i64>, Vec<i64>)> {
    let mut x: Vec<i64> = observation
        .iter()
        .zip(&scales.inputs)
        .map(|(x, scale)| half_up(f64::from(*x) * 2f64.powi(scale.exponent)).clamp(scale.low.into(), scale.high.into()))
        .collect();
    let mut all = Vec::new();
    for (n, (layer, scale)) in policy.layers.iter().zip(&scales.layers).enumerate() {
        let sums: Vec<i64> = (0..layer.outputs)
            .map(|o| {
                let a = scale.accumulators[o];
                let weight = |i: usize| f64::from(layer.weights[o * layer.inputs + i]);
                let term = |i: usize| half_up(weight(i) * 2f64.powi(a - scale.inputs[i])) * x[i];
                half_up(f64::from(layer.bias[o]) * 2f64.powi(a)) + (0..layer.inputs).map(term).sum::<i64>()
            })
            .collect();
        let kind = if n == 0 { kind } else { "identity" };
        x = (0..layer.outputs)
            .map(|o| activated(kind, sums[o], scale.accumulators[o], scale.shift, scale.outputs[o]))
            .collect();
        all.push((sums, x.clone()));
    }
    all
}

#[test]
fn every_layer_is_what_the_formulas_say() {
    let leaky = format!("{{ leaky_relu = {SLOPE} }}");
    let kinds = [("relu", "\"relu\""), ("leaky", &*leaky), ("softsign", "\"softsign\"")];
    let mut signs = [false; 2];
    for ((kind, activation), format) in kinds.into_iter().flat_map(|kind| [(kind, "i16"), (kind, "i8")]) {
        let policy = network(activation, format);
        assert!(matches!(policy.numeric_format, NumericFormat::I16 | NumericFormat::I8));
        let scales = scales::of(&policy).unwrap();
        let controller = Controller::<f32>::new(&policy);
        for n in 0..400_i16 {
            // over the box and a little beyond it, where the ends are taken
            let observation = [f32::from(n) * 0.0113 - 2.2, f32::from((n * 37) % 400) * 0.0107 - 1.1];
            let expected = layers(&policy, &scales, kind, observation);
            signs[0] |= expected[0].0.iter().any(|sum| *sum < 0);
            signs[1] |= expected[0].0.iter().any(|sum| *sum > 0);
            let (_, outputs) = &expected[1];
            let exact = outputs.iter().zip(&scales.layers[1].outputs);
            let exact: Vec<f32> = exact.map(|(y, e)| (*y as f64 * 2f64.powi(-e)) as f32).collect();
            let found = controller.q_values(&aview1(&observation)).unwrap();
            assert_eq!(found.to_vec(), exact, "{kind} {format} {observation:?}");
        }
    }
    assert_eq!(signs, [true; 2], "sums of both signs");
}

/// What a trace tells of each layer: sums and outputs as numbers.
#[test]
fn a_trace_has_the_sums_and_outputs_of_every_layer_as_numbers() {
    let policy = network("\"relu\"", "i16");
    let scales = scales::of(&policy).unwrap();
    let controller = Controller::<f32>::new(&policy);
    let samples = [1.25, -0.5].map(interp::Sample::Physical);
    let trace = controller.eval(&samples).unwrap();
    let expected = layers(&policy, &scales, "relu", [1.25, -0.5]);
    for ((layer, scale), (sums, outputs)) in trace.layers.iter().zip(&scales.layers).zip(&expected) {
        let numbers = |integers: &[i64], exponents: &[i32]| -> Vec<f32> {
            let number = |(x, e): (&i64, &i32)| (*x as f64 * 2f64.powi(-e)) as f32;
            integers.iter().zip(exponents).map(number).collect()
        };
        assert_eq!(layer.pre_activation.to_vec(), numbers(sums, &scale.accumulators));
        assert_eq!(layer.post_activation.to_vec(), numbers(outputs, &scale.outputs));
    }
    assert_eq!(trace.layers.len(), 2);
}

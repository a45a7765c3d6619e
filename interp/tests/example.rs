//! The example policy: the trainer's known answers, and binary32 against binary64.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

use std::path::Path;

use interp::{Controller, Sample, argmax};
use ndarray::{ArrayView1, aview1};
use policy::Policy;
use safetensors::SafeTensors;

fn example() -> Policy {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/buck12/policy.toml");
    policy::load(&path).unwrap_or_else(|faults| panic!("{faults:#?}"))
}

/// Observations, Q values, actions, read from the file and not through the policy.
fn golden() -> (Vec<f32>, Vec<f32>, Vec<i32>) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/buck12/golden.safetensors");
    let bytes = std::fs::read(path).unwrap();
    let tensors = SafeTensors::deserialize(&bytes).unwrap();
    let words = |name: &str| -> Vec<u32> {
        let data = tensors.tensor(name).unwrap().data().to_vec();
        data.chunks_exact(4)
            .map(|word| u32::from_le_bytes(word.try_into().unwrap()))
            .collect()
    };
    let floats = |name: &str| words(name).into_iter().map(f32::from_bits).collect();
    (
        floats("obs"),
        floats("q"),
        words("action").into_iter().map(u32::cast_signed).collect(),
    )
}

#[test]
fn known_answers_of_the_trainer_hold() {
    let controller = Controller::<f32>::new(&example());
    let (observations, q_values, actions) = golden();
    assert_eq!(actions.len(), 515);
    let mut worst = 0.0_f32;
    for ((observation, expected), action) in observations.chunks_exact(6).zip(q_values.chunks_exact(12)).zip(actions) {
        let q = controller.q_values(&aview1(observation)).unwrap();
        assert_eq!(argmax(q.view()), action as usize);
        let largest = expected.iter().fold(0.0_f32, |largest, q| largest.max(q.abs()));
        for (expected, q) in expected.iter().zip(&q) {
            worst = worst.max((expected - q).abs() / largest);
        }
    }
    println!("worst relative error of Q: {worst:e}");
    assert!(worst < 1e-5, "{worst}");
}

/// A posteriori bound of a dense layer in binary32: error of the inputs through |W|, plus gamma_{n+1} of the absolute
/// sums (Higham, Accuracy and Stability, 3.1: bias + n products with two roundings each).
fn propagate(layer: &policy::Layer, input: &[f64], error: &[f64]) -> Vec<f64> {
    let unit = f64::from(f32::EPSILON) / 2.0;
    let n = layer.inputs as f64 + 1.0;
    let gamma = n * unit / (1.0 - n * unit);
    (0..layer.outputs)
        .map(|o| {
            let row = layer.weights[o * layer.inputs..][..layer.inputs]
                .iter()
                .map(|w| f64::from(w.abs()));
            let (mut carried, mut size) = (0.0, f64::from(layer.bias[o].abs()));
            for ((w, x), e) in row.zip(input).zip(error) {
                carried += w * e;
                size += w * (x.abs() + e);
            }
            carried + gamma * size
        })
        .collect()
}

#[test]
fn binary32_and_binary64_agree_within_the_forward_error_bound() {
    let policy = example();
    let single = Controller::<f32>::new(&policy);
    let double = Controller::<f64>::new(&policy);
    let (observations, ..) = golden();
    let (mut worst, mut widest) = (0.0_f64, 0.0_f64);
    for observation in observations.chunks_exact(6) {
        let exact: Vec<f64> = observation.iter().map(|&x| f64::from(x)).collect();
        let q64 = double.q_values(&ArrayView1::from(&exact)).unwrap();
        let q32 = single.q_values(&aview1(observation)).unwrap();
        let (mut x, mut error) = (exact.clone(), vec![0.0; 6]);
        for layer in &policy.layers {
            error = propagate(layer, &x, &error);
            x = dense(layer, &x);
        }
        for ((q64, q32), bound) in q64.iter().zip(&q32).zip(&error) {
            let found = (q64 - f64::from(*q32)).abs();
            assert!(found <= *bound, "{found} > {bound}");
            worst = worst.max(found);
            widest = widest.max(*bound);
        }
        assert_eq!(q64.to_vec(), x, "binary64 interpreter against a plain loop");
    }
    println!("largest difference {worst:e}, largest bound {widest:e}");
    assert!(worst > 0.0);
}

/// A layer as a plain loop in binary64.
fn dense(layer: &policy::Layer, input: &[f64]) -> Vec<f64> {
    (0..layer.outputs)
        .map(|o| {
            let row = &layer.weights[o * layer.inputs..][..layer.inputs];
            let sum = row
                .iter()
                .zip(input)
                .fold(f64::from(layer.bias[o]), |sum, (w, x)| sum + f64::from(*w) * x);
            match layer.activation {
                policy::Activation::Relu => sum.max(0.0),
                _ => sum,
            }
        })
        .collect()
}

#[test]
fn a_step_of_the_example_by_hand() {
    let mut controller = Controller::<f32>::new(&example());
    let first = controller.step(&[98.0, 10.0, 9.5].map(Sample::Physical)).unwrap();
    let k = (1.0_f64 / 1.5e-3) as f32;
    let (scale, slope) = (0.2_f32, 3e-4_f32);
    let expected = [
        2.0 * scale,
        2.0 * scale,
        (9.5 - 10.0) * k * slope,
        -2.0 * scale,
        -2.0 * scale,
        (10.0 - 9.5) * k * slope,
    ];
    assert_eq!(first.observation.to_vec(), expected);
    let second = controller.step(&[99.0, 10.0, 9.5].map(Sample::Physical)).unwrap();
    assert_eq!(second.observation[0], 1.0 * scale);
    assert_eq!(second.observation[1], 2.0 * scale);
    assert!((0.40..=0.60).contains(&second.command.duty));
}

#[test]
#[ignore = "a measurement, not a test: run with --release -- --ignored --nocapture"]
fn time_of_a_step() {
    let mut controller = Controller::<f32>::new(&example());
    let mut trace = controller.blank_trace();
    let steps = 200_000;
    let start = std::time::Instant::now();
    let mut sum = 0.0;
    for n in 0..steps {
        let x = (n % 97) as f32 * 0.05;
        controller
            .step_into(&[97.0 + x, 10.0 + x, 9.5].map(Sample::Physical), &mut trace)
            .unwrap();
        sum += trace.command.duty;
    }
    println!(
        "{:.2} us per step ({sum})",
        start.elapsed().as_secs_f64() * 1e6 / f64::from(steps)
    );
}

//! The scales of an integer network, computed anew from section 6b of the numeric contract: in other steps and in wider
//! integers, with the same answers.
#![allow(clippy::unwrap_used, clippy::panic)]

mod common;
use common::*;
use policy::scales::{self, LayerScale};
use policy::{Activation, Layer, NumericFormat, Policy};

/// What is far beyond every limit may end anywhere beyond it.
fn hu(x: f64) -> i128 {
    (x.clamp(-1e15, 1e15) + 0.5).floor() as i128
}

fn cut(a: i128, s: u32) -> i128 {
    (2 * a + (1 << s)).div_euclid(2 << s)
}

/// x 2^e.
fn times(x: f64, e: i32) -> f64 {
    x * 2.0_f64.powi(e)
}

fn is_curve(layer: &Layer) -> bool {
    !matches!(
        layer.activation,
        Activation::Identity | Activation::Relu | Activation::LeakyRelu { .. }
    )
}

/// `e_i`: from the finest of each feature half way to the coarsest of all.
fn inputs(policy: &Policy) -> Vec<i32> {
    let finest = policy.features.iter().map(|feature| {
        let most = feature.bound.low.abs().max(feature.bound.high.abs());
        (0..125).map(|down| 24 - down).find(|e| times(most, *e) <= 32767.0)
    });
    let finest: Vec<i32> = finest.map(|e| e.unwrap_or(-100)).collect();
    let c = *finest.iter().min().unwrap();
    let half_way = finest.iter().map(|e| c + ((e - c) as f64 / 2.0).floor() as i32);
    half_way.collect()
}

/// `h_i` of the inputs of each layer.
fn largest(policy: &Policy) -> Vec<Vec<f64>> {
    let ends = policy
        .features
        .iter()
        .map(|feature| feature.bound.high.max(-feature.bound.low));
    let mut h: Vec<Vec<f64>> = vec![ends.collect()];
    for layer in &policy.layers {
        let own = (0..layer.outputs).map(|o| {
            let mut sum = f64::from(layer.bias[o].abs());
            for (i, h) in h.last().unwrap().iter().enumerate() {
                sum += f64::from(weight(layer, o, i).abs()) * h;
            }
            if is_curve(layer) { 1.0 } else { sum }
        });
        let own = own.collect();
        h.push(own);
    }
    h
}

fn weight(layer: &Layer, output: usize, input: usize) -> f32 {
    layer.weights[output * layer.inputs + input]
}

fn fourth(x: f64) -> f64 {
    x * x * (x * x)
}

/// `r_o` of every layer.
fn rows(policy: &Policy, e: &[i32]) -> Vec<Vec<i32>> {
    let (layers, h) = (&policy.layers, largest(policy));
    let mut r: Vec<Vec<i32>> = layers.iter().map(|layer| vec![0; layer.outputs]).collect();
    for _ in 0..16 {
        for at in 0..layers.len() - 1 {
            let (layer, next) = (&layers[at], &layers[at + 1]);
            if is_curve(layer) {
                continue;
            }
            let before = if at == 0 { e.to_vec() } else { r[at - 1].clone() };
            let most = (0..layer.inputs)
                .map(|i| times(h[at][i], before[i]))
                .fold(0.0, f64::max);
            for o in 0..layer.outputs {
                let mut row = fourth(f64::from(layer.bias[o]) / most);
                for (i, r) in before.iter().enumerate() {
                    row += fourth(times(f64::from(weight(layer, o, i)), -r));
                }
                let mut column = 0.0;
                for (p, r) in r[at + 1].iter().enumerate() {
                    column += fourth(times(f64::from(weight(next, p, o)), *r));
                }
                let quotient = (column / next.outputs as f64) / (row / layer.inputs as f64);
                r[at][o] = match quotient.is_normal() {
                    true => (quotient.log2() / 8.0 + 0.5).floor() as i32,
                    false => 0,
                };
            }
        }
    }
    for r in &mut r {
        let mut sorted = r.clone();
        sorted.sort_unstable();
        let upper_median = sorted[r.len() / 2];
        r.iter_mut().for_each(|r| *r = (*r - upper_median).clamp(-24, 24));
    }
    r
}

/// One output at an exponent: its full sums from and to, and the partial ones.
struct Ends {
    full: (i128, i128),
    partial: (i128, i128),
}

fn ends(layer: &Layer, output: usize, a_o: i32, e: &[i32], ranges: &[(i64, i64)], limit: i128) -> Option<Ends> {
    let bias = hu(times(f64::from(layer.bias[output]), a_o));
    let mut ends = Ends {
        full: (bias, bias),
        partial: (bias.min(0), bias.max(0)),
    };
    for (input, (e, range)) in e.iter().zip(ranges).enumerate() {
        let w = hu(times(f64::from(weight(layer, output, input)), a_o - e));
        if w.abs() > limit {
            return None;
        }
        let products = [w * i128::from(range.0), w * i128::from(range.1)];
        let (low, high) = (*products.iter().min().unwrap(), *products.iter().max().unwrap());
        ends.full = (ends.full.0 + low, ends.full.1 + high);
        ends.partial = (ends.partial.0 + low.min(0), ends.partial.1 + high.max(0));
    }
    Some(ends)
}

fn shift(layer: &Layer, all: &[Ends], most: i128) -> u32 {
    let fits = |s: &u32| {
        all.iter().all(|one| {
            let low = cut(one.full.0, *s);
            cut(one.full.1, *s) <= most && (low >= -most || layer.activation == Activation::Relu)
        })
    };
    if is_curve(layer) {
        0
    } else {
        (0..100).find(fits).unwrap()
    }
}

fn range(layer: &Layer, one: &Ends, s: u32) -> (i64, i64) {
    let of = |y: i128| match layer.activation {
        Activation::Relu => y.max(0),
        Activation::LeakyRelu { slope } if y <= 0 => cut(y * hu(slope * 32768.0).min(32767), 15),
        _ => y,
    };
    match layer.activation {
        // what lies between -1 or 0 and 1, with 14 bits
        Activation::Tanh | Activation::Softsign => (-16384, 16384),
        Activation::Sigmoid | Activation::HardSigmoid => (0, 16384),
        _ => (of(cut(one.full.0, s)) as i64, of(cut(one.full.1, s)) as i64),
    }
}

/// The largest `a` at which everything fits, and what follows from it.
fn layer_scale(layer: &Layer, r: &[i32], e: &[i32], ranges: &[(i64, i64)], limit: i128, most: i128) -> LayerScale {
    for a in (-100..=100).rev() {
        let all = (0..layer.outputs).map(|o| ends(layer, o, a + r[o], e, ranges, limit));
        let Some(all) = all.collect::<Option<Vec<Ends>>>() else {
            continue;
        };
        let s = shift(layer, &all, most);
        let high = all.iter().map(|one| one.partial.1).max().unwrap() + (1 << s) / 2;
        let low = all.iter().map(|one| one.partial.0).min().unwrap();
        if high >= 1 << 31 || low <= -(1 << 31) {
            continue;
        }
        let accumulators: Vec<i32> = r.iter().map(|r| a + r).collect();
        let outputs = accumulators.iter().map(|a| match is_curve(layer) {
            true => 14,
            false => a - s as i32,
        });
        return LayerScale {
            inputs: e.to_vec(),
            outputs: outputs.collect(),
            accumulators,
            shift: s,
            bound: (low as i64, high as i64),
            ranges: all.iter().map(|one| range(layer, one, s)).collect(),
        };
    }
    panic!("no exponent fits");
}

/// All of it, front to back; also the largest magnitude of a partial sum.
fn assert_scales(policy: &Policy) {
    let limit = if policy.numeric_format == NumericFormat::I16 {
        32767
    } else {
        127
    };
    let found = scales::of(policy).unwrap();
    let mut e = inputs(policy);
    let rows = rows(policy, &e);
    let ends = policy.features.iter().zip(&e);
    let ends = ends
        .map(|(feature, e)| [feature.bound.low, feature.bound.high].map(|end| hu(times(f64::from(end as f32), *e))));
    let mut ranges: Vec<(i64, i64)> = ends.map(|[low, high]| (low as i64, high as i64)).collect();
    for (input, (e, (low, high))) in found.inputs.iter().zip(e.iter().zip(&ranges)) {
        assert_eq!(
            (input.exponent, i64::from(input.low), i64::from(input.high)),
            (*e, *low, *high)
        );
    }
    let mut largest = 0;
    for (at, layer) in policy.layers.iter().enumerate() {
        let most = if at + 1 == policy.layers.len() { 1 << 24 } else { 32767 };
        let expected = layer_scale(layer, &rows[at], &e, &ranges, limit, most);
        assert_eq!(found.layers[at], expected, "layer {at}, {:?}", layer.activation);
        largest = largest.max(expected.bound.1).max(-expected.bound.0);
        (e, ranges) = (expected.outputs, expected.ranges);
    }
    assert_eq!(found.accumulator_bound(), largest);
}

/// Rows of weights of very different sizes, neurons that nothing enters or leaves, and numbers of any size.
fn network(draws: &mut Draws, activations: [Activation; 2]) -> Policy {
    let mut policy = Folder::new()
        .tensors(&[dense("a.0", 5, 2), dense("a.1", 6, 5), dense("a.2", 3, 6)].concat())
        .policy();
    let spread = [1, 6, 60][draws.below(3)];
    for (at, layer) in policy.layers.iter_mut().enumerate() {
        let inputs = layer.inputs;
        for (row, bias) in layer.weights.chunks_exact_mut(inputs).zip(&mut layer.bias) {
            let size = f32::powi(2.0, draws.below(spread) as i32 - spread as i32 / 2);
            let is_empty = draws.below(8) == 0;
            for w in row.iter_mut() {
                *w = if is_empty { 0.0 } else { size * draws.within(-1.0, 1.0) };
            }
            *bias = if is_empty { 0.0 } else { size * draws.within(-3.0, 3.0) };
        }
        if let Some(activation) = activations.get(at) {
            layer.activation = *activation;
        }
    }
    policy
}

#[test]
fn the_scales_of_random_networks_are_those_of_the_contract() {
    let mut draws = Draws::new(61);
    let leaky = |slope| Activation::LeakyRelu { slope };
    for activations in [
        [Activation::Relu, Activation::Relu],
        [Activation::Identity, Activation::Relu],
        [leaky(0.01), leaky(0.999_999)],
        [Activation::Relu, leaky(0.3)],
        [Activation::Relu, Activation::Identity],
        [Activation::Tanh, Activation::Relu],
        [Activation::Relu, Activation::Sigmoid],
        [Activation::Softsign, Activation::HardSigmoid],
    ] {
        for _ in 0..12 {
            let policy = network(&mut draws, activations);
            assert_scales(&policy.clone().with_format(NumericFormat::I16));
            assert_scales(&policy.with_format(NumericFormat::I8));
        }
    }
}

/// Clips make the second feature much smaller than the first, and one that is 0 alone has the finest exponent.
#[test]
fn the_exponents_of_features_meet_half_way() {
    for clip in ["-1e-3, 2e-3", "-0.5, 0.25", "0.0, 90.0"] {
        let policy = Folder::new()
            .replace("filters = [{ delay = 1 }]", &format!("clip = [{clip}]"))
            .policy();
        for format in [NumericFormat::I16, NumericFormat::I8] {
            assert_scales(&policy.clone().with_format(format));
        }
    }
}

/// Where weights leave the exponent free it is the largest that is allowed, and weights far from 1 have one far from 0.
#[test]
fn the_exponent_of_a_layer_follows_its_weights() {
    let with = |weight: f32, bias: f32| {
        let mut policy = Folder::new().policy().with_format(NumericFormat::I16);
        for layer in &mut policy.layers {
            layer.weights.fill(weight);
            layer.bias.fill(bias);
        }
        assert_scales(&policy);
        scales::of(&policy).unwrap().layers[1].accumulators[0]
    };
    assert_eq!(with(0.0, 0.0), 100);
    // 2^31 is one more than a sum may be
    assert_eq!(with(0.0, f32::powi(2.0, -70)), 100);
    assert_eq!(with(0.0, f32::powi(2.0, -69)), 99);
    assert_eq!(with(0.0, 1.0), 30);
    assert_eq!(with(0.0, 1024.0), 20);
    assert!(with(1e6, 0.0) < with(1.0, 0.0));
}

/// Section 6b: the largest E of at most 14 with `max(1.01, H + 0.75) 2^E <= 32766`.
#[test]
fn the_exponent_behind_a_curve_without_ends_leaves_room_for_its_largest_value() {
    for kind in [
        Activation::Elu,
        Activation::Silu,
        Activation::Softplus,
        Activation::Gelu,
    ] {
        // one neuron: the observation within +-20 has 10 bits, a weight of 1 is exact
        for (weight, exponent) in [(0.001_f32, 14), (0.06, 14), (0.07, 13), (1.0, 10), (100.0, 4)] {
            let mut policy = Folder::new().policy().with_format(NumericFormat::I16);
            policy.layers[0].activation = kind;
            policy.layers[0].bias.fill(0.0);
            policy.layers[0].weights = [weight, 0.0].repeat(4);
            let scales = scales::of(&policy).unwrap();
            let most = (20.0 * weight + 0.75).max(1.01);
            assert!(most * f32::powi(2.0, exponent) <= 32766.0, "{weight}");
            assert_eq!(scales.layers[0].outputs, [exponent; 4], "{weight} {kind:?}");
            assert_eq!(scales.layers[0].shift, 0);
        }
    }
}

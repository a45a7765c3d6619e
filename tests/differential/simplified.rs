//! Neurons that are left out: the same bits as the interpreter's, which computes them all.

use codegen::manifest;
use policy::{NumericFormat, Policy};

use super::{assert_equal, run};

fn removed(policy: &Policy) -> Vec<usize> {
    let host = targets::find("host").unwrap();
    manifest::sizes(policy, host).removed_neurons
}

/// The example with neurons that cannot get above 0: by their bias, and pruned ones.
fn with_dead_neurons(format: NumericFormat) -> Policy {
    let mut policy = policy::load(&tests::example()).unwrap();
    for (layer, neurons, bias) in [(0, [0, 5, 63], -500.0), (1, [1, 2, 40], -5000.0)] {
        let layer = &mut policy.layers[layer];
        for neuron in neurons {
            layer.bias[neuron] = bias;
        }
        let pruned = 20;
        layer.weights[pruned * layer.inputs..][..layer.inputs].fill(0.0);
        layer.bias[pruned] = 0.0;
    }
    policy.golden = None;
    policy.with_format(format)
}

#[test]
fn dead_neurons_are_left_out_and_no_bit_changes() {
    let before = policy::load(&tests::example()).unwrap();
    let host = targets::find("host").unwrap();
    for format in NumericFormat::ALL {
        let policy = with_dead_neurons(format);
        if format == NumericFormat::F64 {
            assert!(removed(&policy).is_empty(), "the box of the proof is that of binary32");
            continue;
        }
        let last = if format == NumericFormat::F32Fma { 0 } else { 4 };
        assert_eq!(removed(&policy), [4, last, 0], "{format:?}");
        let (all, fewer) = (manifest::sizes(&before, host).macs, manifest::sizes(&policy, host).macs);
        assert!(fewer < all, "{fewer} of {all} products are left");
        assert_equal(&run(&policy, 3000, 11, &["clang"]), format.name());
    }
}

#[test]
fn a_policy_without_dead_neurons_is_left_as_it_is() {
    for format in NumericFormat::ALL {
        let path = tests::root().join("bench/policy/policy.toml");
        let policy = policy::load(&path).unwrap().with_format(format);
        assert!(removed(&policy).is_empty(), "{format:?}");
    }
}

/// An output whose sum is -0 until a dead neuron adds +0 must keep that neuron; argmax and bits tell the zeros apart.
#[test]
fn a_zero_keeps_its_sign() {
    let path = tests::root().join("tests/golden/cases/tail_blocks/policy.toml");
    for (format, bias) in [(NumericFormat::F32, -0.0), (NumericFormat::F32Fma, 0.0)] {
        let mut policy = policy::load(&path).unwrap().with_format(format);
        let hidden = &mut policy.layers[0];
        hidden.bias[3] = -1e9;
        // about 1e-20 for every input: its product with -1e-30 vanishes, to -0
        hidden.weights[..hidden.inputs].fill(0.0);
        hidden.bias[0] = 1e-20;
        let last = &mut policy.layers[1];
        last.weights[..last.inputs].fill(-0.0);
        last.weights[0] = -1e-30;
        last.weights[3] = 1.0;
        last.bias[0] = bias;
        assert!(removed(&policy).is_empty(), "{format:?}");
        assert_equal(&run(&policy, 500, 12, &["gcc"]), format.name());
        // a negative weight adds -0, which nobody sees
        for row in policy.layers[1].weights.chunks_exact_mut(33) {
            row[3] = -1.0;
        }
        assert_eq!(removed(&policy), [1, 0], "{format:?}");
        assert_equal(&run(&policy, 500, 13, &["gcc"]), format.name());
    }
}

#[test]
fn random_policies_with_pruned_neurons_keep_their_bits() {
    let mut count = 0;
    for seed in 700..705 {
        let folder = tests::random::policy(seed).unwrap();
        let mut policy = policy::load(&folder.path()).unwrap();
        let last = policy.layers.len() - 1;
        for layer in &mut policy.layers[..last] {
            let half = layer.outputs / 2;
            layer.weights[half * layer.inputs..].fill(-0.0);
            layer.bias[half..].fill(-0.0);
        }
        let policy = policy.with_format(NumericFormat::ALL[seed as usize % 5]);
        count += removed(&policy).iter().sum::<usize>();
        assert_equal(&run(&policy, 500, seed, &["gcc"]), &folder.contract);
    }
    assert!(count > 3, "{count} neurons were left out");
}

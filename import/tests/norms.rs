//! Batch norms are folded into the dense layer beside them; what is written is not in its own way.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::disallowed_methods)]

mod common;

use common::{Saved, dense, named};

#[test]
fn a_batch_norm_is_folded_where_its_place_is_known() {
    let norm = |stem: &str, width: usize| {
        let vectors = ["weight", "bias", "running_mean", "running_var"];
        let vectors = vectors.map(|leaf| named(&format!("{stem}.{leaf}"), &[width]));
        // torch counts its batches beside them, without an axis
        [&vectors[..], &[named(&format!("{stem}.num_batches_tracked"), &[])]].concat()
    };
    let x = [0.3, -1.2, 0.7, 0.1, -0.4, 0.9];
    for (name, chain, at) in [
        ("before the activation", ["net.0", "net.3"], "net.1"),
        ("behind the activation", ["net.0", "net.3"], "net.2"),
    ] {
        let tensors = [dense(chain[0], 16, 6), norm(at, 16), dense(chain[1], 5, 16)].concat();
        let saved = Saved::new(&tensors);
        let new = import::new_policy(&saved.weights(), &saved.contract(), &import::Options::default()).unwrap();
        assert!(
            new.said.iter().any(|line| line.contains("epsilon 1e-5")),
            "{:?}",
            new.said
        );
        let policy = saved.filled(&new);
        let found = saved.run(&policy, &x);
        // relu between, as the contract was filled in; the norm as torch's page of BatchNorm1d has it
        let relu = |v: Vec<f64>| v.into_iter().map(|v| v.max(0.0)).collect::<Vec<_>>();
        let normed = |v: Vec<f64>| {
            let at = |leaf: &str| saved.values(&format!("{at}.{leaf}"));
            let (g, b, m, s) = (at("weight"), at("bias"), at("running_mean"), at("running_var"));
            let one = |(i, v): (usize, f64)| {
                (v - f64::from(m[i])) / (f64::from(s[i]) + 1e-5).sqrt() * f64::from(g[i]) + f64::from(b[i])
            };
            v.into_iter().enumerate().map(one).collect::<Vec<_>>()
        };
        let hidden = saved.apply(chain[0], &x);
        let hidden = if at == "net.1" {
            relu(normed(hidden))
        } else {
            normed(relu(hidden))
        };
        for (found, expected) in found.iter().zip(saved.apply(chain[1], &hidden)) {
            assert!(
                (found - expected).abs() <= 2e-6 * expected.abs().max(1.0),
                "{name}: {found} {expected}"
            );
        }
    }
    let unnumbered = [dense("fc1", 16, 6), norm("bn1", 16), dense("fc2", 5, 16)].concat();
    let saved = Saved::new(&unnumbered);
    let faults = import::new_policy(&saved.weights(), &saved.contract(), &import::Options::default()).unwrap_err();
    assert!(faults.to_string().contains("which side of the activation"), "{faults}");
}

#[test]
fn weights_of_the_name_that_new_writes_are_not_in_the_way() {
    let saved = Saved::new(&[dense("fc1", 16, 6), dense("value", 1, 16), dense("adv", 5, 16)].concat());
    let weights = saved.contract().with_file_name("weights.safetensors");
    std::fs::rename(saved.weights(), &weights).unwrap();
    let new = import::new_policy(&weights, &saved.contract(), &import::Options::default()).unwrap();
    assert_eq!(new.beside.keys().collect::<Vec<_>>(), ["chain.safetensors"]);
    assert_eq!(saved.filled(&new).layers.len(), 2);
}

//! Files that libraries saved, and what these libraries answer: tests/fixtures/trainers.

use std::path::{Path, PathBuf};

use import::Options;
use safetensors::SafeTensors;

use super::{filled, run};

pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../tests/fixtures/trainers")
        .join(name)
}

pub fn expected(name: &str, tensor: &str) -> Vec<f32> {
    let bytes = std::fs::read(fixture(&format!("{name}.expected.safetensors"))).unwrap();
    let tensors = SafeTensors::deserialize(&bytes).unwrap();
    let data = tensors.tensor(tensor).unwrap().data().to_vec();
    data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
}

pub fn actions(name: &str) -> Vec<usize> {
    expected(name, "action")
        .iter()
        .map(|bits| bits.to_bits() as usize)
        .collect()
}

/// The policy of a saved model: written, every TODO filled in, and checked with its golden answers.
pub fn policy_of(file: &str, options: &Options) -> (tempfile::TempDir, import::NewPolicy, policy::Policy) {
    let folder = tempfile::tempdir().unwrap();
    let new = import::new_policy(&fixture(file), &folder.path().join("policy.toml"), options)
        .unwrap_or_else(|faults| panic!("{file}: {faults}"));
    let policy = filled(folder.path(), &new);
    (folder, new, policy)
}

/// Every choice as the library's, every output within 1e-5 of the largest, but for a constant where only the choice counts.
pub fn assert_equals_library(policy: &policy::Policy, name: &str, activation: fn(f64) -> f64, choice_only: bool) {
    let (obs, q, chosen) = (expected(name, "obs"), expected(name, "q"), actions(name));
    let count = policy.outputs();
    assert_eq!(chosen.len(), 64);
    for (row, expected) in q.chunks_exact(count).enumerate() {
        let x: Vec<f64> = obs[row * 6..(row + 1) * 6].iter().map(|x| f64::from(*x)).collect();
        let found = run(policy, &x, activation);
        let best = (0..count).fold(0, |best, a| if found[a] > found[best] { a } else { best });
        assert_eq!(best, chosen[row], "{name}, row {row}");
        let largest = expected
            .iter()
            .fold(0.0_f64, |largest, q| largest.max(f64::from(q.abs())));
        let shift = if choice_only {
            f64::from(expected[0]) - found[0]
        } else {
            0.0
        };
        for (found, expected) in found.iter().zip(expected) {
            let apart = (found + shift - f64::from(*expected)).abs();
            assert!(apart <= 1e-5 * largest, "{name}, row {row}: {found} {expected}");
        }
    }
}

pub fn refusal(file: &Path) -> String {
    let folder = tempfile::tempdir().unwrap();
    let new = import::new_policy(file, &folder.path().join("policy.toml"), &Options::default());
    new.err()
        .unwrap_or_else(|| panic!("{} is taken", file.display()))
        .to_string()
}

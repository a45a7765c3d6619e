//! Policies to compile: those of the golden files.
#![allow(dead_code)] // each test file uses its part
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::{Path, PathBuf};

use policy::{Policy, ReadOptions};
use targets::TargetSpec;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/golden/cases")
}

/// The policy of that golden case.
pub fn case(name: &str) -> Policy {
    let options = ReadOptions {
        several_outputs: true,
        ..ReadOptions::default()
    };
    policy::load_with(&folder().join(name).join("policy.toml"), &options).unwrap_or_else(|faults| panic!("{faults}"))
}

/// All of them, by name.
pub fn cases() -> Vec<Policy> {
    let mut names: Vec<String> = std::fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names.iter().map(|name| case(name)).collect()
}

pub fn target(name: &str) -> &'static TargetSpec {
    targets::find(name).unwrap()
}

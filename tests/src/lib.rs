//! Shared by the tests: places, policies drawn at random and long runs over them, tool runs.

pub mod browser;
pub mod fixture;
pub mod random;
pub mod shards;
pub mod tools;

use std::path::{Path, PathBuf};

/// Root of the workspace.
#[must_use]
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The example policy that the README uses.
#[must_use]
pub fn example() -> PathBuf {
    root().join("examples/buck12/policy.toml")
}

/// Tests that take hours in their long form, for a release, have a short one for every day: `cargo xtask test --full` asks for
/// the long one.
#[must_use]
pub fn full() -> bool {
    std::env::var_os("POLICYC_FULL").is_some()
}

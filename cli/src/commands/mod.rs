//! One file per command.

pub mod certify;
pub mod compile;
mod controllers;
pub mod demo;
pub mod diagnose;
pub mod drm;
pub mod inspect;
pub mod new;
mod progress_line;
pub mod replay;
pub mod simulate;
pub mod targets;
pub mod train;
pub mod verify;

use std::path::{Path, PathBuf};

use policy::{NumericFormat, Policy};

use crate::failure::Failure;

/// `policy.toml` itself, also if the folder that holds it was named.
fn contract_path(path: &Path) -> PathBuf {
    if path.is_dir() {
        path.join("policy.toml")
    } else {
        path.to_owned()
    }
}

fn load(path: &Path) -> Result<Policy, Failure> {
    Ok(policy::load(&contract_path(path))?)
}

/// [`load`], in another numeric format if one is asked for.
fn load_as(path: &Path, format: Option<NumericFormat>) -> Result<Policy, Failure> {
    let policy = load(path)?;
    Ok(match format {
        Some(format) => policy.with_format(format),
        None => policy,
    })
}

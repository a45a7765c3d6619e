//! One file per command.

pub mod campaign;
pub mod certify;
pub mod compile;
mod compile_page;
pub mod completions;
mod controllers;
pub mod demo;
pub mod design;
pub mod diagnose;
pub mod drm;
mod foreign;
pub mod inspect;
pub mod limit;
pub mod manpages;
pub mod merge;
pub mod new;
pub mod progress_line;
pub mod prove;
pub mod replay;
pub mod simulate;
pub mod studio;
pub mod targets;
pub mod train;
pub mod verify;
mod verify_codes;

use std::path::{Path, PathBuf};

use policy::{NumericFormat, Policy, ReadOptions};
use toml_input::Message;

use crate::arguments::Outside;
use crate::failure::Failure;

/// `policy.toml` itself, also if the folder that holds it was named.
fn contract_path(path: &Path) -> PathBuf {
    if path.is_dir() {
        path.join("policy.toml")
    } else {
        path.to_owned()
    }
}

fn load(path: &Path, outside: Outside) -> Result<Policy, Failure> {
    Ok(policy::load_with(&contract_path(path), &options(outside))?)
}

/// [`load`] of a contract with one output or several, in another numeric format if one is asked for.
pub fn load_several_as(path: &Path, outside: Outside, format: Option<NumericFormat>) -> Result<Policy, Failure> {
    let options = ReadOptions {
        several_outputs: true,
        ..options(outside)
    };
    let policy = policy::load_with(&contract_path(path), &options)?;
    Ok(match format {
        Some(format) => policy.with_format(format),
        None => policy,
    })
}

/// [`load`] of a contract for a log: with the limits that it sets for golden answers, and where these do not fit the network yet,
/// which a log may explain, without.
fn load_for_a_log(path: &Path, outside: Outside) -> Result<Policy, Failure> {
    load_several_as(path, outside, None).or_else(|_| load_without_golden(path, outside))
}

/// [`load`] of a contract with one output or several, without the golden vectors.
fn load_without_golden(path: &Path, outside: Outside) -> Result<Policy, Failure> {
    let options = ReadOptions {
        without_golden: true,
        several_outputs: true,
        ..options(outside)
    };
    Ok(policy::load_with(&contract_path(path), &options)?)
}

fn options(outside: Outside) -> ReadOptions {
    ReadOptions {
        own_folder: !outside.allow_outside,
        ..ReadOptions::default()
    }
}

/// Refuses a share of decisions for a policy that has none.
fn no_choices(policy: &Policy, golden_decisions: Option<f64>) -> Result<(), Failure> {
    if golden_decisions.is_none() || policy.head.is_choice() {
        return Ok(());
    }
    let message = Message::new("--golden-decisions is a share of choices, and this policy commands a number");
    let found = match policy.head.schedule() {
        Some(_) => "gains in [actions]",
        None => "continuous in [actions]",
    };
    Err(message
        .found(found)
        .hint("golden_duty in [network] of the contract says how far duty or gain may be off, as a share of its range")
        .into())
}

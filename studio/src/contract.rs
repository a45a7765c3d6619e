//! The contract: read and shown, or written for what a trainer saved.

use std::path::Path;

use codegen::Output;
use policy::{NumericFormat, Policy, ReadOptions};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use toml_input::{Faults, messages};

use crate::answer::Contract;
use crate::session::{self, Reply, Session, Tell};

/// The checked policy.
pub(crate) fn load(session: &Session, of: &Contract) -> Result<Policy, Faults> {
    let options = ReadOptions {
        files: Some(session.files().clone()),
        several_outputs: true,
        ..ReadOptions::default()
    };
    let policy = policy::load_with(Path::new(&of.contract), &options)?;
    let Some(format) = &of.format else {
        return Ok(policy);
    };
    let names = NumericFormat::ALL.map(NumericFormat::name);
    let known = NumericFormat::find(format).ok_or_else(|| messages::unknown("numeric format", format, &names))?;
    Ok(policy.with_format(known))
}

#[derive(Serialize)]
struct Choices {
    formats: [&'static str; 5],
    outputs: Vec<(&'static str, &'static str)>,
    targets: Vec<&'static str>,
    /// Numbers of a plant: key, unit, meaning, smallest and largest allowed, smallest and largest usual, neutral.
    parameters: Vec<Parameter>,
}

#[derive(Serialize)]
struct Parameter {
    key: &'static str,
    unit: &'static str,
    meaning: &'static str,
    allowed: (f64, f64),
    typical: (f64, f64),
    neutral: f64,
}

/// What there is to choose from.
pub(crate) fn choices(_: &Session, _: &Value, _: Tell) -> Result<Reply, Faults> {
    // an FMU holds a binary that a compiler of this machine makes
    let outputs = Output::ALL
        .iter()
        .filter(|output| !matches!(output, Output::Fmu2 | Output::Fmu3));
    let parameters = plant::parameters().map(|p| Parameter {
        key: p.key,
        unit: p.unit,
        meaning: p.meaning,
        allowed: p.allowed,
        typical: p.typical,
        neutral: p.neutral,
    });
    Reply::of(&Choices {
        formats: NumericFormat::ALL.map(NumericFormat::name),
        outputs: outputs.map(|output| (output.name(), output.meaning())).collect(),
        targets: targets::names(),
        parameters: parameters.collect(),
    })
}

#[derive(Serialize)]
struct Shown<'p> {
    /// What `policyc inspect` prints.
    inspect: String,
    /// What it says where the answer is 1.
    different: Option<String>,
    name: &'p str,
    format: &'static str,
    sample_period: f64,
    v_ref: Option<f64>,
    signals: &'p [policy::Signal],
    features: usize,
    actions: usize,
    /// Names of several outputs; none where there is one.
    outputs: Vec<&'p str>,
}

/// The contract as `inspect` shows it.
pub(crate) fn read(session: &Session, request: &Value, _: Tell) -> Result<Reply, Faults> {
    let policy = load(session, &session::read(request)?)?;
    Reply::of(&Shown {
        inspect: verify::text::inspection(&policy).trim_end().to_owned() + "\n",
        different: different(&policy),
        name: &policy.name,
        format: policy.numeric_format.name(),
        sample_period: policy.sample_period,
        v_ref: closed_loop::held_by(&policy),
        signals: &policy.signals,
        features: policy.features.len(),
        actions: policy.actions().len(),
        outputs: policy.output_names(),
    })
}

/// What `inspect` warns of when it ends with 1.
fn different(policy: &Policy) -> Option<String> {
    if let Some(golden) = verify::golden_result(policy).filter(|golden| !golden.passed()) {
        let hint = golden.hint();
        return Some(format!(
            "the network does not give the trainer's golden answers\n  = hint: {hint}"
        ));
    }
    let kept = verify::decisions(policy, None).is_none_or(|decisions| decisions.kept());
    (!kept).then(|| "the numeric format changes more of the trainer's decisions than the contract allows".to_owned())
}

/// A contract for a file of a trainer, as `policyc new` would write it.
#[derive(Deserialize)]
struct Model {
    /// What the trainer saved.
    file: String,
    /// Path of the contract.
    contract: String,
    /// Actions, where the file does not say how many.
    actions: Option<usize>,
}

#[derive(Serialize)]
struct New {
    said: Vec<String>,
}

/// A contract for what a trainer saved, and what lies beside it.
pub(crate) fn new(session: &Session, request: &Value, _: Tell) -> Result<Reply, Faults> {
    let Model {
        file,
        contract,
        actions,
    } = session::read(request)?;
    let options = import::Options {
        actions,
        ..import::Options::default()
    };
    let contract = Path::new(&contract);
    let new = import::new_policy(session.named(&file), contract, &options)?;
    let beside = |name: &str| contract.with_file_name(name).display().to_string();
    let mut made: std::collections::BTreeMap<_, _> = new
        .beside
        .into_iter()
        .map(|(name, bytes)| (beside(&name), bytes))
        .collect();
    made.insert(contract.display().to_string(), new.contract.into_bytes());
    Reply::with(&New { said: new.said }, made)
}

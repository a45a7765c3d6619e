//! What a trainer saved, read by the crate `import`, and the contract of an environment as data.

use std::collections::BTreeMap;
use std::path::PathBuf;

use policy::{Head, InputVoltage, Observer, Policy, Residual};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde_json::{Value, json};
use train::Contract;

use crate::faults::raise;

/// Text of a draft, files beside it, and what was recognised.
type Draft<'py> = (String, BTreeMap<String, Bound<'py, PyBytes>>, Vec<String>);

/// The draft of a contract for the model in `file`.
#[pyfunction]
pub fn import_model(
    py: Python<'_>,
    file: PathBuf,
    contract: PathBuf,
    actions: Option<usize>,
    inside: Option<String>,
    vecnormalize: Option<PathBuf>,
) -> PyResult<Draft<'_>> {
    let options = import::Options {
        actions,
        inside,
        vecnormalize,
        ..import::Options::default()
    };
    let new = py
        .detach(|| import::new_policy(&file, &contract, &options))
        .map_err(raise)?;
    let bytes = |(name, bytes): (String, Vec<u8>)| (name, PyBytes::new(py, &bytes));
    Ok((new.contract, new.beside.into_iter().map(bytes).collect(), new.said))
}

/// What a contract without weights says, as JSON: everything but its network.
#[pyfunction]
pub fn contract_json(py: Python<'_>, path: PathBuf) -> PyResult<String> {
    let contract = py.detach(|| Contract::load_any(&path, &[])).map_err(raise)?;
    let policy = &contract.policy;
    let mapping = policy.mapping.map(|mapping| {
        let signal = &policy.signals[mapping.load_current].name;
        json!({ "load_current": signal })
    });
    let whole = json!({
        "name": policy.name,
        "sample_period": policy.sample_period,
        "numeric_format": policy.numeric_format.name(),
        "parameters": policy.parameters,
        "signals": policy.signals,
        "observers": policy.observers.iter().map(|observer| self::observer(policy, observer)).collect::<Vec<_>>(),
        "features": policy.features,
        "duties": match &policy.head { Head::Choice(_) => policy.head.duties(), Head::Continuous(_) | Head::Residual(_) | Head::Schedule(_) | Head::Several(_) => Vec::new() },
        "law": policy.head.residual().map(law),
        "continuous": policy.head.continuous(),
        "schedule": policy.head.schedule(),
        "mapping": mapping,
        "limits": policy.limits,
        "fallback": policy.fallback,
        "files": files(policy),
    });
    Ok(whole.to_string())
}

/// The entries of `[[observer]]`.
fn observer(policy: &Policy, observer: &Observer) -> Value {
    let name = |index: usize| json!(policy.signals[index].name);
    json!({
        "name": observer.name,
        "topology": observer.topology,
        "carrier": observer.carrier,
        "hold": observer.hold.map(|hold| hold.voltage),
        "inductance": observer.inductance,
        "capacitance": observer.capacitance,
        "input_voltage": match observer.input_voltage {
            InputVoltage::Constant(volts) => json!(volts),
            InputVoltage::Signal(index) => name(index),
        },
        "output_voltage": name(observer.output_voltage),
        "load_current": name(observer.load_current),
        "compute_delay": observer.compute_delay,
        "gains": observer.gains,
        "current": [observer.current.low, observer.current.high],
        "bias": [observer.bias.low, observer.bias.high],
    })
}

/// The entries of `[actions]` of a law and what is added to it.
fn law(head: &Residual) -> Value {
    let zone = head.dead_zone.iter();
    let zone: Vec<Value> = zone
        .map(|still| json!({ "source": still.source.text, "within": still.within }))
        .collect();
    json!({
        "base": head.base.text,
        "offsets": head.offsets.iter().map(|action| action.duty).collect::<Vec<_>>(),
        "dead_zone": (!zone.is_empty()).then_some(zone),
    })
}

fn files(policy: &Policy) -> Vec<Value> {
    policy
        .files
        .iter()
        .map(|file| json!(file.display().to_string()))
        .collect()
}

//! `policyc inspect`

use codegen::manifest;
use policy::{Activation, Head, Interval, Policy, describe};
use serde::Serialize;
use verify::text::inspection;

use crate::arguments::Inspect;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;

/// Prints the checked policy.
pub fn run(options: &Inspect) -> Result<Outcome, Failure> {
    let policy = super::load_as(&options.policy, options.outside, options.format)?;
    if options.json {
        output::say(&json(&policy)?)?;
    } else {
        output::say(inspection(&policy).trim_end())?;
    }
    if let Some(golden) = verify::golden_result(&policy).filter(|golden| !golden.passed()) {
        eprintln!("\nDIFFERENT: the network does not give the trainer's golden answers");
        eprintln!("  = hint: {}", golden.hint());
        return Ok(Outcome::Different);
    }
    match verify::decisions(&policy, None).is_some_and(|decisions| !decisions.kept()) {
        false => Ok(Outcome::Done),
        true => {
            let decided = match policy.head {
                Head::Continuous(_) => "the trainer's duties more",
                Head::Schedule(_) => "the trainer's gains more",
                Head::Choice(_) | Head::Residual(_) | Head::Several(_) => "more of the trainer's decisions",
            };
            eprintln!("\nDIFFERENT: the numeric format changes {decided} than the contract allows");
            Ok(Outcome::Different)
        }
    }
}

/// What `--json` prints.
///
/// # Errors
/// If a number of the policy cannot be written as JSON.
pub fn json(policy: &Policy) -> Result<String, Failure> {
    Ok(serde_json::to_string_pretty(&view(policy))?)
}

#[derive(Serialize)]
struct View<'p> {
    name: &'p str,
    sample_period: f64,
    numeric_format: policy::NumericFormat,
    signals: &'p [policy::Signal],
    #[serde(skip_serializing_if = "<[policy::Observer]>::is_empty")]
    observers: &'p [policy::Observer],
    features: &'p [policy::Feature],
    layers: Vec<LayerView<'p>>,
    actions: &'p [policy::Action],
    #[serde(skip_serializing_if = "Option::is_none")]
    continuous: Option<&'p policy::Continuous>,
    #[serde(skip_serializing_if = "Option::is_none")]
    residual: Option<&'p policy::Residual>,
    #[serde(skip_serializing_if = "Option::is_none")]
    schedule: Option<&'p policy::Schedule>,
    mapping: Option<policy::Mapping>,
    limits: policy::Limits,
    fallback: policy::Fallback,
    golden_vectors: usize,
    decisions: Option<verify::Decisions>,
    digests: &'p policy::Digests,
    sizes: manifest::Sizes,
    notes: &'p [String],
}

#[derive(Serialize)]
struct LayerView<'p> {
    name: &'p str,
    inputs: usize,
    outputs: usize,
    activation: Activation,
    /// Smallest and largest bound of an output over the box of observations.
    bound: Interval,
}

fn view(policy: &Policy) -> View<'_> {
    View {
        name: &policy.name,
        sample_period: policy.sample_period,
        numeric_format: policy.numeric_format,
        signals: &policy.signals,
        observers: &policy.observers,
        features: &policy.features,
        layers: policy
            .layers
            .iter()
            .map(|layer| LayerView {
                name: &layer.name,
                inputs: layer.inputs,
                outputs: layer.outputs,
                activation: layer.activation,
                bound: describe::hull(layer.bounds.iter().copied()),
            })
            .collect(),
        actions: policy.actions(),
        continuous: policy.head.continuous(),
        residual: policy.head.residual(),
        schedule: policy.head.schedule(),
        mapping: policy.mapping,
        limits: policy.limits,
        fallback: policy.fallback,
        golden_vectors: policy.golden.as_ref().map_or(0, |golden| golden.count),
        decisions: verify::decisions(policy, None),
        digests: &policy.digests,
        sizes: manifest::sizes(policy, ::targets::host()),
        notes: &policy.notes,
    }
}

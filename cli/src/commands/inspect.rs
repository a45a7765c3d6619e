//! `policyc inspect`

use codegen::manifest;
use policy::{Activation, Head, Interval, Policy, describe};
use serde::Serialize;
use verify::text::inspection;

use crate::arguments::Inspect;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;
use crate::talk;

/// Prints the checked policy.
pub fn run(options: &Inspect) -> Result<Outcome, Failure> {
    let policy = super::load_several_as(&options.policy, options.outside, options.format)?;
    if options.json {
        output::say(&json(&policy)?)?;
    } else {
        output::say(inspection(&policy).trim_end())?;
    }
    if let Some(golden) = verify::golden_result(&policy).filter(|golden| !golden.passed()) {
        let problem = "the network does not give the trainer's golden answers";
        talk::different(problem, Some(&golden.hint().to_string()));
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
            talk::different(
                &format!("the numeric format changes {decided} than the contract allows"),
                None,
            );
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
    /// Several, each with what stands below for one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    outputs: Vec<OutputView<'p>>,
    mapping: Option<policy::Mapping>,
    /// Of one output.
    limits: Option<policy::Limits>,
    fallback: FallbackView,
    golden_vectors: usize,
    decisions: Option<verify::Decisions>,
    digests: &'p policy::Digests,
    sizes: manifest::Sizes,
    notes: &'p [String],
}

/// What happens without a usable measurement; each of several outputs has a duty of its own.
#[derive(Serialize)]
struct FallbackView {
    #[serde(skip_serializing_if = "Option::is_none")]
    duty: Option<f64>,
    hold: u32,
}

/// One of several outputs.
#[derive(Serialize)]
struct OutputView<'p> {
    name: &'p str,
    /// First column of the last layer.
    column: usize,
    actions: &'p [policy::Action],
    #[serde(skip_serializing_if = "Option::is_none")]
    continuous: Option<&'p policy::Continuous>,
    mapping: Option<&'p policy::Mapping>,
    limits: &'p policy::Limits,
    fallback_duty: f64,
}

fn outputs(policy: &Policy) -> Vec<OutputView<'_>> {
    let Head::Several(outputs) = &policy.head else {
        return Vec::new();
    };
    let all = outputs.iter().map(|output| OutputView {
        name: &output.name,
        column: output.column,
        actions: output.head.actions(),
        continuous: output.head.continuous(),
        mapping: output.mapping.as_ref(),
        limits: &output.limits,
        fallback_duty: output.fallback,
    });
    all.collect()
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
    let outputs = outputs(policy);
    let is_one = outputs.is_empty();
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
        outputs,
        mapping: policy.mapping,
        limits: is_one.then_some(policy.limits),
        fallback: FallbackView {
            duty: is_one.then_some(policy.fallback.duty),
            hold: policy.fallback.hold,
        },
        golden_vectors: policy.golden.as_ref().map_or(0, |golden| golden.count),
        decisions: verify::decisions(policy, None),
        digests: &policy.digests,
        sizes: manifest::sizes(policy, ::targets::host()),
        notes: &policy.notes,
    }
}

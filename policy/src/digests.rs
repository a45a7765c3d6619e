//! SHA-256 digests of canonical content: equal policies give equal digests, however their files are written.
//!
//! The contract's digest covers what decides the generated text: all numbers with defaults filled in, and the names,
//! units and source texts that end up in it as identifiers and comments. It does not cover layout, comments, file
//! names, golden vectors or their tolerance, and not the weights and the mapping, which have digests of their own.

use std::collections::BTreeMap;

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::activation::Activation;
use crate::model::{
    Action, Continuous, Digests, Expr, Fallback, Feature, Filter, Head, Interval, Layer, Limits, Mapping,
    NumericFormat, Observer, Output, Policy, Residual, Schedule, Signal,
};

#[derive(Serialize)]
struct Contract<'a> {
    version: u32,
    name: &'a str,
    sample_period: f64,
    numeric_format: NumericFormat,
    // ordered by name: the order of the keys in the file does not count
    parameters: &'a BTreeMap<String, f64>,
    signals: &'a [Signal],
    #[serde(skip_serializing_if = "<[Observer]>::is_empty")]
    observers: &'a [Observer],
    features: Vec<Observed<'a>>,
    activations: Vec<Activation>,
    actions: &'a [Action],
    // left out where there is none: contracts from before there was one keep their digest
    #[serde(skip_serializing_if = "Option::is_none")]
    continuous: Option<&'a Continuous>,
    #[serde(skip_serializing_if = "Option::is_none")]
    residual: Option<&'a Residual>,
    #[serde(skip_serializing_if = "Option::is_none")]
    schedule: Option<&'a Schedule>,
    #[serde(skip_serializing_if = "Option::is_none")]
    outputs: Option<&'a [Output]>,
    limits: &'a Limits,
    fallback: &'a Fallback,
}

impl Policy {
    /// The same policy in another numeric format; its contract's digest changes with it.
    #[must_use]
    pub fn with_format(mut self, format: NumericFormat) -> Self {
        self.numeric_format = format;
        self.digests = of(&self);
        self
    }
}

/// A feature without its bound, which follows from the rest.
#[derive(Serialize)]
struct Observed<'a> {
    name: &'a str,
    source: &'a Expr,
    source_text: &'a str,
    filters: &'a [Filter],
    scale: f64,
    offset: f64,
    clip: Option<Interval>,
}

impl<'a> Observed<'a> {
    fn of(feature: &'a Feature) -> Self {
        // taken apart by name: a field that is added does not compile until somebody decides whether it counts
        let Feature {
            name,
            source,
            source_text,
            filters,
            scale,
            offset,
            clip,
            bound: _,
        } = feature;
        Observed {
            name,
            source,
            source_text,
            filters,
            scale: *scale,
            offset: *offset,
            clip: *clip,
        }
    }
}

/// Digests of a policy's content.
pub(crate) fn of(policy: &Policy) -> Digests {
    let contract = Contract {
        version: 1,
        name: &policy.name,
        sample_period: policy.sample_period,
        numeric_format: policy.numeric_format,
        parameters: &policy.parameters,
        signals: &policy.signals,
        observers: &policy.observers,
        features: policy.features.iter().map(Observed::of).collect(),
        activations: policy.layers.iter().map(|layer| layer.activation).collect(),
        actions: policy.actions(),
        continuous: policy.head.continuous(),
        residual: policy.head.residual(),
        schedule: policy.head.schedule(),
        outputs: match &policy.head {
            Head::Several(outputs) => Some(outputs),
            Head::Choice(_) | Head::Residual(_) | Head::Continuous(_) | Head::Schedule(_) => None,
        },
        limits: &policy.limits,
        fallback: &policy.fallback,
    };
    Digests {
        weights: weights(&policy.layers),
        contract: json(&contract),
        mapping: mapping(policy),
    }
}

fn mapping(policy: &Policy) -> Option<String> {
    let Head::Several(outputs) = &policy.head else {
        return policy.mapping.as_ref().map(|mapping: &Mapping| json(mapping));
    };
    let all: Vec<Option<&Mapping>> = outputs.iter().map(|output| output.mapping.as_ref()).collect();
    all.iter().any(Option::is_some).then(|| json(&all))
}

fn weights(layers: &[Layer]) -> String {
    let mut hash = Sha256::new();
    for layer in layers {
        // sizes first: the same numbers in layers of another shape are another network
        hash.update((layer.outputs as u64).to_le_bytes());
        hash.update((layer.inputs as u64).to_le_bytes());
        for value in layer.weights.iter().chain(&layer.bias) {
            // the bits, little-endian: no form of text between, and the same digest on every machine
            hash.update(value.to_bits().to_le_bytes());
        }
    }
    hex(&hash.finalize())
}

/// Compact JSON with fields in declaration order and floats in their shortest form.
fn json(content: &impl Serialize) -> String {
    // these structs hold no map with keys other than text and no fallible serialiser
    let bytes = serde_json::to_vec(content).unwrap_or_default();
    sha256(&bytes)
}

/// SHA-256 as 64 hexadecimal digits.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

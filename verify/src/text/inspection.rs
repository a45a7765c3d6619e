//! A policy in words.

use codegen::manifest;
use interp::golden::{golden_result, unproven};
use policy::{Policy, describe};

use super::decisions;

/// The checked policy in words, as `policyc inspect` prints it.
#[must_use]
pub fn inspection(policy: &Policy) -> String {
    let mut out = describe::head(policy) + &describe::signals(policy);
    out += &(describe::observers(policy) + &describe::observation(policy));
    out += &describe::network(policy);
    for line in golden(policy) {
        out += &format!("  {line}\n");
    }
    out += &(describe::actions(policy) + &describe::mapping(policy) + &describe::limits(policy));
    out += &format!("\nsize\n  {}\n", manifest::sizes(policy, targets::host()));
    out += &describe::digests(policy);
    for note in &policy.notes {
        out += &format!("\nnote: {note}\n");
    }
    out
}

/// What the trainer's vectors show of the network, and what the numeric format does to his decisions.
fn golden(policy: &Policy) -> Vec<String> {
    let Some(golden) = golden_result(policy) else {
        return vec![unproven(policy)];
    };
    // how a network was read is asked in floats, whatever format it gets
    let read = if policy.numeric_format.is_integer() {
        " in f32"
    } else {
        ""
    };
    let mut lines = vec![format!("{} golden vectors{read}: {golden}", golden.vectors)];
    if let Some(found) = interp::decisions::decisions(policy, None) {
        lines.extend(decisions(policy, &found));
    }
    lines
}

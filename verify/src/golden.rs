//! Known answers of the trainer, as events for a build and as bits from it.

use interp::golden;
use policy::{Golden, Head, Policy, Scalar};

use crate::protocol::numbers;
use crate::report::GoldenResult;
use crate::traces::Event;

/// The observations of the known answers as events; empty without them.
pub(crate) fn events(policy: &Policy) -> Vec<Event> {
    policy.golden.as_ref().map_or_else(Vec::new, |golden| {
        let features = policy.features.len();
        golden
            .observations
            .chunks_exact(features)
            .map(|o| Event::Network(o.iter().copied().map(f64::from).collect()))
            .collect()
    })
}

/// Judges the Q values, given as bits, that answer [`events`]; values that are missing count as wrong.
pub(crate) fn judge(golden: &Golden, scalar: Scalar, head: &Head, words: &[u32]) -> GoldenResult {
    let q_values = numbers(scalar, words);
    let answers: Vec<&[f64]> = q_values.chunks_exact(head.outputs().max(1)).collect();
    golden::judge(golden, head, &answers)
}

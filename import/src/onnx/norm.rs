//! Norms over the values of a step.

use toml_input::Message;

use super::model::Node;
use super::words::named;
use crate::recognise;

/// The way out of a norm over the values of a step.
const LAYER_NORM: &str = "it divides by the deviation of the values of each step, which no dense layer can hold; train without it, or with \
                          BatchNorm1d, which is folded: the exporter does so in evaluation";

/// A norm over the values of a step: one node, or several that begin with a mean over the values. Only such a norm takes that.
pub(super) fn refusal(takers: &[&Node]) -> Option<Message> {
    let is_norm = |node: &&&Node| {
        let operation = node.operation.as_str();
        operation == "ReduceMean" || operation == "RMSNormalization" || operation.ends_with("LayerNormalization")
    };
    let node = takers.iter().find(is_norm)?;
    Some(recognise::layer_norm().found(named(node)).hint(LAYER_NORM))
}

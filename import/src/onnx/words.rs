//! Nodes in words: which activation one is, and why one is refused.

use toml_input::Message;

use super::model::Node;
use crate::activations;

pub(super) fn named(node: &Node) -> String {
    format!("{} `{}`", node.operation.escape_debug(), node.label().escape_debug())
}

pub(super) fn other(what: &str, found: &str, expected: &str) -> Message {
    Message::new(what).found(found).expected(expected)
}

/// The word for a node that is an activation.
pub(super) fn word(node: &Node) -> Option<&'static str> {
    let number = |name: &str, otherwise: f64| node.floats.get(name).copied().unwrap_or(otherwise);
    match node.operation.as_str() {
        "Gelu" if node.texts.get("approximate").is_some_and(|by| by == "tanh") => Some(activations::GELU_TANH),
        "Gelu" => Some(activations::GELU),
        // other parameters make other functions, for which there is no word
        "Elu" if number("alpha", 1.0) != 1.0 => None,
        "HardSigmoid" if !is_sixth(node) => None,
        operation => activations::word_of_onnx(operation),
    }
}

/// A hard sigmoid with the slope of torch and Keras 3; that of ONNX itself is 0.2.
pub(super) fn is_sixth(node: &Node) -> bool {
    let number = |name: &str, otherwise: f64| node.floats.get(name).copied().unwrap_or(otherwise);
    (number("alpha", 0.2) - 1.0 / 6.0).abs() < 1e-6 && number("beta", 0.5) == 0.5
}

pub(super) fn not_compiled(node: &Node, word: &str) -> Message {
    activations::refusal(word, &named(node))
}

pub(super) const EXPORT: &str =
    "export the policy network alone, in evaluation: torch.onnx.export(net.eval(), (obs,), \"policy.onnx\")";

pub(super) fn unknown(node: &Node) -> Message {
    Message::new("this node is not read, or not at this place of the graph")
        .found(named(node))
        .expected(
            "a chain of Gemm, MatMul, Add, Sub, Mul, Div with constants, Relu, Tanh and other activations, a Clip before and an ArgMax behind, \
             and reshapes",
        )
        .hint(EXPORT)
}

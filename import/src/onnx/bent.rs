//! Activations that an exporter writes as several nodes: the value goes two ways and comes together again.
//!
//! ```text
//!   SiLU           x ─ Sigmoid ─ Mul(x, .)
//!   hard swish     x ─ HardSigmoid ─ Mul(x, .)
//!   softplus       x ─ Softplus ─ Where(x > 20, x, .)          beyond 20 they differ by less than 3e-9
//!   GELU           x ─ Div sqrt 2 ─ Erf ─ Add 1 ─ Mul(x, .) ─ Mul 0.5
//! ```

use super::model::{Graph, Node};
use crate::activations::{GELU, HARD_SWISH, SILU, SOFTPLUS};

/// What several nodes make of a value: the word of the activation, the value behind them, and a node for messages.
pub(super) struct Bent<'a> {
    pub word: &'static str,
    pub value: &'a str,
    pub node: &'a Node,
}

/// The activation that begins at a value with these takers.
pub(super) fn find<'a>(graph: &'a Graph, value: &str, takers: &[&'a Node]) -> Option<Bent<'a>> {
    let of = |operation: &str| takers.iter().find(|node| node.operation == operation).copied();
    let one = |node: &'a Node| only_taker(graph, node);
    if let (Some(bound), Some(soft), Some(last)) = (of("Greater"), of("Softplus"), of("Where")) {
        let limit = bound.inputs.get(1).and_then(|name| graph.constants.get(name));
        let is_far = limit.is_some_and(|limit| limit.values.iter().all(|limit| *limit >= 20.0));
        let inputs = [out(bound)?, value, out(soft)?];
        let is_it = takers.len() == 3 && is_far && last.inputs == inputs;
        return bent(SOFTPLUS, last).filter(|_| is_it);
    }
    let product = of("Mul").filter(|_| takers.len() == 2)?;
    let gate = takers.iter().find(|node| node.operation != "Mul").copied();
    let factor = product.inputs.iter().find(|input| *input != value)?;
    if let Some(gate) = gate.filter(|gate| out(gate) == Some(factor) && gate.inputs.first().is_some_and(|x| x == value))
    {
        let word = match gate.operation.as_str() {
            "Sigmoid" => SILU,
            "HardSigmoid" if super::is_sixth(gate) => HARD_SWISH,
            _ => return None,
        };
        return bent(word, product);
    }
    let divided = gate.filter(|gate| gate.operation == "Div" && is_constant(graph, gate, std::f64::consts::SQRT_2))?;
    let erf = one(divided).filter(|node| node.operation == "Erf")?;
    let sum = one(erf).filter(|node| node.operation == "Add" && is_constant(graph, node, 1.0))?;
    let half = one(product).filter(|node| node.operation == "Mul" && is_constant(graph, node, 0.5))?;
    let is_it = one(sum).is_some_and(|node| std::ptr::eq(node, product)) && out(sum) == Some(factor);
    bent(GELU, half).filter(|_| is_it)
}

fn bent<'a>(word: &'static str, node: &'a Node) -> Option<Bent<'a>> {
    let value = out(node)?;
    Some(Bent { word, value, node })
}

fn out(node: &Node) -> Option<&str> {
    node.outputs.first().map(String::as_str)
}

fn only_taker<'a>(graph: &'a Graph, node: &Node) -> Option<&'a Node> {
    let value = node.outputs.first()?;
    let mut takers = graph.nodes.iter().filter(|other| other.inputs.contains(value));
    takers.next().filter(|_| takers.next().is_none())
}

/// Whether one of the inputs is this constant, as binary32 has it.
fn is_constant(graph: &Graph, node: &Node, expected: f64) -> bool {
    let constants = node.inputs.iter().filter_map(|name| graph.constants.get(name));
    let near = |value: &f64| (value - expected).abs() <= 1e-6 * expected;
    constants
        .map(|constant| constant.values.as_slice())
        .any(|values| matches!(values, [one] if near(one)))
}

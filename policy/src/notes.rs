//! What is allowed but worth a look.

use std::collections::BTreeMap;

use crate::model::{Action, Expr, Feature, Input, Limits, Mapping, Signal};

/// Signals and parameters that nothing refers to.
pub(crate) fn unused(
    parameters: &BTreeMap<String, f64>,
    signals: &[Signal],
    features: &[Feature],
    mapping: Option<&Mapping>,
) -> Vec<String> {
    let mut notes = Vec::new();
    if features.is_empty() {
        return notes;
    }
    let read = |index: usize| {
        features.iter().any(|feature| reads(&feature.source, index))
            || mapping.is_some_and(|mapping| mapping.load_current == index)
    };
    let idle = signals.iter().enumerate().filter(|(index, _)| !read(*index));
    notes.extend(idle.map(|(_, signal)| {
        format!(
            "signal `{}` feeds no feature; its plausible range still guards every step",
            signal.name
        )
    }));
    let word = |text: &str, name: &str| {
        text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
            .any(|w| w == name)
    };
    let idle = parameters
        .keys()
        .filter(|name| !features.iter().any(|feature| word(&feature.source_text, name)));
    notes.extend(idle.map(|name| format!("parameter `{name}` is not used")));
    notes
}

fn reads(expr: &Expr, index: usize) -> bool {
    match expr {
        Expr::Input(Input::Signal(found)) => *found == index,
        Expr::Input(_) | Expr::Constant(_) => false,
        Expr::Neg(e) | Expr::Scale(_, e) => reads(e, index),
        Expr::Add(a, b) | Expr::Sub(a, b) => reads(a, index) || reads(b, index),
    }
}

/// Actions that the duty limits cut off even without a mapping.
pub(crate) fn beyond_limits(limits: &Limits, actions: &[Action], mapping: Option<&Mapping>) -> Option<String> {
    if mapping.is_some() {
        return None;
    }
    let cut = |action: &&Action| action.duty < limits.duty.low || action.duty > limits.duty.high;
    let duties: Vec<_> = actions
        .iter()
        .filter(cut)
        .map(|action| action.duty.to_string())
        .collect();
    (!duties.is_empty()).then(|| format!("duties outside the limits are cut off: {}", duties.join(", ")))
}

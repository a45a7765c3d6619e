//! Features as formulas for people.

use crate::model::{Expr, Feature, Filter, Policy};

/// One line such as `e_del = clip(0.2 * delay1(v_ref - v_out), -20, 20)`, in the user's own names; a source that
/// was not written as text is shown from its tree with the names of the policy.
#[must_use]
pub fn formula(feature: &Feature, policy: &Policy) -> String {
    let source = match feature.source_text.as_str() {
        "" => expression(&feature.source, policy),
        text => text.to_owned(),
    };
    let atom = !source.contains([' ', '+', '-', '*', '/']);
    let mut text = source;
    for filter in &feature.filters {
        text = format!("{}({text}){}", filter_name(filter), over_period(filter));
    }
    // a scale before a sum needs parentheses; behind a name or a filter they stand already
    let closed = atom || !feature.filters.is_empty();
    if feature.scale != 1.0 {
        text = if closed {
            format!("{} * {text}", feature.scale)
        } else {
            format!("{} * ({text})", feature.scale)
        };
    }
    if feature.offset != 0.0 {
        let sign = if feature.offset < 0.0 { '-' } else { '+' };
        text = format!("{text} {sign} {}", feature.offset.abs());
    }
    if let Some(clip) = feature.clip {
        text = format!("clip({text}, {}, {})", clip.low, clip.high);
    }
    format!("{} = {text}", feature.name)
}

fn filter_name(filter: &Filter) -> String {
    match filter {
        Filter::Delay { samples } => format!("delay{samples}"),
        Filter::BackwardDifference => "difference".to_owned(),
        Filter::LowPass { time_constant } => format!("low_pass[{time_constant} s]"),
        Filter::FilteredDerivative { time_constant } => format!("derivative[{time_constant} s]"),
        Filter::MovingAverage { samples } => format!("average{samples}"),
        Filter::Integrator {
            min, max, leak: 1.0, ..
        } => format!("integral[{min}, {max}]"),
        Filter::Integrator { min, max, leak, .. } => format!("integral[{min}, {max}; {leak} kept]"),
    }
}

/// A difference is a rate: of one sample to the next, over the control period.
fn over_period(filter: &Filter) -> &'static str {
    match filter {
        Filter::BackwardDifference => "/T",
        _ => "",
    }
}

/// An expression with its constants folded, fully parenthesised below the top.
#[must_use]
pub fn expression(expr: &Expr, policy: &Policy) -> String {
    let inner = |e: &Expr| match e {
        Expr::Input(_) | Expr::Constant(_) => expression(e, policy),
        _ => format!("({})", expression(e, policy)),
    };
    match expr {
        Expr::Input(input) => input.name(&policy.signals, &policy.observers),
        Expr::Constant(value) => value.to_string(),
        Expr::Neg(e) => format!("-{}", inner(e)),
        Expr::Add(a, b) => format!("{} + {}", inner(a), inner(b)),
        Expr::Sub(a, b) => format!("{} - {}", inner(a), inner(b)),
        Expr::Scale(k, e) => format!("{k} * {}", inner(e)),
    }
}

//! Known answers of several outputs: each is judged as if it were alone, by its own columns of the last layer.

use std::fmt;

use policy::{Golden, Output};
use serde::Serialize;

use crate::golden::{self, GoldenResult};

/// What the trainer's answers say of one output of several.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutputResult {
    /// Name of the output.
    pub name: String,
    /// As of a contract with this output alone.
    #[serde(flatten)]
    pub result: GoldenResult,
}

impl fmt::Display for OutputResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.name, self.result)
    }
}

impl GoldenResult {
    /// The same, told and not judged if `rounded`: of each output, too.
    #[must_use]
    pub fn told(mut self, rounded: bool) -> Self {
        self.rounded = rounded;
        self.outputs.iter_mut().for_each(|own| own.result.rounded = rounded);
        self
    }
}

pub(crate) fn judge(golden: &Golden, outputs: &[Output], answers: &[&[f64]]) -> GoldenResult {
    let each = outputs.iter().enumerate().map(|(index, output)| {
        let columns = output.columns();
        // a row that is too short gives none: what is missing counts as wrong
        let rows: Vec<&[f64]> = answers.iter().map_while(|row| row.get(columns.clone())).collect();
        OutputResult {
            name: output.name.clone(),
            result: golden::judge(&golden.of_output(index, &columns), &output.head, &rows),
        }
    });
    let outputs: Vec<OutputResult> = each.collect();
    let sum = |of: fn(&GoldenResult) -> usize| outputs.iter().map(|own| of(&own.result)).sum();
    let largest = |of: fn(&GoldenResult) -> Option<f64>| {
        let errors = outputs.iter().filter_map(|own| of(&own.result));
        errors.reduce(f64::max)
    };
    GoldenResult {
        vectors: golden.count,
        actions_compared: sum(|own| own.actions_compared),
        actions_equal: sum(|own| own.actions_equal),
        worst_relative_error: largest(|own| own.worst_relative_error),
        worst_duty_error: largest(|own| own.worst_duty_error),
        worst_gain_error: None,
        limits_range: None,
        output_error: None,
        activations: Vec::new(),
        tolerance: golden.tolerance,
        rounded: false,
        outputs,
    }
}

/// What to look at for the first output that has not passed; `None` of one output, or if all have.
pub(crate) fn hint(result: &GoldenResult) -> Option<String> {
    let first = result.outputs.iter().find(|own| !own.result.passed())?;
    Some(format!("output `{}`: {}", first.name, first.result.hint()))
}

//! Golden answers of several outputs: the whole last layer once, and actions or duties of each by its name.
//!
//! A tensor that only looks like one of these is a fault: `action_lfet` would otherwise be passed over, and an output that nobody
//! compared would count as right.

use safetensors::SafeTensors;
use safetensors::tensor::TensorView;
use toml_input::{Message, Sink};

use super::{Answers, OutputShape, catalogue, floats, greedy, integers, names, part};
use crate::model::OutputAnswers;
use crate::raw::Binary;

/// How the last layer may be called: as of a continuous head, or as of a choice.
const LAYER: [&str; 2] = ["output", "q"];

pub(super) fn read(
    file: &Binary,
    opened: &SafeTensors<'_>,
    [rows, columns]: [usize; 2],
    outputs: &[OutputShape<'_>],
    faults: &mut Sink,
) -> Option<Answers> {
    let before = faults.count();
    let view = |name: &str| opened.iter().find(|(found, _)| *found == name).map(|(_, view)| view);
    strangers(file, opened, outputs, faults);
    let layer = LAYER.map(|name| (name, view(name)));
    if let [(_, Some(_)), (_, Some(_))] = layer {
        faults.push(file.name.tensor_fault("q", catalogue::golden_layer_twice()));
        return None;
    }
    let layer = layer.into_iter().find_map(|(name, view)| Some((name, view?)));
    let own = |output: &OutputShape<'_>| view(&tensor(output));
    let silent: Vec<&str> = outputs
        .iter()
        .filter(|output| own(output).is_none())
        .map(|output| output.name)
        .collect();
    if layer.is_none() && !silent.is_empty() {
        // a misspelt tensor is the same fault, said better
        if faults.count() == before {
            let expected: Vec<String> = outputs.iter().map(|output| format!("`{}`", tensor(output))).collect();
            let message = catalogue::golden_several([rows, columns], &expected.join(", "), &silent);
            faults.push(file.name.fault(message.found(names(opened))));
        }
        return None;
    }
    let q_values = match &layer {
        None => Some(Vec::new()),
        Some((name, view)) => part(file, name, faults, floats(view, &[rows, columns])),
    };
    let each = outputs.iter().map(|output| {
        let cut = cut(q_values.as_deref().unwrap_or_default(), columns, output);
        one(file, output, (rows, own(output)), &cut, faults)
    });
    let each: Vec<Option<OutputAnswers>> = each.collect();
    Some(Answers {
        q_values: q_values?,
        outputs: each.into_iter().collect::<Option<Vec<_>>>()?,
        ..Answers::default()
    })
}

/// The tensor of an output's own answers.
fn tensor(output: &OutputShape<'_>) -> String {
    let stem = if output.is_choice { "action" } else { "duty" };
    format!("{stem}_{}", output.name)
}

fn one(
    file: &Binary,
    output: &OutputShape<'_>,
    (rows, view): (usize, Option<TensorView<'_>>),
    q_values: &[f32],
    faults: &mut Sink,
) -> Option<OutputAnswers> {
    let Some(view) = view else {
        return Some(OutputAnswers::default());
    };
    let name = tensor(output);
    if !output.is_choice {
        let flat: Result<Vec<f32>, Message> = match view.shape() {
            [_, 1] => floats(&view, &[rows, 1]),
            _ => floats(&view, &[rows]),
        };
        let duties = part(file, &name, faults, flat)?;
        return Some(OutputAnswers {
            duties,
            ..OutputAnswers::default()
        });
    }
    let action_indices = part(file, &name, faults, integers(&view, rows, output.width))?;
    part(file, &name, faults, greedy(q_values, &action_indices, output.width))?;
    Some(OutputAnswers {
        action_indices,
        ..OutputAnswers::default()
    })
}

/// The columns of one output.
fn cut(q_values: &[f32], columns: usize, output: &OutputShape<'_>) -> Vec<f32> {
    let own = output.column..output.column + output.width;
    let rows = q_values.chunks_exact(columns.max(1));
    rows.flat_map(|row| row.get(own.clone()).unwrap_or_default())
        .copied()
        .collect()
}

/// Tensors that would be answers, and are those of no output.
fn strangers(file: &Binary, opened: &SafeTensors<'_>, outputs: &[OutputShape<'_>], faults: &mut Sink) {
    let known: Vec<String> = outputs.iter().map(tensor).collect();
    let is_answer = |name: &str| {
        let stem = name.split_once('_').map_or(name, |(stem, _)| stem);
        ["action", "duty"].contains(&stem)
    };
    let mut strangers: Vec<String> = opened
        .iter()
        .map(|(name, _)| name.to_owned())
        .filter(|name| is_answer(name) && !known.contains(name))
        .collect();
    // the crate lists tensors by their place in the file
    strangers.sort();
    for name in strangers {
        let message = catalogue::golden_stranger(&name, &known);
        faults.push(file.name.tensor_fault(&name, message));
    }
}

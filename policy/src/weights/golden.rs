//! Known answers from the trainer: `obs` [n, features], `q` [n, actions], `action` [n].

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use toml_input::{Message, Sink};

use super::{catalogue, header, tensors};
use crate::model::{Feature, Golden};
use crate::raw::Binary;

/// What the contract allows a network that answers them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// |Q - golden| relative to the largest |Q| of a vector.
    pub tolerance: f64,
    /// Share of changed actions, 0..1.
    pub decisions: Option<f64>,
    /// Share of observations, 0..1, that may lie outside of what the controller can see, and are left out.
    pub outside: f64,
}

/// Reads and checks the vectors; `bounds` are checked only if every feature is known.
pub(crate) fn read(
    file: &Binary,
    features: usize,
    bounds: &[Feature],
    actions: usize,
    limits: Limits,
    faults: &mut Sink,
) -> Option<Golden> {
    let opened = header::open(file, faults)?;
    let before = faults.count();
    for (name, view) in opened.iter() {
        if let Err(message) = tensors::sound(name, view.shape()) {
            faults.push(file.name.tensor_fault(name, message));
        }
    }
    // messages below list the names of all tensors: they have to be fit for printing
    if faults.count() > before {
        return None;
    }
    let view = |name: &str| opened.iter().find(|(found, _)| *found == name).map(|(_, view)| view);
    let Some(observations) = view("obs") else {
        let names = names(&opened);
        let message = catalogue::golden_missing("obs", &format!("f32 [rows, {features}]")).found(names);
        faults.push(file.name.fault(message));
        return None;
    };
    let Some(rows) = rows(&observations, features) else {
        // how many rows there are is not known: what follows would be echoes
        let message = catalogue::golden_shape(observations.shape(), features);
        faults.push(file.name.tensor_fault("obs", message));
        return None;
    };
    let (q, action) = (view("q"), view("action"));
    if q.is_none() && action.is_none() {
        let expected = format!("`q` f32 [{rows}, {actions}] or `action` i32 [{rows}], or both");
        faults.push(
            file.name
                .fault(catalogue::golden_missing("q", &expected).found(names(&opened))),
        );
        return None;
    }
    let obs = part(file, "obs", faults, floats(&observations, &[rows, features]));
    let q_values = q.map(|view| part(file, "q", faults, floats(&view, &[rows, actions])));
    let indices = action.map(|view| part(file, "action", faults, integers(&view, rows, actions)));
    let seen = obs.as_deref().map(|obs| seen(obs, rows, bounds));
    if let Some(seen) = &seen {
        part(file, "obs", faults, seen.enough(rows, limits.outside));
    }
    let (q_values, action_indices) = (
        q_values.unwrap_or(Some(Vec::new())),
        indices.unwrap_or(Some(Vec::new())),
    );
    if let (Some(q), Some(chosen)) = (&q_values, &action_indices) {
        part(file, "action", faults, greedy(q, chosen, actions));
    }
    let (observations, seen) = (obs?, seen?);
    let (q_values, action_indices) = (q_values?, action_indices?);
    let golden = Golden {
        count: seen.rows.len(),
        outside: rows - seen.rows.len(),
        observations: seen.keep(&observations, features),
        q_values: seen.keep(&q_values, actions),
        action_indices: seen.keep(&action_indices, 1),
        tolerance: limits.tolerance,
        decisions: limits.decisions,
    };
    (faults.count() == before).then_some(golden)
}

/// The number of vectors, if the shape is `[rows, features]`.
fn rows(observations: &TensorView<'_>, features: usize) -> Option<usize> {
    match observations.shape() {
        [rows, columns] if *columns == features => Some(*rows),
        _ => None,
    }
}

fn names(tensors: &SafeTensors<'_>) -> String {
    let mut names: Vec<_> = tensors.iter().map(|(name, _)| format!("`{name}`")).collect();
    names.sort();
    names.join(", ")
}

fn part<T>(file: &Binary, tensor: &str, faults: &mut Sink, result: Result<T, Message>) -> Option<T> {
    result
        .map_err(|message| faults.push(file.name.tensor_fault(tensor, message)))
        .ok()
}

fn floats(view: &TensorView<'_>, shape: &[usize; 2]) -> Result<Vec<f32>, Message> {
    if view.shape() != shape {
        let is_transposed = view.shape() == [shape[1], shape[0]];
        let hint = is_transposed.then(|| "save the transposed array: `.T.copy()`".to_owned());
        return Err(catalogue::wrong_shape("this tensor", view.shape(), shape, hint));
    }
    match view.dtype() {
        dtype @ (Dtype::F32 | Dtype::F64) => tensors::values(dtype, view.data()),
        other => Err(catalogue::wrong_dtype(&other.to_string(), "F32 or F64")),
    }
}

fn integers(view: &TensorView<'_>, rows: usize, actions: usize) -> Result<Vec<u32>, Message> {
    if view.shape() != [rows] {
        let hint = (view.shape() == [rows, 1]).then(|| "save it flat: `.squeeze(1)`".to_owned());
        return Err(catalogue::wrong_shape("this tensor", view.shape(), &[rows], hint));
    }
    let data = view.data();
    let numbers: Vec<i64> = match view.dtype() {
        Dtype::I32 => tensors::chunks(data)
            .map(|b| i64::from(i32::from_le_bytes(b)))
            .collect(),
        Dtype::U32 => tensors::chunks(data)
            .map(|b| i64::from(u32::from_le_bytes(b)))
            .collect(),
        Dtype::I64 => tensors::chunks(data).map(i64::from_le_bytes).collect(),
        Dtype::U8 => data.iter().map(|&b| i64::from(b)).collect(),
        other => {
            return Err(catalogue::wrong_dtype(&other.to_string(), "I32, I64, U8 or U32")
                .hint("save whole numbers: `.int()`, or `.astype(np.int32)`"));
        }
    };
    let index = |(row, number): (usize, i64)| match u32::try_from(number) {
        Ok(index) if (index as usize) < actions => Ok(index),
        _ => Err(catalogue::golden_action(row, &number.to_string(), actions)),
    };
    numbers.into_iter().enumerate().map(index).collect()
}

/// Which observations the controller can make.
struct Seen {
    rows: Vec<usize>,
    /// Message about the first row that is none of them.
    first_outside: Option<Message>,
}

impl Seen {
    /// No more rows lie outside than the contract says, and one is left.
    fn enough(&self, rows: usize, share: f64) -> Result<(), Message> {
        let outside = rows - self.rows.len();
        match &self.first_outside {
            Some(message) if self.rows.is_empty() || outside as f64 > share * rows as f64 => {
                Err(catalogue::golden_outside_rows(message.clone(), outside, rows))
            }
            _ => Ok(()),
        }
    }

    /// The values of these rows, `width` in each; nothing of nothing.
    fn keep<T: Copy>(&self, values: &[T], width: usize) -> Vec<T> {
        let row = |row: &usize| values.get(row * width..(row + 1) * width).unwrap_or_default();
        self.rows.iter().flat_map(row).copied().collect()
    }
}

/// The rows that lie within the bounds, give or take a few roundings of the trainer's own arithmetic.
fn seen(observations: &[f32], rows: usize, features: &[Feature]) -> Seen {
    let mut seen = Seen {
        rows: Vec::with_capacity(rows),
        first_outside: None,
    };
    if features.is_empty() {
        seen.rows = (0..rows).collect();
        return seen;
    }
    for (row, values) in observations.chunks_exact(features.len()).enumerate() {
        let outside = values.iter().zip(features).find(|(value, feature)| {
            let (low, high, value) = (feature.bound.low, feature.bound.high, f64::from(**value));
            // 17 units of binary32: the trainer scales and clips in an order of its own
            let slack = 1e-6 * low.abs().max(high.abs());
            value < low - slack || value > high + slack
        });
        match outside {
            None => seen.rows.push(row),
            Some((value, feature)) if seen.first_outside.is_none() => {
                let (low, high) = (feature.bound.low, feature.bound.high);
                seen.first_outside = Some(catalogue::golden_outside(
                    row,
                    &feature.name,
                    (*value).into(),
                    low,
                    high,
                ));
            }
            Some(_) => {}
        }
    }
    seen
}

/// Where both are given, the action has the largest Q value of its row.
fn greedy(q_values: &[f32], chosen: &[u32], actions: usize) -> Result<(), Message> {
    if q_values.is_empty() {
        return Ok(());
    }
    for (row, (values, &action)) in q_values.chunks_exact(actions.max(1)).zip(chosen).enumerate() {
        let best = values
            .iter()
            .enumerate()
            .fold(0, |best, (i, q)| if *q > values[best] { i } else { best });
        // an equal value passes: a trainer may break ties otherwise than section 7
        if values.get(action as usize).is_none_or(|q| *q < values[best]) {
            return Err(catalogue::golden_not_greedy(row, action, best));
        }
    }
    Ok(())
}

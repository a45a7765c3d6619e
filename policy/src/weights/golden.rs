//! Known answers from the trainer: `obs` [n, features] with `q` [n, actions] and `action` [n] of a choice, or with `output` [n]
//! and `duty` [n] of a continuous head, or with `output` [n, gains] and `duty` [n] of a gain schedule. Of several outputs the
//! whole last layer as `output` [n, columns], and `action_NAME` [n] or `duty_NAME` [n] of each.

mod several;

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use toml_input::{Faults, FileName, Message, Sink};

use super::told::Told;
use super::{catalogue, header, tensors};
use crate::model::{Feature, Golden, Head, Output, OutputAnswers};
use crate::raw::Binary;

/// What the contract allows a network that answers them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// |Q - golden| relative to the largest |Q| of a vector.
    pub tolerance: f64,
    /// Share of changed actions, 0..1.
    pub decisions: Option<f64>,
    /// Error of a continuous head's duty, as a share of its range.
    pub duty_error: Option<f64>,
    /// Share of observations, 0..1, that may lie outside of what the controller can see, and are left out.
    pub outside: f64,
}

/// What the contract says of a vector.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shape<'a> {
    pub features: usize,
    pub outputs: usize,
    /// What the outputs become.
    pub head: &'a Head,
    /// Each of several outputs; none where there is one.
    pub several: &'a [OutputShape<'a>],
}

/// What golden answers say of one of several outputs.
#[derive(Debug, Clone, Copy)]
pub struct OutputShape<'a> {
    /// Its name in the contract.
    pub name: &'a str,
    /// First column of the last layer.
    pub column: usize,
    /// How many columns.
    pub width: usize,
    /// Whether it chooses among actions.
    pub is_choice: bool,
}

impl<'a> OutputShape<'a> {
    /// Of an output of a contract.
    pub(crate) fn of(output: &'a Output) -> Self {
        Self {
            name: &output.name,
            column: output.column,
            width: output.head.outputs(),
            is_choice: output.head.is_choice(),
        }
    }
}

/// What the trainer made of the observations; a part that it did not give is empty.
#[derive(Default)]
struct Answers {
    q_values: Vec<f32>,
    action_indices: Vec<u32>,
    duties: Vec<f32>,
    /// Of several outputs.
    outputs: Vec<OutputAnswers>,
}

/// Reads and checks the vectors; `bounds` are checked only if every feature is known.
pub(crate) fn read(
    file: &Binary,
    shape: Shape<'_>,
    bounds: &[Feature],
    limits: Limits,
    faults: &mut Sink,
) -> Option<Golden> {
    let Shape { features, outputs, .. } = shape;
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
    let obs = part(file, "obs", faults, floats(&observations, &[rows, features]));
    let answers = match shape.several {
        [] => answers_of_one(file, &opened, shape, rows, faults),
        several => several::read(file, &opened, [rows, outputs], several, faults),
    };
    let has_duty = matches!(shape.head, Head::Schedule(_)) && view("duty").is_some() && !bounds.is_empty();
    let told = match (shape.head, has_duty) {
        (Head::Schedule(head), true) => part(
            file,
            "duty",
            faults,
            Told::of(head, bounds).map_err(|text| catalogue::golden_law(&text)),
        ),
        _ => Some(Told::default()),
    };
    let seen = obs.as_deref().map(|obs| seen(obs, rows, bounds));
    if let Some(seen) = &seen {
        part(file, "obs", faults, seen.enough(rows, limits.outside));
    }
    let (observations, seen, answers) = (obs?, seen?, answers?);
    let observations = seen.keep(&observations, features);
    let golden = Golden {
        count: seen.rows.len(),
        outside: rows - seen.rows.len(),
        law: told?.law(&observations, bounds),
        observations,
        q_values: seen.keep(&answers.q_values, outputs),
        action_indices: seen.keep(&answers.action_indices, 1),
        duties: seen.keep(&answers.duties, 1),
        outputs: answers.outputs.iter().map(|own| seen.keep_output(own)).collect(),
        tolerance: limits.tolerance,
        decisions: limits.decisions,
        duty_error: limits.duty_error,
    };
    (faults.count() == before).then_some(golden)
}

/// Whether golden answers could be those of a network that chooses, with so many inputs and actions; `several` are the outputs where
/// there is more than one. What a contract says of them, their ranges and the limits of a difference, is not judged.
///
/// # Errors
/// The faults that a contract which names the file would meet.
pub fn golden_fits(
    name: &FileName,
    bytes: Vec<u8>,
    inputs: usize,
    outputs: usize,
    several: &[OutputShape<'_>],
) -> Result<(), Faults> {
    let file = Binary {
        name: name.clone(),
        bytes,
    };
    let shape = Shape {
        features: inputs,
        outputs,
        head: &Head::Choice(Vec::new()),
        several,
    };
    let limits = Limits {
        tolerance: f64::INFINITY,
        decisions: None,
        duty_error: None,
        outside: 1.0,
    };
    let mut faults = Sink::new();
    read(&file, shape, &[], limits, &mut faults);
    if !faults.is_empty() {
        let message = Message::new("these are not the answers of this network")
            .found("a golden file beside the model, which is taken as its trainer's")
            .hint("move that of another network away, or the model into a folder of its own");
        faults.push(name.fault(message));
    }
    faults.propagate()
}

/// Answers of the one output: Q values and actions of a choice, else outputs and duties.
fn answers_of_one(
    file: &Binary,
    opened: &SafeTensors<'_>,
    shape: Shape<'_>,
    rows: usize,
    faults: &mut Sink,
) -> Option<Answers> {
    let outputs = shape.outputs;
    let view = |name: &'static str| {
        (
            name,
            opened.iter().find(|(found, _)| *found == name).map(|(_, view)| view),
        )
    };
    let is_choice = shape.head.is_choice();
    let parts = if is_choice { ["q", "action"] } else { ["output", "duty"] }.map(view);
    if parts.iter().any(|(_, view)| view.is_some()) {
        return match is_choice {
            true => choices(file, [rows, outputs], parts, faults),
            false => numbers(file, [rows, outputs], parts, faults),
        };
    }
    let missing = if is_choice {
        let expected = format!("`q` f32 [{rows}, {outputs}] or `action` i32 [{rows}], or both");
        catalogue::golden_missing("q", &expected)
    } else {
        catalogue::golden_continuous(rows, outputs)
    };
    faults.push(file.name.fault(missing.found(names(opened))));
    None
}

/// A tensor that may be there, by its name.
type Named<'a> = (&'static str, Option<TensorView<'a>>);

/// Q values and greedy actions.
fn choices(file: &Binary, [rows, actions]: [usize; 2], parts: [Named<'_>; 2], faults: &mut Sink) -> Option<Answers> {
    let [(q, q_values), (action, indices)] = parts;
    let q_values = q_values.map(|view| part(file, q, faults, floats(&view, &[rows, actions])));
    let indices = indices.map(|view| part(file, action, faults, integers(&view, rows, actions)));
    let (q_values, action_indices) = (
        q_values.unwrap_or(Some(Vec::new())),
        indices.unwrap_or(Some(Vec::new())),
    );
    if let (Some(q), Some(chosen)) = (&q_values, &action_indices) {
        part(file, action, faults, greedy(q, chosen, actions));
    }
    Some(Answers {
        q_values: q_values?,
        action_indices: action_indices?,
        ..Answers::default()
    })
}

/// Outputs and duties of a head without a choice; one number a row as `[rows]` or as a column.
fn numbers(file: &Binary, [rows, outputs]: [usize; 2], parts: [Named<'_>; 2], faults: &mut Sink) -> Option<Answers> {
    let [first, second] = parts;
    let [q_values, duties] = [(first, outputs), (second, 1)].map(|((name, view), width)| {
        let Some(view) = view else { return Some(Vec::new()) };
        let is_flat = width == 1 && view.shape().len() == 1;
        let shape: &[usize] = if is_flat { &[rows] } else { &[rows, width] };
        part(file, name, faults, floats(&view, shape))
    });
    Some(Answers {
        q_values: q_values?,
        duties: duties?,
        ..Answers::default()
    })
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

fn floats(view: &TensorView<'_>, shape: &[usize]) -> Result<Vec<f32>, Message> {
    if view.shape() != shape {
        let is_transposed = shape.len() == 2 && view.shape().iter().eq(shape.iter().rev());
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

    fn keep_output(&self, own: &OutputAnswers) -> OutputAnswers {
        OutputAnswers {
            action_indices: self.keep(&own.action_indices, 1),
            duties: self.keep(&own.duties, 1),
        }
    }

    /// The values of these rows, `width` in each; nothing of nothing.
    fn keep<T: Copy>(&self, values: &[T], width: usize) -> Vec<T> {
        let row = |row: &usize| values.get(row * width..(row + 1) * width).unwrap_or_default();
        self.rows.iter().flat_map(row).copied().collect()
    }
}

impl Feature {
    /// Whether a plausible measurement gives this observation, or one that lies as near as a trainer's own arithmetic.
    #[must_use]
    pub fn can_be(&self, observation: f64) -> bool {
        let (low, high) = (self.bound.low, self.bound.high);
        // 17 units of binary32: the trainer scales and clips in an order of its own
        let slack = 1e-6 * low.abs().max(high.abs());
        // what is no number is not outside: another check refuses it
        !(observation < low - slack || observation > high + slack)
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
        let mut both = values.iter().zip(features);
        let outside = both.find(|(value, feature)| !feature.can_be(f64::from(**value)));
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

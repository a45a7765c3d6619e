//! The plain chain of dense layers that every reader and every recogniser ends in.

use std::collections::BTreeMap;

use safetensors::Dtype;
use safetensors::tensor::TensorView;
use toml_input::{FileName, Message};

use crate::recognise::Definition;

/// A dense layer in binary64, before it is rounded: `y = W x + b`.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// Its name in the file.
    pub name: String,
    /// Length of `x`.
    pub inputs: usize,
    /// Length of `y`.
    pub outputs: usize,
    /// `W`, `[outputs][inputs]`.
    pub weights: Vec<f64>,
    /// `b`; zeros where the file has none.
    pub bias: Vec<f64>,
}

impl Layer {
    /// The row of `W` that makes one output.
    pub(crate) fn row(&self, output: usize) -> &[f64] {
        self.weights
            .get(output * self.inputs..(output + 1) * self.inputs)
            .unwrap_or_default()
    }

    /// `W x + b` in the order of the inputs.
    pub(crate) fn apply(&self, x: &[f64]) -> Vec<f64> {
        let sum = |(output, bias): (usize, &f64)| {
            let products = self.row(output).iter().zip(x).map(|(w, x)| w * x);
            bias + products.sum::<f64>()
        };
        self.bias.iter().enumerate().map(sum).collect()
    }
}

/// A network whose largest output is the choice.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// First to last.
    pub layers: Vec<Layer>,
    /// Whether the file holds it as it is: the contract can name the file itself.
    pub plain: bool,
    /// Whether only the choice is that of the file, not the values: a constant was left out.
    pub choice_only: bool,
    /// What was joined, folded, renamed or left out, a sentence each.
    pub said: Vec<String>,
    /// Of a continuous actor: what its names say beyond the layers.
    pub(crate) definition: Option<Definition>,
}

impl Network {
    /// Keeps one output of several and says what is left out.
    ///
    /// # Errors
    /// If there is no such output.
    pub(crate) fn keep_output(&mut self, output: usize) -> Result<(), Message> {
        let Some(last) = self.layers.last_mut() else {
            return Ok(());
        };
        let of = last.outputs;
        if output >= of {
            return Err(no_output(output, of));
        }
        (last.weights, last.bias) = (
            last.row(output).to_vec(),
            last.bias.get(output).copied().into_iter().collect(),
        );
        last.outputs = 1;
        self.plain = false;
        self.said
            .push(format!("output {output} of {of} is the duty; {}", left_out(output, of)));
        Ok(())
    }

    /// The layers as a safetensors file, rounded once to binary32: `layer_0.weight`, `layer_0.bias`, ...
    ///
    /// # Errors
    /// If a folded number is too large for binary32.
    pub fn to_safetensors(&self, file: &FileName) -> Result<Vec<u8>, toml_input::Faults> {
        let mut tensors = Vec::new();
        for (index, layer) in self.layers.iter().enumerate() {
            let weight = rounded(&layer.weights).map_err(|message| file.tensor_fault(&layer.name, message))?;
            let bias = rounded(&layer.bias).map_err(|message| file.tensor_fault(&layer.name, message))?;
            tensors.push((
                format!("layer_{index}.weight"),
                vec![layer.outputs, layer.inputs],
                weight,
            ));
            tensors.push((format!("layer_{index}.bias"), vec![layer.outputs], bias));
        }
        written(&tensors, &BTreeMap::new()).map_err(|message| file.fault(message).into())
    }
}

/// An output, or a dimension, that is not there.
pub(crate) fn no_output(output: usize, of: usize) -> Message {
    Message::new("--output names none of the outputs")
        .found(output.to_string())
        .expected(format!("0 to {}", of.saturating_sub(1)))
        .hint("they are counted from 0, in the order of the action space")
}

/// What stands beside the one that is kept.
pub(crate) fn left_out(kept: usize, of: usize) -> String {
    let others: Vec<String> = (0..of)
        .filter(|index| *index != kept)
        .map(|index| index.to_string())
        .collect();
    match others.as_slice() {
        [] => "there is no other".to_owned(),
        [one] => format!("{one} is left out"),
        [first @ .., last] => format!("{} and {last} are left out", first.join(", ")),
    }
}

/// A name, a shape and little-endian binary32 numbers.
pub(crate) type Stored = (String, Vec<usize>, Vec<u8>);

/// Little-endian binary32, nearest to each number.
pub(crate) fn rounded(values: &[f64]) -> Result<Vec<u8>, Message> {
    let mut bytes = Vec::with_capacity(4 * values.len());
    for value in values {
        let near = *value as f32;
        if !near.is_finite() {
            return Err(Message::new("a number is too large for f32")
                .found(format!("{value:e}"))
                .expected("magnitudes up to 3.4e38"));
        }
        bytes.extend(near.to_le_bytes());
    }
    Ok(bytes)
}

fn view(stored: &Stored) -> Result<(String, TensorView<'_>), safetensors::SafeTensorError> {
    let (name, shape, bytes) = stored;
    let dtype = if name == "action" { Dtype::I32 } else { Dtype::F32 };
    Ok((name.clone(), TensorView::new(dtype, shape.clone(), bytes)?))
}

/// A safetensors file of binary32 tensors; `action` holds 32-bit integers.
pub(crate) fn written(tensors: &[Stored], metadata: &BTreeMap<String, String>) -> Result<Vec<u8>, Message> {
    let fault = |error: safetensors::SafeTensorError| Message::new(format!("cannot write safetensors: {error}"));
    let views: Result<Vec<_>, _> = tensors.iter().map(view).collect();
    let metadata = (!metadata.is_empty()).then(|| metadata.clone().into_iter().collect());
    safetensors::serialize(views.map_err(fault)?, metadata).map_err(fault)
}

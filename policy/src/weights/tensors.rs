//! Tensors as finite binary32 numbers.

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use toml_input::{Message, Sink};

use super::catalogue;
use crate::limits::MAX_TENSOR_NAME_CHARS;
use crate::raw::Binary;

/// A tensor whose numbers are all finite.
#[derive(Debug, Clone)]
pub(crate) struct Tensor {
    pub name: String,
    pub shape: Vec<usize>,
    pub values: Vec<f32>,
}

/// The readable tensors of a file, sorted by name, and what was converted or set aside.
#[derive(Debug, Default)]
pub(crate) struct Tensors {
    pub list: Vec<Tensor>,
    /// Names of tensors of integer type that cannot belong to a layer.
    pub set_aside: Vec<String>,
    pub notes: Vec<String>,
}

/// Converts every tensor; `None` if any is unfit.
pub(crate) fn convert(file: &Binary, tensors: &SafeTensors<'_>, faults: &mut Sink) -> Option<Tensors> {
    let before = faults.count();
    let mut result = Tensors::default();
    let mut views = tensors.tensors();
    // the crate hands them out in the order of a hash map: faults and notes must not depend on it
    views.sort_by(|(a, _), (b, _)| a.cmp(b));
    let views = plainly_named(file, views, faults);
    let (mut rounded, mut widened) = (Vec::new(), Vec::new());
    for (name, view) in &views {
        if let Err(message) = sound(name, view.shape()) {
            faults.push(file.name.tensor_fault(name, message));
            continue;
        }
        match view.dtype() {
            Dtype::F32 => {}
            Dtype::F64 => rounded.push(name.as_str()),
            Dtype::F16 | Dtype::BF16 => widened.push(name.as_str()),
            // integers that are no weights, such as counters of a norm layer, do not disturb
            _ if super::layers::role(name).is_none() => {
                result.set_aside.push(name.clone());
                continue;
            }
            other => {
                let message = catalogue::wrong_dtype(&other.to_string(), "F32, F64, F16 or BF16");
                faults.push(file.name.tensor_fault(name, message));
                continue;
            }
        }
        match values(view.dtype(), view.data()) {
            Ok(values) => result.list.push(Tensor {
                name: name.clone(),
                shape: view.shape().to_vec(),
                values,
            }),
            Err(message) => faults.push(file.name.tensor_fault(name, message)),
        }
    }
    if !rounded.is_empty() {
        result
            .notes
            .push(format!("64-bit tensors were rounded to f32: {}", rounded.join(", ")));
    }
    if !widened.is_empty() {
        result.notes.push(format!(
            "16-bit tensors were widened to f32 without loss: {}",
            widened.join(", ")
        ));
    }
    (faults.count() == before).then_some(result)
}

/// A tensor as the file holds it.
#[derive(Debug, Clone)]
pub struct NamedTensor {
    /// Its name in the file.
    pub name: String,
    /// Its axes, outermost first.
    pub shape: Vec<usize>,
    /// Its elements, the last axis running fastest; `None` where they are no floats. Not rounded.
    pub values: Option<Vec<f64>>,
}

/// Every tensor, sorted by name; those of floats are finite.
pub(crate) fn named(file: &Binary, tensors: &SafeTensors<'_>, faults: &mut Sink) -> Vec<NamedTensor> {
    let mut views = tensors.tensors();
    views.sort_by(|(a, _), (b, _)| a.cmp(b));
    let views = plainly_named(file, views, faults);
    let one = |(name, view): &(String, TensorView<'_>)| {
        // counters of a batch norm and ends of an action space have no axis
        let shape = if view.shape().is_empty() { &[1] } else { view.shape() };
        sound(name, shape)?;
        let values = match view.dtype() {
            Dtype::F32 | Dtype::F64 | Dtype::F16 | Dtype::BF16 => Some(wide(view.dtype(), view.data())?),
            _ => None,
        };
        let odd = values.iter().flatten().position(|value| !value.is_finite());
        match odd.and_then(|index| Some((index, *values.as_ref()?.get(index)?))) {
            Some((index, value)) => Err(catalogue::not_finite(index, value)),
            None => Ok(NamedTensor {
                name: name.clone(),
                shape: view.shape().to_vec(),
                values,
            }),
        }
    };
    let mut list = Vec::new();
    for view in &views {
        match one(view) {
            Ok(tensor) => list.push(tensor),
            Err(message) => faults.push(file.name.tensor_fault(&view.0, message)),
        }
    }
    list
}

/// The tensors whose name can be printed. The others are one fault: they are of one hand, and so is what to do.
fn plainly_named<'d>(
    file: &Binary,
    views: Vec<(String, TensorView<'d>)>,
    faults: &mut Sink,
) -> Vec<(String, TensorView<'d>)> {
    let (plain, odd): (Vec<_>, Vec<_>) = views.into_iter().partition(|(name, _)| is_plain(name));
    if let Some((first, _)) = odd.first() {
        faults.push(file.name.tensor_fault(first, catalogue::odd_name(first, odd.len() - 1)));
    }
    plain
}

/// Whether a name can stand in messages, comments and paths.
fn is_plain(name: &str) -> bool {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '/' | ':' | '-');
    let is_short = (1..=MAX_TENSOR_NAME_CHARS).contains(&name.len());
    is_short && name.chars().all(allowed) && !name.contains("..") && !name.contains("//")
}

/// Whether a tensor's name can be printed and its shape holds anything.
pub(crate) fn sound(name: &str, shape: &[usize]) -> Result<(), Message> {
    if !is_plain(name) {
        return Err(catalogue::odd_name(name, 0));
    }
    if shape.is_empty() || shape.contains(&0) {
        return Err(catalogue::empty_tensor(shape));
    }
    Ok(())
}

/// Little-endian floats of `dtype` as finite binary32.
pub(crate) fn values(dtype: Dtype, data: &[u8]) -> Result<Vec<f32>, Message> {
    let wide = wide(dtype, data)?;
    let narrow = wide.iter().enumerate().map(|(index, &value)| {
        if !value.is_finite() {
            return Err(catalogue::not_finite(index, value));
        }
        // a finite binary64 may still become infinite here
        let rounded = value as f32;
        if rounded.is_finite() {
            Ok(rounded)
        } else {
            Err(catalogue::beyond_f32(index, value))
        }
    });
    narrow.collect()
}

fn wide(dtype: Dtype, data: &[u8]) -> Result<Vec<f64>, Message> {
    Ok(match dtype {
        Dtype::F32 => chunks(data).map(|b| f64::from(f32::from_le_bytes(b))).collect(),
        Dtype::F64 => chunks(data).map(f64::from_le_bytes).collect(),
        Dtype::F16 => chunks(data).map(|b| half::f16::from_le_bytes(b).to_f64()).collect(),
        Dtype::BF16 => chunks(data).map(|b| half::bf16::from_le_bytes(b).to_f64()).collect(),
        other => return Err(catalogue::wrong_dtype(&other.to_string(), "F32, F64, F16 or BF16")),
    })
}

/// The data in pieces of N bytes.
pub(crate) fn chunks<const N: usize>(data: &[u8]) -> impl Iterator<Item = [u8; N]> + '_ {
    data.as_chunks::<N>().0.iter().copied()
}

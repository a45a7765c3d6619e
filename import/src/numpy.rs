//! numpy arrays and numbers in a pickle.

use crate::pickle::{Id, Item, Object, Pickle};

/// The elements of an array, or the one of a number.
pub(crate) fn array(pickle: &Pickle, id: Id) -> Option<Vec<f64>> {
    if let Some(number) = pickle.number(id) {
        return Some(vec![number]);
    }
    let parts = parts(pickle, id)?;
    let bytes = match pickle.item(parts.bytes) {
        Item::Bytes(bytes) => bytes.clone(),
        Item::Object(object) => encoded(pickle, object)?,
        _ => return None,
    };
    numbers(&kind(pickle, parts.dtype)?, &bytes)
}

/// Shape and elements of an array of floats whose last axis runs fastest.
pub(crate) fn shaped(pickle: &Pickle, id: Id) -> Option<(Vec<usize>, Vec<f64>)> {
    let parts = parts(pickle, id).filter(|parts| !parts.is_fortran)?;
    let sizes = pickle.list(parts.shape?)?.iter().map(|size| pickle.size(*size));
    let shape: Vec<usize> = sizes.collect::<Option<_>>()?;
    if !kind(pickle, parts.dtype)?.contains('f') {
        return None;
    }
    let values = array(pickle, id)?;
    let count = shape
        .iter()
        .try_fold(1_usize, |product, size| product.checked_mul(*size));
    (count == Some(values.len())).then_some((shape, values))
}

/// What an array is rebuilt from.
struct Parts {
    dtype: Id,
    bytes: Id,
    /// None of a number.
    shape: Option<Id>,
    is_fortran: bool,
}

fn parts(pickle: &Pickle, id: Id) -> Option<Parts> {
    let Item::Object(object) = pickle.item(id) else {
        return None;
    };
    let arguments = pickle.list(object.arguments)?;
    let of = |dtype: &Id, bytes: &Id, shape: Option<&Id>, is_fortran| Parts {
        dtype: *dtype,
        bytes: *bytes,
        shape: shape.copied(),
        is_fortran,
    };
    if object.class.ends_with("._frombuffer") {
        let [bytes, dtype, shape, order, ..] = arguments else {
            return None;
        };
        Some(of(dtype, bytes, Some(shape), pickle.text(*order) == Some("F")))
    } else if object.class.ends_with(".scalar") {
        let [dtype, bytes, ..] = arguments else { return None };
        Some(of(dtype, bytes, None, false))
    } else if object.class.ends_with("._reconstruct") {
        let [_version, shape, dtype, is_fortran, bytes, ..] = pickle.list(object.state?)? else {
            return None;
        };
        let is_fortran = pickle.item(*is_fortran) == &Item::Bool(true);
        Some(of(dtype, bytes, Some(shape), is_fortran))
    } else {
        None
    }
}

/// Protocol 2 has no bytes: `_codecs.encode("...", "latin1")`, or a bytearray of such.
fn encoded(pickle: &Pickle, object: &Object) -> Option<Vec<u8>> {
    let first = *pickle.list(object.arguments)?.first()?;
    match (object.class.as_str(), pickle.item(first)) {
        ("_codecs.encode", Item::Text(text)) => text.chars().map(|c| u8::try_from(u32::from(c)).ok()).collect(),
        (_, Item::Bytes(bytes)) => Some(bytes.clone()),
        _ => None,
    }
}

/// Kind and order of a dtype: `f4` in state `(3, "<", ...)` is `<f4`.
fn kind(pickle: &Pickle, dtype: Id) -> Option<String> {
    let Item::Object(object) = pickle.item(dtype) else {
        return None;
    };
    let name = pickle.text(*pickle.list(object.arguments)?.first()?)?;
    let order = object.state.and_then(|state| pickle.text(*pickle.list(state)?.get(1)?));
    Some(format!("{}{name}", order.unwrap_or("<")))
}

fn numbers(kind: &str, bytes: &[u8]) -> Option<Vec<f64>> {
    Some(match kind {
        "<f4" => bytes
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b).into())
            .collect(),
        "<f8" => bytes
            .as_chunks::<8>()
            .0
            .iter()
            .map(|b| f64::from_le_bytes(*b))
            .collect(),
        "<i4" => bytes
            .as_chunks::<4>()
            .0
            .iter()
            .map(|b| i32::from_le_bytes(*b).into())
            .collect(),
        "<i8" => bytes
            .as_chunks::<8>()
            .0
            .iter()
            .map(|b| i64::from_le_bytes(*b) as f64)
            .collect(),
        "|b1" | "|u1" => bytes.iter().map(|b| (*b).into()).collect(),
        _ => return None,
    })
}

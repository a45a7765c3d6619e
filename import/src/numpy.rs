//! numpy arrays and numbers in a pickle.

use crate::pickle::{Id, Item, Object, Pickle};

/// The elements of an array, or the one of a number.
pub(crate) fn array(pickle: &Pickle, id: Id) -> Option<Vec<f64>> {
    if let Some(number) = pickle.number(id) {
        return Some(vec![number]);
    }
    let Item::Object(object) = pickle.item(id) else {
        return None;
    };
    let arguments = pickle.list(object.arguments)?;
    let (dtype, bytes) = if object.class.ends_with("._frombuffer") {
        // (bytes, dtype, shape, order)
        let [bytes, dtype, ..] = arguments else { return None };
        (*dtype, *bytes)
    } else if object.class.ends_with(".scalar") {
        let [dtype, bytes, ..] = arguments else { return None };
        (*dtype, *bytes)
    } else if object.class.ends_with("._reconstruct") {
        // (version, shape, dtype, is_fortran, bytes)
        let [_, _, dtype, _, bytes, ..] = pickle.list(object.state?)? else {
            return None;
        };
        (*dtype, *bytes)
    } else {
        return None;
    };
    let bytes = match pickle.item(bytes) {
        Item::Bytes(bytes) => bytes.clone(),
        Item::Object(object) => encoded(pickle, object)?,
        _ => return None,
    };
    numbers(&kind(pickle, dtype)?, &bytes)
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

//! Protobuf as it lies in a file: fields of a number and a value, one behind the other.
//!
//! A schema compiler and its runtime would be larger than these lines, and a message is a slice of the file here: nothing is
//! allocated by a number that the file claims.

use toml_input::Message;

// numbers of a tensor are one field; nodes of a policy are a few dozen
const MOST_FIELDS: usize = 10_000;

/// A value: its meaning depends on the field's number.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Value<'a> {
    Number(u64),
    /// A text, a message, or packed numbers.
    Bytes(&'a [u8]),
    Fixed32([u8; 4]),
    /// Of no field that is read here.
    Fixed64,
}

/// The fields of a message in the order of the file.
pub(crate) fn fields(message: &[u8]) -> Result<Vec<(u64, Value<'_>)>, Message> {
    let mut rest = message;
    let mut fields = Vec::new();
    while !rest.is_empty() {
        let (tag, behind) = number(rest)?;
        let (value, behind) = match tag & 7 {
            0 => number(behind).map(|(number, rest)| (Value::Number(number), rest))?,
            1 => split::<8>(behind).map(|(_, rest)| (Value::Fixed64, rest))?,
            2 => {
                let (length, behind) = number(behind)?;
                let length = usize::try_from(length).map_err(|_| broken())?;
                let (bytes, rest) = behind.split_at_checked(length).ok_or_else(broken)?;
                (Value::Bytes(bytes), rest)
            }
            5 => split::<4>(behind).map(|(bytes, rest)| (Value::Fixed32(bytes), rest))?,
            _ => return Err(broken()),
        };
        if fields.len() == MOST_FIELDS {
            return Err(Message::new("this ONNX model has more parts than a network")
                .found(format!("more than {MOST_FIELDS} in one message"))
                .expected("the policy network alone")
                .hint("export the policy network alone"));
        }
        fields.push((tag >> 3, value));
        rest = behind;
    }
    Ok(fields)
}

/// Whole numbers of a repeated field, packed or not.
pub(crate) fn numbers(value: Value<'_>) -> Result<Vec<i64>, Message> {
    match value {
        Value::Number(one) => Ok(vec![one as i64]),
        Value::Bytes(mut packed) => {
            let mut list = Vec::new();
            while !packed.is_empty() {
                let (one, rest) = number(packed)?;
                list.push(one as i64);
                packed = rest;
            }
            Ok(list)
        }
        _ => Err(broken()),
    }
}

/// A number in groups of seven bits.
fn number(bytes: &[u8]) -> Result<(u64, &[u8]), Message> {
    let mut value = 0;
    for (index, byte) in bytes.iter().take(10).enumerate() {
        value |= u64::from(byte & 0x7f).checked_shl(7 * index as u32).unwrap_or(0);
        if byte & 0x80 == 0 {
            return Ok((value, bytes.get(index + 1..).unwrap_or_default()));
        }
    }
    Err(broken())
}

fn split<const N: usize>(bytes: &[u8]) -> Result<([u8; N], &[u8]), Message> {
    bytes
        .split_first_chunk::<N>()
        .map(|(first, rest)| (*first, rest))
        .ok_or_else(broken)
}

pub(crate) fn broken() -> Message {
    Message::new("this is not a sound ONNX model")
        .found("fields that do not hold together")
        .expected("a model as torch.onnx.export writes it")
        .hint("copy or download the file again")
}

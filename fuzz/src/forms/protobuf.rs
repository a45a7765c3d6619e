//! Fields of protobuf: a field of bytes may be a message again.

use std::ops::Range;

use random::{Random, SplitMix};

use super::Change;

/// Messages within messages: an ONNX model has six.
const DEEPEST: usize = 8;

struct Field {
    /// Tag and, of bytes, their length.
    whole: Range<usize>,
    /// Content of a field of bytes.
    content: Option<Range<usize>>,
}

pub(super) fn edit(input: &[u8], random: &mut SplitMix, change: &Change<'_>) -> Option<Vec<u8>> {
    within(input, random, change, DEEPEST)
}

/// The fields of a message; `None` if it is none.
fn fields(message: &[u8]) -> Option<Vec<Field>> {
    let mut fields = Vec::new();
    let mut at = 0;
    while at < message.len() {
        let (tag, behind) = number(message, at)?;
        let (content, end) = match tag & 7 {
            0 => (None, number(message, behind)?.1),
            1 => (None, behind + 8),
            2 => {
                let (length, start) = number(message, behind)?;
                let end = start.checked_add(usize::try_from(length).ok()?)?;
                (Some(start..end), end)
            }
            5 => (None, behind + 4),
            _ => return None,
        };
        if tag >> 3 == 0 || end > message.len() {
            return None;
        }
        fields.push(Field {
            whole: at..end,
            content,
        });
        at = end;
    }
    (!fields.is_empty()).then_some(fields)
}

fn within(message: &[u8], random: &mut SplitMix, change: &Change<'_>, left: usize) -> Option<Vec<u8>> {
    let fields = fields(message)?;
    let field = fields.get(random.below(fields.len()))?;
    let mut edited = message.to_vec();
    match (random.below(12), &field.content) {
        (0, _) => drop(edited.drain(field.whole.clone())),
        (1, _) => {
            let copy = message[field.whole.clone()].to_vec();
            let at = fields.get(random.below(fields.len()))?.whole.start;
            edited.splice(at..at, copy);
        }
        (_, Some(content)) => {
            let inner = &message[content.clone()];
            let inner = match left.checked_sub(1).and_then(|left| within(inner, random, change, left)) {
                Some(inner) => inner,
                None => {
                    let mut inner = inner.to_vec();
                    change(&mut inner, random);
                    inner
                }
            };
            let (_, behind_tag) = number(message, field.whole.start)?;
            edited.splice(behind_tag..content.end, [varint(inner.len() as u64), inner].concat());
        }
        (_, None) => {
            let (tag, behind) = number(message, field.whole.start)?;
            // a number as it was written, and another in its place
            let value = match tag & 7 {
                0 => varint(random.pick(&[0, 1, 2, 3, 7, 11, 255, 1 << 31, 1 << 40, u64::MAX, u64::MAX - 1], 0)),
                _ => (0..field.whole.end - behind).map(|_| random.bits() as u8).collect(),
            };
            edited.splice(behind..field.whole.end, value);
        }
    }
    Some(edited)
}

/// A number in groups of seven bits, and where it ends.
fn number(bytes: &[u8], at: usize) -> Option<(u64, usize)> {
    let mut value = 0;
    for index in 0..10 {
        let byte = *bytes.get(at + index)?;
        value |= u64::from(byte & 0x7f) << (7 * index);
        if byte & 0x80 == 0 {
            return Some((value, at + index + 1));
        }
    }
    None
}

fn varint(mut number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while number >= 0x80 {
        bytes.push(number as u8 | 0x80);
        number >>= 7;
    }
    bytes.push(number as u8);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_around_a_change_are_right() {
        // field 1: message { field 2: "abc" }
        let input = b"\x0a\x05\x12\x03abc";
        let mut random = SplitMix::new(3);
        let mut grown = 0;
        for _ in 0..200 {
            let edited = edit(input, &mut random, &|part, _| part.push(b'!')).unwrap();
            if edited == b"\x0a\x06\x12\x04abc!" {
                grown += 1;
            }
        }
        assert!(grown > 50, "{grown}");
    }
}

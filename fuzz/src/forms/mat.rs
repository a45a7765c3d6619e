//! Elements of a MAT file of level 5, whose sizes count the elements within.

use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use random::{Random, SplitMix};

use super::Change;

const HEAD: usize = 128;
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Matrices within cells within structs.
const DEEPEST: usize = 6;
// seeds hold a few kilobytes
const LARGEST: usize = 1 << 20;

type Element = (u32, Vec<u8>);

/// `input` without compression, so that changes reach what is in it.
#[must_use]
pub(super) fn inflated(input: &[u8]) -> Option<Vec<u8>> {
    let mut bytes = input.get(..HEAD)?.to_vec();
    for (kind, data) in elements(input.get(HEAD..)?)? {
        match kind {
            COMPRESSED => bytes.extend(decompress_to_vec_zlib_with_limit(&data, LARGEST).ok()?),
            _ => bytes.extend(packed(&[(kind, data)])),
        }
    }
    Some(bytes)
}

pub(super) fn edit(input: &[u8], random: &mut SplitMix, change: &Change<'_>) -> Option<Vec<u8>> {
    let input = inflated(input)?;
    let body = within(input.get(HEAD..)?, random, change, DEEPEST)?;
    Some([&input[..HEAD], &body].concat())
}

fn within(bytes: &[u8], random: &mut SplitMix, change: &Change<'_>, left: usize) -> Option<Vec<u8>> {
    let mut list = elements(bytes)?;
    let count = list.len();
    let index = random.below(count);
    match random.below(16) {
        0 => drop(list.swap_remove(index)),
        1 => list.insert(random.below(count), list.get(index)?.clone()),
        2 => list.get_mut(index)?.0 = random.below(20) as u32,
        _ => {
            let (kind, data) = list.get_mut(index)?;
            let inner = left.checked_sub(1).filter(|_| *kind == MATRIX);
            match inner.and_then(|left| within(data, random, change, left)) {
                Some(edited) => *data = edited,
                None => change(data, random),
            }
        }
    }
    Some(packed(&list))
}

fn elements(mut bytes: &[u8]) -> Option<Vec<Element>> {
    let mut list = Vec::new();
    while !bytes.is_empty() {
        let word = |at: usize| Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?));
        let first = word(0)?;
        let (kind, data, end) = if first >> 16 != 0 {
            (first & 0xffff, bytes.get(4..4 + (first >> 16) as usize)?, 8)
        } else {
            let size = word(4)? as usize;
            let filled = if first == COMPRESSED {
                size
            } else {
                size.next_multiple_of(8)
            };
            (first, bytes.get(8..8 + size)?, 8 + filled)
        };
        list.push((kind, data.to_vec()));
        bytes = bytes.get(end..).unwrap_or_default();
    }
    (!list.is_empty()).then_some(list)
}

fn packed(list: &[Element]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (kind, data) in list {
        bytes.extend(kind.to_le_bytes());
        bytes.extend((data.len() as u32).to_le_bytes());
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_around_a_change_are_right() {
        let inner = packed(&[(1, b"abc".to_vec())]);
        let input = [&[b' '; HEAD][..], &packed(&[(MATRIX, inner)])].concat();
        let mut random = SplitMix::new(1);
        let wanted = [
            &[b' '; HEAD][..],
            &packed(&[(MATRIX, packed(&[(1, b"abc!".to_vec())]))]),
        ]
        .concat();
        let edited = (0..100).filter_map(|_| edit(&input, &mut random, &|part, _| part.push(b'!')));
        assert!(edited.filter(|edited| *edited == wanted).count() > 20);
    }
}

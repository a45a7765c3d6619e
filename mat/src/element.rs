//! Elements: type, size, content.

use crate::Error;

pub const COMPRESSED: u32 = 15;
pub const MATRIX: u32 = 14;

/// A piece of the file.
pub struct Element<'a> {
    pub kind: u32,
    pub data: &'a [u8],
}

/// The first element and what stands behind it.
pub fn element(bytes: &[u8]) -> Result<(Element<'_>, &[u8]), Error> {
    let first = u32_at(bytes, 0)?;
    // up to four bytes stand in the tag itself, with their number in its upper half
    if first >> 16 != 0 {
        let size = (first >> 16) as usize;
        let data = bytes.get(4..8).and_then(|four| four.get(..size)).ok_or(Error::Broken)?;
        let kind = first & 0xffff;
        return Ok((Element { kind, data }, bytes.get(8..).unwrap_or_default()));
    }
    let size = usize::try_from(u32_at(bytes, 4)?).map_err(|_| Error::Broken)?;
    let data = bytes.get(8..).and_then(|rest| rest.get(..size)).ok_or(Error::Broken)?;
    let filled = if first == COMPRESSED {
        size
    } else {
        size.next_multiple_of(8)
    };
    let behind = bytes.get(8 + filled..).unwrap_or_default();
    Ok((Element { kind: first, data }, behind))
}

pub fn u32_at(bytes: &[u8], at: usize) -> Result<u32, Error> {
    let four = bytes.get(at..).and_then(|rest| rest.first_chunk::<4>());
    four.map(|four| u32::from_le_bytes(*four)).ok_or(Error::Broken)
}

impl Element<'_> {
    /// Numbers of any type: MATLAB stores those of a matrix in the smallest that holds them all.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        fn each<const N: usize>(data: &[u8], number: impl Fn([u8; N]) -> f64) -> Option<Vec<f64>> {
            let (numbers, rest) = data.as_chunks::<N>();
            rest.is_empty()
                .then(|| numbers.iter().map(|bytes| number(*bytes)).collect())
        }
        let data = self.data;
        match self.kind {
            1 => each(data, |b| f64::from(i8::from_le_bytes(b))),
            2 => each(data, |b: [u8; 1]| f64::from(b[0])),
            3 => each(data, |b| f64::from(i16::from_le_bytes(b))),
            4 => each(data, |b| f64::from(u16::from_le_bytes(b))),
            5 => each(data, |b| f64::from(i32::from_le_bytes(b))),
            6 => each(data, |b| f64::from(u32::from_le_bytes(b))),
            7 => each(data, |b| f64::from(f32::from_le_bytes(b))),
            9 => each(data, f64::from_le_bytes),
            12 => each(data, |b| i64::from_le_bytes(b) as f64),
            13 => each(data, |b| u64::from_le_bytes(b) as f64),
            _ => None,
        }
    }

    /// Text in one, two or four bytes a character, or UTF-8.
    pub fn text(&self) -> Option<String> {
        let units = || -> Vec<u16> {
            self.data
                .as_chunks::<2>()
                .0
                .iter()
                .map(|b| u16::from_le_bytes(*b))
                .collect()
        };
        match self.kind {
            1 | 2 | 16 => Some(String::from_utf8_lossy(self.data).into_owned()),
            4 | 17 => Some(String::from_utf16_lossy(&units())),
            _ => None,
        }
    }
}

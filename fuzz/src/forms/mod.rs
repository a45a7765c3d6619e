//! Containers: one part is taken out, changed and put back, and the lengths around it are made right again.
//!
//! A changed length or digest alone is refused at the door of a reader. What lies behind the door is reached this way.

mod mat;
mod protobuf;
pub mod zip;

use random::{Random, SplitMix};
use sha2::{Digest, Sha256};

/// How the bytes of an input hold together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// In no way: texts, pickles.
    Bytes,
    /// A zip archive with stored members; one of them may be such an archive again.
    Zip,
    /// Fields of protobuf, messages within messages.
    Protobuf,
    /// A MAT file of level 5.
    Mat,
    /// The length of a header as 8 bytes, the header in JSON, numbers.
    Safetensors,
    /// Values, and a SHA-256 of them at the end.
    Digested,
}

/// Changes one part.
pub type Change<'a> = dyn Fn(&mut Vec<u8>, &mut SplitMix) + 'a;

impl Form {
    /// `input` with one part changed; `None` if it is not of this form.
    #[must_use]
    pub fn edit(self, input: &[u8], random: &mut SplitMix, change: &Change<'_>) -> Option<Vec<u8>> {
        match self {
            Form::Bytes => None,
            Form::Zip => zip::edit(input, random, change),
            Form::Protobuf => protobuf::edit(input, random, change),
            Form::Mat => mat::edit(input, random, change),
            Form::Safetensors => safetensors(input, random, change),
            Form::Digested => digested(input, random, change),
        }
    }
}

fn safetensors(input: &[u8], random: &mut SplitMix, change: &Change<'_>) -> Option<Vec<u8>> {
    let (length, rest) = input.split_first_chunk::<8>()?;
    let (header, data) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
    let (mut header, mut data) = (header.to_vec(), data.to_vec());
    // numbers are read in one way whatever they are; the header decides
    change(if random.one_in(6) { &mut data } else { &mut header }, random);
    Some([&(header.len() as u64).to_le_bytes()[..], &header, &data].concat())
}

const DIGEST: usize = 32;

fn digested(input: &[u8], random: &mut SplitMix, change: &Change<'_>) -> Option<Vec<u8>> {
    let mut values = input[..input.len().checked_sub(DIGEST)?].to_vec();
    change(&mut values, random);
    let digest = Sha256::digest(&values);
    values.extend_from_slice(&digest);
    Some(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_header_has_its_length() {
        let input = [&4_u64.to_le_bytes()[..], b"{\"a\"", b"data"].concat();
        let mut random = SplitMix::new(1);
        for _ in 0..100 {
            let edited = safetensors(&input, &mut random, &|part, _| part.insert(0, b'x')).unwrap();
            let length = u64::from_le_bytes(*edited.first_chunk().unwrap());
            assert_eq!(edited.len(), 17);
            assert!(length == 5 && edited[8] == b'x' || length == 4 && edited[12] == b'x');
        }
    }

    #[test]
    fn a_changed_value_has_its_digest() {
        let input = [&b"values"[..], &[0; DIGEST]].concat();
        let edited = digested(&input, &mut SplitMix::new(1), &|part, _| part.push(b'!')).unwrap();
        assert_eq!(&edited[..7], b"values!");
        assert_eq!(&edited[7..], Sha256::digest(b"values!").as_slice());
    }
}

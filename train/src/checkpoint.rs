//! The bytes of a checkpoint: a version, values in a fixed order, a SHA-256 over all of it.

use sha2::{Digest, Sha256};
use toml_input::Message;

use crate::faults::Error;

/// First bytes of every checkpoint; the number changes with the order of what follows.
const MAGIC: &[u8; 16] = b"policyc-train\0v3";
const DIGEST: usize = 32;

/// Writes values one behind the other, little-endian.
#[derive(Debug)]
pub(crate) struct Writer {
    bytes: Vec<u8>,
}

impl Writer {
    pub fn new() -> Self {
        Self { bytes: MAGIC.to_vec() }
    }

    pub fn u64(&mut self, value: u64) {
        self.bytes.extend_from_slice(&value.to_le_bytes());
    }

    pub fn words(&mut self, values: &[u64]) {
        values.iter().for_each(|value| self.u64(*value));
    }

    pub fn f64(&mut self, value: f64) {
        // as bits: a checkpoint must go on to the same bytes, so the sign of a zero counts
        self.u64(value.to_bits());
    }

    pub fn numbers(&mut self, values: &[f64]) {
        values.iter().for_each(|value| self.f64(*value));
    }

    pub fn bytes(&mut self, value: &[u8]) {
        self.u64(value.len() as u64);
        self.bytes.extend_from_slice(value);
    }

    pub fn floats(&mut self, values: &[f32]) {
        self.u64(values.len() as u64);
        self.bytes.extend(values.iter().flat_map(|x| x.to_le_bytes()));
    }

    pub fn finish(mut self) -> Vec<u8> {
        let digest = Sha256::digest(&self.bytes);
        self.bytes.extend_from_slice(&digest);
        self.bytes
    }
}

/// Reads what [`Writer`] wrote; every fault is a sentence.
#[derive(Debug)]
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    pub fn new(bytes: &'a [u8]) -> Result<Self, Error> {
        let Some(rest) = bytes.strip_prefix(&MAGIC[..]) else {
            return Err(match bytes.starts_with(&MAGIC[..14]) {
                true => Message::new("checkpoint: it is of another version")
                    .expected("version 3")
                    .hint("start the training anew"),
                false => Message::new("checkpoint: this is not one of policyc"),
            }
            .into());
        };
        let Some(end) = rest.len().checked_sub(DIGEST) else {
            return Err(damaged());
        };
        let (values, digest) = rest.split_at(end);
        // before any value is read: from here on a value that does not fit means another training, not a damaged file
        if Sha256::digest(&bytes[..bytes.len() - DIGEST]).as_slice() != digest {
            return Err(damaged());
        }
        Ok(Self { bytes: values })
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], Error> {
        let (head, tail) = self.bytes.split_at_checked(count).ok_or_else(damaged)?;
        self.bytes = tail;
        Ok(head)
    }

    pub fn u64(&mut self) -> Result<u64, Error> {
        let mut word = [0; 8];
        word.copy_from_slice(self.take(8)?);
        Ok(u64::from_le_bytes(word))
    }

    pub fn f64(&mut self) -> Result<f64, Error> {
        Ok(f64::from_bits(self.u64()?))
    }

    pub fn count(&mut self) -> Result<usize, Error> {
        usize::try_from(self.u64()?).map_err(|_| damaged())
    }

    pub fn bytes(&mut self) -> Result<&'a [u8], Error> {
        let count = self.count()?;
        self.take(count)
    }

    pub fn floats(&mut self) -> Result<Vec<f32>, Error> {
        let count = self.count()?.checked_mul(4).ok_or_else(damaged)?;
        let (words, _) = self.take(count)?.as_chunks::<4>();
        Ok(words.iter().map(|word| f32::from_le_bytes(*word)).collect())
    }

    /// Floats into a slice of the same length.
    pub fn floats_into(&mut self, values: &mut [f32]) -> Result<(), Error> {
        let read = self.floats()?;
        if read.len() != values.len() {
            return Err(other());
        }
        values.copy_from_slice(&read);
        Ok(())
    }

    pub fn finish(self) -> Result<(), Error> {
        if self.bytes.is_empty() { Ok(()) } else { Err(other()) }
    }
}

fn damaged() -> Error {
    Message::new("checkpoint: it is damaged: its digest does not fit its content").into()
}

/// The checkpoint is sound but not of this training.
pub(crate) fn other() -> Error {
    Message::new("checkpoint: it is of another training")
        .expected("one of this training file, contract and plant")
        .hint("files that were edited since need a new training")
        .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Vec<u8> {
        let mut writer = Writer::new();
        writer.u64(7);
        writer.f64(-0.0);
        writer.bytes(b"abc");
        writer.floats(&[1.5, f32::MIN_POSITIVE]);
        writer.finish()
    }

    #[test]
    fn what_was_written_is_read() {
        let bytes = sample();
        let mut reader = Reader::new(&bytes).unwrap();
        assert_eq!(reader.u64().unwrap(), 7);
        assert_eq!(reader.f64().unwrap().to_bits(), (-0.0_f64).to_bits());
        assert_eq!(reader.bytes().unwrap(), b"abc");
        assert_eq!(reader.floats().unwrap(), [1.5, f32::MIN_POSITIVE]);
        reader.finish().unwrap();
    }

    #[test]
    fn every_changed_or_missing_byte_is_noticed() {
        let bytes = sample();
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 1;
            assert!(Reader::new(&changed).is_err(), "byte {at}");
            assert!(Reader::new(&bytes[..at]).is_err(), "cut at {at}");
        }
    }

    #[test]
    fn another_version_is_named_as_such() {
        let mut bytes = sample();
        bytes[15] = b'1';
        let text = Reader::new(&bytes).unwrap_err().to_string();
        assert!(text.contains("another version"), "{text}");
    }
}

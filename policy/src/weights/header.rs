//! The outside of a safetensors file: is it one, and is its header unambiguous?
//!
//! ```text
//! bytes 0..8      length n of the header, little-endian
//!       8..8+n    JSON: {"__metadata__": {...}, "fc1.weight": {"dtype", "shape", "data_offsets": [from, to]}, ...}
//!       8+n..     data, which the offsets cover without gaps
//! ```
//!
//! The crate `safetensors` refuses wrong offsets, overlaps and holes. It lets keys pass that stand twice (the last one
//! wins), and any number of tensors; so the header is walked here once more, before the crate sees it.

use std::collections::BTreeSet;
use std::fmt;

use safetensors::SafeTensors;
use serde::de::{Deserialize, DeserializeSeed, Deserializer, MapAccess, SeqAccess, Visitor};
use toml_input::Sink;

use super::catalogue;
use crate::limits::{MAX_HEADER_BYTES, MAX_TENSORS};
use crate::raw::Binary;

const EXPORT: &str = "export in Python: from safetensors.torch import save_file; \
    save_file(model.q_net.state_dict(), \"weights.safetensors\")";

/// Opens `file`; the crate checks offsets, this checks what the crate lets pass.
pub(crate) fn open<'a>(file: &'a Binary, faults: &mut Sink) -> Option<SafeTensors<'a>> {
    let header = match header_text(&file.bytes) {
        Ok(header) => header,
        Err(message) => {
            faults.push(file.name.fault(message));
            return None;
        }
    };
    let mut keys = Keys::default();
    // malformed JSON is left to the crate, which says where
    let mut reader = serde_json::Deserializer::from_str(header);
    let complete = Node {
        keys: &mut keys,
        depth: 0,
        tensor: None,
    }
    .deserialize(&mut reader)
    .is_ok();
    for (tensor, key) in &keys.repeated {
        let message = catalogue::duplicate_key(key);
        faults.push(match tensor {
            Some(tensor) => file.name.tensor_fault(tensor, message),
            None => file.name.tensor_fault(key, message),
        });
    }
    // before the crate builds its table of them
    if complete && keys.tensors > MAX_TENSORS {
        faults.push(file.name.fault(catalogue::too_many_tensors(keys.tensors)));
        return None;
    }
    if !keys.repeated.is_empty() {
        return None;
    }
    match SafeTensors::deserialize(&file.bytes) {
        // a sound file to the crate
        Ok(tensors) if tensors.is_empty() => {
            faults.push(file.name.fault(catalogue::no_tensors()));
            None
        }
        Ok(tensors) => Some(tensors),
        Err(error) => {
            let length = file.bytes.len().saturating_sub(8 + header.len());
            // more data promised than there is: that the end is missing says more than a wrong offset
            let message = match described(header) {
                Some(described) if described > length as u64 => catalogue::cut_off(length, described),
                _ => catalogue::malformed(&error.to_string(), None),
            };
            faults.push(file.name.fault(message));
            None
        }
    }
}

/// Bytes of data that the header promises.
fn described(header: &str) -> Option<u64> {
    let header: serde_json::Value = serde_json::from_str(header).ok()?;
    let ends = header
        .as_object()?
        .values()
        .filter_map(|tensor| tensor["data_offsets"][1].as_u64());
    ends.max()
}

/// Why `bytes` are no contract although somebody named them as one; `None` if they may be text.
pub(crate) fn not_a_contract(bytes: &[u8]) -> Option<toml_input::Message> {
    // a JSON object behind a length that fits: no TOML begins so
    if plausible_length(bytes) && bytes.get(8) == Some(&b'{') {
        return Some(catalogue::weights_as_contract());
    }
    foreign(bytes)
}

fn header_text(bytes: &[u8]) -> Result<&str, toml_input::Message> {
    if let Some(message) = foreign(bytes) {
        return Err(message);
    }
    let Some((length, rest)) = bytes.split_first_chunk::<8>() else {
        return Err(catalogue::malformed(
            &format!("only {} bytes", bytes.len()),
            Some(EXPORT),
        ));
    };
    let length = u64::from_le_bytes(*length);
    // before anything is sliced or allocated by a number of the file
    if length > MAX_HEADER_BYTES {
        let found = format!("a header of {length} bytes, more than {MAX_HEADER_BYTES}");
        return Err(catalogue::malformed(&found, Some(EXPORT)));
    }
    let header = usize::try_from(length).ok().and_then(|length| rest.get(..length));
    let Some(header) = header else {
        let found = format!("a header of {length} bytes in a file of {}: cut off", bytes.len());
        return Err(catalogue::malformed(&found, Some("copy or download the file again")));
    };
    std::str::from_utf8(header).map_err(|_| catalogue::malformed("a header that is not UTF-8", Some(EXPORT)))
}

/// Files of other kinds that end up here.
fn foreign(bytes: &[u8]) -> Option<toml_input::Message> {
    let begins = |magic: &[u8]| bytes.starts_with(magic);
    if begins(b"PK\x03\x04") {
        return Some(catalogue::other_format(
            "a zip archive, as torch.save and stable-baselines3 write",
            "`policyc new <this file>` reads it, and writes weights.safetensors beside the contract",
        ));
    }
    // the opcode PROTO and its version; pickles of protocols 0 and 1 have no such mark. A header of 0x280 bytes has the same
    if bytes.len() > 2 && bytes[0] == 0x80 && (2..=5).contains(&bytes[1]) && !plausible_length(bytes) {
        return Some(catalogue::other_format(
            "a python pickle (never opened here: it can run code)",
            EXPORT,
        ));
    }
    if begins(b"\x89HDF\r\n\x1a\n") {
        return Some(catalogue::other_format("an HDF5 file, as Keras writes", EXPORT));
    }
    if begins(b"version https://git-lfs") {
        return Some(catalogue::other_format(
            "a git-lfs pointer",
            "fetch the content: git lfs pull",
        ));
    }
    // a protobuf whose field 1 is a number (ir_version), and soon field 2, a text (0x12)
    if begins(b"\x08") && bytes.iter().take(64).any(|&b| b == b':' || b == 0x12) && !plausible_length(bytes) {
        let hint = "`policyc new <this file>` reads it, and writes weights.safetensors beside the contract";
        return Some(catalogue::other_format("what looks like an ONNX model", hint));
    }
    None
}

/// Whether the first eight bytes can be a header length of this file.
fn plausible_length(bytes: &[u8]) -> bool {
    bytes.split_first_chunk::<8>().is_some_and(|(length, rest)| {
        usize::try_from(u64::from_le_bytes(*length)).is_ok_and(|length| length <= rest.len())
    })
}

/// What a pass over the header found.
#[derive(Default)]
struct Keys {
    repeated: Vec<(Option<String>, String)>,
    tensors: usize,
}

/// Any JSON value; remembers keys that stand twice in one object.
struct Node<'k> {
    keys: &'k mut Keys,
    depth: usize,
    tensor: Option<String>,
}

impl<'de> DeserializeSeed<'de> for Node<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

/// A key, taken as text.
// owned and not borrowed: a key with escapes cannot be, and `\u0061` is the same key as `a`
struct Key(String);

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer).map(Key)
    }
}

impl<'de> Visitor<'de> for Node<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("any JSON value")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let mut seen = BTreeSet::new();
        while let Some(Key(key)) = map.next_key()? {
            if self.depth == 0 && key != "__metadata__" {
                self.keys.tensors += 1;
            }
            let tensor = if self.depth == 0 {
                Some(key.clone())
            } else {
                self.tensor.clone()
            };
            // bounded, for a hostile header may repeat a key a hundred thousand times
            if !seen.insert(key.clone()) && self.keys.repeated.len() < MAX_TENSORS {
                self.keys.repeated.push((self.tensor.clone(), key));
            }
            // serde_json refuses 128 levels, which bounds this recursion
            map.next_value_seed(Node {
                keys: &mut *self.keys,
                depth: self.depth + 1,
                tensor,
            })?;
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<(), A::Error> {
        while let Some(()) = seq.next_element_seed(Node {
            keys: &mut *self.keys,
            depth: self.depth + 1,
            tensor: self.tensor.clone(),
        })? {}
        Ok(())
    }

    fn visit_bool<E>(self, _: bool) -> Result<(), E> {
        Ok(())
    }

    fn visit_i64<E>(self, _: i64) -> Result<(), E> {
        Ok(())
    }

    fn visit_u64<E>(self, _: u64) -> Result<(), E> {
        Ok(())
    }

    fn visit_f64<E>(self, _: f64) -> Result<(), E> {
        Ok(())
    }

    fn visit_str<E>(self, _: &str) -> Result<(), E> {
        Ok(())
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }
}

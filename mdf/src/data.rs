//! The records of a data group: one block, or a list of blocks, packed or not.

use std::borrow::Cow;

use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;

use crate::block::{Block, Blocks, Link};
use crate::channel::Layout;
use crate::{Error, broken};

/// What the place of a record takes, in values.
const VALUES_OF_A_RECORD: usize = size_of::<&[u8]>() / size_of::<f64>();

impl<'a> Blocks<'a> {
    /// The bytes of all records, one behind the other; nothing if they are stored by columns (MDF 4.2).
    pub fn data(&self, link: Link) -> Result<Option<Cow<'a, [u8]>>, Error> {
        const ANY: [&str; 6] = ["DT", "DZ", "DL", "HL", "DV", "LD"];
        let mut block = self.at(link, &ANY)?;
        if block.id == b"HL" {
            block = self.at(block.link(0).ok_or(block.short())?, &["DL", "LD"])?;
        }
        match block.id {
            b"DT" => self
                .take_bytes(block.data.len())
                .map(|()| Some(Cow::Borrowed(block.data))),
            b"DZ" => Ok(Some(Cow::Owned(self.unpacked(block)?))),
            b"DL" => self.list(block).map(|bytes| Some(Cow::Owned(bytes))),
            _ => Ok(None),
        }
    }

    fn list(&self, first: Block<'a>) -> Result<Vec<u8>, Error> {
        let (mut bytes, mut list) = (Vec::new(), first);
        loop {
            for part in (1..list.links()).filter_map(|index| list.link(index)) {
                let block = self.at(part, &["DT", "DZ"])?;
                if block.id == b"DZ" {
                    bytes.append(&mut self.unpacked(block)?);
                } else {
                    self.take_bytes(block.data.len())?;
                    bytes.extend_from_slice(block.data);
                }
            }
            let Some(next) = list.link(0) else { return Ok(bytes) };
            list = self.at(next, &["DL"])?;
        }
    }

    /// DZ: type of what is packed, way, its parameter, lengths before and behind, bytes.
    fn unpacked(&self, block: Block<'_>) -> Result<Vec<u8>, Error> {
        if block.data.get(..2) != Some(b"DT") {
            return Err(block.short());
        }
        let (kind, columns) = (block.byte(2)?, block.word(4)?);
        if kind > 1 {
            return Err(Error::Packed { kind });
        }
        let most = self.most_bytes;
        let length = usize::try_from(block.long(8)?).map_err(|_| Error::Unpacked { most })?;
        self.take_bytes(length)?;
        let packed = usize::try_from(block.long(16)?).ok();
        let packed = packed
            .and_then(|packed| block.data.get(24..)?.get(..packed))
            .ok_or(block.short())?;
        let bytes = decompress_to_vec_zlib_with_limit(packed, length).map_err(|_| Error::Unpacked { most: length })?;
        if bytes.len() != length {
            return Err(block.short());
        }
        Ok(match kind {
            0 => bytes,
            _ => turned(&bytes, columns as usize),
        })
    }
}

/// Undoes the transposition: whole records of `columns` bytes were written byte by byte; what is left over stands as it is.
fn turned(bytes: &[u8], columns: usize) -> Vec<u8> {
    let rows = bytes.len().checked_div(columns).unwrap_or(0);
    let (whole, rest) = bytes.split_at(rows * columns);
    let mut turned = Vec::with_capacity(bytes.len());
    for row in 0..rows {
        turned.extend(whole.iter().skip(row).step_by(rows));
    }
    turned.extend_from_slice(rest);
    turned
}

/// The records of each layout. With one layout they follow each other; otherwise each begins with the number of its layout.
pub fn split<'b>(
    blocks: &Blocks<'_>,
    bytes: &'b [u8],
    id_size: usize,
    layouts: &[Layout],
) -> Result<Vec<Vec<&'b [u8]>>, Error> {
    let mut records = vec![Vec::new(); layouts.len()];
    if id_size == 0 {
        if let ([layout], [records]) = (layouts, records.as_mut_slice()) {
            let most = usize::try_from(layout.rows).unwrap_or(usize::MAX);
            if let Some(size) = std::num::NonZero::new(layout.record_bytes()) {
                let rows = most.min(bytes.len() / size);
                blocks.take_values(rows.saturating_mul(VALUES_OF_A_RECORD))?;
                records.extend(bytes.chunks_exact(size.get()).take(rows));
            }
        }
        return Ok(records);
    }
    if id_size > 8 {
        return Err(broken("record", 0));
    }
    let mut rest = bytes;
    while !rest.is_empty() {
        let Some((id, behind)) = rest.split_at_checked(id_size) else {
            break;
        };
        let id = id.iter().rev().fold(0, |id, byte| id << 8 | u64::from(*byte));
        let Some(index) = layouts.iter().position(|layout| layout.id == id) else {
            return Err(broken("record", (bytes.len() - rest.len()) as u64));
        };
        let layout = layouts.get(index).ok_or(broken("record", 0))?;
        let (size, behind) = match layout.is_variable {
            false => (layout.record_bytes(), behind),
            true => {
                let Some((four, behind)) = behind.split_first_chunk::<4>() else {
                    break;
                };
                (u32::from_le_bytes(*four) as usize, behind)
            }
        };
        // the recorder was switched off within a record
        let Some((record, behind)) = behind.split_at_checked(size) else {
            break;
        };
        if let Some(records) = records.get_mut(index) {
            blocks.take_values(VALUES_OF_A_RECORD)?;
            records.push(record);
        }
        rest = behind;
    }
    Ok(records)
}

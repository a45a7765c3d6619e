//! MDF 4 files: records of dSPACE ControlDesk, INCA, CANape and asammdf, as groups of channels in physical units.
//!
//! ```text
//!   HD ─► DG ─► DG ...             data groups; each with its records: DT, or DL and HL of DT and DZ (deflate)
//!         └► CG ─► CG ...          groups of channels: rows, bytes of a record
//!            └► CN ─► CN ...       channels: place in a record, type; CC makes physical values of them
//! ```
//!
//! Numbers at a fixed place of a record are read: integers and floats of both byte orders, conversions that are a formula of
//! numbers or a table of them, invalidation bits. What is something else (text, arrays, values of changing length) is named.
//! The crate that exists for this reads paths alone, writes, logs buses, and asks for a newer compiler. The zlib is a
//! crate's, whose inflation takes a bound. Format: ASAM MDF 4.1; field names as in its public descriptions.

mod block;
mod channel;
mod conversion;
mod data;

use block::{Blocks, Link};

/// What a file may take.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Bytes of all records together, unpacked.
    pub most_bytes: usize,
    /// Channels of all groups.
    pub most_channels: usize,
}

/// What is in a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct File {
    /// In the order of the file; each has rows and channels.
    pub groups: Vec<Group>,
    /// Channels and groups that are not read, and why: `` `gear` (text) ``.
    pub left_out: Vec<String>,
}

/// Channels of one raster.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// The name of the acquisition or of its source; may be empty.
    pub name: String,
    /// What the rows were taken over, if the file says it.
    pub master: Option<Channel>,
    /// The others, in the order of the file.
    pub channels: Vec<Channel>,
}

/// Numbers over the rows of a group.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// As the file has it.
    pub name: String,
    /// Of the physical values; may be empty.
    pub unit: String,
    /// Whether it is the time, in seconds.
    pub is_time: bool,
    /// Physical values; NaN where the file says that a value is invalid.
    pub values: Vec<f64>,
}

/// Why a file is not read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Error {
    /// MDF 3 and older: `3.30`.
    Older(String),
    /// The recorder stopped before it had finished the file.
    Unfinished,
    /// Records are packed in a way of MDF 4.3 (zstd, lz4).
    Packed {
        /// Number of the way.
        kind: u8,
    },
    /// Records are damaged, or unpack to more than this.
    Unpacked {
        /// Bytes.
        most: usize,
    },
    /// More channels or blocks than a record has.
    Parts,
    /// A block that is not there or is another one.
    Broken {
        /// What was looked for: `DG`.
        block: &'static str,
        /// Where, in bytes from the start.
        at: u64,
    },
}

/// Whether `bytes` begin as an MDF file, of any version.
#[must_use]
pub fn is_mdf(bytes: &[u8]) -> bool {
    bytes.starts_with(b"MDF     ") || bytes.starts_with(b"UnFinMF ")
}

/// All groups that hold numbers.
///
/// # Errors
/// A file that is not sound, not of version 4, not finished, or larger inside than the limits.
pub fn read(bytes: &[u8], limits: Limits) -> Result<File, Error> {
    // ID block: who, version as text, program, version as a number
    let version = match bytes.get(28..30) {
        Some(&[low, high]) => u16::from_le_bytes([low, high]),
        _ => return Err(broken("ID", 0)),
    };
    if version < 400 {
        let text = bytes.get(8..16).unwrap_or_default();
        let text = String::from_utf8_lossy(text);
        return Err(Error::Older(text.trim_matches(['\0', ' ']).to_owned()));
    }
    if bytes.starts_with(b"UnFinMF ") {
        return Err(Error::Unfinished);
    }
    let blocks = Blocks::new(bytes, limits.most_bytes);
    let header = blocks.at(Link(64), &["HD"])?;
    let mut found = File::default();
    let mut channels_left = limits.most_channels;
    let mut next = header.link(0);
    while let Some(link) = next {
        let group = blocks.at(link, &["DG"])?;
        data_group(&blocks, group, &mut channels_left, &mut found)?;
        next = group.link(0);
    }
    Ok(found)
}

/// The groups of channels of one data group.
fn data_group(
    blocks: &Blocks<'_>,
    group: block::Block<'_>,
    channels_left: &mut usize,
    found: &mut File,
) -> Result<(), Error> {
    let mut layouts = Vec::new();
    let mut next = group.link(1);
    while let Some(link) = next {
        let block = blocks.at(link, &["CG"])?;
        layouts.push(channel::Layout::read(blocks, block, channels_left)?);
        next = block.link(0);
    }
    let id_size = usize::from(group.byte(0)?);
    let Some(data) = group.link(2) else { return Ok(()) };
    if layouts.iter().all(|layout| layout.rows == 0) {
        return Ok(());
    }
    let Some(bytes) = blocks.data(data)? else {
        let names = layouts.iter().flat_map(channel::Layout::names);
        found
            .left_out
            .extend(names.map(|name| format!("`{name}` (stored by columns)")));
        return Ok(());
    };
    let records = data::split(blocks, &bytes, id_size, &layouts)?;
    for (layout, records) in layouts.iter().zip(records) {
        let Some(group) = layout.decode(blocks, &records, &mut found.left_out)? else {
            continue;
        };
        found.groups.push(group);
    }
    Ok(())
}

#[cfg(test)]
mod tests;

fn broken(block: &'static str, at: u64) -> Error {
    Error::Broken { block, at }
}

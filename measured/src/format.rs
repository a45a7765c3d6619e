//! Which format a file is in, by its first bytes.

use std::path::Path;

use toml_input::{Faults, FileName, Message};

use crate::csv;
use crate::mat;
use crate::mdf;
use crate::newer;
use crate::sheet::Sheet;

/// How a file is read.
#[derive(Debug, Clone)]
pub struct Options {
    /// Longest file, bytes.
    pub most_bytes: u64,
    /// A last line without end and with too few cells is left out and said: a logger was switched off while it wrote.
    /// Otherwise it is a fault like any other short line.
    pub leave_out_cut_line: bool,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            // a minute of eight channels at 20 kHz; a table is held in memory as a whole
            most_bytes: 200_000_000,
            leave_out_cut_line: false,
        }
    }
}

/// First bytes of formats that are not read, what they are, and how to get to a table.
const FOREIGN: &[(&[u8], &str, &str)] = &[
    (
        // by first bytes and not by the extension: files are renamed
        b"\x89HDF",
        "an HDF5 file",
        "export the channels as CSV",
    ),
    (
        b"PK\x03\x04",
        "a zip archive (an Excel workbook is one)",
        "save the sheet as CSV UTF-8",
    ),
    (
        b"\xd0\xcf\x11\xe0",
        "an old Excel workbook",
        "save the sheet as CSV UTF-8",
    ),
    (b"\x1f\x8b", "a gzip archive", "unpack it with gunzip"),
    (b"PAR1", "a Parquet file", "export the columns as CSV"),
    (
        b"\x93NUMPY",
        "a NumPy array",
        "save it with numpy.savetxt, a header and delimiter=\",\"",
    ),
];

impl Sheet {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read or is too large, and those of [`Sheet::parse`].
    pub fn open(file: impl Into<FileName>, options: &Options) -> Result<Self, Faults> {
        let name: FileName = file.into();
        let bytes = name.read(options.most_bytes).map_err(|message| name.fault(message))?;
        Self::of_bytes(name, bytes, options)
    }

    /// Reads the bytes of a file; `file` only names it in faults.
    ///
    /// # Errors
    /// A file that is no text, no table, or has lines of different lengths: all faults, of very many the first.
    pub fn parse(file: &Path, bytes: Vec<u8>, options: &Options) -> Result<Self, Faults> {
        Self::of_bytes(FileName::new(file), bytes, options)
    }

    fn of_bytes(name: FileName, bytes: Vec<u8>, options: &Options) -> Result<Self, Faults> {
        // before anything is decoded: "not UTF-8" would be the lesser hint
        if let Some((_, what, hint)) = FOREIGN.iter().find(|(start, ..)| bytes.starts_with(start)) {
            let message = Message::new(format!("the file is {what}, which is not read yet"));
            return Err(name
                .fault(
                    message
                        .expected("a table as text (CSV), a MAT or an MDF file")
                        .hint(*hint),
                )
                .into());
        }
        // one that was cut off within its first 128 bytes is a MAT file, too
        if ::mat::is_mat(&bytes) || bytes.starts_with(b"MATLAB 5.0 MAT-file") || newer::is_newer(&bytes) {
            return mat::read(name, &bytes, options.most_bytes);
        }
        if ::mdf::is_mdf(&bytes) {
            return mdf::read(name, &bytes, options.most_bytes);
        }
        csv::read(name, bytes, options)
    }
}

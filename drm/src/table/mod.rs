//! Tables of settled points: files with the columns `duty` (or `d_real`), `v_out`, `i_out`, `v_in`.
//!
//! [`Table::open`] reads strictly: all faults at once, each with file, line, what was found, what was expected and what
//! to do. The crate `measured` finds the columns and turns them into SI units; here is what only a mapping asks for: each
//! point whole, settled, and within the range of a buck converter.

mod point;
mod reading;
mod suspicion;

use std::path::Path;

use measured::{Options, Sheet};
use toml_input::Faults;

pub(crate) use point::{PLAN_COLUMNS, lines};
pub use point::{Point, Table, TableOptions};

/// Largest file of settled points, bytes: the points that a table may have take a twentieth of it.
const MOST_BYTES: u64 = 4 << 20;

impl Table {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read, and those of [`Table::read`].
    pub fn open(file: &Path, options: &TableOptions) -> Result<Table, Faults> {
        Self::read(&Sheet::open(file, &Self::file_options())?, options)
    }

    /// Reads the bytes of a file; `file` only names it in faults.
    ///
    /// # Errors
    /// As [`Table::open`].
    pub fn parse(file: &Path, bytes: impl Into<Vec<u8>>, options: &TableOptions) -> Result<Table, Faults> {
        Self::read(&Sheet::parse(file, bytes.into(), &Self::file_options())?, options)
    }

    /// Reads the settled points of a sheet; columns that nobody asked for are named in the notes.
    ///
    /// # Errors
    /// All faults of the table; of very many the first.
    pub fn read(sheet: &Sheet, options: &TableOptions) -> Result<Table, Faults> {
        reading::read(sheet, options)
    }

    /// How files with settled points are read.
    #[must_use]
    pub fn file_options() -> Options {
        Options {
            most_bytes: MOST_BYTES,
            leave_out_cut_line: false,
        }
    }
}

//! What several tests of tables need.
#![allow(dead_code, clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use drm::{Table, TableOptions};
use toml_input::{FileName, Source};

/// A CSV text as a file called `table.csv`.
pub fn source(text: &str) -> Source {
    Source::new(FileName::new(Path::new("table.csv")), text.as_bytes().to_vec()).unwrap()
}

/// A table that must be sound.
pub fn table(text: &str) -> Table {
    Table::parse(&source(text), &TableOptions::default()).unwrap_or_else(|faults| panic!("{faults}"))
}

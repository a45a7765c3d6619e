//! Where a cell of a text stands.

use toml_input::{Fault, Message, Source, Span};

use super::split::{Separator, cells};

/// A row of a text.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TextRow {
    /// From 1.
    pub line: usize,
    /// First byte of the line.
    pub start: usize,
}

/// The text of a sheet, to show what a fault is about.
#[derive(Debug, Clone)]
pub(crate) struct TextPlaces {
    source: Source,
    separator: Separator,
    header: Vec<Span>,
    rows: Vec<TextRow>,
    /// Cells before the first column.
    skip: usize,
}

impl TextPlaces {
    pub fn new(source: Source, separator: Separator, header: Vec<Span>, rows: Vec<TextRow>, skip: usize) -> Self {
        TextPlaces {
            source,
            separator,
            header,
            rows,
            skip,
        }
    }

    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    pub fn line(&self, row: usize) -> usize {
        self.rows.get(row).map_or(0, |row| row.line)
    }

    pub fn cell(&self, row: usize, column: usize, message: Message) -> Fault {
        let line = self.span(row);
        // cut again for a fault only: spans of all cells would take more memory than the numbers
        let cells = cells(&self.source.text[line.clone()], line.start, self.separator).unwrap_or_default();
        self.source
            .fault(cells.get(self.skip + column).unwrap_or(&line), message)
    }

    pub fn row(&self, row: usize, message: Message) -> Fault {
        self.source.fault(&self.span(row), message)
    }

    /// A fault of one name, or of all.
    pub fn header(&self, column: Option<usize>, message: Message) -> Fault {
        let whole = self
            .header
            .first()
            .zip(self.header.last())
            .map(|(first, last)| first.start..last.end);
        let one = column.and_then(|column| self.header.get(column)).cloned();
        self.source.fault(&one.or(whole).unwrap_or(0..0), message)
    }

    /// The bytes of a row's line.
    fn span(&self, row: usize) -> Span {
        let Some(row) = self.rows.get(row) else { return 0..0 };
        let text = &self.source.text[row.start..];
        let line = text.split('\n').next().unwrap_or_default();
        row.start..row.start + line.trim_end_matches('\r').len()
    }
}

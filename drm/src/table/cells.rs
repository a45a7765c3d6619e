//! CSV text as rows of cells, each with its place.

use toml_input::{Fault, Message, Source, Span};

/// One line of the file, cut into cells.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    /// From 1.
    pub line: usize,
    /// As many as the header has.
    cells: Vec<Span>,
}

/// Header and rows.
#[derive(Debug)]
pub(crate) struct Sheet<'a> {
    source: &'a Source,
    header: Vec<Span>,
    pub rows: Vec<Row>,
}

impl<'a> Sheet<'a> {
    /// Cuts a text into cells; every row has as many as the header.
    pub fn parse(source: &'a Source) -> Result<Self, Vec<Fault>> {
        let mut lines = lines(&source.text).filter(|(_, span)| !is_skipped(&source.text[span.clone()]));
        let Some((_, header_span)) = lines.next() else {
            let message = Message::new("the table is empty").expected("a header and one row for each settled point");
            return Err(vec![source.name.fault(message)]);
        };
        if let Some(message) = foreign(&source.text[header_span.clone()]) {
            return Err(vec![source.fault(&header_span, message)]);
        }
        let mut sheet = Sheet {
            header: cut(&source.text, header_span.clone()),
            source,
            rows: Vec::new(),
        };
        let mut faults = sheet.twins();
        for (line, span) in lines {
            let mut cells = cut(&source.text, span.clone());
            while cells.len() > sheet.header.len() && cells.last().is_some_and(Span::is_empty) {
                cells.pop();
            }
            if cells.len() == sheet.header.len() {
                sheet.rows.push(Row { line, cells });
            } else {
                faults.push(source.fault(&span, uneven(cells.len(), sheet.header.len())));
            }
        }
        if sheet.rows.is_empty() && faults.is_empty() {
            let message =
                Message::new("the table has no rows").expected("one row for each settled point below the header");
            faults.push(source.fault(&header_span, message));
        }
        if faults.is_empty() { Ok(sheet) } else { Err(faults) }
    }

    /// The names of the columns.
    pub fn header(&self) -> impl Iterator<Item = &str> {
        self.header.iter().map(|span| &self.source.text[span.clone()])
    }

    pub fn cell(&self, row: &Row, column: usize) -> &str {
        row.cells.get(column).map_or("", |span| &self.source.text[span.clone()])
    }

    /// A fault of one cell.
    pub fn cell_fault(&self, row: &Row, column: usize, message: Message) -> Fault {
        match row.cells.get(column) {
            Some(span) => self.source.fault(span, message),
            None => self.line_fault(row.line, message),
        }
    }

    /// A fault of a whole line.
    pub fn line_fault(&self, line: usize, message: Message) -> Fault {
        match lines(&self.source.text).find(|(number, _)| *number == line) {
            Some((_, span)) => self.source.fault(&span, message),
            None => self.source.name.fault(message),
        }
    }

    /// A fault of the names of the columns.
    pub fn header_fault(&self, message: Message) -> Fault {
        let span = self
            .header
            .first()
            .zip(self.header.last())
            .map(|(first, last)| first.start..last.end);
        self.source.fault(&span.unwrap_or(0..0), message)
    }

    /// A fault of the table as a whole.
    pub fn fault(&self, message: Message) -> Fault {
        self.source.name.fault(message)
    }

    /// Columns of equal names.
    fn twins(&self) -> Vec<Fault> {
        let names: Vec<&str> = self.header().collect();
        let is_twin = |index: &usize| !names[*index].is_empty() && names[..*index].contains(&names[*index]);
        let fault = |index: usize| {
            let message = Message::new(format!("two columns are called `{}`", names[index]));
            self.source
                .fault(&self.header[index], message.hint("remove or rename one"))
        };
        (0..names.len()).filter(is_twin).map(fault).collect()
    }
}

/// The lines of a text from 1, each with its bytes.
fn lines(text: &str) -> impl Iterator<Item = (usize, Span)> {
    let mut start = 0;
    text.split('\n').enumerate().map(move |(index, line)| {
        let span = start..start + line.trim_end_matches('\r').len();
        start += line.len() + 1;
        (index + 1, span)
    })
}

fn is_skipped(line: &str) -> bool {
    line.trim().is_empty() || line.trim_start().starts_with('#')
}

/// The cells of a line, without blanks and quotes around them.
fn cut(text: &str, line: Span) -> Vec<Span> {
    let mut start = line.start;
    text[line]
        .split(',')
        .map(|cell| {
            let inner = cell.trim().trim_matches('"').trim();
            let lead = cell.find(inner).unwrap_or(0);
            let span = start + lead..start + lead + inner.len();
            start += cell.len() + 1;
            span
        })
        .collect()
}

/// A header cut by something else than commas.
fn foreign(text: &str) -> Option<Message> {
    let (name, separator) = [("semicolons", ';'), ("tabs", '\t')]
        .into_iter()
        .find(|(_, separator)| !text.contains(',') && text.contains(*separator))?;
    let hint = match separator {
        ';' => "decimal commas become points, then semicolons commas: sed 's/,/./g; s/;/,/g' TABLE.csv > POINTS.csv",
        _ => "write the table with commas",
    };
    Some(
        Message::new("the cells are not separated by commas")
            .found(name)
            .expected("cells separated by commas, numbers with a decimal point")
            .hint(hint),
    )
}

fn uneven(found: usize, expected: usize) -> Message {
    let (problem, hint) = if found > expected {
        (
            "more cells than the header has columns",
            "numbers take a decimal point: write 0.5 instead of 0,5",
        )
    } else {
        (
            "cells are missing",
            "leave a cell empty between two commas where nothing was measured",
        )
    };
    let message = Message::new(problem).found(format!("{found} cells"));
    message
        .expected(format!("{expected} cells as in the header"))
        .hint(hint)
}

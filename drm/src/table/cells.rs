//! CSV text as rows of cells, each with its line.

use crate::faults::Fault;

/// One line of the file, cut into cells.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    /// From 1.
    pub line: usize,
    /// As many as the header has.
    pub cells: Vec<String>,
}

/// Header and rows.
#[derive(Debug, Clone)]
pub(crate) struct Sheet {
    pub header: Vec<String>,
    pub rows: Vec<Row>,
}

impl Sheet {
    /// Cuts `text` into cells; every row has as many as the header.
    pub fn parse(text: &str) -> Result<Sheet, Vec<Fault>> {
        let mut lines = text
            .trim_start_matches('\u{feff}')
            .lines()
            .enumerate()
            .map(|(index, line)| (index + 1, line))
            .filter(|(_, line)| !line.trim().is_empty() && !line.trim_start().starts_with('#'));
        let Some((header_line, header_text)) = lines.next() else {
            return Err(vec![
                Fault::new("the table is empty").expected("a header and one row for each settled point"),
            ]);
        };
        if let Some(fault) = foreign(header_line, header_text) {
            return Err(vec![fault]);
        }
        let header = cut(header_text);
        let mut faults = Vec::new();
        for (index, name) in header.iter().enumerate() {
            if !name.is_empty() && header[..index].contains(name) {
                faults.push(Fault::new("two columns have the same name").line(header_line).found(format!("`{name}`")));
            }
        }
        let mut rows = Vec::new();
        for (line, text) in lines {
            let mut cells = cut(text);
            while cells.len() > header.len() && cells.last().is_some_and(String::is_empty) {
                cells.pop();
            }
            if cells.len() == header.len() {
                rows.push(Row { line, cells });
                continue;
            }
            faults.push(uneven(line, text, cells.len(), header.len()));
        }
        if rows.is_empty() && faults.is_empty() {
            faults.push(
                Fault::new("the table has no rows")
                    .line(header_line)
                    .expected("one row for each settled point below the header"),
            );
        }
        if faults.is_empty() { Ok(Sheet { header, rows }) } else { Err(faults) }
    }
}

fn cut(line: &str) -> Vec<String> {
    line.split(',')
        .map(|cell| cell.trim().trim_matches('"').trim().to_owned())
        .collect()
}

/// A header cut by something else than commas.
fn foreign(line: usize, text: &str) -> Option<Fault> {
    let (name, separator) = [("semicolons", ';'), ("tabs", '\t')]
        .into_iter()
        .find(|(_, separator)| !text.contains(',') && text.contains(*separator))?;
    let mut hint = format!("replace `{}` by `,`", separator.escape_default());
    if separator == ';' {
        hint = "replace decimal commas by points first, then `;` by `,`: \
                sed 's/,/./g; s/;/,/g' TABLE.csv > POINTS.csv"
            .to_owned();
    }
    Some(
        Fault::new("the table does not separate its cells by commas")
            .line(line)
            .found(format!("{name}: {}", clip(text)))
            .expected("cells separated by commas, numbers with a decimal point")
            .hint(hint),
    )
}

fn uneven(line: usize, text: &str, found: usize, expected: usize) -> Fault {
    let fault = Fault::new(if found > expected {
        "more cells than the header has columns"
    } else {
        "cells are missing"
    })
    .line(line)
    .found(format!("{found} cells: {}", clip(text)))
    .expected(format!("{expected} cells as in the header"));
    if found > expected {
        fault.hint("numbers take a decimal point: write 0.5 instead of 0,5")
    } else {
        fault.hint("leave a cell empty between two commas if its quantity is not measured")
    }
}

/// The start of a text, fit for one line of a message.
pub(crate) fn clip(text: &str) -> String {
    const WIDTH: usize = 60;
    let shown: String = text.chars().filter(|c| !c.is_control() || *c == '\t').take(WIDTH).collect();
    let more = if text.chars().count() > WIDTH { "..." } else { "" };
    format!("`{}{more}`", shown.replace('\t', " "))
}

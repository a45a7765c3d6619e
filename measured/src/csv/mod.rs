//! Tables as text, as instruments, spreadsheets and scripts write them.
//!
//! ```text
//! bytes ─► text::decode ─► lines ─► split::cells ─► number::read ─► Column
//!          UTF-8, UTF-16            , ; tab blanks   1.5  1,5  nan
//! ```
//! Every cell keeps its place: a row knows where its line begins, and a line is cut again when a fault must be shown.

pub(crate) mod number;
mod places;
mod preamble;
mod split;
mod text;
mod units;

use std::iter::Peekable;

use toml_input::{Fault, Faults, FileName, Message, Sink, Source, Span};

use crate::format::Options;
use crate::quantity::split_unit;
use crate::sheet::{Column, Sheet, table_faults};
use number::Mark;
pub(crate) use places::TextPlaces;
use places::TextRow;
use split::{Separator, cells};

/// What a header looks like, for people who have none.
const A_HEADER: &str = "t,duty,v_out,i_l,i_out,v_in,r_load";

/// A line that is neither empty nor a comment.
#[derive(Debug, Clone)]
struct Line {
    /// From 1.
    number: usize,
    span: Span,
}

/// Reads a table.
pub(crate) fn read(name: FileName, bytes: Vec<u8>, options: &Options) -> Result<Sheet, Faults> {
    let (source, mut repairs) = text::decode(name, bytes)?;
    let all: Vec<Line> = lines(&source.text).collect();
    if let Some(layout) = preamble::of(&source, &all) {
        return captured(source, layout, &all, options, repairs);
    }
    let mut lines = all.into_iter().peekable();
    let stated = stated_separator(&source.text, &mut lines);
    let Some(header) = lines.next() else {
        let message =
            Message::new("the table is empty").expected(format!("a header such as {A_HEADER} and rows below it"));
        return Err(source.name.fault(message).into());
    };
    let head = &source.text[header.span.clone()];
    let separator = stated.unwrap_or_else(|| Separator::of_header(head));
    let mut names = cells(head, header.span.start, separator).map_err(|cell| open_quote(&source, &cell))?;
    // one stays: a line of separators alone is a header without names
    drop_empty_end(&mut names, 1);
    header_faults(&source, &header, &names)?;
    let mut body: Vec<Line> = lines.collect();
    let is_units = |line: &&Line| {
        let text = &source.text[line.span.clone()];
        // a header that stands twice holds words alone and would pass for units
        text != head && units::are_units(text, separator)
    };
    let mut titles: Vec<String> = names.iter().map(|name| source.text[name.clone()].to_owned()).collect();
    if let Some(line) = body.first().filter(is_units) {
        titles = units::named_with_units(&source, &names, &line.span, separator)?;
        repairs.push(format!("line {} holds units: they are heeded", line.number));
        body.remove(0);
    }
    let table = Reader {
        separator,
        skip: 0,
        columns: titles.iter().map(|title| Column::new(title, Vec::new())).collect(),
        source: &source,
        header: &names,
        rows: Vec::new(),
        faults: table_faults(),
        marks: [None, None],
    };
    let (columns, rows) = table.read(&body, options, &mut repairs)?;
    if rows.is_empty() {
        return Err(no_rows(&source, &header.span));
    }
    let name = source.name.clone();
    Ok(Sheet::of_text(
        name,
        columns,
        repairs,
        TextPlaces::new(source, separator, names, rows, 0),
    ))
}

/// Reads a table that an instrument wrote with a preamble.
fn captured(
    source: Source,
    layout: preamble::Layout,
    lines: &[Line],
    options: &Options,
    mut repairs: Vec<String>,
) -> Result<Sheet, Faults> {
    repairs.push(layout.note);
    let titles: Vec<&str> = layout.titles.iter().map(String::as_str).collect();
    twins(&source, &layout.names, &titles)?;
    let table = Reader {
        separator: layout.separator,
        skip: layout.skip,
        columns: layout
            .titles
            .iter()
            .map(|title| Column::new(title, Vec::new()))
            .collect(),
        source: &source,
        header: &layout.names,
        rows: Vec::new(),
        faults: table_faults(),
        marks: [None, None],
    };
    let (mut columns, rows) = table.read(lines.get(layout.body..).unwrap_or_default(), options, &mut repairs)?;
    if rows.is_empty() {
        return Err(no_rows(&source, layout.names.first().unwrap_or(&(0..0))));
    }
    if let (Some((start, step)), Some(count)) = (layout.clock, columns.first_mut()) {
        count.values.iter_mut().for_each(|value| *value = start + *value * step);
        count.decimals = number::decimals(step).max(number::decimals(start));
        "t".clone_into(&mut count.name);
    }
    let name = source.name.clone();
    let places = TextPlaces::new(source, layout.separator, layout.names, rows, layout.skip);
    Ok(Sheet::of_text(name, columns, repairs, places))
}

/// The lines that are neither empty nor comments.
fn lines(text: &str) -> impl Iterator<Item = Line> {
    let mut start = 0;
    let all = text.split('\n').enumerate().map(move |(index, line)| {
        let span = start..start + line.trim_end_matches('\r').len();
        start += line.len() + 1;
        Line {
            number: index + 1,
            span,
        }
    });
    all.filter(|line| {
        let line = text[line.span.clone()].trim_start();
        !line.is_empty() && !line.starts_with('#')
    })
}

/// `sep=;` in the first line, as spreadsheets write and hide it.
fn stated_separator(text: &str, lines: &mut Peekable<impl Iterator<Item = Line>>) -> Option<Separator> {
    let first = lines.peek()?;
    let mark = text[first.span.clone()].trim().strip_prefix("sep=")?;
    let separator = Separator::of_mark(mark)?;
    lines.next();
    Some(separator)
}

/// A separator at the end of a line makes no cell beyond the `wanted` ones.
fn drop_empty_end(cells: &mut Vec<Span>, wanted: usize) {
    while cells.len() > wanted && cells.last().is_some_and(Span::is_empty) {
        cells.pop();
    }
}

fn open_quote(source: &Source, cell: &Span) -> Fault {
    let message = Message::new("a quotation mark is not closed").expected("a second one in the same line");
    source.fault(cell, message)
}

/// A table without a header, and names that stand in it twice.
fn header_faults(source: &Source, line: &Line, names: &[Span]) -> Result<(), Faults> {
    let text = |name: &Span| &source.text[name.clone()];
    // numbers as names: the first measurement would be lost, and every column unknown
    if names
        .iter()
        .all(|name| number::read(text(name)).is_some_and(|n| n.value.is_finite()))
    {
        let message = Message::new("the first line holds numbers, not the names of the columns").expected("a header");
        // numpy.savetxt and others write the header as a comment
        let commented = source.text[..line.span.start].lines().next_back();
        let hint = match commented.filter(|above| above.starts_with('#') && above.contains(|c: char| c.is_alphabetic()))
        {
            Some(_) => "if the line above it is the header, take away its `#`".to_owned(),
            None => format!("put a first line above such as {A_HEADER}"),
        };
        return Err(source.fault(&line.span, message.hint(hint)).into());
    }
    let titles: Vec<&str> = names.iter().map(text).collect();
    twins(source, names, &titles)
}

/// Names that stand in a table twice, where each has a span to show.
fn twins(source: &Source, names: &[Span], titles: &[&str]) -> Result<(), Faults> {
    let twin = |index: &usize| {
        let name = titles[*index];
        !name.is_empty() && titles[..*index].contains(&name)
    };
    let fault = |index: usize| {
        let message = Message::new(format!("two columns are called `{}`", titles[index]));
        let shown = names.get(index).or(names.last()).cloned().unwrap_or(0..0);
        source.fault(&shown, message.hint("remove or rename one"))
    };
    let mut faults: Sink = (0..titles.len()).filter(twin).map(fault).collect();
    faults.propagate()
}

/// A header above no rows.
fn no_rows(source: &Source, header: &Span) -> Faults {
    let message = Message::new("the table has no rows").expected("rows of numbers below the header");
    source.fault(header, message).into()
}

/// What has been read of the rows.
struct Reader<'a> {
    source: &'a Source,
    separator: Separator,
    /// Cells before the first column.
    skip: usize,
    header: &'a [Span],
    columns: Vec<Column>,
    rows: Vec<TextRow>,
    faults: Sink,
    /// The first number with a decimal point and the first with a decimal comma.
    marks: [Option<Span>; 2],
}

impl Reader<'_> {
    fn read(
        mut self,
        lines: &[Line],
        options: &Options,
        repairs: &mut Vec<String>,
    ) -> Result<(Vec<Column>, Vec<TextRow>), Faults> {
        let whole = self.source.text.ends_with('\n');
        for (index, line) in lines.iter().enumerate() {
            // a logger that was switched off while it wrote leaves a last line without its end
            let cut = index + 1 == lines.len() && !whole && options.leave_out_cut_line;
            if !self.row(line, cut) {
                repairs.push(format!("line {} is cut off: left out", line.number));
            }
        }
        // 1.500 may then be 1500 or 1.5: the table has to be clear about it
        if let [Some(point), Some(comma)] = &self.marks {
            // the first of them set the rule that this one breaks
            let second = if point.start > comma.start { point } else { comma };
            let message = Message::new("decimal points and decimal commas in one table")
                .found(&self.source.text[second.clone()])
                .expected("one of them throughout, and no mark between thousands");
            self.faults.push(self.source.fault(second, message));
        } else if self.marks[Mark::Comma as usize].is_some() {
            repairs.push("decimal commas read as points".to_owned());
        }
        self.faults.propagate()?;
        Ok((self.columns, self.rows))
    }

    /// Reads a line; false if it may be cut off and is.
    fn row(&mut self, line: &Line, may_be_cut: bool) -> bool {
        let text = &self.source.text[line.span.clone()];
        let mut cells = match cells(text, line.span.start, self.separator) {
            Ok(cells) => cells,
            Err(cell) => {
                self.faults.push(open_quote(self.source, &cell));
                return true;
            }
        };
        cells.drain(..self.skip.min(cells.len()));
        // some programs end each row with a separator, but not the header
        drop_empty_end(&mut cells, self.columns.len());
        if cells.len() < self.columns.len() && may_be_cut {
            return false;
        }
        if cells.len() != self.columns.len() {
            let message = uneven(cells.len(), self.columns.len(), self.separator);
            self.faults.push(self.source.fault(&line.span, message));
            return true;
        }
        // behind the count of cells, so that it compares name by name
        if self.is_header(&cells) {
            let message = Message::new("the header stands a second time")
                .expected("one header and rows of numbers")
                .hint("cut the file into one for each record, or remove this line");
            self.faults.push(self.source.fault(&line.span, message));
            return true;
        }
        for (column, cell) in self.columns.iter_mut().zip(cells) {
            let text = &self.source.text[cell.clone()];
            let number = number::read(text);
            if let Some(mark) = number.as_ref().and_then(|number| number.mark) {
                self.marks[mark as usize].get_or_insert(cell);
            }
            column.decimals = column.decimals.max(number.as_ref().map_or(0, |number| number.decimals));
            if number.is_none() && !text.is_empty() {
                column.words.push((self.rows.len(), text.to_owned()));
            }
            column.values.push(number.map_or(f64::NAN, |number| number.value));
        }
        self.rows.push(TextRow {
            line: line.number,
            start: line.span.start,
        });
        true
    }

    /// Whether a row is the header again, as in files that were joined.
    fn is_header(&self, cells: &[Span]) -> bool {
        let text = |cell: &Span| &self.source.text[cell.clone()];
        let pairs = || cells.iter().zip(self.header);
        self.skip == 0 && pairs().all(|(cell, name)| text(cell) == text(name))
            // nameless columns would "repeat their header" in every row of empty cells
            && pairs().any(|(_, name)| !split_unit(text(name)).0.is_empty())
    }
}

fn uneven(found: usize, expected: usize, separator: Separator) -> Message {
    let (problem, hint) = match (found > expected, separator) {
        (true, Separator::Mark(',')) => (
            "more cells than the header has columns",
            "a decimal comma? write 0.5 instead of 0,5, or put `;` between the cells",
        ),
        (true, _) => (
            "more cells than the header has columns",
            "a name of a column is missing, or a cell too many",
        ),
        (false, _) => (
            "cells are missing",
            "leave a cell empty between two separators where nothing was measured",
        ),
    };
    let message = Message::new(problem).found(format!("{found} cells"));
    message
        .expected(format!("{expected} cells as in the header"))
        .hint(hint)
}

#[cfg(test)]
mod preamble_tests;
#[cfg(test)]
mod tests;

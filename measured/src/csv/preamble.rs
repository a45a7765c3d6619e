//! What instruments write above and beside their columns.
//!
//! | instrument | what stands there |
//! |---|---|
//! | Keysight, Agilent | `x-axis,1,2` and `second,Volt,Volt`: channels are called by their numbers |
//! | Rigol | `X,CH1,CH2,Start,Increment` and `Sequence,Volt,Volt,-6e-4,1e-6`: the first column counts samples |
//! | Tektronix TDS | settings in the first two columns beside the first rows, samples in the fourth and fifth |
//! | Tektronix, Siglent, LeCroy and relatives | lines of settings, then names or units, then samples |
//!
//! A text is taken for one of these by its first cell, and for the last only with settings above its names, so that no other table is
//! read differently. Forms are those that public descriptions and programs that read them show.

use toml_input::{Source, Span};

use super::split::{Separator, cells};
use super::{Line, number, units};

/// First cells of files that begin with settings.
const SETTINGS: [&str; 19] = [
    "model",
    "model number",
    "firmware version",
    "record length",
    "sample interval",
    "sample rate",
    "waveform type",
    "point format",
    "horizontal units",
    "horizontal scale",
    "vertical units",
    "label",
    "memory length",
    "segments",
    "type",
    "descr",
    "path",
    "date",
    "title",
];
/// Names that instruments give the time.
const TIMES: [&str; 6] = ["x-axis", "x", "time", "second", "source", "s"];

/// How a text with a preamble is laid out.
pub(super) struct Layout {
    pub separator: Separator,
    /// Names and units of the columns.
    pub titles: Vec<String>,
    /// Cells that stand for the names in a fault.
    pub names: Vec<Span>,
    /// Number of the first line of samples, among the lines.
    pub body: usize,
    /// Cells before the first column.
    pub skip: usize,
    /// Time of the first sample and between samples, where the first column counts them.
    pub clock: Option<(f64, f64)>,
    pub note: String,
}

struct Cut<'a> {
    source: &'a Source,
    lines: &'a [Line],
    separator: Separator,
}

impl Cut<'_> {
    fn spans(&self, line: usize) -> Vec<Span> {
        let Some(line) = self.lines.get(line) else {
            return Vec::new();
        };
        let text = &self.source.text[line.span.clone()];
        let mut all = cells(text, line.span.start, self.separator).unwrap_or_default();
        super::drop_empty_end(&mut all, 0);
        all
    }

    fn text(&self, span: &Span) -> &str {
        self.source.text[span.clone()].trim()
    }

    fn texts(&self, line: usize) -> Vec<&str> {
        let spans = self.spans(line);
        spans.into_iter().map(|span| self.source.text[span].trim()).collect()
    }

    fn numbers(&self, line: usize) -> Vec<Option<f64>> {
        let cells = self.texts(line);
        cells
            .into_iter()
            .map(|cell| number::read(cell).map(|n| n.value))
            .collect()
    }

    /// Whether a line holds two numbers or more and nothing else.
    fn is_samples(&self, line: usize) -> bool {
        let all = self.numbers(line);
        all.len() >= 2 && all.iter().all(Option::is_some)
    }

    fn are_units(&self, line: usize) -> bool {
        let text = self.lines.get(line).map(|line| &self.source.text[line.span.clone()]);
        text.is_some_and(|text| units::are_units(text, self.separator))
    }
}

/// The layout of a text that an instrument wrote with a preamble; nothing for any other.
pub(super) fn of(source: &Source, lines: &[Line]) -> Option<Layout> {
    let head = &source.text[lines.first()?.span.clone()];
    let cut = Cut {
        source,
        lines,
        separator: Separator::of_header(head),
    };
    let first = cut.texts(0).first()?.to_ascii_lowercase();
    match first.as_str() {
        "x-axis" => keysight(&cut),
        "x" => rigol(&cut),
        first if SETTINGS.contains(&first.trim_end_matches(':')) => beside(&cut).or_else(|| above(&cut)),
        _ => None,
    }
}

/// A name as the column gets it: `t` for what instruments call the time, `CH1` for a channel that is called by its number.
fn name(cell: &str) -> String {
    if TIMES.iter().any(|time| time.eq_ignore_ascii_case(cell)) {
        return "t".to_owned();
    }
    match !cell.is_empty() && cell.chars().all(|c| c.is_ascii_digit()) {
        true => format!("CH{cell}"),
        false => cell.to_owned(),
    }
}

/// A name with the unit below it.
fn with_unit(cell: &str, unit: &str) -> String {
    let (name, unit) = (name(cell), unit.trim_matches(|c: char| " []()".contains(c)));
    // a number of samples has no unit, and a name may have its own
    match unit.is_empty() || unit.eq_ignore_ascii_case("sequence") || name.contains(['[', '(']) {
        true => name,
        false => format!("{name} [{unit}]"),
    }
}

fn named(names: &[&str], units: &[&str]) -> Vec<String> {
    let unit = |n: usize| units.get(n).copied().unwrap_or("");
    names
        .iter()
        .enumerate()
        .map(|(n, cell)| with_unit(cell, unit(n)))
        .collect()
}

fn keysight(cut: &Cut<'_>) -> Option<Layout> {
    let body = (1..3).find(|line| cut.is_samples(*line))?;
    let names = cut.texts(0);
    let units = if body == 2 { cut.texts(1) } else { Vec::new() };
    Some(Layout {
        separator: cut.separator,
        titles: named(&names, &units),
        names: cut.spans(0),
        body,
        skip: 0,
        clock: None,
        note: "read as a capture of a Keysight oscilloscope: x-axis is `t`, channel 1 is `CH1`".to_owned(),
    })
}

fn rigol(cut: &Cut<'_>) -> Option<Layout> {
    let names = cut.texts(0);
    let place = |wanted: &str| names.iter().position(|name| name.eq_ignore_ascii_case(wanted));
    let (start, increment) = (place("start")?, place("increment")?);
    let values = cut.numbers(1);
    let value = |place: usize| values.get(place).copied().flatten();
    let columns = start.min(increment);
    Some(Layout {
        separator: cut.separator,
        titles: named(names.get(..columns)?, &cut.texts(1)),
        names: cut.spans(0).get(..columns)?.to_vec(),
        body: 2,
        skip: 0,
        clock: Some((value(start)?, value(increment)?)),
        note: "read as a capture of a Rigol oscilloscope: `t` is counted from Start in steps of Increment".to_owned(),
    })
}

/// Settings in the first columns beside the samples.
fn beside(cut: &Cut<'_>) -> Option<Layout> {
    // name, value, nothing, time, value: from the very first line on
    let is_row = |line: usize| {
        let cells = cut.texts(line);
        let number = |n: usize| cells.get(n).is_some_and(|cell| number::read(cell).is_some());
        cells.len() >= 5 && cells[2].is_empty() && number(3) && number(4)
    };
    if !(is_row(0) && is_row(1)) {
        return None;
    }
    let setting = |wanted: &str| {
        let rows = (0..cut.lines.len().min(30)).map(|line| cut.texts(line));
        rows.filter(|row| row.first().is_some_and(|key| key.eq_ignore_ascii_case(wanted)))
            .find_map(|row| row.get(1).copied())
    };
    let count = cut.spans(0).len() - 3;
    let mut names = vec!["time"];
    names.push(setting("source").unwrap_or("CH1"));
    // more columns than one channel: no such file is known
    if count != names.len() {
        return None;
    }
    let units = [
        setting("horizontal units").unwrap_or("s"),
        setting("vertical units").unwrap_or("V"),
    ];
    Some(Layout {
        separator: cut.separator,
        titles: named(&names, &units),
        names: cut.spans(0).get(3..)?.to_vec(),
        body: 0,
        skip: 3,
        clock: None,
        note: "read as a capture of a Tektronix oscilloscope: settings stand beside the first rows".to_owned(),
    })
}

/// Whether names, perhaps units, and rows are all there is: a table like any other, whatever its first column is called.
fn is_plain(cut: &Cut<'_>, head: usize, count: usize) -> bool {
    let first = cut.numbers(0);
    // a setting has another number of cells than the rows, or words beside numbers
    let is_setting = first.len() != count || first.iter().any(Option::is_some);
    // `time,CH1` passes for units by its letters
    let names_time = |cell: &&str| name(cell) == "t" && !crate::quantity::is_unit(cell);
    let is_units = cut.are_units(head) && !cut.texts(head).first().is_some_and(names_time);
    head == 0 || head == 1 && is_units && !is_setting
}

/// Settings above the names.
fn above(cut: &Cut<'_>) -> Option<Layout> {
    // two lines of samples: a setting may be two numbers
    let body = (1..cut.lines.len())
        .find(|line| cut.is_samples(*line) && (cut.is_samples(line + 1) || line + 1 == cut.lines.len()))?;
    let count = cut.spans(body).len();
    let is_words = |line: usize| cut.spans(line).len() == count && cut.numbers(line).iter().all(Option::is_none);
    let last = body.checked_sub(1).filter(|line| is_words(*line))?;
    let before = last
        .checked_sub(1)
        .filter(|line| is_words(*line) && cut.are_units(last));
    let (head, units) = match before {
        // settings in words have as many cells now and then, but `Source` or a time names columns
        Some(line) if cut.texts(line).first().is_some_and(|cell| name(cell) == "t") => (line, cut.texts(last)),
        _ => (last, Vec::new()),
    };
    if is_plain(cut, head, count) {
        return None;
    }
    let names = cut.texts(head);
    // units alone: channels are counted
    let is_bare = units.is_empty()
        && cut.are_units(head)
        && names
            .first()
            .is_some_and(|cell| cell.to_ascii_lowercase().starts_with("sec"));
    let titles = match is_bare {
        true => {
            let numbers: Vec<String> = (0..count)
                .map(|n| if n == 0 { "t".to_owned() } else { format!("CH{n}") })
                .collect();
            let own: Vec<&str> = numbers.iter().map(String::as_str).collect();
            named(&own, &names)
        }
        false => named(&names, &units),
    };
    let spans = cut.spans(head);
    let label = spans.first().map_or("", |span| cut.text(span));
    Some(Layout {
        separator: cut.separator,
        titles,
        names: spans.clone(),
        body,
        skip: 0,
        clock: None,
        note: format!(
            "settings of an instrument stand above the columns, which begin with `{label}` in line {}",
            cut.lines[head].number
        ),
    })
}

//! Faults as a person reads them: the line of the file with a caret below, then what was found, expected and what to do.

use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet, normalize_untrusted_str};

use crate::fault::{Fault, Faults, Place};

impl Faults {
    /// A text for each fault; what is still to be filled in comes first, in one text. `coloured`: with the codes of a terminal.
    #[must_use]
    pub fn snippets(&self, coloured: bool) -> Vec<String> {
        let renderer = if coloured {
            Renderer::styled()
        } else {
            Renderer::plain()
        };
        let (gaps, faults): (Vec<&Fault>, Vec<&Fault>) = self.iter().partition(|fault| fault.is_gap);
        let mut texts: Vec<String> = match gaps.as_slice() {
            [] => Vec::new(),
            [only] => vec![rendered(only, &renderer)],
            [first, ..] => vec![gaps_rendered(first, &gaps, &renderer)],
        };
        texts.extend(faults.into_iter().map(|fault| rendered(fault, &renderer)));
        texts
    }
}

/// What is still to be filled in, a line each: a new contract has dozens.
fn gaps_rendered(first: &Fault, gaps: &[&Fault], renderer: &Renderer) -> String {
    let title = format!("{} values are still to be filled in", gaps.len());
    let file = normalize_untrusted_str(&first.file.display().to_string());
    let lines: Vec<(String, String)> = gaps
        .iter()
        .map(|gap| {
            let line = gap
                .line_column()
                .map_or_else(String::new, |(line, _)| format!("line {line}"));
            (line, normalize_untrusted_str(&gap.problem))
        })
        .collect();
    let notes = lines
        .iter()
        .map(|(line, problem)| Level::NOTE.with_name(line.as_str()).message(problem.as_str()));
    let group = Level::ERROR.primary_title(title.as_str()).element(Origin::path(file));
    renderer.render(&[group.elements(notes)])
}

/// One fault.
fn rendered(fault: &Fault, renderer: &Renderer) -> String {
    let title = Level::ERROR.primary_title(fault.problem.as_str());
    // text of a user's file must not move the cursor or colour what follows; title and source are seen to by the printer
    let file = normalize_untrusted_str(&fault.file.display().to_string());
    let group = match &fault.place {
        Place::Span {
            line,
            column,
            text,
            length,
        } => {
            let caret = AnnotationKind::Primary.span(bytes(text, *column, *length));
            let snippet = Snippet::source(text.as_str()).line_start(*line).path(file);
            title.element(snippet.annotation(caret))
        }
        Place::File => title.element(Origin::path(file)),
        Place::Tensor(name) => title.element(Origin::path(format!("{file}: tensor `{}`", name.escape_debug()))),
        _ => Group::with_title(title),
    };
    let notes = [
        (Level::NOTE, "found", &fault.found),
        (Level::NOTE, "expected", &fault.expected),
        (Level::HELP, "hint", &fault.hint),
    ];
    let notes = notes.into_iter().filter_map(|(level, name, text)| {
        Some(level.with_name(name).message(normalize_untrusted_str(text.as_deref()?)))
    });
    renderer.render(&[group.elements(notes)])
}

/// Where `length` characters from a column, counted from 1, lie in a line.
fn bytes(line: &str, column: usize, length: usize) -> Range<usize> {
    let byte = |character: usize| line.char_indices().nth(character).map_or(line.len(), |(byte, _)| byte);
    let start = byte(column.saturating_sub(1));
    start..byte(column.saturating_sub(1) + length).max(start)
}

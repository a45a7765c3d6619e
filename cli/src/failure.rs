//! Why a run could not be done, and the one place that prints it.

use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet, normalize_untrusted_str};
use toml_input::{Fault, Faults, Message, Place};

/// Bad input or an output that cannot be written. Exit code 2, nothing written.
#[derive(Debug)]
pub struct Failure(pub Faults);

impl Failure {
    /// Prints all faults on standard error, with colours where that is a terminal that wants them.
    pub fn print(&self) {
        anstream::eprintln!("{}", self.rendered());
    }

    /// The faults with their lines of source, coloured.
    fn rendered(&self) -> String {
        let (gaps, faults): (Vec<&Fault>, Vec<&Fault>) = self.0.iter().partition(|fault| fault.is_gap);
        let mut texts: Vec<String> = match gaps.as_slice() {
            [] => Vec::new(),
            [only] => vec![rendered(only)],
            [first, ..] => vec![gaps_rendered(first, &gaps)],
        };
        texts.extend(faults.into_iter().map(rendered));
        if texts.len() > 1 {
            texts.push(format!("{} faults; nothing was written", self.0.list.len()));
        }
        texts.join("\n\n")
    }
}

/// What is still to be filled in, a line each: a new contract has dozens.
fn gaps_rendered(first: &Fault, gaps: &[&Fault]) -> String {
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
    Renderer::styled().render(&[group.elements(notes)])
}

/// One fault, coloured.
fn rendered(fault: &Fault) -> String {
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
    // always with colours: the stream takes them out where they do not belong
    Renderer::styled().render(&[group.elements(notes)])
}

/// Where `length` characters from a column, counted from 1, lie in a line.
fn bytes(line: &str, column: usize, length: usize) -> Range<usize> {
    let byte = |character: usize| line.char_indices().nth(character).map_or(line.len(), |(byte, _)| byte);
    let start = byte(column.saturating_sub(1));
    start..byte(column.saturating_sub(1) + length).max(start)
}

/// Errors that are faults with places.
macro_rules! of_faults {
    ($($error:ty),+ $(,)?) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Failure(error.into())
            }
        })+
    };
}

of_faults!(
    Fault,
    Faults,
    Message,
    policy::Faults,
    codegen::CodegenError,
    verify::VerifyError,
);

/// Errors of libraries that know nothing of input files.
macro_rules! of_text {
    ($($error:ty),+ $(,)?) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Message::new(error.to_string()).into()
            }
        })+
    };
}

of_text!(
    std::fmt::Error,
    std::io::Error,
    ctrlc::Error,
    report::ReportError,
    serde_json::Error,
);

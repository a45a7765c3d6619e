//! A TOML file as a tree in which every key and value knows its place.
//!
//! ```text
//! FileName ─► Source ─► Document ─► Table ─► Value ─► f64, &str, ...      each step knows the place in the text
//!   path       text      tree        keys      kind                       what is wrong goes into a Sink
//! ```

use std::path::Path;

use toml::de::DeTable;

use crate::fault::{Fault, Faults, Message};
use crate::messages;
use crate::node::{Entries, entries, texts};
use crate::sink::Sink;
use crate::source::{FileName, Source, Span};
use crate::table::Table;
use crate::value::Value;

/// Largest TOML file in bytes (1 MiB).
pub const MAX_TOML_BYTES: u64 = 1 << 20;
/// Faults shown at most for one file's syntax; what follows is mostly an echo.
pub const MAX_SYNTAX_FAULTS: usize = 8;

/// A parsed TOML file.
#[derive(Debug, Clone)]
pub struct Document {
    source: Source,
    root: Entries,
}

impl Document {
    /// Reads a file, at most [`MAX_TOML_BYTES`] long.
    ///
    /// # Errors
    /// If it cannot be read, is no UTF-8 text or no valid TOML.
    pub fn open(file: impl Into<FileName>) -> Result<Self, Faults> {
        let name: FileName = file.into();
        let bytes = name.read(MAX_TOML_BYTES).map_err(|message| name.fault(message))?;
        Self::sound(Source::new(name, bytes).map_err(|fault| *fault)?)
    }

    /// Reads `text`; `file` only names it in faults.
    ///
    /// # Errors
    /// If it is no valid TOML.
    pub fn from_text(file: &Path, text: &str) -> Result<Self, Faults> {
        Self::sound(Source {
            name: FileName::new(file),
            text: text.to_owned(),
        })
    }

    fn sound(source: Source) -> Result<Self, Faults> {
        let mut faults = Sink::new();
        let document = Self::parse(source, &mut faults);
        faults.propagate().map(|()| document)
    }

    /// Parses `source`; with faults of syntax the document holds what could be recovered.
    pub fn parse(source: Source, faults: &mut Sink) -> Self {
        // recoverable, so that a reader can still tell name and signals of a contract with faults of syntax
        let (tree, errors) = DeTable::parse_recoverable(&source.text);
        let mut found: Vec<Fault> = Vec::new();
        for error in &errors {
            let span = error.span().unwrap_or(0..0);
            let fault = source.fault(&span, syntax(&source.text, &span, error.message()));
            let line = |f: &Fault| f.line_column().map(|(line, _)| line);
            // the parser goes on in the middle of the line and stumbles again over the same slip
            if found.iter().all(|known| line(known) != line(&fault)) {
                found.push(fault);
            }
        }
        faults.extend(found.into_iter().take(MAX_SYNTAX_FAULTS));
        let root = entries(tree.get_ref());
        Document { source, root }
    }

    /// The file by name and text.
    #[must_use]
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// The top level of the file.
    #[must_use]
    pub fn root(&self) -> Table<'_> {
        Table::root(&self.source, &self.root)
    }

    /// What `read` makes of the top level; keys it did not ask for are faults.
    ///
    /// # Errors
    /// All faults, in the order of the file.
    pub fn read<T>(&self, read: impl FnOnce(&mut Table<'_>, &mut Sink) -> Option<T>) -> Result<T, Faults> {
        let mut faults = Sink::new();
        let mut root = self.root();
        let value = read(&mut root, &mut faults);
        root.finish(&mut faults);
        self.conclude(value, faults)
    }

    /// `value` if nothing is wrong.
    ///
    /// # Errors
    /// The faults in the order of the file; a fault as well if there is no value for no reason given.
    pub fn conclude<T>(&self, value: Option<T>, faults: Sink) -> Result<T, Faults> {
        faults.conclude(value, || self.source.name.fault(messages::incomplete()))
    }

    /// Every text of the file, wherever it stands, with its place.
    #[must_use]
    pub fn texts(&self) -> Vec<(&str, &Span)> {
        let mut found = Vec::new();
        self.root.iter().for_each(|(_, value)| texts(value, &mut found));
        found
    }

    /// A fault at `span` of the text.
    #[must_use]
    pub fn fault(&self, span: &Span, message: Message) -> Fault {
        self.source.fault(span, message)
    }

    /// Looks up a path of keys without a fault and without recording it as read.
    #[must_use]
    pub fn peek(&self, path: &[&str]) -> Option<Value<'_>> {
        let (first, rest) = path.split_first()?;
        let value = Value::find(&self.source, &self.root, first)?;
        rest.iter().try_fold(value, |value, key| value.peek(key))
    }
}

fn syntax(text: &str, span: &Span, message: &str) -> Message {
    let bytes = text.as_bytes();
    let digit = |index: Option<usize>| index.and_then(|i| bytes.get(i)).is_some_and(u8::is_ascii_digit);
    // to the parser `1,5` is a 1 with something behind it: the comma lies in the span of its complaint, or at its end
    let comma = (span.start..=span.end).find(|&i| bytes.get(i) == Some(&b','));
    let between_digits = |i: usize| digit(i.checked_sub(1)) && digit(Some(i + 1));
    // the zero of 0,05 stands behind the comma
    let leading_zero = bytes.get(span.start) == Some(&b'0') && span.start > 0 && between_digits(span.start - 1);
    messages::syntax(
        message,
        comma.is_some_and(between_digits) || (leading_zero && bytes[span.start - 1] == b','),
    )
}

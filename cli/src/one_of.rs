//! A word of a list on the command line: the help shows the list, and a word that is not in it gets the same answer as
//! one in a file.

use std::ffi::OsStr;

use clap::builder::{PossibleValue, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, Command, Error};
use toml_input::{Fault, messages};

/// Reads one of a list of words.
#[derive(Debug, Clone)]
pub struct OneOf<T> {
    kind: &'static str,
    /// Word, meaning, value.
    list: Vec<(&'static str, &'static str, T)>,
}

impl<T> OneOf<T> {
    /// Words with their meanings and values; `kind` is what they are in faults, such as `output`.
    pub fn new(kind: &'static str, list: impl IntoIterator<Item = (&'static str, &'static str, T)>) -> Self {
        OneOf {
            kind,
            list: list.into_iter().collect(),
        }
    }
}

impl<T: Clone + Send + Sync + 'static> TypedValueParser for OneOf<T> {
    type Value = T;

    fn parse_ref(&self, _: &Command, _: Option<&Arg>, value: &OsStr) -> Result<T, Error> {
        let text = value.to_string_lossy();
        let found = self.list.iter().find(|(word, ..)| *word == text);
        found.map(|(.., value)| value.clone()).ok_or_else(|| {
            let words: Vec<&str> = self.list.iter().map(|(word, ..)| *word).collect();
            let fault = Fault::from(messages::unknown(self.kind, &text, &words)).to_string();
            // clap writes the same label in front
            let text = fault.strip_prefix("error: ").unwrap_or(&fault);
            Error::raw(ErrorKind::InvalidValue, text)
        })
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let row = |(word, meaning, _): &(&'static str, &'static str, T)| PossibleValue::new(*word).help(*meaning);
        Some(Box::new(self.list.iter().map(row)))
    }
}

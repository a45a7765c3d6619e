//! A table that remembers which keys were asked for.

use crate::fault::{Fault, Message};
use crate::messages;
use crate::node::{At, Entries, Node};
use crate::sink::Sink;
use crate::source::{Source, Span};
use crate::value::Value;

/// A table being read: every key asked for is known, what is left over at the end is a fault.
pub struct Table<'a> {
    source: &'a Source,
    entries: &'a [(At<String>, At<Node>)],
    /// Nothing for the top level and for a table that the file leaves out.
    span: Option<Span>,
    title: String,
    known: Vec<&'static str>,
}

impl<'a> Table<'a> {
    pub(crate) fn root(source: &'a Source, entries: &'a Entries) -> Self {
        Self::new(source, entries, None, "")
    }

    pub(crate) fn new(
        source: &'a Source,
        entries: &'a [(At<String>, At<Node>)],
        span: Option<Span>,
        title: &str,
    ) -> Self {
        Table {
            source,
            entries,
            span,
            title: title.to_owned(),
            known: Vec::new(),
        }
    }

    /// The value of `key`, if present.
    pub fn optional(&mut self, key: &'static str) -> Option<Value<'a>> {
        // also where the key is missing: the list of known keys is what an unknown one is compared with
        self.known.push(key);
        Value::find(self.source, self.entries, key)
    }

    /// The value of `key`; a fault with `hint` if it is missing.
    pub fn required(&mut self, key: &'static str, hint: &str, faults: &mut Sink) -> Option<Value<'a>> {
        let value = self.optional(key);
        if value.is_none() {
            faults.push(self.fault(messages::missing_key(key, &self.title, hint)));
        }
        value
    }

    /// What `read` makes of the value of `key`; `default` if it is missing, or faulty, which has left a fault.
    pub fn with_default<T>(
        &mut self,
        key: &'static str,
        default: T,
        faults: &mut Sink,
        read: impl FnOnce(&Value<'a>, &mut Sink) -> Option<T>,
    ) -> T {
        let value = self.optional(key);
        value.and_then(|value| read(&value, faults)).unwrap_or(default)
    }

    /// What `read` makes of the table `[key]`; one that is left out reads as an empty one.
    pub fn section<T>(
        &mut self,
        key: &'static str,
        faults: &mut Sink,
        read: impl FnOnce(&mut Table<'a>, &mut Sink) -> Option<T>,
    ) -> Option<T> {
        let title = format!("[{key}]");
        let mut table = match self.optional(key) {
            Some(value) => value.table(&title, faults)?,
            // so its required keys are missing with their own hints, instead of one fault for the section
            None => Table::new(self.source, &[], None, &title),
        };
        let result = read(&mut table, faults);
        table.finish(faults);
        result
    }

    /// What `read` makes of each table of the array `[[key]]`, without the faulty ones; none if it is left out.
    pub fn sections<T>(
        &mut self,
        key: &'static str,
        faults: &mut Sink,
        read: impl Fn(&mut Table<'a>, &mut Sink) -> Option<T>,
    ) -> Vec<T> {
        let title = format!("[[{key}]]");
        let items = self
            .optional(key)
            .and_then(|value| value.list(&format!("{title} tables"), faults))
            .unwrap_or_default();
        let one = |item: &Value<'a>| item.read_table(&title, faults, &read);
        items.iter().filter_map(one).collect()
    }

    /// A fault of the table as a whole.
    #[must_use]
    pub fn fault(&self, message: Message) -> Fault {
        match &self.span {
            Some(span) => self.source.fault(span, message),
            None => self.source.name.fault(message),
        }
    }

    /// How many keys there are, known or not.
    #[must_use]
    pub fn count(&self) -> usize {
        self.entries.len()
    }

    /// Reports keys nobody asked for.
    pub fn finish(self, faults: &mut Sink) {
        self.finish_with(faults, |_| None);
    }

    /// Reports keys nobody asked for; `hint` may know better than the nearest key what is meant.
    pub fn finish_with(self, faults: &mut Sink, hint: impl Fn(&str) -> Option<String>) {
        for (key, _) in self.entries {
            if !self.known.contains(&key.value.as_str()) {
                let message = messages::unknown_key(&key.value, &self.title, &self.known);
                faults.push(self.source.fault(&key.span, message.maybe_hint(hint(&key.value))));
            }
        }
    }
}

//! A value that knows its key and its place.

use std::fmt::Display;
use std::ops::RangeInclusive;

use crate::fault::{Fault, Message};
use crate::messages;
use crate::node::{At, Node};
use crate::sink::Sink;
use crate::source::{Source, Span};
use crate::table::Table;

/// A value being read. The readers (`number`, `text`, ...) return nothing where they leave a fault; `peek`, `as_text`
/// and `is_...` look without one.
#[derive(Clone)]
pub struct Value<'a> {
    source: &'a Source,
    label: String,
    node: &'a At<Node>,
}

impl<'a> Value<'a> {
    pub(crate) fn new(source: &'a Source, label: &str, node: &'a At<Node>) -> Self {
        Value {
            source,
            label: label.to_owned(),
            node,
        }
    }

    pub(crate) fn find(source: &'a Source, entries: &'a [(At<String>, At<Node>)], key: &str) -> Option<Self> {
        let (name, node) = entries.iter().find(|(name, _)| name.value == key)?;
        Some(Value::new(source, &name.value, node))
    }

    /// The same value, called `label` in faults.
    #[must_use]
    pub fn labelled(self, label: &str) -> Self {
        Value::new(self.source, label, self.node)
    }

    /// The key the value belongs to, as faults call it.
    #[must_use]
    pub fn label(&self) -> &str {
        &self.label
    }

    /// The file the value stands in.
    #[must_use]
    pub fn source(&self) -> &'a Source {
        self.source
    }

    /// The value's bytes in the text of the document.
    #[must_use]
    pub fn span(&self) -> &'a Span {
        &self.node.span
    }

    /// A fault of this value.
    #[must_use]
    pub fn fault(&self, message: Message) -> Fault {
        self.source.fault(&self.node.span, message)
    }

    /// A fault of the bytes `range` of a text; of the whole value if the text is written with escapes.
    #[must_use]
    pub fn fault_within(&self, range: &Span, message: Message) -> Fault {
        let span = &self.node.span;
        let raw = self.source.text.get(span.clone()).unwrap_or_default();
        match raw.get(1..raw.len().saturating_sub(1)) {
            // an escape is longer in the file than in the text, and every place behind it would be wrong
            Some(inner) if Some(inner) == self.as_text() => {
                let first = span.start + 1;
                self.source.fault(&(first + range.start..first + range.end), message)
            }
            _ => self.fault(message),
        }
    }

    /// The value of `key`, if this is a table that has it.
    #[must_use]
    pub fn peek(&self, key: &str) -> Option<Value<'a>> {
        match &self.node.value {
            Node::Table(entries) => Value::find(self.source, entries, key),
            _ => None,
        }
    }

    /// The text as it stands there, if this is one.
    #[must_use]
    pub fn as_text(&self) -> Option<&'a str> {
        match &self.node.value {
            Node::Text(text) => Some(text),
            _ => None,
        }
    }

    /// `true` or `false`, if this is one.
    #[must_use]
    pub fn as_boolean(&self) -> Option<bool> {
        match self.node.value {
            Node::Boolean(value) => Some(value),
            _ => None,
        }
    }

    /// The elements, if this is an array.
    #[must_use]
    pub fn as_list(&self) -> Option<Vec<Value<'a>>> {
        match &self.node.value {
            Node::List(items) => {
                let item = |node| Value::new(self.source, &self.label, node);
                Some(items.iter().map(item).collect())
            }
            _ => None,
        }
    }

    /// Whether this is a table.
    #[must_use]
    pub fn is_table(&self) -> bool {
        matches!(self.node.value, Node::Table(_))
    }

    fn wrong(&self, expected: &str, faults: &mut Sink) {
        let message = match &self.node.value {
            // not wrong, only not filled in yet: a new contract has many of them
            Node::Text(text) if is_todo(text) => messages::still_todo(&self.label, expected),
            found => messages::wrong_type(&self.label, &describe(found), expected),
        };
        faults.push(self.fault(message));
    }

    fn out_of_range(&self, found: impl Display, expected: &str, faults: &mut Sink) {
        faults.push(self.fault(messages::out_of_range(&self.label, &found.to_string(), expected)));
    }

    /// A finite number; integers are accepted.
    pub fn number(&self, faults: &mut Sink) -> Option<f64> {
        match &self.node.value {
            Node::Float(value) if value.is_finite() => Some(*value),
            Node::Float(value) => {
                faults.push(self.fault(messages::not_finite(&self.label, *value)));
                None
            }
            Node::Integer(Some(value)) => Some(*value as f64),
            _ => {
                self.wrong("a number", faults);
                None
            }
        }
    }

    /// A number within `range`; an end of `f64::MIN` or `f64::MAX` stands for none.
    pub fn number_within(&self, range: RangeInclusive<f64>, faults: &mut Sink) -> Option<f64> {
        let number = self.number(faults)?;
        if range.contains(&number) {
            return Some(number);
        }
        let (low, high) = range.into_inner();
        let expected = match (low == f64::MIN, high == f64::MAX) {
            (_, true) => format!("at least {low}"),
            (true, false) => format!("at most {high}"),
            (false, false) => format!("{low} to {high}"),
        };
        self.out_of_range(number, &expected, faults);
        None
    }

    /// A number above 0.
    pub fn positive(&self, faults: &mut Sink) -> Option<f64> {
        let number = self.number(faults)?;
        if number > 0.0 {
            return Some(number);
        }
        faults.push(self.fault(messages::not_positive(&self.label, number)));
        None
    }

    /// A whole number within `range`.
    pub fn integer<T>(&self, range: RangeInclusive<T>, faults: &mut Sink) -> Option<T>
    where
        T: TryFrom<i64> + PartialOrd + Display,
    {
        let expected = format!("{} to {}", range.start(), range.end());
        let Node::Integer(Some(value)) = self.node.value else {
            self.wrong(&format!("a whole number, {expected}"), faults);
            return None;
        };
        let number = T::try_from(value).ok().filter(|number| range.contains(number));
        if number.is_none() {
            self.out_of_range(value, &expected, faults);
        }
        number
    }

    /// A text that is not a placeholder (`"TODO"`).
    pub fn text(&self, faults: &mut Sink) -> Option<&'a str> {
        let text = self.as_text().filter(|text| !is_todo(text));
        if text.is_none() {
            self.wrong("a text in quotes", faults);
        }
        text
    }

    /// A text that is one of `choices`, and what it stands for.
    pub fn choice<T: Clone>(&self, choices: &[(&str, T)], faults: &mut Sink) -> Option<T> {
        let text = self.text(faults)?;
        if let Some((_, meaning)) = choices.iter().find(|(word, _)| *word == text) {
            return Some(meaning.clone());
        }
        let words: Vec<&str> = choices.iter().map(|(word, _)| *word).collect();
        faults.push(self.fault(messages::not_one_of(&self.label, text, &words)));
        None
    }

    /// `true` or `false`.
    pub fn boolean(&self, faults: &mut Sink) -> Option<bool> {
        if let Node::Boolean(value) = self.node.value {
            return Some(value);
        }
        self.wrong("true or false", faults);
        None
    }

    /// The elements of an array; `expected` says what an array is wanted.
    pub fn list(&self, expected: &str, faults: &mut Sink) -> Option<Vec<Value<'a>>> {
        let list = self.as_list();
        if list.is_none() {
            self.wrong(expected, faults);
        }
        list
    }

    /// What `read` makes of each element of an array; nothing if one is faulty.
    pub fn each<T>(
        &self,
        expected: &str,
        faults: &mut Sink,
        read: impl Fn(&Value<'a>, &mut Sink) -> Option<T>,
    ) -> Option<Vec<T>> {
        let items = self.list(expected, faults)?;
        // all are read before one that is missing ends it, so that all faults are found
        let read: Vec<_> = items.iter().map(|item| read(item, faults)).collect();
        read.into_iter().collect()
    }

    /// Two numbers within `range`.
    pub fn pair(&self, range: RangeInclusive<f64>, faults: &mut Sink) -> Option<[f64; 2]> {
        self.two("two numbers", range, faults)
    }

    /// `[low, high]` with `low <= high`.
    pub fn interval(&self, faults: &mut Sink) -> Option<[f64; 2]> {
        self.interval_within(f64::MIN..=f64::MAX, faults)
    }

    /// `[low, high]` with `low <= high`, both within `range`.
    pub fn interval_within(&self, range: RangeInclusive<f64>, faults: &mut Sink) -> Option<[f64; 2]> {
        let [low, high] = self.two("two numbers: [low, high]", range, faults)?;
        if low <= high {
            return Some([low, high]);
        }
        faults.push(self.fault(messages::crossed(&self.label, low, high)));
        None
    }

    fn two(&self, expected: &str, range: RangeInclusive<f64>, faults: &mut Sink) -> Option<[f64; 2]> {
        // all numbers before their count: of two slips in one array both are said
        let items = self.list(expected, faults)?;
        let numbers: Vec<_> = items
            .iter()
            .map(|item| item.number_within(range.clone(), faults))
            .collect();
        let [a, b] = numbers.as_slice() else {
            faults.push(self.fault(messages::wrong_length(&self.label, items.len(), expected)));
            return None;
        };
        Some([(*a)?, (*b)?])
    }

    /// The table, to be finished by the caller; `title` as the user knows it, such as `[network]`.
    pub fn table(&self, title: &str, faults: &mut Sink) -> Option<Table<'a>> {
        let Node::Table(entries) = &self.node.value else {
            self.wrong("a table", faults);
            return None;
        };
        Some(Table::new(self.source, entries, Some(self.node.span.clone()), title))
    }

    /// All keys and values of a table whose keys the user chooses.
    pub fn pairs(&self, faults: &mut Sink) -> Option<Vec<(&'a At<String>, Value<'a>)>> {
        let Node::Table(entries) = &self.node.value else {
            self.wrong("a table", faults);
            return None;
        };
        let pair = |(key, node): &'a (At<String>, _)| (key, Value::new(self.source, &key.value, node));
        Some(entries.iter().map(pair).collect())
    }

    /// What `read` makes of the table; keys it did not ask for are faults.
    pub fn read_table<T>(
        &self,
        title: &str,
        faults: &mut Sink,
        read: impl FnOnce(&mut Table<'a>, &mut Sink) -> Option<T>,
    ) -> Option<T> {
        let mut table = self.table(title, faults)?;
        let result = read(&mut table, faults);
        table.finish(faults);
        result
    }
}

fn is_todo(text: &str) -> bool {
    text.trim_start().starts_with("TODO")
}

fn describe(node: &Node) -> String {
    match node {
        Node::Text(text) => format!(
            "the text \"{}\"",
            text.chars().take(40).collect::<String>().escape_debug()
        ),
        Node::Integer(Some(value)) => format!("the whole number {value}"),
        Node::Integer(None) => "a whole number beyond 64 bits".to_owned(),
        Node::Float(value) => format!("the number {value}"),
        Node::Boolean(value) => value.to_string(),
        Node::Date => "a date".to_owned(),
        Node::List(items) => format!("an array of {}", items.len()),
        Node::Table(_) => "a table".to_owned(),
    }
}

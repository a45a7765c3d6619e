//! TOML as a tree with places, and a reader that remembers which keys were asked for.

use toml::de::{DeTable, DeValue};

use crate::catalogue;
use crate::faults::{Fault, Message};
use crate::limits;
use crate::model::Interval;
use crate::source::{Source, Span};

/// A value and where it stands.
#[derive(Debug, Clone)]
pub(crate) struct At<T> {
    pub value: T,
    pub span: Span,
}

/// A TOML value; numbers are kept as far as they can be represented.
#[derive(Debug, Clone)]
pub(crate) enum Node {
    Text(String),
    Integer(Option<i64>),
    Float(f64),
    Boolean(bool),
    Date,
    List(Vec<At<Node>>),
    Table(Vec<(At<String>, At<Node>)>),
}

/// A parsed TOML file.
#[derive(Debug, Clone)]
pub(crate) struct Document {
    pub source: Source,
    root: Vec<(At<String>, At<Node>)>,
}

impl Document {
    /// Parses `source`; with faults of syntax the document holds what could be recovered.
    pub fn parse(source: Source) -> (Document, Vec<Fault>) {
        let (tree, errors) = DeTable::parse_recoverable(&source.text);
        let mut faults: Vec<Fault> = Vec::new();
        for error in &errors {
            let span = error.span().unwrap_or(0..0);
            let fault = source.fault(&span, syntax(&source.text, &span, error.message()));
            let line = |f: &Fault| f.line_column().map(|(line, _)| line);
            if faults.iter().all(|known| line(known) != line(&fault)) {
                faults.push(fault);
            }
        }
        faults.truncate(limits::MAX_SYNTAX_FAULTS);
        let root = entries(tree.get_ref());
        (Document { source, root }, faults)
    }

    /// The top level of the file.
    pub fn root(&self) -> Section<'_> {
        Section {
            doc: self,
            entries: &self.root,
            span: None,
            title: String::new(),
            known: Vec::new(),
        }
    }

    pub fn fault(&self, span: &Span, message: Message) -> Fault {
        self.source.fault(span, message)
    }

    /// Looks up a path of keys without recording it as read.
    pub fn peek(&self, path: &[&str]) -> Option<&At<Node>> {
        let (first, rest) = path.split_first()?;
        let mut node = find(&self.root, first)?;
        for key in rest {
            let Node::Table(entries) = &node.value else { return None };
            node = find(entries, key)?;
        }
        Some(node)
    }
}

fn find<'a>(entries: &'a [(At<String>, At<Node>)], key: &str) -> Option<&'a At<Node>> {
    entries.iter().find(|(name, _)| name.value == key).map(|(_, node)| node)
}

fn entries(table: &DeTable<'_>) -> Vec<(At<String>, At<Node>)> {
    let mut list: Vec<_> = table
        .iter()
        .map(|(key, value)| {
            let key = At {
                value: key.get_ref().to_string(),
                span: key.span(),
            };
            (
                key,
                At {
                    value: node(value.get_ref()),
                    span: value.span(),
                },
            )
        })
        .collect();
    list.sort_by_key(|(key, _)| key.span.start);
    list
}

fn node(value: &DeValue<'_>) -> Node {
    match value {
        DeValue::String(text) => Node::Text(text.to_string()),
        DeValue::Integer(number) => Node::Integer(i64::from_str_radix(number.as_str(), number.radix()).ok()),
        DeValue::Float(number) => Node::Float(number.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(value) => Node::Boolean(*value),
        DeValue::Datetime(_) => Node::Date,
        DeValue::Array(list) => Node::List(
            list.iter()
                .map(|v| At {
                    value: node(v.get_ref()),
                    span: v.span(),
                })
                .collect(),
        ),
        DeValue::Table(table) => Node::Table(entries(table)),
    }
}

fn syntax(text: &str, span: &Span, message: &str) -> Message {
    let bytes = text.as_bytes();
    let digit = |index: Option<usize>| index.and_then(|i| bytes.get(i)).is_some_and(u8::is_ascii_digit);
    let comma = (span.start..=span.end).find(|&i| bytes.get(i) == Some(&b','));
    let decimal = comma.is_some_and(|i| digit(i.checked_sub(1)) && digit(Some(i + 1)));
    catalogue::syntax(message, decimal)
}

/// A table being read: every key asked for is known, what is left over at the end is a fault.
pub(crate) struct Section<'a> {
    pub doc: &'a Document,
    entries: &'a [(At<String>, At<Node>)],
    span: Option<Span>,
    title: String,
    known: Vec<&'static str>,
}

impl<'a> Section<'a> {
    /// The value of `key`, if present.
    pub fn optional(&mut self, key: &'static str) -> Option<Value<'a>> {
        self.known.push(key);
        let node = find(self.entries, key)?;
        Some(Value {
            doc: self.doc,
            label: key.to_owned(),
            node,
        })
    }

    /// The value of `key`; a fault with `hint` if it is missing.
    pub fn required(&mut self, key: &'static str, hint: &str, faults: &mut Vec<Fault>) -> Option<Value<'a>> {
        let value = self.optional(key);
        if value.is_none() {
            faults.push(self.fault(catalogue::missing_key(key, &self.title, hint)));
        }
        value
    }

    /// A fault about the table as a whole.
    pub fn fault(&self, message: Message) -> Fault {
        match &self.span {
            Some(span) => self.doc.fault(span, message),
            None => self.doc.source.name.fault(message),
        }
    }

    /// All entries, for tables whose keys the user chooses.
    pub fn pairs(&self) -> impl Iterator<Item = (&'a At<String>, Value<'a>)> + use<'a> {
        let doc = self.doc;
        self.entries.iter().map(move |(key, node)| {
            (
                key,
                Value {
                    doc,
                    label: key.value.clone(),
                    node,
                },
            )
        })
    }

    /// Reports keys nobody asked for.
    pub fn finish(self, faults: &mut Vec<Fault>) {
        for (key, _) in self.entries {
            if !self.known.contains(&key.value.as_str()) {
                faults.push(
                    self.doc
                        .fault(&key.span, catalogue::unknown_key(&key.value, &self.title, &self.known)),
                );
            }
        }
    }
}

/// A value being read, with the key it belongs to.
#[derive(Clone)]
pub(crate) struct Value<'a> {
    pub doc: &'a Document,
    pub label: String,
    pub node: &'a At<Node>,
}

impl<'a> Value<'a> {
    pub fn fault(&self, message: Message) -> Fault {
        self.doc.fault(&self.node.span, message)
    }

    fn at<T>(&self, value: T) -> At<T> {
        At {
            value,
            span: self.node.span.clone(),
        }
    }

    fn wrong(&self, expected: &str, faults: &mut Vec<Fault>) {
        let message = match &self.node.value {
            Node::Text(text) if is_todo(text) => catalogue::still_todo(&self.label, expected),
            found => catalogue::wrong_type(&self.label, &describe(found), expected),
        };
        faults.push(self.fault(message));
    }

    /// A finite number; integers are accepted.
    pub fn number(&self, faults: &mut Vec<Fault>) -> Option<At<f64>> {
        match &self.node.value {
            Node::Float(value) if value.is_finite() => Some(self.at(*value)),
            Node::Float(value) => {
                faults.push(self.fault(catalogue::not_finite(&self.label, *value)));
                None
            }
            Node::Integer(Some(value)) => Some(self.at(*value as f64)),
            _ => {
                self.wrong("a number", faults);
                None
            }
        }
    }

    /// An integer within `low..=high`.
    pub fn integer(&self, low: i64, high: i64, faults: &mut Vec<Fault>) -> Option<At<i64>> {
        match &self.node.value {
            Node::Integer(Some(value)) if (low..=high).contains(value) => Some(self.at(*value)),
            Node::Integer(Some(value)) => {
                let expected = format!("{low} to {high}");
                faults.push(self.fault(catalogue::out_of_range(&self.label, &value.to_string(), &expected)));
                None
            }
            _ => {
                self.wrong(&format!("a whole number, {low} to {high}"), faults);
                None
            }
        }
    }

    /// A text that is not a placeholder.
    pub fn text(&self, faults: &mut Vec<Fault>) -> Option<At<&'a str>> {
        match &self.node.value {
            Node::Text(text) if !is_todo(text) => Some(At {
                value: text.as_str(),
                span: self.node.span.clone(),
            }),
            _ => {
                self.wrong("a text in quotes", faults);
                None
            }
        }
    }

    pub fn boolean(&self, faults: &mut Vec<Fault>) -> Option<bool> {
        if let Node::Boolean(value) = self.node.value {
            return Some(value);
        }
        self.wrong("true or false", faults);
        None
    }

    /// The elements of an array.
    pub fn list(&self, expected: &str, faults: &mut Vec<Fault>) -> Option<Vec<Value<'a>>> {
        let Node::List(items) = &self.node.value else {
            self.wrong(expected, faults);
            return None;
        };
        let doc = self.doc;
        Some(
            items
                .iter()
                .map(|node| Value {
                    doc,
                    label: self.label.clone(),
                    node,
                })
                .collect(),
        )
    }

    /// The table as a section; `title` as the user knows it, such as `[network]`.
    pub fn section(&self, title: &str, faults: &mut Vec<Fault>) -> Option<Section<'a>> {
        let Node::Table(entries) = &self.node.value else {
            self.wrong("a table", faults);
            return None;
        };
        let span = Some(self.node.span.clone());
        Some(Section {
            doc: self.doc,
            entries,
            span,
            title: title.to_owned(),
            known: Vec::new(),
        })
    }

    /// `[low, high]` with `low <= high`.
    pub fn interval(&self, faults: &mut Vec<Fault>) -> Option<At<Interval>> {
        const EXPECTED: &str = "two numbers: [low, high]";
        let items = self.list(EXPECTED, faults)?;
        let numbers: Vec<_> = items.iter().map(|item| item.number(faults)).collect();
        let [low, high] = numbers.as_slice() else {
            faults.push(self.fault(catalogue::wrong_length(&self.label, items.len(), EXPECTED)));
            return None;
        };
        let (low, high) = (low.as_ref()?.value, high.as_ref()?.value);
        if low > high {
            faults.push(self.fault(catalogue::crossed(&self.label, low, high)));
            return None;
        }
        Some(self.at(Interval { low, high }))
    }

    /// Span of `range` (bytes of the text value) in the file; the whole value if the text is written with escapes.
    pub fn inner_span(&self, text: &str, range: &Span) -> Span {
        let span = &self.node.span;
        let raw = self.doc.source.text.get(span.clone()).unwrap_or_default();
        match raw.get(1..raw.len().saturating_sub(1)) {
            Some(inner) if inner == text => span.start + 1 + range.start..span.start + 1 + range.end,
            _ => span.clone(),
        }
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

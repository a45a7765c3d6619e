//! The tree of a TOML file, in which every key and value knows its place.

use toml::de::{DeTable, DeValue};

use crate::source::Span;

/// Something and where it stands.
#[derive(Debug, Clone)]
pub struct At<T> {
    /// The thing.
    pub value: T,
    /// Its bytes in the text of the document.
    pub span: Span,
}

/// Keys and values in the order of the file.
pub(crate) type Entries = Vec<(At<String>, At<Node>)>;

/// A TOML value; numbers are kept as far as they can be represented.
#[derive(Debug, Clone)]
pub(crate) enum Node {
    Text(String),
    Integer(Option<i64>),
    Float(f64),
    Boolean(bool),
    Date,
    List(Vec<At<Node>>),
    Table(Entries),
}

pub(crate) fn entries(table: &DeTable<'_>) -> Entries {
    let mut list: Entries = table
        .iter()
        .map(|(key, value)| (at(key.get_ref().to_string(), key.span()), node(value)))
        .collect();
    // the parser's map does not keep the order of the file, in which faults have to come
    list.sort_by_key(|(key, _)| key.span.start);
    list
}

/// Adds every text of a value to `found`, in the order of the file.
pub(crate) fn texts<'a>(value: &'a At<Node>, found: &mut Vec<(&'a str, &'a Span)>) {
    match &value.value {
        Node::Text(text) => found.push((text, &value.span)),
        Node::List(items) => items.iter().for_each(|item| texts(item, found)),
        Node::Table(entries) => entries.iter().for_each(|(_, value)| texts(value, found)),
        Node::Integer(_) | Node::Float(_) | Node::Boolean(_) | Node::Date => {}
    }
}

fn at<T>(value: T, span: Span) -> At<T> {
    At { value, span }
}

fn node(value: &toml::Spanned<DeValue<'_>>) -> At<Node> {
    let node = match value.get_ref() {
        DeValue::String(text) => Node::Text(text.to_string()),
        // beyond 64 bits it is nothing here; who reads it says so at its place
        DeValue::Integer(number) => Node::Integer(i64::from_str_radix(number.as_str(), number.radix()).ok()),
        DeValue::Float(number) => Node::Float(number.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(value) => Node::Boolean(*value),
        DeValue::Datetime(_) => Node::Date,
        DeValue::Array(list) => Node::List(list.iter().map(node).collect()),
        DeValue::Table(table) => Node::Table(entries(table)),
    };
    at(node, value.span())
}

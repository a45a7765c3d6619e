//! TOML with places: a table that remembers which keys were asked for, and values that know where they stand.

use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::faults::{Fault, Place};

/// The text of a file, for the places of faults.
#[derive(Clone, Copy)]
pub(super) struct Text<'a> {
    pub file: &'a Path,
    pub text: &'a str,
}

impl Text<'_> {
    /// `fault` at a stretch of bytes of this text.
    pub fn at(self, span: &Range<usize>, fault: Fault) -> Fault {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        let start = before.rfind('\n').map_or(0, |at| at + 1);
        let line = self.text[start..].lines().next().unwrap_or_default();
        let inside = self.text.get(span.clone()).unwrap_or_default();
        let length = inside.lines().next().unwrap_or_default().chars().count();
        let place = Place {
            line: before.matches('\n').count() + 1,
            column: before[start..].chars().count() + 1,
            length: length.max(1),
            text: line.to_owned(),
        };
        Fault {
            file: self.file.to_owned(),
            place: Some(place),
            ..fault
        }
    }

    /// `fault` of the file as a whole.
    pub fn whole(self, fault: Fault) -> Fault {
        Fault {
            file: self.file.to_owned(),
            ..fault
        }
    }
}

/// A table being read.
pub(super) struct Table<'a> {
    pub text: Text<'a>,
    /// Nothing stands for an empty table.
    table: Option<&'a DeTable<'a>>,
    span: Option<Range<usize>>,
    /// As the user knows it: `[learning]`; empty for the top level.
    title: String,
    known: Vec<&'static str>,
}

/// A value being read.
#[derive(Clone)]
pub(super) struct Value<'a> {
    pub text: Text<'a>,
    pub label: String,
    node: &'a Spanned<DeValue<'a>>,
}

pub(super) type FaultList = Vec<Fault>;

impl<'a> Table<'a> {
    pub fn root(text: Text<'a>, table: &'a DeTable<'a>) -> Self {
        Self {
            text,
            table: Some(table),
            span: None,
            title: String::new(),
            known: Vec::new(),
        }
    }

    /// A table that the file leaves out.
    pub fn empty(&self, title: &str) -> Self {
        Self {
            text: self.text,
            table: None,
            span: None,
            title: title.to_owned(),
            known: Vec::new(),
        }
    }

    pub fn optional(&mut self, key: &'static str) -> Option<Value<'a>> {
        self.known.push(key);
        Some(Value {
            text: self.text,
            label: key.to_owned(),
            node: self.table?.get(key)?,
        })
    }

    pub fn required(&mut self, key: &'static str, hint: &str, faults: &mut FaultList) -> Option<Value<'a>> {
        let value = self.optional(key);
        if value.is_none() {
            let place = self.place_text();
            faults.push(self.fault(Fault::new(format!("`{key}` is missing {place}")).hint(hint)));
        }
        value
    }

    /// A fault of the table as a whole.
    pub fn fault(&self, fault: Fault) -> Fault {
        match &self.span {
            Some(span) => self.text.at(span, fault),
            None => self.text.whole(fault),
        }
    }

    /// Reports keys that nobody asked for.
    pub fn finish(self, faults: &mut FaultList) {
        for (key, _) in self.table.into_iter().flatten() {
            let name: &str = key.get_ref();
            if !self.known.contains(&name) {
                let place = self.place_text();
                let fault = Fault::new(format!("unknown key `{}` {place}", name.escape_debug()))
                    .expected(format!("one of {}", self.known.join(", ")));
                let fault = match nearest(name, &self.known) {
                    Some(near) => fault.hint(format!("did you mean `{near}`?")),
                    None => fault,
                };
                faults.push(self.text.at(&key.span(), fault));
            }
        }
    }

    fn place_text(&self) -> String {
        if self.title.is_empty() {
            "at the top level".to_owned()
        } else {
            format!("in {}", self.title)
        }
    }
}

impl<'a> Value<'a> {
    pub fn fault(&self, fault: Fault) -> Fault {
        self.text.at(&self.node.span(), fault)
    }

    fn wrong(&self, expected: &str, faults: &mut FaultList) {
        let found = match self.node.get_ref() {
            DeValue::String(text) => format!("the text \"{}\"", text.escape_debug()),
            DeValue::Integer(number) => format!("the whole number {}", number.as_str()),
            DeValue::Float(number) => format!("the number {}", number.as_str()),
            DeValue::Boolean(value) => value.to_string(),
            DeValue::Datetime(_) => "a date".to_owned(),
            DeValue::Array(list) => format!("an array of {}", list.len()),
            DeValue::Table(_) => "a table".to_owned(),
        };
        let fault = Fault::new(format!("`{}` is of the wrong kind", self.label));
        faults.push(self.fault(fault.found(found).expected(expected)));
    }

    /// A finite number within `[low, high]`.
    pub fn number(&self, low: f64, high: f64, faults: &mut FaultList) -> Option<f64> {
        let number: f64 = match self.node.get_ref() {
            DeValue::Float(number) => number.as_str().parse().unwrap_or(f64::NAN),
            DeValue::Integer(number) => {
                i64::from_str_radix(number.as_str(), number.radix()).map_or(f64::NAN, |number| number as f64)
            }
            _ => {
                self.wrong("a number", faults);
                return None;
            }
        };
        if (low..=high).contains(&number) {
            return Some(number);
        }
        self.out_of_range(&number.to_string(), &expected_range(low, high), faults);
        None
    }

    /// A number above 0.
    pub fn positive(&self, faults: &mut FaultList) -> Option<f64> {
        let number = self.number(f64::MIN, f64::MAX, faults)?;
        if number > 0.0 {
            return Some(number);
        }
        self.out_of_range(&number.to_string(), "more than 0", faults);
        None
    }

    /// A whole number within `[low, high]`.
    pub fn integer(&self, low: u64, high: u64, faults: &mut FaultList) -> Option<u64> {
        let DeValue::Integer(number) = self.node.get_ref() else {
            self.wrong("a whole number", faults);
            return None;
        };
        match u64::from_str_radix(number.as_str(), number.radix()) {
            Ok(value) if (low..=high).contains(&value) => Some(value),
            _ => {
                self.out_of_range(number.as_str(), &format!("{low} to {high}"), faults);
                None
            }
        }
    }

    pub fn count(&self, low: usize, high: usize, faults: &mut FaultList) -> Option<usize> {
        let number = self.integer(low as u64, high as u64, faults)?;
        usize::try_from(number).ok()
    }

    pub fn boolean(&self, faults: &mut FaultList) -> Option<bool> {
        if let DeValue::Boolean(value) = self.node.get_ref() {
            return Some(*value);
        }
        self.wrong("true or false", faults);
        None
    }

    pub fn string(&self, faults: &mut FaultList) -> Option<&'a str> {
        if let DeValue::String(text) = self.node.get_ref() {
            return Some(text);
        }
        self.wrong("a text in quotes", faults);
        None
    }

    /// A text that is one of `choices`; its index.
    pub fn choice(&self, choices: &[&'static str], faults: &mut FaultList) -> Option<usize> {
        let text = self.string(faults)?;
        let index = choices.iter().position(|choice| *choice == text);
        if index.is_none() {
            let fault = Fault::new(format!("`{}` has no such value", self.label))
                .found(format!("\"{}\"", text.escape_debug()))
                .expected(choices.join(", "));
            let fault = match nearest(text, choices) {
                Some(near) => fault.hint(format!("did you mean \"{near}\"?")),
                None => fault,
            };
            faults.push(self.fault(fault));
        }
        index
    }

    pub fn list(&self, expected: &str, faults: &mut FaultList) -> Option<Vec<Value<'a>>> {
        let DeValue::Array(items) = self.node.get_ref() else {
            self.wrong(expected, faults);
            return None;
        };
        let values = items.iter().map(|node| Value {
            text: self.text,
            label: self.label.clone(),
            node,
        });
        Some(values.collect())
    }

    pub fn table(&self, title: &str, faults: &mut FaultList) -> Option<Table<'a>> {
        let DeValue::Table(table) = self.node.get_ref() else {
            self.wrong("a table", faults);
            return None;
        };
        Some(Table {
            text: self.text,
            table: Some(table),
            span: Some(self.node.span()),
            title: title.to_owned(),
            known: Vec::new(),
        })
    }

    /// All entries of a table whose keys the user chooses.
    pub fn entries(&self, faults: &mut FaultList) -> Option<Vec<(String, Value<'a>)>> {
        let DeValue::Table(table) = self.node.get_ref() else {
            self.wrong("a table", faults);
            return None;
        };
        let entry = |(key, node): (&'a Spanned<_>, &'a Spanned<DeValue<'a>>)| -> (String, Value<'a>) {
            let key: &std::borrow::Cow<'a, str> = key.get_ref();
            let value = Value {
                text: self.text,
                label: key.to_string(),
                node,
            };
            (key.to_string(), value)
        };
        Some(table.iter().map(entry).collect())
    }

    /// `[low, high]` with `low <= high`, both within `bounds`.
    pub fn interval(&self, bounds: [f64; 2], faults: &mut FaultList) -> Option<[f64; 2]> {
        let [low, high] = self.pair(bounds, faults)?;
        if low <= high {
            return Some([low, high]);
        }
        let fault = Fault::new(format!("the limits of `{}` are crossed", self.label));
        let fault = fault.found(format!("low {low}, high {high}")).expected("low <= high");
        faults.push(self.fault(fault.hint(format!("write [{high}, {low}]"))));
        None
    }

    /// Two numbers within `bounds`.
    pub fn pair(&self, bounds: [f64; 2], faults: &mut FaultList) -> Option<[f64; 2]> {
        let items = self.list("two numbers", faults)?;
        let numbers: Vec<_> = items
            .iter()
            .map(|item| item.number(bounds[0], bounds[1], faults))
            .collect();
        if let [a, b] = numbers.as_slice() {
            return Some([(*a)?, (*b)?]);
        }
        let fault = Fault::new(format!("`{}` has the wrong number of values", self.label));
        faults.push(self.fault(fault.found(items.len().to_string()).expected("two numbers")));
        None
    }

    pub fn out_of_range(&self, found: &str, expected: &str, faults: &mut FaultList) {
        let fault = Fault::new(format!("`{}` is out of range", self.label));
        faults.push(self.fault(fault.found(found).expected(expected)));
    }
}

fn expected_range(low: f64, high: f64) -> String {
    match (low == f64::MIN, high == f64::MAX) {
        (true, true) => "a finite number".to_owned(),
        (false, true) => format!("at least {low}"),
        (true, false) => format!("at most {high}"),
        (false, false) => format!("{low} to {high}"),
    }
}

/// The known word closest to `name`, if it is close enough to be a slip.
pub(super) fn nearest(name: &str, known: &[&'static str]) -> Option<&'static str> {
    let best = known.iter().map(|word| (distance(name, word), *word)).min()?;
    (best.0 <= 1 + name.len() / 4).then_some(best.1)
}

/// Levenshtein distance in bytes.
fn distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.bytes().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.bytes().enumerate() {
            let replaced = diagonal + usize::from(x != y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

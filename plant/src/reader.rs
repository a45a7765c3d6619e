//! Reads a `plant.toml`: tables and keys are those of the catalogue, everything left out is neutral.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use toml::de::{DeTable, DeValue};

use crate::catalogue::{self, Field, Parameter};
use crate::check;
use crate::faults::{Fault, Faults, Place};
use crate::parameters::Parameters;

impl Parameters {
    /// Reads the text of a `plant.toml`; `file` only names it in messages.
    ///
    /// # Errors
    /// All faults: syntax, unknown keys, wrong types, values out of range, effects that lack a partner.
    pub fn from_toml(file: &Path, text: &str) -> Result<Self, Faults> {
        let mut reader = Reader {
            file,
            text,
            parameters: Parameters::default(),
            places: BTreeMap::new(),
            faults: Vec::new(),
        };
        let (tree, errors) = DeTable::parse_recoverable(text);
        for error in errors {
            let fault = Fault::new("this is not valid TOML").found(error.message());
            reader.fault(&error.span().unwrap_or(0..0), fault);
        }
        if reader.faults.is_empty() {
            reader.table(tree.get_ref(), "");
            reader.check();
        }
        if reader.faults.is_empty() {
            Ok(reader.parameters)
        } else {
            Err(Faults(reader.faults))
        }
    }

    /// Reads the `plant.toml` at `path`.
    ///
    /// # Errors
    /// As [`Parameters::from_toml`], and a file that cannot be read.
    pub fn from_file(path: &Path) -> Result<Self, Faults> {
        match std::fs::read_to_string(path) {
            Ok(text) => Self::from_toml(path, &text),
            Err(error) => {
                let mut fault = Fault::new("cannot read the plant file").found(error.to_string());
                fault.file = Some(path.to_path_buf());
                Err(Faults(vec![
                    fault.hint("a path to a plant.toml; examples/plants/ has some"),
                ]))
            }
        }
    }
}

struct Reader<'a> {
    file: &'a Path,
    text: &'a str,
    parameters: Parameters,
    /// Where each key that was read has its value.
    places: BTreeMap<&'static str, Range<usize>>,
    faults: Vec<Fault>,
}

impl Reader<'_> {
    fn table(&mut self, table: &DeTable<'_>, prefix: &str) {
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        for (key, value) in entries {
            let path = match prefix {
                "" => key.get_ref().to_string(),
                _ => format!("{prefix}.{}", key.get_ref()),
            };
            match (value.get_ref(), catalogue::parameter(&path)) {
                (DeValue::Table(inner), None) if is_section(&path) => self.table(inner, &path),
                (value_read, Some(parameter)) => self.value(parameter, value_read, &value.span()),
                (_, None) => {
                    let fault = unknown(&path, prefix);
                    self.fault(&key.span(), fault);
                }
            }
        }
    }

    fn value(&mut self, parameter: &'static Parameter, value: &DeValue<'_>, span: &Range<usize>) {
        self.places.insert(parameter.key, span.clone());
        let outcome = match parameter.field {
            Field::Number(_, set) => number(value).map(|number| set(&mut self.parameters, number)),
            Field::Whole(_, set) => whole(value).map(|number| set(&mut self.parameters, number)),
            Field::Choice(words, _, set) => {
                let word = if let DeValue::String(text) = value {
                    text.as_ref()
                } else {
                    ""
                };
                let index = words.iter().position(|candidate| *candidate == word);
                index.map(|index| set(&mut self.parameters, index))
            }
        };
        if outcome.is_none() {
            let fault = wrong_value(parameter, value);
            self.fault(span, fault);
        }
    }

    fn check(&mut self) {
        let required = [
            "converter.v_in",
            "converter.inductance",
            "converter.capacitance",
            "converter.f_sw",
        ];
        for key in required {
            if !self.places.contains_key(key)
                && let Some(parameter) = catalogue::parameter(key)
            {
                let fault = Fault::new(format!("`{key}` is missing"))
                    .expected(format!("{} in {}", parameter.meaning, parameter.unit))
                    .hint("a plant has no default circuit");
                self.fault(&(0..0), fault);
            }
        }
        if !self.faults.is_empty() {
            return;
        }
        for (key, fault) in check::keyed(&self.parameters) {
            let span = self.places.get(key).cloned().unwrap_or(0..0);
            self.fault(&span, fault);
        }
    }

    fn fault(&mut self, span: &Range<usize>, mut fault: Fault) {
        fault.file = Some(self.file.to_path_buf());
        let place = place(self.text, span);
        let known = |other: &Fault| other.place == place && other.problem == fault.problem;
        if !self.faults.iter().any(known) {
            // a span of nothing at the start stands for the file as a whole
            fault.place = if *span == (0..0) { None } else { place };
            self.faults.push(fault);
        }
    }
}

fn place(text: &str, span: &Range<usize>) -> Option<Place> {
    let before = text.get(..span.start)?;
    let start = before.rfind('\n').map_or(0, |at| at + 1);
    let line = text.get(start..)?.lines().next().unwrap_or_default();
    let inside = text.get(span.clone())?.lines().next().unwrap_or_default();
    Some(Place {
        line: before.matches('\n').count() + 1,
        column: text.get(start..span.start)?.chars().count() + 1,
        length: inside.chars().count().max(1),
        text: line.to_owned(),
    })
}

fn is_section(path: &str) -> bool {
    catalogue::parameters().any(|p| p.key.strip_prefix(path).is_some_and(|rest| rest.starts_with('.')))
}

fn number(value: &DeValue<'_>) -> Option<f64> {
    let number = match value {
        DeValue::Float(number) => number.as_str().parse().ok()?,
        DeValue::Integer(number) => i64::from_str_radix(number.as_str(), number.radix()).ok()? as f64,
        _ => return None,
    };
    f64::is_finite(number).then_some(number)
}

fn whole(value: &DeValue<'_>) -> Option<u64> {
    match value {
        DeValue::Integer(number) => u64::from_str_radix(number.as_str(), number.radix()).ok(),
        _ => None,
    }
}

fn wrong_value(parameter: &Parameter, value: &DeValue<'_>) -> Fault {
    let found = match value {
        DeValue::String(text) => format!("the text \"{}\"", text.escape_debug()),
        DeValue::Integer(number) => number.to_string(),
        DeValue::Float(number) => number.to_string(),
        DeValue::Boolean(value) => value.to_string(),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::Array(_) => "an array".to_owned(),
        DeValue::Table(_) => "a table".to_owned(),
    };
    let fault = Fault::new(format!("`{}` has a wrong value", parameter.key)).found(found);
    match parameter.field {
        Field::Choice(words, ..) => {
            let list: Vec<_> = words.iter().map(|word| format!("\"{word}\"")).collect();
            fault.expected(list.join(" or ")).hint(parameter.meaning)
        }
        Field::Whole(..) => fault.expected("a whole number, 0 or more").hint(parameter.meaning),
        Field::Number(..) => {
            let unit = if parameter.unit == "1" { "" } else { parameter.unit };
            let hint = format!("{}; no unit and no quotes: 150 uF is 150e-6", parameter.meaning);
            fault.expected(format!("a finite number {unit}").trim_end()).hint(hint)
        }
    }
}

fn unknown(path: &str, prefix: &str) -> Fault {
    let last = path.rsplit('.').next().unwrap_or(path);
    let fault = Fault::new(format!("unknown key `{path}`"));
    let elsewhere = catalogue::parameters().find(|p| p.key.rsplit('.').next() == Some(last));
    if let Some(parameter) = elsewhere {
        return fault.hint(format!("did you mean `{}`?", parameter.key));
    }
    let depth = prefix.split('.').filter(|part| !part.is_empty()).count();
    let mut here: Vec<&str> = catalogue::parameters()
        .filter(|p| prefix.is_empty() || p.key.strip_prefix(prefix).is_some_and(|rest| rest.starts_with('.')))
        .filter_map(|p| p.key.split('.').nth(depth))
        .collect();
    here.dedup();
    let expected = here.join(", ");
    let nearest = here.into_iter().min_by_key(|candidate| distance(candidate, last));
    let fault = fault.expected(if prefix.is_empty() {
        format!("a table: {expected}")
    } else {
        expected
    });
    match nearest.filter(|candidate| distance(candidate, last) <= 3) {
        Some(candidate) => fault.hint(format!("did you mean `{candidate}`?")),
        None => fault,
    }
}

/// Letters to change, insert or delete.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut corner = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let change = corner + usize::from(x != *y);
            corner = row[j + 1];
            row[j + 1] = change.min(corner + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

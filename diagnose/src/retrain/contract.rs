//! A contract with the errors of sensors taken out, as text: everything else of it stays, comments too.
//!
//! ```text
//!   adc = { gain = 0.0625, offset = -2.0 }      gain / g, (offset - o) / g
//!   source = "v_out - v_ref"                    ((v_out - v_out_offset) / v_out_gain) - v_ref, with both in [parameters]
//! ```

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::Correction;
use crate::extend::rounded;

/// What came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Corrected {
    /// The contract.
    pub text: String,
    /// The corrections that it has now.
    pub taken: Vec<Correction>,
    /// Those of them that are corrected before they are numbers, in `adc`: a simulation, whose sensors show numbers, has to show the true
    /// ones for the new contract.
    pub before: Vec<&'static str>,
    /// What could not be corrected, and why: the network has to learn it.
    pub left: Vec<String>,
}

/// A piece of text in the place of another.
type Edit = (Range<usize>, String);
type Node<'a> = Spanned<DeValue<'a>>;

/// `text` with `corrections` for the signals that it has. A correction is taken whole or not at all.
#[must_use]
pub fn corrected(text: &str, corrections: &[Correction]) -> Corrected {
    let (tree, _) = DeTable::parse_recoverable(text);
    let root = tree.get_ref();
    let (mut edits, mut parameters): (Vec<Edit>, Vec<String>) = (Vec::new(), Vec::new());
    let (mut taken, mut left, mut before) = (Vec::new(), Vec::new(), Vec::new());
    for correction in corrections {
        let name = correction.signal;
        // a contract that does not measure it has nothing to correct
        let Some(signal) = tables(root.get("signal")).find(|table| string(table.get("name")) == Some(name)) else {
            continue;
        };
        if let Some(adc) = signal.get("adc") {
            match converter(text, adc, correction) {
                Some(more) => {
                    edits.extend(more);
                    before.push(name);
                }
                None => {
                    left.push(format!("{name}: its `adc` has no gain that is a number"));
                    continue;
                }
            }
        } else if let Some(reason) = in_the_way(root, name) {
            left.push(format!("{name}: {reason}"));
            continue;
        } else {
            parameters.push(format!(
                "{name}_gain = {:?}  # {} shown over true, found by a diagnosis",
                rounded(correction.gain),
                correction.unit
            ));
            parameters.push(format!(
                "{name}_offset = {:?}  # {} shown at 0",
                rounded(correction.offset),
                correction.unit
            ));
        }
        taken.push(correction.clone());
    }
    let physical: Vec<&str> = (taken.iter().map(|one: &Correction| one.signal))
        .filter(|name| parameters.iter().any(|line| line.starts_with(&format!("{name}_gain "))))
        .collect();
    edits.extend(expressions(root).filter_map(|node| {
        let written = text.get(node.span())?;
        let new = with_corrections(written, &physical);
        (new != written).then(|| (node.span(), new))
    }));
    let end = insert_parameters(text, root, &parameters, &mut edits);
    edits.sort_by_key(|(range, _)| range.start);
    let mut out = text.to_owned();
    for (range, new) in edits.into_iter().rev() {
        out.replace_range(range, &new);
    }
    Corrected {
        text: out + &end,
        taken,
        before,
        left,
    }
}

fn tables<'t, 'a>(value: Option<&'t Node<'a>>) -> impl Iterator<Item = &'t DeTable<'a>> {
    let items = match value.map(Spanned::get_ref) {
        Some(DeValue::Array(items)) => items.iter().collect(),
        _ => Vec::new(),
    };
    items.into_iter().filter_map(|item| match item.get_ref() {
        DeValue::Table(table) => Some(table),
        _ => None,
    })
}

fn table<'t, 'a>(value: Option<&'t Node<'a>>) -> Option<&'t DeTable<'a>> {
    match value.map(Spanned::get_ref) {
        Some(DeValue::Table(table)) => Some(table),
        _ => None,
    }
}

fn string<'t>(value: Option<&'t Node<'_>>) -> Option<&'t str> {
    match value.map(Spanned::get_ref) {
        Some(DeValue::String(text)) => Some(text),
        _ => None,
    }
}

fn number(text: &str, value: Option<&Node<'_>>) -> Option<f64> {
    let written = text.get(value?.span())?;
    written.replace('_', "").trim_start_matches('+').parse().ok()
}

/// Gain and offset of the codes.
fn converter(text: &str, adc: &Node<'_>, correction: &Correction) -> Option<Vec<Edit>> {
    let entries = table(Some(adc))?;
    let gain = entries.get("gain")?;
    let own = number(text, Some(gain))?;
    let offset = entries.get("offset");
    let zero = match offset {
        Some(_) => number(text, offset)?,
        None => 0.0,
    };
    let new_gain = format!("{:?}", rounded(own / correction.gain));
    let new_offset = format!("{:?}", rounded((zero - correction.offset) / correction.gain));
    Some(match offset {
        Some(offset) => vec![(gain.span(), new_gain), (offset.span(), new_offset)],
        None => {
            let is_inline = text.get(adc.span()).is_some_and(|text| text.starts_with('{'));
            let between = if is_inline { ", " } else { "\n" };
            vec![(gain.span(), format!("{new_gain}{between}offset = {new_offset}"))]
        }
    })
}

/// What takes a signal as it is measured, and can take no expression.
fn in_the_way(root: &DeTable<'_>, name: &str) -> Option<String> {
    let uses = |observer: &DeTable<'_>| {
        let keys = ["input_voltage", "output_voltage", "load_current"];
        keys.into_iter().find(|key| string(observer.get(*key)) == Some(name))
    };
    if let Some(key) = tables(root.get("observer")).find_map(uses) {
        return Some(format!("`{key}` of an observer takes it as it is measured"));
    }
    let known = table(root.get("parameters"));
    let own = [format!("{name}_gain"), format!("{name}_offset")];
    let taken = own
        .iter()
        .find(|own| known.is_some_and(|table| table.get(own.as_str()).is_some()));
    taken.map(|own| format!("the contract has a parameter `{own}` of its own"))
}

/// The strings that are expressions of signals.
fn expressions<'t, 'a>(root: &'t DeTable<'a>) -> impl Iterator<Item = &'t Node<'a>> {
    let sources = |list: Option<&'t Node<'a>>| tables(list).filter_map(|one| one.get("source")).collect::<Vec<_>>();
    let mut all = sources(root.get("feature"));
    if let Some(actions) = table(root.get("actions")) {
        all.extend(actions.get("base"));
        all.extend(sources(actions.get("gains")));
        all.extend(sources(actions.get("dead_zone")));
    }
    all.into_iter().filter(|node| string(Some(node)).is_some())
}

/// An expression in which each of these signals is corrected.
fn with_corrections(written: &str, signals: &[&str]) -> String {
    let is_inside = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let (mut out, mut rest) = (String::new(), written);
    while let Some(start) = rest.find(is_inside) {
        let length = rest[start..].find(|c| !is_inside(c)).unwrap_or(rest.len() - start);
        let (before, word) = (&rest[..start], &rest[start..start + length]);
        out.push_str(before);
        match signals.contains(&word) {
            true => out.push_str(&format!("(({word} - {word}_offset) / {word}_gain)")),
            false => out.push_str(word),
        }
        rest = &rest[start + length..];
    }
    out + rest
}

/// Puts lines into `[parameters]`; what comes behind the text where it has none.
fn insert_parameters(text: &str, root: &DeTable<'_>, lines: &[String], edits: &mut Vec<Edit>) -> String {
    if lines.is_empty() {
        return String::new();
    }
    let Some(node) = root.get("parameters") else {
        let gap = if text.ends_with('\n') { "\n" } else { "\n\n" };
        return format!("{gap}[parameters]\n{}\n", lines.join("\n"));
    };
    let span = node.span();
    let is_inline = text.get(span.clone()).is_some_and(|text| text.starts_with('{'));
    if is_inline {
        // a comment would end the line inside of the braces
        let bare = |line: &String| line.split("  #").next().unwrap_or_default().to_owned();
        let all: Vec<String> = lines.iter().map(bare).collect();
        let is_empty = table(Some(node)).is_none_or(|table| table.is_empty());
        let more = if is_empty { "" } else { ", " };
        edits.push((span.start + 1..span.start + 1, format!(" {}{more}", all.join(", "))));
        return String::new();
    }
    let header = text[span.start..]
        .find('\n')
        .map_or(text.len(), |at| span.start + at + 1);
    let gap = if header == text.len() && !text.ends_with('\n') {
        "\n"
    } else {
        ""
    };
    edits.push((header..header, format!("{gap}{}\n", lines.join("\n"))));
    String::new()
}

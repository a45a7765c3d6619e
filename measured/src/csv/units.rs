//! A line of units below the names, as oscilloscopes and loggers write it.

use toml_input::{Fault, Faults, Message, Sink, Source, Span};

use super::split::{Separator, cells};
use crate::quantity::{Quantity, split_unit};

/// Signs of a unit beside letters: `m/s`, `[%]`, `deg C`, `-`, and 1 for a share.
const SIGNS: &str = "%/[]()-1\u{b0}^. ";

/// Whether a line holds words throughout that are not missing numbers.
pub(super) fn are_units(line: &str, separator: Separator) -> bool {
    let Ok(words) = cells(line, 0, separator) else {
        return false;
    };
    let unit =
        // `nan` is letters alone, but a line of it is a row in which nothing was measured
        |cell: &str| cell.chars().all(|c| c.is_alphabetic() || SIGNS.contains(c)) && !cell.eq_ignore_ascii_case("nan");
    let letters = |cell: &str| cell.contains(|c: char| c.is_alphabetic() || c == '%');
    words.iter().all(|cell| unit(&line[cell.clone()])) && words.iter().any(|cell| letters(&line[cell.clone()]))
}

/// The names of the columns, each with the unit that the line at `line` has below it.
///
/// # Errors
/// A unit that is none of the quantity's, or another than the one behind the name.
pub(super) fn named_with_units(
    source: &Source,
    names: &[Span],
    line: &Span,
    separator: Separator,
) -> Result<Vec<String>, Faults> {
    let units = cells(&source.text[line.clone()], line.start, separator).unwrap_or_default();
    let mut faults = Sink::new();
    let mut named = Vec::with_capacity(names.len());
    for (n, name) in names.iter().enumerate() {
        let name = source.text[name.clone()].trim();
        let cell = units.get(n).cloned().unwrap_or(line.end..line.end);
        let unit = source.text[cell.clone()].trim_matches(|c: char| c == ' ' || "[]()".contains(c));
        // nothing, or a pure number
        if matches!(unit, "" | "-" | "1") {
            named.push(name.to_owned());
            continue;
        }
        match checked(name, unit) {
            Ok(name) => named.push(name),
            Err(message) => faults.push(fault(source, &cell, message)),
        }
    }
    faults.propagate()?;
    Ok(named)
}

fn fault(source: &Source, cell: &Span, message: Message) -> Fault {
    source.fault(cell, message.found(&source.text[cell.clone()]))
}

/// A name with its unit, if they go together.
fn checked(name: &str, unit: &str) -> Result<String, Message> {
    let with = format!("{name} [{unit}]");
    let Some((quantity, behind)) = Quantity::of_header(name) else {
        // a column with a name of its own: a map may want it
        return Ok(if split_unit(name).1.is_some() {
            name.to_owned()
        } else {
            with
        });
    };
    let Some(scale) = quantity.scale_from(unit) else {
        let problem = format!("a line of units with one that is no unit of `{}`", quantity.name);
        let message = Message::new(problem).expected(quantity.units());
        return Err(message.hint("correct the unit, or remove the line if the numbers are in SI units"));
    };
    match behind {
        None => Ok(with),
        // both are products of powers of ten, equal but for their last bits
        Some(own) if (own / scale - 1.0).abs() < 1e-9 => Ok(name.to_owned()),
        Some(_) => {
            let message = Message::new(format!("`{name}` has another unit behind its name than below it"));
            Err(message.hint("remove one of them"))
        }
    }
}

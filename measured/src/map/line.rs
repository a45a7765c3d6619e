//! Maps on the command line: `duty=duty_percent*0.01,v_in=24`.

use toml_input::{Faults, Message, Sink};

use super::{ColumnMap, Wish, quantity};
use crate::quantity::{Quantity, VOCABULARY};

impl ColumnMap {
    /// Reads `quantity=column`, `quantity=column*factor` or `quantity=number`, several separated by commas.
    ///
    /// # Errors
    /// If an entry is none of these, or a quantity is mapped twice.
    pub fn parse(text: &str) -> Result<Self, Faults> {
        let hint = "for example --map duty=duty_percent*0.01,v_in=24; a file can say more: --columns MAP.toml";
        Self::of_line(text, &VOCABULARY, hint)
    }

    /// [`ColumnMap::parse`] of a table with other quantities than the vocabulary's, such as the signals of a policy.
    ///
    /// # Errors
    /// As [`ColumnMap::parse`].
    pub fn parse_among(text: &str, known: &[Quantity<'_>]) -> Result<Self, Faults> {
        Self::of_line(text, known, "for example --map v_out=CH1,i_l=CH2*0.001")
    }

    fn of_line(text: &str, known: &[Quantity<'_>], hint: &str) -> Result<Self, Faults> {
        let mut map = ColumnMap::default();
        let mut faults = Sink::new();
        // so a header with a comma has to be mapped in a file
        for text in text.split(',').map(str::trim).filter(|text| !text.is_empty()) {
            if let Err(message) = entry(text, known, hint).and_then(|(name, wish)| map.add(name, wish)) {
                faults.push(message.found(text));
            }
        }
        faults.propagate().map(|()| map)
    }
}

fn entry(text: &str, known: &[Quantity<'_>], hint: &str) -> Result<(String, Wish), Message> {
    let form = || {
        Message::new("the column map cannot be read")
            .expected("quantity=column, quantity=column*factor or quantity=number")
            .hint(hint)
    };
    let (name, value) = text.split_once('=').ok_or_else(form)?;
    let (name, value) = (quantity(name.trim(), known)?, value.trim());
    // a number before a name: a column that is called `10` has to be mapped in a file
    if let Some(number) = finite(value) {
        return Ok((name, Wish::Constant(number)));
    }
    // from the right: a header may hold a `*` of its own
    let (column, scale) = match value.rsplit_once('*') {
        None => (value, None),
        Some((column, factor)) => (column.trim(), Some(finite(factor.trim()).ok_or_else(form)?)),
    };
    if column.is_empty() {
        return Err(form());
    }
    let wish = Wish::Column {
        name: column.to_owned(),
        scale,
        offset: 0.0,
    };
    Ok((name, wish))
}

fn finite(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|number| number.is_finite())
}

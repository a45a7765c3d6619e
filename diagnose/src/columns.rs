//! Which column of a file is which signal: canonical names, names with a unit, or a map file.

use std::path::Path;

use toml_input::{Document, Fault, Faults, Value};

/// The signals a record may hold, in canonical names.
pub const NAMES: [&str; 9] = ["t", "d", "v_o", "i_l", "i_o", "v_in", "r_load", "i_load", "p_load"];

/// Suffixes of a column's name that say its unit, and what they are in SI.
const UNITS: &[(&str, f64)] = &[
    ("us", 1e-6),
    ("ms", 1e-3),
    ("mv", 1e-3),
    ("ma", 1e-3),
    ("kw", 1e3),
    ("percent", 0.01),
    ("pct", 0.01),
    ("%", 0.01),
    ("s", 1.0),
    ("v", 1.0),
    ("a", 1.0),
    ("w", 1.0),
    ("ohm", 1.0),
];

/// What the duty of a record is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DutyIs {
    /// Commanded; or applied, if the record's sampling chain is another one and the data say so.
    #[default]
    Unknown,
    /// What the controller asked for.
    Commanded,
    /// What the modulator did: delays and rounding of the duty lie before it.
    Applied,
    /// The same, and the sensors show at once what is true: another measuring chain, or a simulator's.
    Direct,
}

/// One signal in a file: its column and how to get to SI from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Name of the column.
    pub column: String,
    /// SI value over value in the file.
    pub scale: f64,
    /// Added after scaling.
    pub offset: f64,
}

/// How files are to be read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Columns {
    sources: Vec<(&'static str, Source)>,
    constants: Vec<(&'static str, f64)>,
    /// Sampling instant as a fraction of the PWM period; from the time column if not given.
    pub phase: Option<f64>,
    /// What the duty column holds.
    pub duty: DutyIs,
}

impl Columns {
    /// Reads a map file:
    ///
    /// ```toml
    /// phase = 0.5                 # sampling instant in the PWM period; left out: from the time column
    /// duty = "commanded"          # or "applied", "direct"
    /// [columns]
    /// v_o = "CH1 [V]"
    /// d = { name = "duty", scale = 0.01 }
    /// [constants]
    /// r_load = 10.0
    /// ```
    ///
    /// # Errors
    /// A file that cannot be read, unknown keys, wrong types.
    pub fn open(path: &Path) -> Result<Self, Faults> {
        Document::open(path)?.read(|root, faults| {
            let mut map = Columns::default();
            if let Some(value) = root.optional("phase") {
                map.phase = value.number_within(0.0..=0.999_999, faults);
            }
            if let Some(value) = root.optional("duty") {
                let choices = [
                    ("commanded", DutyIs::Commanded),
                    ("applied", DutyIs::Applied),
                    ("direct", DutyIs::Direct),
                ];
                map.duty = value.choice(&choices, faults).unwrap_or_default();
            }
            let table = root.optional("columns").and_then(|v| v.table("[columns]", faults));
            if let Some(mut table) = table {
                for name in NAMES {
                    if let Some(value) = table.optional(name) {
                        map.sources.extend(source(value, faults).map(|source| (name, source)));
                    }
                }
                table.finish(faults);
            }
            let table = root.optional("constants").and_then(|v| v.table("[constants]", faults));
            if let Some(mut table) = table {
                for name in NAMES {
                    if let Some(value) = table.optional(name) {
                        map.constants.extend(value.number(faults).map(|number| (name, number)));
                    }
                }
                table.finish(faults);
            }
            Some(map)
        })
    }

    /// Where `name` stands among `headers`, if it does.
    #[must_use]
    pub fn find(&self, name: &str, headers: &[&str]) -> Option<(usize, Source)> {
        if let Some((_, source)) = self.sources.iter().find(|(known, _)| *known == name) {
            let index = headers.iter().position(|header| *header == source.column)?;
            return Some((index, source.clone()));
        }
        headers.iter().enumerate().find_map(|(index, header)| {
            let (base, scale) = with_unit(header)?;
            let source = Source {
                column: (*header).to_owned(),
                scale,
                offset: 0.0,
            };
            (base == name).then_some((index, source))
        })
    }

    /// The column the map names for `name`, whether or not the file has it.
    #[must_use]
    pub fn wanted(&self, name: &str) -> Option<&str> {
        let found = self.sources.iter().find(|(known, _)| *known == name);
        found.map(|(_, source)| source.column.as_str())
    }

    /// A value that holds for the whole record.
    #[must_use]
    pub fn constant(&self, name: &str) -> Option<f64> {
        let found = self.constants.iter().find(|(known, _)| *known == name);
        found.map(|(_, value)| *value)
    }
}

fn source(value: Value<'_>, faults: &mut Vec<Fault>) -> Option<Source> {
    if let Some(column) = value.as_text() {
        return Some(Source {
            column: column.to_owned(),
            scale: 1.0,
            offset: 0.0,
        });
    }
    let mut table = value.table("a column", faults)?;
    let column = table
        .required("name", "the column's header", faults)
        .and_then(|v| v.text(faults));
    let scale = table.with_default("scale", 1.0, faults, |v, faults| v.number(faults));
    let offset = table.with_default("offset", 0.0, faults, |v, faults| v.number(faults));
    table.finish(faults);
    Some(Source {
        column: column?.to_owned(),
        scale,
        offset,
    })
}

/// `v_o`, `v_o_mV`, `v_o [mV]`, `d (%)`: the canonical name and the scale to SI.
fn with_unit(header: &str) -> Option<(&'static str, f64)> {
    let lower = header.trim().to_ascii_lowercase();
    NAMES.iter().find_map(|name| {
        let rest = lower.strip_prefix(name)?;
        if rest.is_empty() {
            return Some((*name, 1.0));
        }
        let unit = rest.trim_matches(|c: char| c == '_' || c == ' ' || "[]()".contains(c));
        let separated = !rest.starts_with(|c: char| c.is_ascii_alphanumeric());
        let known = UNITS.iter().find(|(text, _)| *text == unit)?;
        separated.then_some((*name, known.1))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_in_the_header_are_scaled_to_si() {
        assert_eq!(with_unit("v_o [mV]"), Some(("v_o", 1e-3)));
        assert_eq!(with_unit("t_us"), Some(("t", 1e-6)));
        assert_eq!(with_unit("d (%)"), Some(("d", 0.01)));
        assert_eq!(with_unit("v_in"), Some(("v_in", 1.0)));
        assert_eq!(with_unit("v_offset"), None);
        assert_eq!(with_unit("temperature"), None);
    }
}

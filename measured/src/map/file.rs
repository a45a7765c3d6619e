//! Maps as files in TOML.

use std::path::Path;

use toml_input::{Document, Faults, FileName, Sink, Table, Value};

use super::{ColumnMap, DutyIs, OfRecord, Sampled, Wish, quantity};
use crate::quantity::VOCABULARY;

impl ColumnMap {
    /// Reads a map file:
    ///
    /// ```toml
    /// phase = 0.5                 # sampling instant in the PWM period; left out: from the time column
    /// duty = "commanded"          # or "applied", "direct"
    /// settled = true              # rows are settled points; left out: if there is no time column
    /// sampled = "mean"            # or "instant": rows many periods apart; left out: what fits better
    /// [columns]
    /// v_out = "CH1 [V]"
    /// duty = { name = "D", scale = 0.01, offset = 0.0 }
    /// [constants]
    /// r_load = 10.0
    /// [records.run2]              # what is different in run2.csv: the same keys and tables
    /// columns = { v_out = "CH3 [V]", i_l = false }    # false: it has none
    /// ```
    ///
    /// # Errors
    /// A file that cannot be read, unknown keys, wrong types, a quantity that is mapped twice.
    pub fn open(file: impl Into<FileName>) -> Result<Self, Faults> {
        Self::of_document(&Document::open(file)?)
    }

    /// [`ColumnMap::open`] of a text; `file` only names it in messages.
    ///
    /// # Errors
    /// As [`ColumnMap::open`], apart from the file.
    pub fn from_text(file: &Path, text: &str) -> Result<Self, Faults> {
        Self::of_document(&Document::from_text(file, text)?)
    }

    fn of_document(document: &Document) -> Result<Self, Faults> {
        document.read(|root, faults| {
            let mut map = ColumnMap::default();
            map.read_keys(root, faults);
            map.read_records(root, faults);
            Some(map)
        })
    }

    /// What a map says of all records, or of one.
    fn read_keys(&mut self, root: &mut Table<'_>, faults: &mut Sink) {
        if let Some(value) = root.optional("phase") {
            // a fraction below 1: the whole period is the start of the next one
            self.phase = value.number_within(0.0..=0.999_999, faults);
        }
        if let Some(value) = root.optional("duty") {
            let choices = [
                ("commanded", DutyIs::Commanded),
                ("applied", DutyIs::Applied),
                ("direct", DutyIs::Direct),
            ];
            self.duty = value.choice(&choices, faults).unwrap_or_default();
        }
        if let Some(value) = root.optional("settled") {
            self.settled = value.boolean(faults);
        }
        if let Some(value) = root.optional("sampled") {
            self.sampled = value.choice(&[("mean", Sampled::Mean), ("instant", Sampled::Instant)], faults);
        }
        self.read_table(root, "columns", faults, column);
        self.read_table(root, "constants", faults, |value, faults| {
            value.number(faults).map(Wish::Constant)
        });
    }

    /// What is different in single records, by the names of their files.
    fn read_records(&mut self, root: &mut Table<'_>, faults: &mut Sink) {
        let sections = root.optional("records").and_then(|table| table.pairs(faults));
        for (key, value) in sections.unwrap_or_default() {
            let mut map = ColumnMap::default();
            value.read_table("a record", faults, |table, faults| {
                map.read_keys(table, faults);
                Some(())
            });
            self.records.push(OfRecord {
                name: key.value.clone(),
                map,
            });
        }
    }

    /// The entries of a table whose keys are quantities.
    fn read_table(
        &mut self,
        root: &mut Table<'_>,
        title: &'static str,
        faults: &mut Sink,
        read: impl Fn(&Value<'_>, &mut Sink) -> Option<Wish>,
    ) {
        let entries = root
            .optional(title)
            .and_then(|table| table.pairs(faults))
            .unwrap_or_default();
        for (key, value) in entries {
            // the fault is left; the other entries are read all the same
            let Some(wish) = read(&value, faults) else { continue };
            let added = quantity(&key.value, &VOCABULARY).and_then(|name| self.add(name, wish));
            faults.extend(added.err().map(|message| value.source().fault(&key.span, message)));
        }
    }
}

fn column(value: &Value<'_>, faults: &mut Sink) -> Option<Wish> {
    if let Some(name) = value.as_text() {
        return Some(Wish::Column {
            name: name.to_owned(),
            scale: None,
            offset: 0.0,
        });
    }
    if value.as_boolean() == Some(false) {
        return Some(Wish::Nothing);
    }
    value.read_table("a column", faults, |table, faults| {
        let name = table
            .required("name", "the column's header", faults)
            .and_then(|v| v.text(faults));
        let scale = table.with_default("scale", None, faults, |v, faults| v.number(faults).map(Some));
        let offset = table.with_default("offset", 0.0, faults, |v, faults| v.number(faults));
        Some(Wish::Column {
            name: name?.to_owned(),
            scale,
            offset,
        })
    })
}

//! Reads a `plant.toml`: tables and keys are those of the catalogue, everything left out is neutral.

use std::collections::BTreeMap;
use std::path::Path;

use toml_input::{Document, Faults, FileName, Message, Sink, Table, Value};

use crate::catalogue;
use crate::check;
use crate::entry::{Field, Parameter};
use crate::parameters::Parameters;
use crate::topology;

impl Parameters {
    /// Reads the text of a `plant.toml`; `file` only names it in messages.
    ///
    /// # Errors
    /// All faults: syntax, unknown keys, wrong types, values out of range, effects that lack a partner.
    pub fn from_toml(file: &Path, text: &str) -> Result<Self, Faults> {
        read(&Document::from_text(file, text)?, None, Outside::Refused)
    }

    /// Reads a `plant.toml`.
    ///
    /// # Errors
    /// As [`Parameters::from_toml`], a file that cannot be read, and a converter that is not computed here: one with `[fmu]`.
    pub fn from_file(file: impl Into<FileName>) -> Result<Self, Faults> {
        read(&Document::open(file)?, None, Outside::Refused)
    }

    /// Reads the numbers of a `plant.toml` that controllers are designed on; beside `[fmu]` they are nominal ones. True if there is
    /// such a table, which is not read.
    ///
    /// # Errors
    /// As [`Parameters::from_toml`], and a file that cannot be read.
    pub fn nominal_from_file(file: impl Into<FileName>) -> Result<(Self, bool), Faults> {
        let document = Document::open(file)?;
        let parameters = read(&document, None, Outside::Taken)?;
        Ok((parameters, document.peek(&[FMU]).is_some()))
    }

    /// Reads a `plant.toml` for `what` (such as `drm fit`), which is built for the buck converter alone.
    ///
    /// # Errors
    /// As [`Parameters::from_file`], and another topology.
    pub fn buck_from_file(file: impl Into<FileName>, what: &str) -> Result<Self, Faults> {
        read(&Document::open(file)?, Some(what), Outside::Refused)
    }
}

impl Parameters {
    /// [`Parameters::nominal_from_file`] of a buck converter, as [`Parameters::buck_from_file`].
    ///
    /// # Errors
    /// As [`Parameters::nominal_from_file`], and another topology.
    pub fn nominal_buck_from_file(file: impl Into<FileName>, what: &str) -> Result<(Self, bool), Faults> {
        let document = Document::open(file)?;
        let parameters = read(&document, Some(what), Outside::Taken)?;
        Ok((parameters, document.peek(&[FMU]).is_some()))
    }
}

/// The table that names a converter which is computed elsewhere; the crate `fmu` reads it.
const FMU: &str = "fmu";

/// What becomes of a file with [`FMU`].
#[derive(PartialEq, Eq)]
enum Outside {
    /// Its numbers are read.
    Taken,
    /// The caller would compute another circuit, without a word.
    Refused,
}

fn read(document: &Document, for_the_buck: Option<&str>, outside: Outside) -> Result<Parameters, Faults> {
    let mut reader = Reader {
        parameters: Parameters::default(),
        values: BTreeMap::new(),
        faults: Sink::new(),
    };
    let mut root = document.root();
    if let Some(fmu) = root.optional(FMU).filter(|_| outside == Outside::Refused) {
        let message = Message::new("this converter is an FMU, and the circuit of this program is asked for");
        let hint = "`simulate`, `train`, `drm acquire` and `drm transfer` run it with --run-fmu; take [fmu] out for the nominal circuit";
        reader.faults.push(fmu.fault(message.hint(hint)));
    }
    reader.table(root, "");
    reader.required(document);
    // a number that could not be read is still neutral here: its range and partners would be those of another plant
    if reader.faults.is_empty() {
        for (key, message) in check::keyed(&reader.parameters) {
            reader.faults.push(match reader.values.get(key) {
                Some(value) => value.fault(message),
                None => document.source().name.fault(message),
            });
        }
    }
    let other = for_the_buck.and_then(|what| topology::other_than_buck(&reader.parameters, what));
    if let (Some(message), Some(value)) = (other, reader.values.get("converter.topology")) {
        reader.faults.push(value.fault(message));
    }
    document.conclude(Some(reader.parameters), reader.faults)
}

/// Numbers that a plant file must give.
pub const REQUIRED: [&str; 4] = [
    // neutral is the paper's converter: a forgotten line would silently be one of its numbers
    "converter.v_in",
    "converter.inductance",
    "converter.capacitance",
    "converter.f_sw",
];

struct Reader<'a> {
    parameters: Parameters,
    /// The value of each key that was read.
    values: BTreeMap<&'static str, Value<'a>>,
    faults: Sink,
}

impl<'a> Reader<'a> {
    /// The table at `path`, such as `sensors.v_out`; empty for the top level.
    fn table(&mut self, mut table: Table<'a>, path: &str) {
        for key in keys(path) {
            let Some(value) = table.optional(key) else { continue };
            let path = format!("{path}.{key}");
            let path = path.trim_start_matches('.');
            if let Some(parameter) = catalogue::parameter(path) {
                self.value(parameter, value.labelled(parameter.key));
            } else if let Some(inner) = value.table(&format!("[{path}]"), &mut self.faults) {
                self.table(inner, path);
            }
        }
        table.finish_with(&mut self.faults, elsewhere);
    }

    fn value(&mut self, parameter: &'static Parameter, value: Value<'a>) {
        let (plant, faults) = (&mut self.parameters, &mut self.faults);
        let (before, mut hint) = (faults.count(), parameter.meaning.to_owned());
        let read = match parameter.field {
            Field::Number(_, set) => {
                if parameter.unit != "1" {
                    hint = format!("{hint} in {}", parameter.unit);
                }
                hint += "; no unit and no quotes: 150 uF is 150e-6";
                value.number(faults).map(|number| set(plant, number))
            }
            Field::Whole(_, set) => {
                // TOML knows no larger integers
                let range = 0..=parameter.allowed.1.min(i64::MAX as f64) as u64;
                value.integer(range, faults).map(|number| set(plant, number))
            }
            Field::Choice(words, _, set) => {
                let choices: Vec<_> = words.iter().copied().zip(0..).collect();
                value.choice(&choices, faults).map(|index| set(plant, index))
            }
        };
        if read.is_none() {
            faults.hint_since(before, &hint);
        }
        self.values.insert(parameter.key, value);
    }

    fn required(&mut self, document: &Document) {
        let missing = REQUIRED.iter().filter(|key| !self.values.contains_key(*key));
        let missing = missing.filter_map(|key| catalogue::parameter(key));
        let faults = missing.map(|Parameter { key, meaning, unit, .. }| {
            let message = Message::new(format!("`{key}` is missing"))
                .expected(format!("{meaning} in {unit}"))
                .hint("a plant has no default circuit");
            document.source().name.fault(message)
        });
        self.faults.extend(faults);
    }
}

/// What may stand in the table at `path`.
fn keys(path: &str) -> Vec<&'static str> {
    let mut keys = Vec::new();
    for parameter in catalogue::parameters() {
        let inside = match path {
            "" => Some(parameter.key),
            _ => parameter.key.strip_prefix(path).and_then(|rest| rest.strip_prefix('.')),
        };
        let key = inside.and_then(|rest| rest.split('.').next());
        keys.extend(key.filter(|key| !keys.contains(key)));
    }
    keys
}

/// Tables that a circuit suggests, and where their numbers stand.
const BY_PART: [(&[&str], &str); 6] = [
    (&["diode", "freewheel", "rectifier"], "`switch.v_f` and `switch.r_d`"),
    (
        &["mosfet", "fet", "transistor", "igbt"],
        "`switch.r_ds_on` and `switch.r_ds_on_low`",
    ),
    (&["coil", "choke", "l"], "`inductor.dcr`, and `converter.inductance`"),
    (
        &["esr", "output_capacitor", "c"],
        "`capacitor.esr`, and `converter.capacitance`",
    ),
    (
        &["sensor", "adc", "measurement"],
        "`sensors.v_out.lsb`, `sensors.v_out.noise` and their like",
    ),
    (&["input", "supply"], "`converter.v_in`, and `source.resistance`"),
];

/// A key that stands in the wrong table, or a table of a part that has its numbers elsewhere.
fn elsewhere(key: &str) -> Option<String> {
    if let Some(parameter) = catalogue::parameters().find(|p| p.key.rsplit('.').next() == Some(key)) {
        return Some(format!("did you mean `{}`?", parameter.key));
    }
    let part = key.to_lowercase();
    let (_, keys) = BY_PART.iter().find(|(names, _)| names.contains(&part.as_str()))?;
    Some(format!("a plant file has these as {keys}"))
}

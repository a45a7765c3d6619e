//! `[[output]]`: several duties in one contract, each with columns of the last layer, limits, fallback and mapping of its own
//! (contract section 9b).
//!
//! ```text
//! names    before the features: expressions call <name>_previous_duty and <name>_previous_command
//! content  [actions], [mapping], [limits] and [fallback] of the single form, read by the same readers
//! columns  every column of the last layer belongs to one output, and to one alone
//! ```

use toml_input::{Document, Sink, Table, Value};

use super::features::Surroundings;
use super::{Taken, actions, mapping, name, protection, taken_once};
use crate::catalogue;
use crate::limits::{MAX_OUTPUTS, MAX_WIDTH};
use crate::model::{Fallback, Head, Input, Mapping, Output};
use crate::names::{Kind, REMEMBERED};

/// What stands at the top level for one output and in each `[[output]]` for several.
const OWN: [&str; 3] = ["actions", "mapping", "limits"];

/// The entries of the contract, before what they say is read.
#[derive(Default)]
pub(crate) struct Outputs<'a> {
    /// Names of the duties of the step before, and what they stand for.
    pub remembered: Vec<(String, Input)>,
    /// Each entry with its name, if that is fit.
    list: Vec<(Value<'a>, Table<'a>, Option<String>)>,
}

impl Outputs<'_> {
    /// Their names in the order of the list, empty where one is not fit.
    pub fn names(&self) -> Vec<String> {
        let names = self.list.iter().map(|(.., name)| name.clone().unwrap_or_default());
        names.collect()
    }
}

/// What the outputs are, as far as it could be read.
pub(crate) struct Read {
    /// All of them; `None` if one is faulty.
    pub outputs: Option<Vec<Output>>,
    /// Columns of the last layer by the contract; 0 if that is unknown.
    pub columns: usize,
}

/// Whether the contract has several outputs.
pub(crate) fn are_given(document: &Document) -> bool {
    document.peek(&["output"]).is_some()
}

/// The entries and what expressions may call; `several` is whether the reader of the policy takes more than one.
pub(crate) fn names<'a>(
    root: &mut Table<'a>,
    taken: &mut Taken,
    several: bool,
    faults: &mut Sink,
) -> Option<Outputs<'a>> {
    let value = root.optional("output")?;
    let items = value.list("[[output]] tables", faults)?;
    if !(2..=MAX_OUTPUTS).contains(&items.len()) {
        let message = catalogue::count("outputs", items.len(), 2, MAX_OUTPUTS);
        faults.push(
            value.fault(
                message.hint(
                    "one output is written without [[output]]: [actions], [limits] and [fallback] at the top level",
                ),
            ),
        );
        return None;
    }
    if !several {
        let written = items.iter().filter_map(|item| item.peek("name"));
        let names: Vec<&str> = written.filter_map(|name| name.as_text()).collect();
        faults.push(value.fault(catalogue::one_output(&names)));
    }
    let mut outputs = Outputs::default();
    let mut names = Taken::new();
    for (index, item) in items.into_iter().enumerate() {
        let mut table = item.table("[[output]]", faults)?;
        let hint = "an output needs a name: `name = \"left\"`";
        let written = table.required("name", hint, faults);
        let own = written.as_ref().and_then(|v| name(v, Kind::Output, &mut names, faults));
        let duties = [Input::OutputDuty(index), Input::OutputCommand(index)];
        for (word, input) in REMEMBERED.into_iter().zip(duties) {
            let called = format!("{}_{word}", own.as_deref().unwrap_or_default());
            if let (Some(written), Some(_)) = (&written, &own) {
                let clash = taken_once(&called, Kind::Remembered, taken);
                faults.extend(clash.err().map(|message| written.fault(message)));
                outputs.remembered.push((called, input));
            }
        }
        outputs.list.push((item, table, own));
    }
    Some(outputs)
}

/// What the entries say; `mappings` are the files that they name, in their order.
pub(crate) fn read(
    root: &mut Table<'_>,
    outputs: Outputs<'_>,
    around: &Surroundings<'_>,
    mappings: &[Option<Document>],
    faults: &mut Sink,
) -> (Read, Option<Fallback>) {
    for key in OWN {
        if let Some(value) = root.optional(key) {
            faults.push(value.fault(catalogue::beside_outputs(key)));
        }
    }
    let hold = protection::hold(root, faults);
    let mut columns = 0;
    let mut known = true;
    let mut list: Vec<Option<Output>> = Vec::new();
    let mut taken: Vec<(Value<'_>, std::ops::Range<usize>)> = Vec::new();
    for (index, (item, table, name)) in outputs.list.into_iter().enumerate() {
        let document = mappings.get(index).and_then(Option::as_ref);
        let one = one(table, name, (around, document), columns, faults);
        known &= one.width > 0;
        let first = one.column;
        columns += one.width;
        taken.push((item, first..first + one.width));
        list.push(one.output);
    }
    if !known || !disjoint(&taken, columns, faults) {
        columns = 0;
    }
    let outputs: Option<Vec<Output>> = list.into_iter().collect();
    // of the first output: whoever reads this instead of the outputs knows one duty
    let first = outputs.as_ref().and_then(|all| all.first()).map(|first| first.fallback);
    let fallback = first.zip(hold).map(|(duty, hold)| Fallback { duty, hold });
    (Read { outputs, columns }, fallback)
}

/// One entry, its first column, and how many it has; 0 if that is unknown.
struct One {
    output: Option<Output>,
    column: usize,
    width: usize,
}

fn one(
    mut table: Table<'_>,
    name: Option<String>,
    (around, document): (&Surroundings<'_>, Option<&Document>),
    next: usize,
    faults: &mut Sink,
) -> One {
    // the columns behind those of the output before, unless it says others
    let column = table
        .optional("column")
        .map_or(Some(next), |v| v.integer(0..=MAX_WIDTH - 1, faults));
    let at = table.optional("actions");
    let before = faults.count();
    let actions = actions::read(&mut table, around, &[], faults);
    let is_sound = faults.count() == before;
    if let (Some(at), Head::Residual(_) | Head::Schedule(_)) = (at, &actions.head) {
        faults.push(at.fault(catalogue::law_of_several()));
    }
    let mapping = mapped(&mut table, document, around.signals, faults);
    let fallback = protection::own_fallback(&mut table, faults);
    // without a fallback the limits are read all the same, for their own faults
    let assumed = fallback.map(|duty| Fallback { duty, hold: 0 });
    let limits = protection::limits(&mut table, assumed, faults);
    table.finish(faults);
    let width = if is_sound { actions.outputs } else { 0 };
    let output = || {
        Some(Output {
            name: name?,
            column: column?,
            head: is_sound.then_some(actions.head)?,
            mapping: mapping?,
            limits: limits?,
            fallback: fallback?,
        })
    };
    One {
        output: output(),
        column: column.unwrap_or(next),
        width: if column.is_some() { width } else { 0 },
    }
}

/// `None` if faulty, `Some(None)` without a mapping.
pub(crate) fn mapped(
    table: &mut Table<'_>,
    document: Option<&Document>,
    signals: &[String],
    faults: &mut Sink,
) -> Option<Option<Mapping>> {
    let Some(value) = table.optional("mapping") else {
        return Some(None);
    };
    let mut section = value.table("[mapping]", faults)?;
    let hint = "the file with the coefficients: `file = \"drm.toml\"`";
    if let Some(file) = section.required("file", hint, faults) {
        file.text(faults);
    }
    let load_current = mapping::load_current(&mut section, signals, faults);
    section.finish(faults);
    // read without a load current too, so that the faults of drm.toml come in the same run
    let mapping = mapping::read(document?, load_current.unwrap_or_default(), faults)?;
    load_current.map(|_| Some(mapping))
}

/// Whether no column belongs to two outputs, and none of so many to none.
fn disjoint(taken: &[(Value<'_>, std::ops::Range<usize>)], columns: usize, faults: &mut Sink) -> bool {
    let before = faults.count();
    for (index, (item, own)) in taken.iter().enumerate() {
        let at = item.peek("column").unwrap_or_else(|| item.clone());
        let earlier = taken[..index].iter().map(|(_, other)| other);
        if let Some(other) = earlier
            .clone()
            .find(|other| own.start < other.end && other.start < own.end)
        {
            faults.push(at.fault(catalogue::columns_overlap(own, other)));
        } else if own.end > columns {
            faults.push(at.fault(catalogue::columns_outside(own, columns)));
        }
    }
    faults.count() == before
}

//! A scenario: which converter, which load steps, which classical controllers beside the policy.

use std::ops::RangeInclusive;
use std::path::Path;

use toml_input::{Document, Faults, FileName, Message, Sink, Table, Value, messages};

use crate::baselines::Kind;
use crate::load_step::{LoadKind, LoadStep, REFERENCE_RANGE, SOURCE_RANGE};
use crate::read;
use crate::scenario::Task;

/// What a scenario file says.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// The plant's file, from the scenario's folder; nothing if the scenario leaves it open.
    pub plant: Option<FileName>,
    /// Numbers of the plant that take the place of its file's, by key.
    pub set: Vec<(String, f64)>,
    /// Which of several outputs of the policy drives the plant, by name.
    pub output: Option<String>,
    /// Voltage to hold, V; nothing if it is the policy's parameter `v_ref`.
    pub v_ref: Option<f64>,
    /// Load steps in the order of the file: powers, currents, resistances.
    pub load_steps: Vec<LoadStep>,
    /// Whether the load steps are those of the paper's converter, because the file names none.
    pub default_steps: bool,
    /// Instants and periods; its own load steps are not used.
    pub task: Task,
    /// Classical controllers that run beside the policy.
    pub baselines: Vec<Kind>,
    /// Observers of the policy behind which they stand, by name; none where they see what the sensors show.
    pub observers: Vec<String>,
    /// Duties that the limits may use, one limit each.
    pub limits: Vec<[f64; 2]>,
}

/// Control periods of one run at most, so that a slip of the pen does not run for hours.
const LONGEST_RUN: usize = 100_000;

impl Scenario {
    /// Reads a scenario file.
    ///
    /// # Errors
    /// All faults of the file with their places, or that it cannot be read.
    pub fn load(file: impl Into<FileName>) -> Result<Self, Faults> {
        Self::read(&Document::open(file)?)
    }

    /// Reads the text of a scenario; `file` names it in messages, and paths are from its folder.
    ///
    /// # Errors
    /// All faults of the text with their places.
    pub fn from_toml(file: &Path, text: &str) -> Result<Self, Faults> {
        Self::read(&Document::from_text(file, text)?)
    }

    fn read(document: &Document) -> Result<Self, Faults> {
        document.read(|root, faults| top(document, root, faults))
    }
}

fn top(document: &Document, root: &mut Table<'_>, faults: &mut Sink) -> Option<Scenario> {
    let plant = root.optional("plant").and_then(|v| v.text(faults));
    let set = root.with_default("set", Vec::new(), faults, read::plant_numbers);
    let output = root.optional("output").and_then(|v| v.text(faults)).map(str::to_owned);
    let v_ref = root.optional("v_ref").and_then(|v| v.positive(faults));
    let (currents, resistances) = (root.optional("current_steps"), root.optional("resistance_steps"));
    let others = ["source_steps", "reference_steps"];
    let others = others.iter().any(|key| document.peek(&[key]).is_some());
    let task = read::task(root, faults);
    check(&task, document, root, faults);
    let default_steps =
        document.peek(&["load_steps"]).is_none() && currents.is_none() && resistances.is_none() && !others;
    let powers_meant = document.peek(&["load_steps"]).is_some() || default_steps;
    let powers = if powers_meant {
        task.load_steps.clone()
    } else {
        Vec::new()
    };
    let read_steps = |value: Option<Value<'_>>, of, range, faults: &mut Sink| {
        value
            .and_then(|v| read::pairs(&v, of, range, faults))
            .unwrap_or_default()
    };
    let currents = read_steps(currents, "currents in A: [[2, 10]]", LoadKind::Current.range(), faults);
    let resistances = read_steps(
        resistances,
        "resistances in ohm: [[50, 10]]",
        LoadKind::Resistance.range(),
        faults,
    );
    let kinds = [
        (LoadKind::Power, powers),
        (LoadKind::Current, currents),
        (LoadKind::Resistance, resistances),
    ];
    let of_kind = |(kind, pairs): (LoadKind, Vec<[f64; 2]>)| {
        pairs.into_iter().map(move |values| LoadStep { kind, ..values.into() })
    };
    let mut load_steps: Vec<LoadStep> = kinds.into_iter().flat_map(of_kind).collect();
    let first = load_steps.first().map(|step| (step.kind, step.values[0]));
    for beside in [SOURCE, REFERENCE] {
        beside.read(root, first, &mut load_steps, faults);
    }
    if load_steps.is_empty() && faults.is_empty() {
        let hint = "load_steps = [[200, 500], [500, 200]]  # W";
        faults.push(root.fault(Message::new("a scenario without a load step").hint(hint)));
    }
    Some(Scenario {
        plant: plant.map(|text| document.source().name.beside(text)),
        set,
        output,
        v_ref,
        load_steps,
        default_steps,
        task,
        baselines: root.with_default("baselines", Kind::ALL.to_vec(), faults, baselines),
        observers: root.with_default("observer", Vec::new(), faults, observers),
        limits: root.with_default("limit", vec![[0.0, 1.0]], faults, limits),
    })
}

/// Steps of something else, at a load that stays.
struct Beside {
    steps: &'static str,
    load: &'static str,
    /// What steps, in a sentence.
    what: &'static str,
    /// How the list is written.
    list: &'static str,
    /// How the file says it.
    hint: &'static str,
    range: RangeInclusive<f64>,
    make: fn([f64; 2], LoadKind, f64) -> LoadStep,
}

const SOURCE: Beside = Beside {
    steps: "source_steps",
    load: "source_load",
    what: "the source",
    list: "source voltages in V: [[180, 220]]",
    hint: "source_steps = [[180, 220]]  # V",
    range: SOURCE_RANGE,
    make: LoadStep::of_source,
};

const REFERENCE: Beside = Beside {
    steps: "reference_steps",
    load: "reference_load",
    what: "the reference",
    list: "voltages to hold in V: [[10, 12]]",
    hint: "reference_steps = [[10, 12]]  # V",
    range: REFERENCE_RANGE,
    make: LoadStep::of_reference,
};

impl Beside {
    /// The steps behind those of the load, at their own load or at `first`, the one before the first load step.
    fn read(
        self,
        root: &mut Table<'_>,
        first: Option<(LoadKind, f64)>,
        load_steps: &mut Vec<LoadStep>,
        faults: &mut Sink,
    ) {
        let given = root.optional(self.load);
        let load = match &given {
            Some(value) => standing_load(value, self.load, faults),
            None => first,
        };
        let Some(value) = root.optional(self.steps) else {
            if let Some(value) = given.filter(|_| faults.is_empty()) {
                let message = format!("a load for steps of {}, and no such steps", self.what);
                faults.push(value.fault(Message::new(message).hint(self.hint)));
            }
            return;
        };
        let pairs = read::pairs(&value, self.list, self.range, faults).unwrap_or_default();
        if let Some((kind, load)) = load {
            load_steps.extend(pairs.into_iter().map(|pair| (self.make)(pair, kind, load)));
        } else if given.is_none() {
            let message = Message::new(format!("steps of {} without a load", self.what));
            faults.push(value.fault(message.hint(format!("{} = {{ power = 500.0 }}", self.load))));
        }
    }
}

fn standing_load(value: &Value<'_>, key: &'static str, faults: &mut Sink) -> Option<(LoadKind, f64)> {
    let kinds = [
        ("power", LoadKind::Power),
        ("current", LoadKind::Current),
        ("resistance", LoadKind::Resistance),
    ];
    value.read_table(key, faults, |table, faults| {
        let mut found = Vec::new();
        for (key, kind) in kinds {
            let number = table.optional(key).and_then(|v| v.number_within(kind.range(), faults));
            found.extend(number.map(|number| (kind, number)));
        }
        match found.as_slice() {
            [one] => Some(*one),
            _ if !faults.is_empty() => None,
            several => {
                let keys = "`power` (W), `current` (A), `resistance` (ohm)";
                faults.push(table.fault(messages::exactly_one_of(key, keys, several.len())));
                None
            }
        }
    })
}

fn check(task: &Task, document: &Document, root: &Table<'_>, faults: &mut Sink) {
    // at the key that is there: the other one is the default
    let fault = |keys: [&str; 2], message: Message| {
        let value = keys.iter().find_map(|key| document.peek(&[key]));
        match value {
            Some(value) => value.fault(message),
            None => root.fault(message),
        }
    };
    if task.tail > task.after {
        let message = Message::new("`tail` is longer than `after`")
            .found(format!("tail = {}, after = {}", task.tail, task.after))
            .expected("the tail is the last part of the periods after the step");
        faults.push(fault(["tail", "after"], message));
    }
    // instants come one period after the other, so the last of them makes the lead that much longer
    let longest = task.lead + task.after + task.instants.max(task.sampling_instants);
    if longest > LONGEST_RUN {
        let message = Message::new("a run is too long")
            .found(format!("{longest} control periods of `lead`, `after` and instants"))
            .expected(format!("at most {LONGEST_RUN}"));
        let longer = if task.lead > task.after {
            ["lead", "after"]
        } else {
            ["after", "lead"]
        };
        faults.push(fault(longer, message));
    }
}

fn baselines(value: &Value<'_>, faults: &mut Sink) -> Option<Vec<Kind>> {
    let choices = Kind::ALL.map(|kind| (kind.name(), kind));
    let mut kinds = value.each("names: [\"pid\", \"deadbeat\"]", faults, |item, faults| {
        item.choice(&choices, faults)
    })?;
    // in the order of the page, whatever that of the file
    kinds.sort();
    kinds.dedup();
    Some(kinds)
}

/// A name, or several of them.
fn observers(value: &Value<'_>, faults: &mut Sink) -> Option<Vec<String>> {
    if value.as_list().is_none() {
        return value.text(faults).map(|name| vec![name.to_owned()]);
    }
    value.each("names of observers: [\"slow\", \"fast\"]", faults, |item, faults| {
        item.text(faults).map(str::to_owned)
    })
}

/// `false`, the duties the limit may use, or several of them.
fn limits(value: &Value<'_>, faults: &mut Sink) -> Option<Vec<[f64; 2]>> {
    let Some(items) = value.as_list() else {
        // its fault is thrown away: that of `list` names all forms there are
        let Some(wanted) = value.boolean(&mut Sink::new()) else {
            value.list("`false`, duties [low, high], or several of them", faults);
            return None;
        };
        return Some(if wanted { vec![[0.0, 1.0]] } else { Vec::new() });
    };
    let one = |value: &Value<'_>, faults: &mut Sink| value.interval_within(0.0..=1.0, faults);
    if items.iter().all(|item| item.as_list().is_some()) {
        value.each("pairs of duties: [[0.44, 0.55], [0, 1]]", faults, one)
    } else {
        one(value, faults).map(|range| vec![range])
    }
}

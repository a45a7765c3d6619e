//! From the text of a training file to [`Settings`]: one function per table.

use std::path::Path;

use sha2::{Digest, Sha256};
use toml::de::DeTable;

use super::reader::{FaultList, Table, Text, Value, nearest};
use super::{Draw, Episode, Instants, Learning, Loads, Randomised, Requirement, Reward, Selection, Settings, Stage};
use crate::faults::{Fault, Faults};
use crate::learner::{LearnerSettings, Loss, TargetUpdate};
use crate::optimiser::AdamSettings;
use closed_loop::scenario::Task;

const ANY: [f64; 2] = [f64::MIN, f64::MAX];
const POWER: [f64; 2] = [0.0, 1e7];
const MOST_STEPS: u64 = 1_000_000_000;

pub(super) fn settings(text: &str, path: &Path) -> Result<Settings, Faults> {
    let (tree, errors) = DeTable::parse_recoverable(text);
    let text = Text { file: path, text };
    if !errors.is_empty() {
        let fault = |error: &toml::de::Error| {
            let fault = Fault::new("this is not valid TOML").found(error.message().to_lowercase());
            text.at(&error.span().unwrap_or(0..0), fault)
        };
        return Err(Faults(errors.iter().map(fault).collect()));
    }
    let mut faults = Vec::new();
    let mut root = Table::root(text, tree.get_ref());
    let settings = top(&mut root, path, &mut faults);
    root.finish(&mut faults);
    faults.sort_by_key(|fault| fault.place.as_ref().map(|place| (place.line, place.column)));
    match settings {
        Some(settings) if faults.is_empty() => Ok(settings),
        _ => Err(Faults(faults)),
    }
}

fn top(root: &mut Table<'_>, path: &Path, faults: &mut FaultList) -> Option<Settings> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut file = |key, hint, faults: &mut FaultList| {
        let value = root.required(key, hint, faults)?;
        value.string(faults).map(|text| folder.join(text))
    };
    let plant = file(
        "plant",
        "the converter: `plant = \"../plants/paper-model.toml\"`",
        faults,
    );
    let contract = file(
        "contract",
        "a policy.toml: `contract = \"paper12/policy.toml\"`",
        faults,
    );
    let set = root.optional("set").map_or(Some(Vec::new()), |v| set(&v, faults));
    let hint = "control periods of training at most: `steps = 20000`";
    let steps = root
        .required("steps", hint, faults)
        .and_then(|v| v.integer(1, MOST_STEPS, faults));
    let seeds = root.optional("seeds").map_or(Some(vec![0]), |v| seeds(&v, faults));
    let early_stop = root
        .optional("early_stop")
        .and_then(|v| v.boolean(faults))
        .unwrap_or(true);
    let hidden = match root.optional("network") {
        Some(value) => network(&value, faults),
        None => Some(vec![64, 64]),
    };
    let steps_or = steps.unwrap_or(1);
    let learning = with_table(root, "learning", faults, |table, faults| {
        Some(learning(table, steps_or, faults))
    });
    let reward = with_table(root, "reward", faults, |table, faults| Some(reward(table, faults)));
    let episode = with_table(root, "episode", faults, episode);
    let curriculum = tables(root, "curriculum", faults, stage);
    let randomise = tables(root, "randomise", faults, randomised);
    let selection = with_table(root, "selection", faults, selection);
    let evaluation = with_table(root, "evaluation", faults, |table, faults| task(table, faults));
    let specification = tables(root, "spec", faults, requirement);
    let digest = Sha256::digest(root.text.text.as_bytes());
    Some(Settings {
        file: path.to_owned(),
        plant: plant?,
        set: set?,
        contract: contract?,
        seeds: seeds?,
        steps: steps?,
        early_stop,
        hidden: hidden?,
        learning: learning?,
        reward: reward?,
        episode: episode?,
        curriculum,
        randomise,
        selection: selection?,
        evaluation: evaluation?,
        specification,
        digest: digest.iter().map(|byte| format!("{byte:02x}")).collect(),
    })
}

/// Reads the table `key`; one that is missing reads as an empty one.
fn with_table<'a, T>(
    root: &mut Table<'a>,
    key: &'static str,
    faults: &mut FaultList,
    read: impl FnOnce(&mut Table<'a>, &mut FaultList) -> Option<T>,
) -> Option<T> {
    let title = format!("[{key}]");
    let mut table = match root.optional(key) {
        Some(value) => value.table(&title, faults)?,
        None => root.empty(&title),
    };
    let result = read(&mut table, faults);
    table.finish(faults);
    result
}

/// Reads an array of tables; a missing one is empty.
fn tables<'a, T>(
    root: &mut Table<'a>,
    key: &'static str,
    faults: &mut FaultList,
    read: impl Fn(&mut Table<'a>, &mut FaultList) -> Option<T>,
) -> Vec<T> {
    let Some(value) = root.optional(key) else {
        return Vec::new();
    };
    let title = format!("[[{key}]]");
    let items = value.list(&format!("tables: {title}"), faults).unwrap_or_default();
    let mut list = Vec::new();
    for item in items {
        let Some(mut table) = item.table(&title, faults) else {
            continue;
        };
        list.extend(read(&mut table, faults));
        table.finish(faults);
    }
    list
}

fn set(value: &Value<'_>, faults: &mut FaultList) -> Option<Vec<(String, f64)>> {
    let entries = value.entries(faults)?;
    let mut list = Vec::new();
    for (key, value) in entries {
        known_parameter(&key, &value, faults);
        list.push((key, value.number(ANY[0], ANY[1], faults)?));
    }
    Some(list)
}

/// A fault at `value` if the plant has no number `key`.
fn known_parameter(key: &str, value: &Value<'_>, faults: &mut FaultList) {
    if plant::parameter(key).is_none() {
        let keys: Vec<&'static str> = plant::parameters().map(|parameter| parameter.key).collect();
        let fault = Fault::new(format!("the plant has no number `{}`", key.escape_debug()));
        let hint = match nearest(key, &keys) {
            Some(near) => format!("did you mean `{near}`?"),
            None => "write it as in the plant's file, `table.key`: \"switch.v_f\"".to_owned(),
        };
        faults.push(value.fault(fault.hint(hint)));
    }
}

fn seeds(value: &Value<'_>, faults: &mut FaultList) -> Option<Vec<u64>> {
    let items = value.list("whole numbers: [0, 1, 2]", faults)?;
    if items.is_empty() {
        value.out_of_range("no seed", "at least one", faults);
    }
    items
        .iter()
        .map(|item| item.integer(0, i64::MAX as u64, faults))
        .collect()
}

fn network(value: &Value<'_>, faults: &mut FaultList) -> Option<Vec<usize>> {
    let mut table = value.table("[network]", faults)?;
    let hidden = match table.optional("hidden") {
        Some(value) => widths(&value, faults),
        None => Some(vec![64, 64]),
    };
    table.finish(faults);
    hidden
}

fn widths(value: &Value<'_>, faults: &mut FaultList) -> Option<Vec<usize>> {
    let items = value.list("widths of the hidden layers: [64, 64]", faults)?;
    if !(1..=8).contains(&items.len()) {
        value.out_of_range(&format!("{} hidden layers", items.len()), "1 to 8", faults);
        return None;
    }
    items.iter().map(|item| item.count(1, 1024, faults)).collect()
}

fn learning(table: &mut Table<'_>, steps: u64, faults: &mut FaultList) -> Learning {
    let algorithm = table
        .optional("algorithm")
        .and_then(|v| v.choice(&["dqn", "double-dqn"], faults));
    let loss = table
        .optional("loss")
        .and_then(|v| v.choice(&["huber", "squared"], faults));
    let rate = table
        .optional("learning_rate")
        .and_then(|v| v.positive(faults))
        .unwrap_or(1e-3);
    let last = table
        .optional("final_learning_rate")
        .and_then(|v| v.positive(faults))
        .unwrap_or(rate);
    let discount = table
        .optional("discount")
        .and_then(|v| v.number(0.0, 0.999_999, faults))
        .unwrap_or(0.9);
    let batch = table
        .optional("batch")
        .and_then(|v| v.count(1, 65_536, faults))
        .unwrap_or(256);
    let replay = table
        .optional("replay")
        .and_then(|v| v.count(1, 10_000_000, faults))
        .unwrap_or(200_000);
    let warm_up = table
        .optional("warm_up")
        .and_then(|v| v.integer(1, MOST_STEPS, faults))
        .unwrap_or(batch as u64);
    let updates_per_step = table
        .optional("updates_per_step")
        .and_then(|v| v.count(1, 100, faults))
        .unwrap_or(1);
    let gradient_clip = match table.optional("gradient_clip") {
        Some(value) => value.positive(faults),
        None => Some(1.0),
    };
    let target_update = table
        .optional("target_update")
        .and_then(|v| target_update(&v, faults))
        .unwrap_or(TargetUpdate::Soft { rate: 1e-3 });
    let adam = table
        .optional("adam")
        .and_then(|v| adam(&v, faults))
        .unwrap_or_default();
    let (epsilon_start, epsilon_end, epsilon_steps) = table
        .optional("epsilon")
        .and_then(|v| epsilon(&v, steps, faults))
        .unwrap_or((1.0, 0.1, steps.div_ceil(3)));
    let learner = LearnerSettings {
        batch,
        discount,
        double: algorithm == Some(1),
        target_update,
        loss: if loss == Some(1) { Loss::Squared } else { Loss::Huber },
        gradient_clip,
        adam,
    };
    Learning {
        learner,
        learning_rate: rate,
        final_learning_rate: last,
        replay,
        warm_up,
        updates_per_step,
        epsilon_start,
        epsilon_end,
        epsilon_steps,
    }
}

fn target_update(value: &Value<'_>, faults: &mut FaultList) -> Option<TargetUpdate> {
    let mut table = value.table("target_update", faults)?;
    let (soft, hard) = (table.optional("soft"), table.optional("hard"));
    let update = match (soft, hard) {
        (Some(soft), None) => {
            let rate = soft.positive(faults)?;
            if rate > 1.0 {
                soft.out_of_range(&rate.to_string(), "more than 0, at most 1", faults);
            }
            Some(TargetUpdate::Soft { rate })
        }
        (None, Some(hard)) => hard
            .integer(1, MOST_STEPS, faults)
            .map(|every| TargetUpdate::Hard { every }),
        _ => {
            let fault = Fault::new("`target_update` needs exactly one of `soft`, `hard`");
            faults.push(value.fault(fault.hint("{ soft = 1e-3 } or { hard = 500 }")));
            None
        }
    };
    table.finish(faults);
    update
}

fn adam(value: &Value<'_>, faults: &mut FaultList) -> Option<AdamSettings> {
    let mut table = value.table("adam", faults)?;
    let default = AdamSettings::default();
    let mut beta = |key, default, faults: &mut FaultList| {
        table
            .optional(key)
            .and_then(|v| v.number(0.0, 0.999_999, faults))
            .unwrap_or(default)
    };
    let beta1 = beta("beta1", default.beta1, faults);
    let beta2 = beta("beta2", default.beta2, faults);
    let epsilon = table
        .optional("epsilon")
        .and_then(|v| v.positive(faults))
        .unwrap_or(default.epsilon);
    table.finish(faults);
    Some(AdamSettings { beta1, beta2, epsilon })
}

fn epsilon(value: &Value<'_>, steps: u64, faults: &mut FaultList) -> Option<(f64, f64, u64)> {
    let mut table = value.table("epsilon", faults)?;
    let start = table
        .optional("start")
        .and_then(|v| v.number(0.0, 1.0, faults))
        .unwrap_or(1.0);
    let end = table
        .optional("end")
        .and_then(|v| v.number(0.0, 1.0, faults))
        .unwrap_or(0.1);
    let over = table.optional("steps").and_then(|v| v.integer(1, MOST_STEPS, faults));
    table.finish(faults);
    Some((start, end, over.unwrap_or(steps.div_ceil(3))))
}

fn reward(table: &mut Table<'_>, faults: &mut FaultList) -> Reward {
    let v_ref = table
        .optional("v_ref")
        .and_then(|v| v.positive(faults))
        .unwrap_or(100.0);
    let bands = match table.optional("bands") {
        Some(value) => bands(&value, faults),
        None => vec![(0.1, 10.0), (1.0, 1.0)],
    };
    let mut weight = |key, default, faults: &mut FaultList| {
        table
            .optional(key)
            .and_then(|v| v.number(0.0, f64::MAX, faults))
            .unwrap_or(default)
    };
    Reward {
        v_ref,
        bands,
        error_weight: weight("error_weight", 10.0, faults),
        duty_change_weight: weight("duty_change_weight", 0.0, faults),
    }
}

fn bands(value: &Value<'_>, faults: &mut FaultList) -> Vec<(f64, f64)> {
    let items = value
        .list("pairs: [[0.1, 10.0], [1.0, 1.0]]", faults)
        .unwrap_or_default();
    let mut list: Vec<(f64, f64)> = Vec::new();
    for item in &items {
        let Some([within, reward]) = item.pair(ANY, faults) else {
            continue;
        };
        if within <= list.last().map_or(0.0, |(before, _)| *before) {
            item.out_of_range(&format!("{within} V"), "bands from the narrowest to the widest", faults);
        }
        list.push((within, reward));
    }
    list
}

fn loads(value: &Value<'_>, faults: &mut FaultList) -> Option<Loads> {
    let mut table = value.table("loads", faults)?;
    let given = table.optional("values");
    let values = match &given {
        Some(value) => {
            let items = value.list("powers in W: [200, 500]", faults)?;
            items
                .iter()
                .map(|item| item.number(POWER[0], POWER[1], faults))
                .collect::<Option<Vec<_>>>()?
        }
        None => Vec::new(),
    };
    let range = table.optional("range").and_then(|v| v.interval(POWER, faults));
    let share = table.optional("share").and_then(|v| v.number(0.0, 1.0, faults));
    table.finish(faults);
    let (range, share) = match (values.is_empty(), range) {
        (true, Some(range)) => (range, 0.0),
        (false, Some(range)) => (range, share.unwrap_or(0.5)),
        (false, None) => ([values[0]; 2], 1.0),
        (true, None) => {
            let fault = Fault::new("`loads` is empty").expected("`values`, `range` or both, in W");
            faults.push(value.fault(fault));
            return None;
        }
    };
    Some(Loads { values, range, share })
}

fn episode(table: &mut Table<'_>, faults: &mut FaultList) -> Option<Episode> {
    let steps = table
        .optional("steps")
        .and_then(|v| v.integer(1, MOST_STEPS, faults))
        .unwrap_or(400);
    let load_every = table
        .optional("load_every")
        .and_then(|v| v.integer(1, MOST_STEPS, faults))
        .unwrap_or(100);
    let default = Loads {
        values: vec![200.0, 500.0, 800.0, 1000.0],
        range: [150.0, 1050.0],
        share: 0.5,
    };
    let loads = table.optional("loads").map_or(Some(default), |v| loads(&v, faults));
    let any_phase = table
        .optional("any_phase")
        .and_then(|v| v.boolean(faults))
        .unwrap_or(false);
    let mut interval = |key, bounds, default, faults: &mut FaultList| match table.optional(key) {
        Some(value) => value.interval(bounds, faults),
        None => Some(default),
    };
    let initial_voltage = interval("initial_voltage", [0.0, 1e5], [97.0, 103.0], faults);
    let initial_current = interval("initial_current", [-1e4, 1e4], [-2.0, 2.0], faults);
    let max_error = table
        .optional("max_error")
        .and_then(|v| v.positive(faults))
        .unwrap_or(40.0);
    Some(Episode {
        steps,
        load_every,
        loads: loads?,
        any_phase,
        initial_voltage: initial_voltage?,
        initial_current: initial_current?,
        max_error,
    })
}

fn stage(table: &mut Table<'_>, faults: &mut FaultList) -> Option<Stage> {
    let hint = "first control period behind the stage: `until = 4000`";
    let until = table
        .required("until", hint, faults)
        .and_then(|v| v.integer(1, MOST_STEPS, faults));
    let loads = table.optional("loads").and_then(|v| loads(&v, faults));
    let randomise = table
        .optional("randomise")
        .and_then(|v| v.number(0.0, 1.0, faults))
        .unwrap_or(1.0);
    Some(Stage {
        until: until?,
        loads,
        randomise,
    })
}

fn randomised(table: &mut Table<'_>, faults: &mut FaultList) -> Option<Randomised> {
    let hint = "a number of the plant's file: `key = \"switch.v_f\"`";
    let key = table.required("key", hint, faults).and_then(|v| {
        let key = v.string(faults)?;
        known_parameter(key, &v, faults);
        Some(key)
    });
    let draw = match (table.optional("value"), table.optional("factor")) {
        (Some(value), None) => value.interval(ANY, faults).map(Draw::Value),
        (None, Some(value)) => value.interval(ANY, faults).map(Draw::Factor),
        _ => {
            let fault = Fault::new("[[randomise]] needs exactly one of `value`, `factor`");
            faults.push(table.fault(fault.hint("value = [0.0, 0.2] or factor = [0.8, 1.2]")));
            None
        }
    };
    Some(Randomised {
        key: key?.to_owned(),
        draw: draw?,
    })
}

fn selection(table: &mut Table<'_>, faults: &mut FaultList) -> Option<Selection> {
    let every = table
        .optional("every")
        .and_then(|v| v.integer(1, MOST_STEPS, faults))
        .unwrap_or(500);
    let margin = table.optional("margin").and_then(|v| v.positive(faults)).unwrap_or(1.0);
    let task = task(table, faults)?;
    Some(Selection { every, margin, task })
}

fn task(table: &mut Table<'_>, faults: &mut FaultList) -> Option<Task> {
    let default = Task::default();
    let load_steps = match table.optional("load_steps") {
        Some(value) => {
            let items = value.list("pairs of powers in W: [[200, 500]]", faults)?;
            items
                .iter()
                .map(|item| item.pair(POWER, faults))
                .collect::<Option<Vec<_>>>()
        }
        None => Some(default.load_steps),
    };
    let mut count = |key, low, default, faults: &mut FaultList| {
        table
            .optional(key)
            .and_then(|v| v.count(low, 1_000_000, faults))
            .unwrap_or(default)
    };
    Some(Task {
        load_steps: load_steps?,
        instants: count("instants", 1, default.instants, faults),
        sampling_instants: count("sampling_instants", 1, default.sampling_instants, faults),
        lead: count("lead", 1, default.lead, faults),
        after: count("after", 1, default.after, faults),
        tail: count("tail", 1, default.tail, faults),
    })
}

fn requirement(table: &mut Table<'_>, faults: &mut FaultList) -> Option<Requirement> {
    let load_step = table.optional("load_step").and_then(|v| v.pair(POWER, faults));
    let instants = table
        .optional("instants")
        .and_then(|v| v.choice(&["worst", "sample"], faults));
    let mut limit = |key, faults: &mut FaultList| table.optional(key).and_then(|v: Value<'_>| v.positive(faults));
    let (deviation, settling, tail) = (
        limit("deviation", faults),
        limit("settling", faults),
        limit("tail", faults),
    );
    if deviation.or(settling).or(tail).is_none() {
        faults.push(table.fault(Fault::new("a [[spec]] without a limit").expected("deviation, settling or tail")));
    }
    Some(Requirement {
        load_step,
        instants: if instants == Some(1) {
            Instants::Sample
        } else {
            Instants::Worst
        },
        deviation,
        settling,
        tail,
    })
}

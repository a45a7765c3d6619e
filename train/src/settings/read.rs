//! From a training file to [`Settings`]: one function per table.

use std::ops::RangeInclusive;
use std::path::Path;

use sha2::{Digest, Sha256};
use toml_input::{Document, Faults, Message, Sink, Table, Value, messages};

use super::spread;
use super::{
    Draw, Episode, Instants, Learning, Limits, Loads, Randomised, Requirement, Reward, Selection, Settings, Stage,
};
use crate::learner::{LearnerSettings, Loss, TargetUpdate};
use crate::optimiser::AdamSettings;
use closed_loop::LoadKind;
use closed_loop::read;
use closed_loop::scenario::Task;

// any finite number
const ANY: RangeInclusive<f64> = f64::MIN..=f64::MAX;

pub(super) fn settings(document: &Document) -> Result<Settings, Faults> {
    document.read(|root, faults| top(document, root, faults))
}

fn top(document: &Document, root: &mut Table<'_>, faults: &mut Sink) -> Option<Settings> {
    let name = &document.source().name;
    let path = &name.path;
    let folder = path.parent().unwrap_or(Path::new(""));
    // by the way that is shown, where it is one that can be opened: `plants/buck.toml`, and not `train/../plants/buck.toml`
    let beside = |text: &str| match name.path == name.shown {
        true => name.beside(text).shown,
        false => folder.join(text),
    };
    let mut file = |key, hint, faults: &mut Sink| {
        let value = root.required(key, hint, faults)?;
        value.text(faults).map(&beside)
    };
    let hint = "the converter: `plant = \"../plants/paper-model.toml\"`";
    let plant = file("plant", hint, faults);
    let hint = "a policy.toml: `contract = \"paper12/policy.toml\"`";
    let contract = file("contract", hint, faults);
    let set = root.with_default("set", Vec::new(), faults, read::plant_numbers);
    let hint = "control periods of training at most: `steps = 20000`";
    let steps = root.required("steps", hint, faults).and_then(|v| periods(&v, faults));
    let seeds = root.with_default("seeds", vec![0], faults, seeds);
    let early_stop = root.with_default("early_stop", true, faults, Value::boolean);
    let hidden = root.section("network", faults, |table, faults| {
        Some(table.with_default("hidden", vec![64, 64], faults, widths))
    });
    let learning = root.section("learning", faults, |table, faults| {
        // missing steps have a fault of their own; the default of epsilon only needs some number
        Some(learning(table, steps.unwrap_or(1), faults))
    });
    let reward = root.section("reward", faults, reward);
    let v_ref = reward.as_ref().map_or(100.0, |reward| reward.v_ref);
    let episode = root.section("episode", faults, |table, faults| episode(table, v_ref, faults));
    let curriculum = root.sections("curriculum", faults, stage);
    let randomise = root.sections("randomise", faults, randomised);
    let spread = root.sections("spread", faults, spread::read);
    let selection = root.section("selection", faults, selection);
    let evaluation = root.section("evaluation", faults, task);
    let specification = root.sections("spec", faults, requirement);
    let digest = Sha256::digest(document.source().text.as_bytes());
    Some(Settings {
        file: path.clone(),
        plant: plant?,
        set,
        contract: contract?,
        seeds,
        steps: steps?,
        early_stop,
        hidden: hidden?,
        learning: learning?,
        reward: reward?,
        episode: episode?,
        curriculum,
        randomise,
        spread,
        selection: selection?,
        evaluation: evaluation?,
        specification,
        digest: digest.iter().map(|byte| format!("{byte:02x}")).collect(),
    })
}

/// A number of control periods.
fn periods(value: &Value<'_>, faults: &mut Sink) -> Option<u64> {
    // two days of a training that does 5,000 a second: more is a slip of the pen
    value.integer(1..=1_000_000_000, faults)
}

fn share(value: &Value<'_>, faults: &mut Sink) -> Option<f64> {
    value.number_within(0.0..=1.0, faults)
}

/// A factor that makes a sum over the past converge.
fn below_one(value: &Value<'_>, faults: &mut Sink) -> Option<f64> {
    // ranges are closed: this stands for below 1
    value.number_within(0.0..=0.999_999, faults)
}

fn seeds(value: &Value<'_>, faults: &mut Sink) -> Option<Vec<u64>> {
    let seeds = value.each("whole numbers: [0, 1, 2]", faults, |item, faults| {
        // TOML knows no larger integers
        item.integer(0..=i64::MAX as u64, faults)
    })?;
    if let Some(twice) = seeds.iter().enumerate().find(|(n, seed)| seeds[..*n].contains(seed)) {
        let message = Message::new(format!("{} names a seed twice", value.label())).found(twice.1.to_string());
        faults.push(value.fault(message.expected("different numbers")));
    }
    if seeds.is_empty() {
        faults.push(value.fault(messages::out_of_range(value.label(), "no seed", "at least one")));
    }
    Some(seeds)
}

fn widths(value: &Value<'_>, faults: &mut Sink) -> Option<Vec<usize>> {
    let widths = value.each("widths of the hidden layers: [64, 64]", faults, |item, faults| {
        // width and depth that a policy may have (`policy::limits`), of whose nine layers the last is no hidden one
        item.integer(1..=1024, faults)
    })?;
    if !(1..=8).contains(&widths.len()) {
        faults.push(value.fault(messages::count("hidden layers", widths.len(), 1, 8)));
    }
    Some(widths)
}

fn learning(table: &mut Table<'_>, steps: u64, faults: &mut Sink) -> Learning {
    let double = table.with_default("algorithm", false, faults, |v, faults| {
        v.choice(&[("dqn", false), ("double-dqn", true)], faults)
    });
    let loss = table.with_default("loss", Loss::Huber, faults, |v, faults| {
        v.choice(&[("huber", Loss::Huber), ("squared", Loss::Squared)], faults)
    });
    // rate, discount and batch are the paper's; clipping, soft update and replay are from its authors' code. The
    // replay buffer of 1e-6 that the paper prints is a misprint
    let learning_rate = table.with_default("learning_rate", 1e-3, faults, Value::positive);
    let final_learning_rate = table.with_default("final_learning_rate", learning_rate, faults, Value::positive);
    let discount = table.with_default("discount", 0.9, faults, below_one);
    // upper ends are conventions: ten million transitions of six features take 600 MB, more is a slip of the pen
    let batch = table.with_default("batch", 256, faults, |v, faults| v.integer(1..=65_536, faults));
    let replay = table.with_default("replay", 200_000, faults, |v, faults| v.integer(1..=10_000_000, faults));
    let warm_up = table.with_default("warm_up", batch as u64, faults, periods);
    let updates_per_step = table.with_default("updates_per_step", 1, faults, |v, faults| v.integer(1..=100, faults));
    let gradient_clip = table.with_default("gradient_clip", Some(1.0), faults, |v, faults| {
        v.positive(faults).map(Some)
    });
    let soft = TargetUpdate::Soft { rate: 1e-3 };
    let target_update = table.with_default("target_update", soft, faults, target_update);
    let adam = table.with_default("adam", AdamSettings::default(), faults, adam);
    // the paper's 0.1; start and a third of the steps are conventions
    let default = (1.0, 0.1, steps.div_ceil(3));
    let (epsilon_start, epsilon_end, epsilon_steps) = table.with_default("epsilon", default, faults, |v, faults| {
        v.read_table("epsilon", faults, |table, faults| Some(epsilon(table, default, faults)))
    });
    let learner = LearnerSettings {
        batch,
        discount,
        double,
        target_update,
        loss,
        gradient_clip,
        adam,
    };
    Learning {
        learner,
        learning_rate,
        final_learning_rate,
        replay,
        warm_up,
        updates_per_step,
        epsilon_start,
        epsilon_end,
        epsilon_steps,
    }
}

fn target_update(value: &Value<'_>, faults: &mut Sink) -> Option<TargetUpdate> {
    value.read_table("target_update", faults, |table, faults| {
        match (table.optional("soft"), table.optional("hard")) {
            (Some(soft), None) => {
                let rate = soft.positive(faults)?;
                if rate > 1.0 {
                    let message = messages::out_of_range("soft", &rate.to_string(), "more than 0, at most 1");
                    faults.push(soft.fault(message));
                }
                Some(TargetUpdate::Soft { rate })
            }
            (None, Some(hard)) => periods(&hard, faults).map(|every| TargetUpdate::Hard { every }),
            (soft, _) => {
                let count = if soft.is_some() { 2 } else { 0 };
                let message = messages::exactly_one_of("`target_update`", "`soft`, `hard`", count);
                faults.push(value.fault(message.hint("{ soft = 1e-3 } or { hard = 500 }")));
                None
            }
        }
    })
}

fn adam(value: &Value<'_>, faults: &mut Sink) -> Option<AdamSettings> {
    let default = AdamSettings::default();
    value.read_table("adam", faults, |table, faults| {
        Some(AdamSettings {
            beta1: table.with_default("beta1", default.beta1, faults, below_one),
            beta2: table.with_default("beta2", default.beta2, faults, below_one),
            epsilon: table.with_default("epsilon", default.epsilon, faults, Value::positive),
        })
    })
}

/// Start, end and control periods between.
fn epsilon(table: &mut Table<'_>, default: (f64, f64, u64), faults: &mut Sink) -> (f64, f64, u64) {
    let start = table.with_default("start", default.0, faults, share);
    let end = table.with_default("end", default.1, faults, share);
    (start, end, table.with_default("steps", default.2, faults, periods))
}

fn reward(table: &mut Table<'_>, faults: &mut Sink) -> Option<Reward> {
    let weight = |v: &Value<'_>, faults: &mut Sink| v.number_within(0.0..=f64::MAX, faults);
    let hint = "the voltage that the policy is to hold, in V: `v_ref = 12.0` in [reward]";
    let v_ref = table.required("v_ref", hint, faults).and_then(|v| v.positive(faults));
    // without it every voltage below would be another converter's; the fault is there, and any number does to read on
    let scale = v_ref.unwrap_or(100.0);
    let read = Reward {
        v_ref: scale,
        // the paper's, whose converter has 100 V: 0.1 V and 1 V, and 10 a volt
        bands: table.with_default("bands", vec![(1e-3 * scale, 10.0), (1e-2 * scale, 1.0)], faults, bands),
        error_weight: table.with_default("error_weight", 1e3 / scale, faults, weight),
        duty_change_weight: table.with_default("duty_change_weight", 0.0, faults, weight),
    };
    v_ref.map(|_| read)
}

fn bands(value: &Value<'_>, faults: &mut Sink) -> Option<Vec<(f64, f64)>> {
    let items = value.list("pairs: [[0.1, 10.0], [1.0, 1.0]]", faults)?;
    let mut list: Vec<(f64, f64)> = Vec::new();
    for item in &items {
        let Some([within, reward]) = item.pair(ANY, faults) else {
            continue;
        };
        // the first band that holds |e| counts: a narrow one behind a wide one never would
        if within <= list.last().map_or(0.0, |(before, _)| *before) {
            let expected = "bands from the narrowest to the widest";
            let message = messages::out_of_range(item.label(), &format!("{within} V"), expected);
            faults.push(item.fault(message));
        }
        list.push((within, reward));
    }
    Some(list)
}

fn loads(value: &Value<'_>, faults: &mut Sink) -> Option<Loads> {
    value.read_table("loads", faults, |table, faults| {
        let values = table.optional("values").map_or(Some(Vec::new()), |v| {
            v.each("powers in W: [200, 500]", faults, |item, faults| {
                item.number_within(LoadKind::Power.range(), faults)
            })
        });
        let range = table.optional("range").map_or(Some(None), |v| {
            v.interval_within(LoadKind::Power.range(), faults).map(Some)
        });
        let share = table.with_default("share", 0.5, faults, share);
        let (values, range) = (values?, range?);
        let (range, share) = match (values.first(), range) {
            (None, Some(range)) => (range, 0.0),
            (Some(_), Some(range)) => (range, share),
            // with a share of 1 nothing is ever drawn from the range
            (Some(first), None) => ([*first; 2], 1.0),
            (None, None) => {
                let message = Message::new("`loads` is empty").expected("`values`, `range` or both, in W");
                faults.push(value.fault(message));
                return None;
            }
        };
        Some(Loads { values, range, share })
    })
}

fn episode(table: &mut Table<'_>, v_ref: f64, faults: &mut Sink) -> Option<Episode> {
    let hint = "constant powers that the converter meets, in W: `loads = { values = [40, 100], range = [30, 120] }` in [episode]";
    let given = table.required("loads", hint, faults).and_then(|v| loads(&v, faults));
    // stands in where they are missing or faulty, which is a fault already: the other keys are read all the same
    let no_loads = Loads {
        values: Vec::new(),
        range: [0.0, 0.0],
        share: 0.0,
    };
    let voltage = |v: &Value<'_>, faults: &mut Sink| v.interval_within(0.0..=1e5, faults);
    let current = |v: &Value<'_>, faults: &mut Sink| v.interval_within(-1e4..=1e4, faults);
    let is_given = given.is_some();
    let read = Episode {
        // conventions: a new load after twice the 50 periods in which the paper settles, four loads an episode; a start
        // beside rest; 40 % of the voltage is far beyond all that a controller meets, and nothing is learnt there
        steps: table.with_default("steps", 400, faults, periods),
        load_every: table.with_default("load_every", 100, faults, periods),
        loads: given.unwrap_or(no_loads),
        any_phase: table.with_default("any_phase", false, faults, Value::boolean),
        initial_voltage: table.with_default("initial_voltage", [0.97 * v_ref, 1.03 * v_ref], faults, voltage),
        initial_current: table.with_default("initial_current", [-2.0, 2.0], faults, current),
        max_error: table.with_default("max_error", 0.4 * v_ref, faults, Value::positive),
    };
    is_given.then_some(read)
}

fn stage(table: &mut Table<'_>, faults: &mut Sink) -> Option<Stage> {
    let hint = "first control period behind the stage: `until = 4000`";
    let until = table.required("until", hint, faults).and_then(|v| periods(&v, faults));
    let loads = table.optional("loads").and_then(|v| loads(&v, faults));
    let randomise = table.with_default("randomise", 1.0, faults, share);
    Some(Stage {
        until: until?,
        loads,
        randomise,
    })
}

fn randomised(table: &mut Table<'_>, faults: &mut Sink) -> Option<Randomised> {
    let hint = "a number of the plant's file: `key = \"switch.v_f\"`";
    let key = table.required("key", hint, faults).and_then(|v| {
        let key = v.text(faults)?;
        read::known_parameter(key, &v, faults);
        Some(key)
    });
    let draw = match (table.optional("value"), table.optional("factor")) {
        (Some(value), None) => value.interval(faults).map(Draw::Value),
        (None, Some(value)) => value.interval(faults).map(Draw::Factor),
        (value, _) => {
            let count = if value.is_some() { 2 } else { 0 };
            let message = messages::exactly_one_of("[[randomise]]", "`value`, `factor`", count);
            faults.push(table.fault(message.hint("value = [0.0, 0.2] or factor = [0.8, 1.2]")));
            None
        }
    };
    Some(Randomised {
        key: key?.to_owned(),
        draw: draw?,
    })
}

fn selection(table: &mut Table<'_>, faults: &mut Sink) -> Option<Selection> {
    let every = table.with_default("every", 500, faults, periods);
    let margin = table.with_default("margin", 1.0, faults, Value::positive);
    let task = task(table, faults)?;
    Some(Selection { every, margin, task })
}

/// The load steps, which no default knows: another converter's powers would be judged without a word.
fn task(table: &mut Table<'_>, faults: &mut Sink) -> Option<Task> {
    let hint = "pairs of powers in W, in [selection] and in [evaluation]: `load_steps = [[40, 200], [200, 40]]`";
    let given = table.required("load_steps", hint, faults).is_some();
    let task = read::task(table, faults);
    given.then_some(task)
}

/// A `[[spec]]`.
pub(super) fn requirement(table: &mut Table<'_>, faults: &mut Sink) -> Option<Requirement> {
    let load_step = table
        .optional("load_step")
        .and_then(|v| v.pair(LoadKind::Power.range(), faults));
    let instants = table.with_default("instants", Instants::Worst, faults, |v, faults| {
        v.choice(&[("worst", Instants::Worst), ("sample", Instants::Sample)], faults)
    });
    let limits = limits(table, faults);
    if limits == Limits::default() {
        let expected = "deviation, settling, tail, duty_activity, current_swing or subharmonic";
        faults.push(table.fault(Message::new("a [[spec]] without a limit").expected(expected)));
    }
    Some(Requirement {
        load_step,
        instants,
        limits,
    })
}

/// What a specification limits.
pub(super) fn limits(table: &mut Table<'_>, faults: &mut Sink) -> Limits {
    let mut limit = |key| table.optional(key).and_then(|v| v.positive(faults));
    Limits {
        deviation: limit("deviation"),
        settling: limit("settling"),
        tail: limit("tail"),
        duty_activity: limit("duty_activity"),
        current_swing: limit("current_swing"),
        subharmonic: limit("subharmonic"),
    }
}

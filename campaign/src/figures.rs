//! The few numbers of a result that stand in the table of all results, read from the files that the command wrote.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::kind::Kind;

/// Names and values, in the order of the table's columns.
pub type Figures = Vec<(String, Value)>;

/// What is taken over as it stands: name in the table, file, and place in it (RFC 6901).
type Row = (&'static str, &'static str, &'static str);

const TRAIN: &[Row] = &[
    ("met", "answer.json", "/met"),
    ("ended", "answer.json", "/seeds/0/ended"),
    ("control_periods", "answer.json", "/control_periods"),
    ("kept_after", "answer.json", "/seeds/0/kept/after"),
    ("selection_met", "answer.json", "/seeds/0/kept/selection/met"),
    ("selection_cost", "answer.json", "/seeds/0/kept/selection/cost"),
    ("evaluation_cost", "answer.json", "/seeds/0/kept/evaluation/cost"),
    ("deviation_V", "answer.json", "/seeds/0/kept/worst/deviation"),
    ("settling_s", "answer.json", "/seeds/0/kept/worst/settling"),
    ("tail_max_V", "answer.json", "/seeds/0/kept/worst/tail_max"),
];
const VERIFY: &[Row] = &[
    ("equal", "answer.json", "/equal"),
    ("steps", "answer.json", "/report/steps"),
    ("seed", "answer.json", "/report/seed"),
    ("checksum", "answer.json", "/report/checksum"),
    ("combinations", "answer.json", "/combinations"),
    ("compared", "answer.json", "/compared"),
];
const CERTIFY: &[Row] = &[
    ("bound", "certificate.json", "/state_bound/bound/largest"),
    ("largest_error", "certificate.json", "/measured/largest_error"),
    ("changed_actions", "certificate.json", "/measured/changed_actions"),
    ("observations", "certificate.json", "/measured/observations"),
    ("proven_low", "certificate.json", "/proven_share/low"),
    ("proven_high", "certificate.json", "/proven_share/high"),
];
const DIAGNOSE: &[Row] = &[
    ("verdict", "diagnosis.json", "/verdict"),
    ("sentence", "diagnosis.json", "/sentence"),
];
const PROVE: &[Row] = &[("holds", "proof.json", "/holds")];

/// The figures of a task's files. What a file does not say is left out.
pub(crate) fn of(kind: Kind, files: &BTreeMap<String, Vec<u8>>) -> Figures {
    let mut read: BTreeMap<&str, Value> = BTreeMap::new();
    for name in [
        "answer.json",
        "metrics.json",
        "certificate.json",
        "diagnosis.json",
        "proof.json",
    ] {
        let value = files.get(name).and_then(|bytes| serde_json::from_slice(bytes).ok());
        read.insert(name, value.unwrap_or(Value::Null));
    }
    let rows = match kind {
        Kind::Train => TRAIN,
        Kind::Verify => VERIFY,
        Kind::Certify => CERTIFY,
        Kind::Diagnose => DIAGNOSE,
        Kind::Prove => PROVE,
        Kind::Simulate => &[],
    };
    let taken = rows.iter().filter_map(|(name, file, place)| {
        let value = read.get(file)?.pointer(place)?;
        (!value.is_null()).then(|| ((*name).to_owned(), value.clone()))
    });
    let mut figures: Figures = taken.collect();
    let at = |file: &str, place: &str| read.get(file).and_then(|value| value.pointer(place));
    match kind {
        Kind::Simulate => figures.extend(loads(at("metrics.json", "/load_steps"))),
        Kind::Verify => figures.extend(counted(
            "builds_",
            at("answer.json", "/report/builds"),
            "/outcome/result",
        )),
        Kind::Prove => figures.extend(counted("claims_", at("proof.json", "/claims"), "/verdict")),
        Kind::Diagnose => {
            let causes = at("diagnosis.json", "/causes").and_then(Value::as_array);
            let ids = causes
                .into_iter()
                .flatten()
                .filter_map(|cause| cause.get("id")?.as_str());
            figures.push(("causes".to_owned(), ids.collect::<Vec<_>>().join(" ").into()));
        }
        Kind::Train | Kind::Certify => {}
    }
    figures
}

/// The worst of all load steps for each controller: `policy_deviation_V`, ...
fn loads(steps: Option<&Value>) -> Figures {
    let steps = steps.and_then(Value::as_array);
    let steps: Vec<&Value> = steps.into_iter().flatten().collect();
    let mut names: Vec<&String> = Vec::new();
    for step in &steps {
        let controllers = step.get("controllers").and_then(Value::as_object);
        for name in controllers.into_iter().flat_map(serde_json::Map::keys) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
    }
    // the policy is what the task is about
    names.sort_by_key(|name| (name.as_str() != "policy", name.as_str()));
    let mut figures = Figures::new();
    for name in names {
        for (figure, unit) in [
            ("deviation", "V"),
            ("settling", "s"),
            ("tail_max", "V"),
            ("ripple", "V"),
        ] {
            let of_step = |step: &&Value| step.get("controllers")?.get(name)?.get("worst")?.get(figure)?.as_f64();
            let worst = steps.iter().filter_map(of_step).fold(f64::NEG_INFINITY, f64::max);
            if worst.is_finite() {
                figures.push((format!("{name}_{figure}_{unit}"), worst.into()));
            }
        }
    }
    figures
}

/// How many elements of a list say what: `builds_equal`, ...
fn counted(prefix: &str, list: Option<&Value>, place: &str) -> Figures {
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    for item in list.and_then(Value::as_array).into_iter().flatten() {
        if let Some(word) = item.pointer(place).and_then(Value::as_str) {
            *counts.entry(word).or_default() += 1;
        }
    }
    let named = counts
        .into_iter()
        .map(|(word, count)| (format!("{prefix}{}", word.replace('-', "_")), count.into()));
    named.collect()
}

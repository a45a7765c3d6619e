//! What a result was made without: a program that is not on the machine, or more time. Such a result is shown, and made again.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use crate::kind::Kind;

/// Name of the figure that says so.
pub(crate) const FIGURE: &str = "lacks";

/// Each once, in the order of the alphabet.
pub(crate) fn of(kind: Kind, files: &BTreeMap<String, Vec<u8>>) -> Vec<String> {
    let read = |name: &str| -> Option<Value> { serde_json::from_slice(files.get(name)?).ok() };
    let found = match kind {
        Kind::Verify => read("answer.json").map(|answer| of_builds(&answer)),
        Kind::Prove => read("proof.json").map(|proof| of_claims(&proof)),
        // they start no program and keep no clock
        Kind::Train | Kind::Simulate | Kind::Certify | Kind::Diagnose => None,
    };
    found.unwrap_or_default().into_iter().collect()
}

fn items<'a>(value: &'a Value, place: &str) -> &'a [Value] {
    let list = value.pointer(place).and_then(Value::as_array);
    list.map_or(&[], Vec::as_slice)
}

fn text<'a>(value: &'a Value, place: &str) -> &'a str {
    value.pointer(place).and_then(Value::as_str).unwrap_or_default()
}

/// Builds that were skipped, unless it is the files that lack something: these are the same everywhere.
fn of_builds(answer: &Value) -> BTreeSet<String> {
    let builds = items(answer, "/report/builds").iter();
    let skipped = builds.filter(|build| text(build, "/outcome/result") == "skipped");
    let missing = skipped.flat_map(|build| items(build, "/outcome/missing"));
    let reasons = missing.map(|missing| text(missing, "/reason"));
    reasons
        .filter(|reason| !reason.starts_with("the files have no"))
        .map(str::to_owned)
        .collect()
}

/// Claims whose prover is not installed or was not given the time. What a prover cannot state, it can state nowhere.
fn of_claims(proof: &Value) -> BTreeSet<String> {
    let open = items(proof, "/claims").iter();
    let open = open.filter(|claim| matches!(text(claim, "/verdict"), "not-run" | "unproven"));
    let reasons = open.map(|claim| text(claim, "/reason"));
    let of_machine = |reason: &&str| {
        reason.contains("install") || reason.starts_with("no answer within") || *reason == "interrupted"
    };
    reasons.filter(of_machine).map(str::to_owned).collect()
}

//! Results: the same bytes in whatever order they came, and what they say.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // helpers of tests stand outside of #[test] functions

use std::collections::BTreeMap;

use campaign::{Done, Plan, RECORD, Results, Schedule, State};
use serde_json::{Value, json};

fn plan(seeds: &str) -> Plan {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.toml"), "x = 1").unwrap();
    std::fs::write(folder.path().join("b.toml"), "x = 2").unwrap();
    let text = format!("[[train]]\nsettings = [\"a.toml\", \"b.toml\"]\nseeds = {seeds}\n");
    Plan::from_text(&folder.path().join("plan.toml"), &text).unwrap()
}

/// A training with that answer.
fn done(plan: &Plan, index: usize, exit: u8, met: bool, cost: f64) -> (String, State) {
    let kept = json!({ "selection": { "met": met, "cost": cost } });
    let answer = json!({ "met": exit == 0, "seeds": [{ "ended": "budget", "kept": kept }] });
    let files = BTreeMap::from([("answer.json".to_owned(), answer.to_string().into_bytes())]);
    let done = Done::new(&plan.tasks[index], exit, files);
    let figures = done.figures();
    (done.record.id, State::Done { exit, figures })
}

#[test]
fn the_best_seed_is_the_one_that_train_would_choose() {
    let plan = plan("[10, 2, 3]");
    // a: what meets the specification goes before what costs less; b: the first of two equal ones, by seed and not by letters
    let states = [
        (0, 1, false, 0.1),
        (1, 0, true, 0.9),
        (2, 0, true, 0.8),
        (3, 1, false, 0.5),
        (4, 1, false, 0.5),
        (5, 1, false, 0.7),
    ];
    let states = states.map(|(index, exit, met, cost)| done(&plan, index, exit, met, cost));
    let results = Results::new(&plan.schedule(), states.into());
    let best: Vec<String> = results.best().into_iter().map(|(listed, _)| listed.title()).collect();
    assert_eq!(
        best,
        ["train: settings a.toml, seed 3", "train: settings b.toml, seed 2"]
    );
    // one seed of a is enough; of b there is none
    let refused: Vec<String> = results.refused().into_iter().map(|listed| listed.title()).collect();
    assert_eq!(refused.len(), 3);
    assert!(refused.iter().all(|title| title.contains("b.toml")) && !results.hold());
}

#[test]
fn rows_stand_in_the_order_of_their_axes_however_the_plan_lists_them() {
    let text = |seeds| {
        let plan = plan(seeds);
        let all = (0..6).map(|index| done(&plan, index, 0, true, 0.5));
        let results = Results::new(&plan.schedule(), all.collect());
        (results.json(), results.csv(), results.page().unwrap())
    };
    assert_eq!(text("[10, 2, 3]"), text("[3, 10, 2]"));
    let csv = text("[10, 2, 3]").1;
    let seeds: Vec<&str> = csv
        .lines()
        .skip(1)
        .map(|line| line.split(',').nth(2).unwrap())
        .collect();
    assert_eq!(seeds, ["2", "3", "10", "2", "3", "10"]);
}

#[test]
fn what_failed_or_is_missing_is_counted_and_named() {
    let plan = plan("[1, 2]");
    let failed = State::Failed("error: no \"room\", he said".to_owned());
    let states = [done(&plan, 0, 0, true, 0.5), (plan.tasks[1].id.clone(), failed)];
    let results = Results::new(&plan.schedule(), states.into());
    assert_eq!((results.counts(), results.hold()), ([1, 1, 2], false));
    assert!(
        results
            .csv()
            .contains(",failed,,,,,,\"error: no \"\"room\"\", he said\","),
        "{}",
        results.csv()
    );
    let json: Value = serde_json::from_str(&results.json()).unwrap();
    assert_eq!(
        json["counts"],
        json!({ "tasks": 4, "done": 1, "failed": 1, "missing": 2 })
    );
    assert_eq!(
        (json["best"][0]["axes"]["seed"].clone(), json["holds"].clone()),
        (json!(1), json!(false))
    );
    let page = results.page().unwrap();
    assert!(
        page.contains("no &quot;room&quot;, he said") || page.contains("no \"room\", he said"),
        "{page}"
    );
}

#[test]
fn a_result_that_was_edited_is_none() {
    let plan = plan("[1]");
    let files = BTreeMap::from([("answer.json".to_owned(), b"{}\n".to_vec())]);
    let done = Done::new(&plan.tasks[0], 0, files);
    let (id, folder) = (&plan.tasks[0].id, done.folder());
    assert_eq!(Done::read(id, folder.clone()).unwrap(), done);
    let mut more = folder.clone();
    more.insert("notes.txt".to_owned(), b"mine".to_vec());
    assert_eq!(
        Done::read(id, more).unwrap(),
        done,
        "what lies beside is nobody's result"
    );
    let mut edited = folder.clone();
    edited.insert("answer.json".to_owned(), b"{ }\n".to_vec());
    assert!(Done::read(id, edited).is_err());
    let mut torn = folder.clone();
    torn.remove("answer.json");
    assert!(Done::read(id, torn).is_err());
    let mut none = folder;
    none.remove(RECORD);
    assert!(Done::read(id, none).is_err());
    assert!(
        Done::read("train-0000000000000000", done.folder()).is_err(),
        "of another task"
    );
}

#[test]
fn a_name_that_leads_out_of_the_folder_is_none() {
    let plan = plan("[1]");
    let (text, id) = (plan.schedule().json(), &plan.tasks[0].id);
    assert_eq!(Schedule::read(text.as_bytes()).unwrap(), plan.schedule());
    for strange in [
        "../../results",
        "train-/../../results",
        "train-0123456789abcde",
        "train-0123456789ABCDEF",
        "prove-0123456789abcdef",
    ] {
        let message = Schedule::read(text.replace(id.as_str(), strange).as_bytes()).unwrap_err();
        let fault = toml_input::Fault::from(message);
        assert_eq!(fault.found.as_deref(), Some(strange));
    }
}

/// The record decides which file holds the figures.
#[test]
fn a_record_of_another_command_is_none() {
    let plan = plan("[1]");
    let mut done = Done::new(&plan.tasks[0], 0, BTreeMap::new());
    done.record.kind = campaign::Kind::Prove;
    let fault = toml_input::Fault::from(Done::read(&plan.tasks[0].id, done.folder()).unwrap_err());
    assert!(fault.problem.contains("another command"), "{fault:?}");
}

/// Two plans that call one file by two paths.
#[test]
fn schedules_merge_to_the_same_in_any_order_with_each_task_once() {
    let first = plan("[1]").schedule();
    let text = first.json().replace("\"a.toml\"", "\"./a.toml\"");
    let mut second = Schedule::read(text.replace("policyc ", "policyc 0.0.0-").as_bytes()).unwrap();
    second.name = "an older one".to_owned();
    let (one, other) = (first.clone().merge(second.clone()), second.merge(first.clone()));
    assert_eq!(one, other);
    assert_eq!(one.tasks.len(), first.tasks.len());
    assert_eq!((one.generator, one.name.as_str()), (first.generator, "an older one"));
}

fn state_of(plan: &Plan, index: usize, name: &str, value: &Value) -> (Vec<String>, State) {
    let files = BTreeMap::from([(name.to_owned(), value.to_string().into_bytes())]);
    let done = Done::new(&plan.tasks[index], 0, files);
    let (figures, exit) = (done.figures(), 0);
    (done.lacks(), State::Done { exit, figures })
}

#[test]
fn a_result_without_a_program_or_the_time_for_it_is_not_for_good() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("policy.toml"), "x = 1").unwrap();
    let text = "[[verify]]\npolicies = \"policy.toml\"\n[[prove]]\npolicies = \"policy.toml\"\n";
    let plan = Plan::from_text(&folder.path().join("plan.toml"), text).unwrap();
    let skipped = |reason: &str| {
        let outcome = json!({ "result": "skipped", "missing": [{ "reason": reason, "install": null }] });
        json!({ "report": { "builds": [{ "outcome": { "result": "equal" } }, { "outcome": outcome }] } })
    };
    let (lacks, state) = state_of(&plan, 0, "answer.json", &skipped("clang is not on PATH"));
    assert_eq!(lacks, ["clang is not on PATH"]);
    assert!(!state.is_settled());
    let results = Results::new(&plan.schedule(), [(plan.tasks[0].id.clone(), state)].into());
    assert!(results.json().contains("\"lacks\": \"clang is not on PATH\""));
    let (_, state) = state_of(&plan, 0, "answer.json", &skipped("the files have no Rust code"));
    assert!(state.is_settled(), "they have none on any machine");
    let proof = |verdict: &str, reason: &str| json!({ "claims": [{ "verdict": verdict, "reason": reason }] });
    for (verdict, reason, is_settled) in [
        ("proved", "", true),
        ("refuted", "", true),
        ("not-run", "it has no state", true),
        ("unproven", "the solver says: unknown", true),
        ("unproven", "no answer within 60 s", false),
        (
            "not-run",
            "frama-c is not on PATH; install it: apt-get install frama-c-base",
            false,
        ),
    ] {
        let (_, state) = state_of(&plan, 1, "proof.json", &proof(verdict, reason));
        assert_eq!(state.is_settled(), is_settled, "{reason}");
    }
}

//! Results: the same bytes in whatever order they came, and what they say.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // helpers of tests stand outside of #[test] functions

use std::collections::BTreeMap;

use campaign::{Done, Plan, RECORD, Results, State};
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

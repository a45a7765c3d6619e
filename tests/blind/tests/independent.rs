//! The judge of the independent world on answers made by hand.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use blind::independent::{Answer, Judgement, Outcome, Truth, judge, markdown};
use serde_json::{Value, json};

fn truth(family: &str, hidden: &[&str], expect: &Value) -> Truth {
    let listed = family != "unlisted" && family != "bench";
    let hidden: Vec<Value> = hidden
        .iter()
        .map(|id| json!({"id": id, "listed": listed, "what": "", "parameters": {}, "channel": null, "chi2": 5000.0}))
        .collect();
    let mut whole = json!({"verdicts": [], "causes": [], "must_name": false, "set_aside": null, "refusal": false, "words": [], "wrong": ""});
    for (key, value) in expect.as_object().unwrap() {
        whole[key] = value.clone();
    }
    let truth = json!({
        "world": "independent", "seed": 1, "case": 0, "family": family, "converter": "Buck 24.0 V to 12.0 V", "hidden": hidden,
        "expect": whole, "chi2": 5000.0, "chi2_listed": 5000.0, "ties": [],
        "records": [{"record": "a", "channel": "v_out", "floor": 0.1, "reducible": 1.0}],
    });
    serde_json::from_value(truth).unwrap()
}

fn answer(verdict: &str, causes: &Value) -> Answer {
    let diagnosis =
        json!({"verdict": verdict, "causes": causes, "sentence": "", "noise": {"outliers": [], "repairs": []}});
    Answer {
        exit: Some(0),
        seconds: 1.0,
        said: String::new(),
        diagnosis,
    }
}

fn refusal(said: &str) -> Answer {
    Answer {
        exit: Some(2),
        seconds: 0.1,
        said: said.to_owned(),
        diagnosis: Value::Null,
    }
}

fn dcr() -> Truth {
    let expect = json!({"verdicts": ["explained", "ambiguous"], "causes": ["dcr", "r_ds_on"], "must_name": true});
    truth("cause", &["dcr"], &expect)
}

fn outcome(truth: &Truth, verdict: &str, causes: &Value) -> Outcome {
    judge(truth, &answer(verdict, causes)).outcome
}

#[test]
fn a_hidden_cause_is_right_and_what_stands_beside_it_is_counted() {
    assert_eq!(outcome(&dcr(), "explained", &json!([{"id": "dcr"}])), Outcome::Right);
    assert_eq!(
        outcome(&dcr(), "explained", &json!([{"id": "dcr"}, {"id": "esr"}])),
        Outcome::RightAndWrong
    );
    assert_eq!(
        outcome(&dcr(), "explained", &json!([{"id": "esr"}])),
        Outcome::ConfidentAndWrong
    );
    assert_eq!(
        outcome(&dcr(), "ambiguous", &json!([{"id": "esr", "rivals": [["esl"]]}])),
        Outcome::WrongAmongSeveral
    );
    assert_eq!(outcome(&dcr(), "unexplained", &json!([])), Outcome::Withheld);
    assert_eq!(outcome(&dcr(), "consistent", &json!([])), Outcome::Missed);
    assert_eq!(judge(&dcr(), &refusal("error: no")).outcome, Outcome::Refused);
}

#[test]
fn a_tie_has_to_be_said() {
    let alone = json!([{"id": "r_ds_on", "rivals": []}]);
    assert_eq!(outcome(&dcr(), "explained", &alone), Outcome::TieUnsaid);
    let said = json!([{"id": "r_ds_on", "rivals": [["dcr"]]}]);
    assert_eq!(outcome(&dcr(), "ambiguous", &said), Outcome::Right);
    // another cause that has the hidden one among its rivals is no wrong answer
    assert_eq!(
        outcome(&dcr(), "ambiguous", &json!([{"id": "esr", "rivals": [["dcr"]]}])),
        Outcome::Right
    );
    // a rival that needs more than what is hidden is another story
    assert_eq!(
        outcome(&dcr(), "ambiguous", &json!([{"id": "esr", "rivals": [["dcr", "esl"]]}])),
        Outcome::WrongAmongSeveral
    );
}

#[test]
fn on_nothing_any_claim_is_a_false_alarm() {
    let healthy = truth("healthy", &[], &json!({"verdicts": ["consistent"]}));
    let judged = |verdict, causes: Value| judge(&healthy, &answer(verdict, &causes));
    assert!(!judged("consistent", json!([])).false_alarm);
    assert_eq!(judged("consistent", json!([])).outcome, Outcome::Right);
    assert!(judged("explained", json!([{"id": "esr"}])).false_alarm);
    assert_eq!(
        judged("explained", json!([{"id": "esr"}])).outcome,
        Outcome::ConfidentAndWrong
    );
    assert!(judged("unexplained", json!([])).false_alarm);
    assert_eq!(judged("unexplained", json!([])).outcome, Outcome::Withheld);
}

#[test]
fn a_fault_of_the_bench_has_to_be_named_in_a_refusal_or_a_note() {
    let sign = truth(
        "bench",
        &["sign"],
        &json!({"verdicts": ["unexplained"], "refusal": true, "words": [["turned sign"], ["*-1"]]}),
    );
    assert_eq!(
        judge(&sign, &refusal("error: i_l has the turned sign")).outcome,
        Outcome::Right
    );
    assert_eq!(
        judge(&sign, &refusal("error: line 4 is short")).outcome,
        Outcome::NotNamed
    );
    assert_eq!(outcome(&sign, "unexplained", &json!([])), Outcome::NotNamed);
    assert_eq!(
        outcome(&sign, "explained", &json!([{"id": "dcr"}])),
        Outcome::ConfidentAndWrong
    );
    let mut noted = answer("unexplained", &json!([]));
    noted.diagnosis["noise"]["repairs"] = json!(["try --map i_l=i_l*-1"]);
    assert_eq!(judge(&sign, &noted).outcome, Outcome::Right);
    // the key `outliers` alone is no answer to spikes
    let spikes = truth(
        "bench",
        &["spikes"],
        &json!({"verdicts": ["consistent"], "words": [["outlier"]]}),
    );
    assert_eq!(outcome(&spikes, "unexplained", &json!([])), Outcome::Withheld);
    assert_eq!(outcome(&spikes, "consistent", &json!([])), Outcome::Right);
}

#[test]
fn nonsense_and_unlisted_physics_have_no_cause() {
    let nonsense = truth(
        "nonsense",
        &["walk"],
        &json!({"verdicts": ["unexplained"], "refusal": true}),
    );
    assert_eq!(outcome(&nonsense, "unexplained", &json!([])), Outcome::Right);
    assert_eq!(
        judge(&nonsense, &refusal("error: not of this converter")).outcome,
        Outcome::Right
    );
    assert_eq!(
        outcome(&nonsense, "explained", &json!([{"id": "dcr"}])),
        Outcome::ConfidentAndWrong
    );
    assert_eq!(outcome(&nonsense, "consistent", &json!([])), Outcome::Missed);
    let odd = truth(
        "unlisted",
        &["node_capacitance"],
        &json!({"verdicts": ["unexplained"], "causes": ["turn_off_delay"]}),
    );
    assert_eq!(
        outcome(&odd, "explained", &json!([{"id": "turn_off_delay"}])),
        Outcome::Right
    );
    assert_eq!(
        outcome(&odd, "explained", &json!([{"id": "esr"}])),
        Outcome::ConfidentAndWrong
    );
    // where one listed cause would leave nothing, nobody could tell
    let mut blurred = odd;
    blurred.ties = serde_json::from_value(json!([{"id": "esr", "wiring": "", "left": 3.0}])).unwrap();
    assert_eq!(outcome(&blurred, "explained", &json!([{"id": "esr"}])), Outcome::Right);
}

#[test]
fn a_refused_topology_is_counted_apart() {
    let mut boost = dcr();
    "BuckBoost 17.0 V to 7.4 V".clone_into(&mut boost.converter);
    let said = refusal("error: `diagnose` is built for the buck converter alone");
    assert_eq!(judge(&boost, &said).outcome, Outcome::NoSuchTopology);
    assert_eq!(judge(&dcr(), &said).outcome, Outcome::Refused);
}

#[test]
fn the_gain_is_measured_from_the_true_floor() {
    let mut diagnosis = answer("explained", &json!([{"id": "dcr"}]));
    let line = |record: &str, regime: &str| json!({"record": record, "channel": "v_o", "regime": regime, "rmse_before": 1.0, "rmse_after": 0.28});
    diagnosis.diagnosis["gain"] =
        json!({"heldout": [line("heldout/a.csv", "all"), line("a", "DCM"), line("b", "all")]});
    let judged = judge(&dcr(), &diagnosis);
    assert_eq!(judged.removed.len(), 1);
    assert!((judged.removed[0] - 0.8).abs() < 1e-12);
}

/// Truths exchanged between two perfect answers turn the table red.
#[test]
fn exchanged_truths_are_seen() {
    let esr = truth(
        "cause",
        &["esr"],
        &json!({"verdicts": ["explained"], "causes": ["esr"], "must_name": true}),
    );
    let answers = ["dcr", "esr"].map(|id| answer("explained", &json!([{"id": id}])));
    let table = |first: &Truth, second: &Truth| {
        let cases: Vec<(usize, Judgement)> = vec![(0, judge(first, &answers[0])), (1, judge(second, &answers[1]))];
        markdown(1, &cases)
    };
    assert!(
        table(&dcr(), &esr).contains("| cause | 2 of 2, 100 % (16 to 100 %) |"),
        "{}",
        table(&dcr(), &esr)
    );
    assert!(table(&esr, &dcr()).contains("| cause | 0 of 2, 0 % (0 to 84 %) | 0 | 0 | 0 | 0 | 0 | 0 | 2 |"));
}

#[test]
fn of_a_pair_both_are_asked_for() {
    let pair = truth(
        "pair",
        &["dcr", "esr"],
        &json!({"verdicts": ["explained", "ambiguous"], "causes": ["dcr", "esr"], "must_name": true}),
    );
    let outcome = |ids: &[&str]| {
        let causes: Vec<_> = ids.iter().map(|id| json!({"id": id})).collect();
        judge(&pair, &answer("explained", &json!(causes))).outcome
    };
    assert_eq!(outcome(&["esr", "dcr"]), Outcome::Right);
    assert_eq!(outcome(&["esr"]), Outcome::OneOfTwo);
    assert_eq!(outcome(&["esr", "v_gain"]), Outcome::RightAndWrong);
    assert_eq!(outcome(&["v_gain"]), Outcome::ConfidentAndWrong);
}

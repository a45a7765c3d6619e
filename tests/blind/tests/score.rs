//! The scorer on diagnoses made by hand.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use blind::case::Truth;
use blind::plan::Kind;
use blind::score::{Diagnosis, Judgement, judge, table};
use serde_json::{Value, json};

fn truth(kind: &str, effects: &[(&str, bool, f64, Value)], explanations: &[&[&str]]) -> Truth {
    let effects: Vec<Value> = effects
        .iter()
        .map(|(id, listed, chi2, parameters)| json!({"id": id, "listed": listed, "chi2": chi2, "parameters": parameters}))
        .collect();
    let chi2 = effects
        .iter()
        .map(|effect| effect["chi2"].as_f64().unwrap())
        .sum::<f64>();
    let listed = effects.iter().all(|effect| effect["listed"] == true);
    let truth = json!({
        "seed": 1, "case": 0, "kind": kind, "effects": effects, "chi2": chi2,
        "chi2_listed": if listed { 0.0 } else { 0.5 * chi2 },
        "explanations": explanations,
        "records": [
            {"record": "heldout/a.csv", "column": "v_o", "floor": 0.1, "reducible": 1.0},
            {"record": "train/a.csv", "column": "v_o", "floor": 0.1, "reducible": 1.0},
        ],
    });
    serde_json::from_value(truth).unwrap()
}

fn dcr(explanations: &[&[&str]]) -> Truth {
    let value = json!({"dcr": {"value": 0.4, "nominal": 0.1, "unit": "ohm"}});
    truth("single", &[("dcr", true, 5000.0, value)], explanations)
}

fn answer(verdict: &str, causes: &Value) -> Diagnosis {
    serde_json::from_value(json!({"verdict": verdict, "causes": causes, "not_detectable": ["esl"]})).unwrap()
}

fn none(verdict: &str, causes: &Value) -> Judgement {
    judge(&truth("none", &[], &[]), &answer(verdict, causes))
}

#[test]
fn on_nothing_any_claim_is_a_false_alarm() {
    assert!(!none("consistent", &json!([])).false_alarm);
    assert!(none("consistent", &json!([{"id": "esr"}])).false_alarm);
    assert!(none("unexplained", &json!([])).false_alarm);
    assert_eq!(none("explained", &json!([{"id": "esr"}])).precise, (0, 1));
}

#[test]
fn the_hidden_cause_first_is_right_and_its_parameter_is_checked() {
    let estimate = |value: f64| json!([{"id": "dcr", "parameters": {"dcr": {"value": value, "low": 0.39, "high": 0.41, "unit": "ohm"}}}]);
    let good = judge(&dcr(&[&["dcr"]]), &answer("explained", &estimate(0.404)));
    assert!(good.right_first && good.nothing_wrong && !good.wrong_member);
    assert_eq!((good.precise, good.recalled), ((1, 1), (1, 1)));
    assert!(good.parameters[0].covered && good.parameters[0].of_bound.unwrap() < 0.3);
    let bad = judge(&dcr(&[&["dcr"]]), &answer("explained", &estimate(0.45)));
    assert!(bad.parameters[0].of_bound.unwrap() > 2.0);
}

#[test]
fn a_tie_counts_only_when_it_is_said() {
    let tied = dcr(&[&["dcr"], &["r_ds_on"]]);
    let said = judge(
        &tied,
        &answer(
            "ambiguous",
            &json!([{"id": "r_ds_on", "rivals": ["dcr", ["diode", "esr"]]}]),
        ),
    );
    assert!(said.right_first && !said.wrong_member);
    // a tie has no parameter to check
    assert!(said.parameters.is_empty());
    let silent = judge(&tied, &answer("explained", &json!([{"id": "r_ds_on"}])));
    assert!(!silent.right_first && silent.wrong_member && !silent.nothing_wrong);
    assert_eq!((silent.precise, silent.recalled), ((0, 1), (0, 1)));
    // a rival that needs more than what is hidden is another story
    let more = judge(
        &tied,
        &answer("ambiguous", &json!([{"id": "r_ds_on", "rivals": [["dcr", "esr"]]}])),
    );
    assert!(!more.right_first);
}

#[test]
fn what_stands_beside_the_right_cause_costs_precision() {
    let answer = answer("explained", &json!([{"id": "dcr"}, {"id": "esr"}]));
    let judged = judge(&dcr(&[&["dcr"]]), &answer);
    assert!(judged.right_first && !judged.nothing_wrong && !judged.wrong_member);
    assert_eq!(judged.precise, (1, 2));
}

#[test]
fn of_a_pair_both_have_to_be_found_if_both_show() {
    let both = |second: f64| {
        let hidden = [("esr", true, 900.0, json!({})), ("v_gain", true, second, json!({}))];
        truth("pair", &hidden, &[&["esr", "v_gain"]])
    };
    let half = answer("explained", &json!([{"id": "esr"}]));
    assert_eq!(judge(&both(800.0), &half).recalled, (1, 2));
    assert_eq!(judge(&both(8.0), &half).recalled, (1, 1));
}

#[test]
fn too_small_an_effect_may_be_missed_or_found_but_not_mistaken() {
    let small = truth("single", &[("esl", true, 3.0, json!({}))], &[]);
    let judged = |verdict, causes: Value| judge(&small, &answer(verdict, &causes));
    assert_eq!(judged("consistent", json!([])).kind, Kind::Small);
    assert!(!judged("consistent", json!([])).false_alarm);
    assert!(!judged("explained", json!([{"id": "esl"}])).false_alarm);
    assert!(judged("explained", json!([{"id": "esr"}])).false_alarm);
    assert!(judged("unexplained", json!([])).false_alarm);
    assert_eq!(judged("consistent", json!([])).recalled, (0, 0));
}

#[test]
fn an_unlisted_effect_is_unexplained_or_the_same_thing_by_another_name() {
    let odd = |id| truth("unlisted", &[(id, false, 4000.0, json!({}))], &[]);
    assert!(judge(&odd("mains_pickup"), &answer("unexplained", &json!([]))).unexplained);
    assert!(!judge(&odd("mains_pickup"), &answer("explained", &json!([{"id": "esr"}]))).unexplained);
    assert!(
        judge(
            &odd("slow_turn_off"),
            &answer("explained", &json!([{"id": "turn_off_delay"}]))
        )
        .unexplained
    );
    assert!(judge(&odd("mains_pickup"), &answer("unexplained", &json!([]))).knowable);
    let mut named = answer("consistent", &json!([]));
    assert!(!judge(&odd("outlier_burst"), &named).unexplained);
    named.noise.outliers = vec![json!("a:3:v_o")];
    assert!(judge(&odd("outlier_burst"), &named).unexplained);
}

#[test]
fn the_gain_is_measured_from_the_true_floor() {
    let mut diagnosis = answer("explained", &json!([{"id": "dcr"}]));
    let line = |before, after, record: &str| json!({"record": record, "rmse_before": before, "rmse_after": after, "floor": 0.0, "unit": "V"});
    let heldout = json!([line(1.0, 0.28, "heldout/a.csv"), line(0.1, 0.12, "b.csv"),
        {"record": "a", "channel": "v_o", "regime": "DCM", "rmse_before": 1.0, "rmse_after": 2.0, "unit": "V"}]);
    diagnosis.gain.heldout = serde_json::from_value(heldout).unwrap();
    let judged = judge(&dcr(&[&["dcr"]]), &diagnosis);
    // (1.0 - 0.28) / (1.0 - 0.1); record b is not known to have anything reducible
    assert_eq!(judged.removed.len(), 1);
    assert!((judged.removed[0] - 0.8).abs() < 1e-12);
    assert!((judged.worst_ratio - 1.2).abs() < 1e-12);
}

/// Truths exchanged between two perfect answers: every line that can see it does.
#[test]
fn exchanged_truths_turn_the_table_red() {
    let other = truth("single", &[("esr", true, 900.0, json!({}))], &[&["esr"]]);
    let answers = ["dcr", "esr"].map(|id| answer("explained", &json!([{"id": id}])));
    let judged = |first: &Truth, second: &Truth| {
        let cases = [
            ("a".to_owned(), judge(first, &answers[0])),
            ("b".to_owned(), judge(second, &answers[1])),
        ];
        table(1, &cases)
    };
    let right = judged(&dcr(&[&["dcr"]]), &other);
    assert!(
        right.contains("| single: right cause or its tie first | 2 of 2 | 100 % (16 to 100 %) | >= 92 % | yes |"),
        "{right}"
    );
    let wrong = judged(&other, &dcr(&[&["dcr"]]));
    assert!(
        wrong.contains("| single: right cause or its tie first | 0 of 2 | 0 % (0 to 84 %) | >= 92 % | **no** |"),
        "{wrong}"
    );
    assert!(
        wrong.contains("| precision over causes, pairs included | 0 of 2 |"),
        "{wrong}"
    );
}

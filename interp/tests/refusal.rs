//! Why no code is made of a policy, in words, for each kind of head.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

#[allow(dead_code)] // another file of tests has the rest
mod common;

use common::{Dense, PLAIN, actor, load, threshold, vectors};
use interp::golden::{golden_result, refusal, unproven};
use policy::{Golden, Policy};
use toml_input::Faults;

/// What is said of a policy with these answers.
fn said(mut policy: Policy, golden: Golden) -> Option<String> {
    policy.golden = Some(golden);
    refusal(&policy).map(|message| Faults::from(message).to_string())
}

fn holds(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in:\n{text}");
    }
}

/// Q = (5, x): action 1 if x > 5.
fn chooser() -> Policy {
    threshold("source = \"u\"", PLAIN, &[])
}

#[test]
fn of_actions_alone_their_number_is_told() {
    let answers = |actions: &[u32]| Golden {
        action_indices: actions.to_vec(),
        ..vectors(4, &[3.0, 6.0, 8.0, 2.0])
    };
    assert_eq!(said(chooser(), answers(&[0, 1, 1, 0])), None);
    let told = said(chooser(), answers(&[0, 1, 0, 1])).unwrap();
    holds(
        &told,
        &[
            "the trainer's golden answers",
            "2 of 4 actions equal",
            "hidden_activation",
        ],
    );
}

#[test]
fn changed_decisions_are_counted_beside_what_is_allowed() {
    // each Q is within 6 % of 5.3, so that the network is read right; the trainer's two differ by 11 %, and the network takes the other
    let answers = |decisions: Option<f64>| Golden {
        q_values: vec![5.0, 3.0, 5.3, 4.72, 5.0, 8.0],
        action_indices: vec![0, 0, 1],
        tolerance: 0.06,
        decisions,
        ..vectors(3, &[3.0, 5.02, 8.0])
    };
    let told = said(chooser(), answers(None)).unwrap();
    holds(
        &told,
        &[
            "decisions than allowed",
            "1 of 3 changed in f32, allowed 0 %",
            "golden_decisions in [network]",
        ],
    );
    let told = said(chooser(), answers(Some(0.0725))).unwrap();
    holds(&told, &["1 of 3 changed in f32, allowed 7.25 %"]);
    assert_eq!(said(chooser(), answers(Some(0.34))), None);
}

#[test]
fn duties_that_are_off_are_told_as_a_share_of_their_range() {
    let answers = |tolerance: f64, duty_error: Option<f64>| Golden {
        duties: vec![0.5, 0.625],
        tolerance,
        duty_error,
        ..vectors(2, &[0.5, 0.5])
    };
    // another network: 0.125 of 0.5 is more than the tolerance
    let told = said(actor(), answers(1e-4, None)).unwrap();
    holds(
        &told,
        &[
            "golden answers",
            "DIFFERENT: largest error of the duty 2.5e-1 of its range (allowed 1e-4)",
        ],
    );
    // the same network, of which the format changes too much
    let told = said(actor(), answers(0.3, Some(0.2))).unwrap();
    holds(
        &told,
        &[
            "the trainer's duties more than allowed",
            "2.5e-1 of its range in f32, allowed 2e-1",
            "golden_duty",
        ],
    );
    assert_eq!(said(actor(), answers(0.3, Some(0.25))), None);
}

fn schedule(actions: &str) -> Policy {
    let contract = format!(
        "name = \"gains\"\nsample_period = 0.25\n[[signal]]\nname = \"u\"\nrange = [0.0, 10.0]\n[[feature]]\nname = \"f\"\nsource = \"u\"\n\
         [network]\nweights = \"weights.safetensors\"\n[actions]\n{actions}\n{PLAIN}"
    );
    let network = Dense {
        inputs: 1,
        outputs: 1,
        weights: &[0.0],
        bias: &[0.5],
    };
    load(&contract, &[], &[network])
}

#[test]
fn gains_that_are_off_are_told_as_a_share_of_their_range() {
    let policy = || schedule("base = \"0.25\"\ngains = [{ source = \"u\", clip = [-1, 1], scale = 0.125 }]");
    let answers = |tolerance: f64, duty_error: Option<f64>| Golden {
        q_values: vec![0.5, 0.25],
        tolerance,
        duty_error,
        ..vectors(2, &[1.0, 2.0])
    };
    // a quarter of an output is an eighth of the range from -1 to 1
    let told = said(policy(), answers(1e-4, None)).unwrap();
    holds(
        &told,
        &[
            "DIFFERENT: ",
            "largest error of a gain 1.2e-1 of its range (allowed 1e-4)",
        ],
    );
    let told = said(policy(), answers(0.2, Some(0.1))).unwrap();
    holds(
        &told,
        &[
            "the trainer's gains more than allowed",
            "1.2e-1 of its range in f32, allowed 1e-1",
        ],
    );
    assert_eq!(said(policy(), answers(0.2, Some(0.125))), None);
}

/// The duty of a law is a share of its limits, from 0.125 to 0.875.
#[test]
fn a_duty_of_a_law_is_told_as_a_share_of_its_limits() {
    let policy = schedule("base = \"0.25\"\ngains = [{ source = \"u\", clip = [-1, 1], scale = 0.125 }]");
    let answers = Golden {
        // the network says 0.5: 0.25 + 0.5 / 8 * 2 is 0.375, and 0.1875 more is a quarter of the limits
        duties: vec![0.375, 0.5625],
        law: vec![0.25, 2.0, 0.25, 2.0],
        ..vectors(2, &[2.0, 2.0])
    };
    let result = interp::golden::judge(&answers, &policy.head, &[&[0.5], &[0.5]]);
    assert_eq!((result.worst_duty_error, result.limits_range), (Some(0.25), Some(0.75)));
    holds(
        &result.to_string(),
        &["DIFFERENT: largest error of the duty 2.5e-1 of the range of the limits, 0.75 (allowed 1e-4)"],
    );
}

#[test]
fn a_hint_names_activations_alone_where_answers_tell_them_apart() {
    // one layer has no hidden activation to be another
    let mut policy = chooser();
    policy.golden = Some(Golden {
        q_values: vec![5.0, 4.0],
        ..vectors(1, &[3.0])
    });
    assert!(golden_result(&policy).unwrap().activations.is_empty());
}

#[test]
fn without_answers_a_log_is_named_where_it_tells_them() {
    let open = "nothing shows that the weights were read as the trainer meant";
    let told = unproven(&chooser());
    holds(&told, &["no golden vectors", open, "`policyc replay --golden`"]);
    // no feature passes on what the law reads
    let told = unproven(&schedule(
        "base = \"u / 40\"\ngains = [{ source = \"u - 4\", clip = [-1, 1], scale = 0.125 }]",
    ));
    holds(&told, &["no golden vectors", open]);
    assert!(!told.contains("replay"), "{told}");
    let told = unproven(&schedule(
        "base = \"0.25\"\ngains = [{ source = \"u\", clip = [-1, 1], scale = 0.125 }]",
    ));
    holds(&told, &["replay --golden"]);
}

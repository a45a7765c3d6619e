//! What a numeric format does to the trainer's decisions and duties, on vectors small enough for paper.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

#[allow(dead_code)] // another file of tests has the rest
mod common;

use common::{PLAIN, actor, threshold, vectors};
use interp::decisions::{Choices, Decisions, decisions};
use policy::{Golden, NumericFormat, Policy};

/// Vectors of one observation each; the tolerance is that of a contract.
fn golden(observations: &[f32], q_values: &[f32], actions: &[u32]) -> Golden {
    Golden {
        q_values: q_values.to_vec(),
        action_indices: actions.to_vec(),
        ..vectors(observations.len(), observations)
    }
}

/// The network with Q = (5, x), which takes action 1 if x > 5, with these known answers.
fn chooser(golden: Golden) -> Policy {
    let mut policy = threshold("source = \"u\"", PLAIN, &[]);
    policy.golden = Some(golden);
    policy
}

fn choices(policy: &Policy, allowed: Option<f64>) -> Choices {
    match decisions(policy, allowed).unwrap() {
        Decisions::Choice(choices) => choices,
        other => panic!("{other:?}"),
    }
}

const NEARLY_FIVE: f32 = 5.000_244; // 5 + 2^-12

/// The trainer's Q beside (5, x): equal, other by 1, other by 2, a tie by its own rounding, another action than its Q says.
fn five() -> Golden {
    golden(
        &[3.0, 6.0, 4.0, 5.0, 8.0],
        &[5.0, 3.0, 7.0, 6.0, 2.0, 4.0, 5.0, NEARLY_FIVE, 5.0, 8.0],
        &[0, 0, 1, 1, 0],
    )
}

#[test]
fn changed_decisions_are_weighed_by_what_they_give_up() {
    let found = choices(&chooser(five()), None);
    assert_eq!((found.observations, found.changed, found.ties), (5, 2, 2));
    assert_eq!(found.numeric_format, "f32");
    // best less worst: 2, 1, 2, 2^-12 and 3, of which the mean
    let range = (2.0 + 1.0 + 2.0 + 0.000_244_140_625 + 3.0) / 5.0;
    assert!((found.operating_range - range).abs() < 1e-12);
    assert!((found.largest_loss - 2.0 / range).abs() < 1e-12);
    assert!((found.mean_loss - (1.0 + 2.0) / 5.0 / range).abs() < 1e-12);
    let told: Vec<_> = (found.worst.iter())
        .map(|change| (change.row, change.expected, change.found, change.observation[0]))
        .collect();
    assert_eq!(told, [(2, 1, 0, 4.0), (1, 0, 1, 6.0)], "the worst first");
    assert!((found.worst[1].loss - 1.0 / range).abs() < 1e-12);
}

#[test]
fn one_vector_is_weighed_by_its_own_range() {
    // 2 of a range of 2 is given up: the trainer takes 7 where the network takes 5
    let found = choices(&chooser(golden(&[4.0], &[5.0, 7.0], &[1])), None);
    assert_eq!((found.observations, found.changed, found.operating_range), (1, 1, 2.0));
    assert_eq!((found.largest_loss, found.mean_loss), (1.0, 1.0));
}

#[test]
fn the_share_that_may_change_is_the_contracts_or_the_one_given() {
    let found = choices(&chooser(five()), None);
    assert!(!found.kept() && found.allowed == 0.0, "a real format changes none");
    // 2 of 5
    assert!(choices(&chooser(five()), Some(0.4)).kept());
    assert!(!choices(&chooser(five()), Some(0.39)).kept());
    assert_eq!((found.share(), found.accepting_share()), (0.4, 0.4));
    let own = chooser(Golden {
        decisions: Some(0.5),
        ..five()
    });
    assert!(choices(&own, None).kept());
    // 1 of 3 is .333...: .34 accepts it
    let third = golden(&[3.0, 6.0, 4.0], &[5.0, 3.0, 7.0, 6.0, 5.0, 4.0], &[0, 0, 0]);
    let found = decisions(&chooser(third), None).unwrap();
    assert!(!found.kept());
    assert_eq!(
        (found.remedy(), found.numeric_format()),
        ("golden_decisions = 0.34".into(), "f32")
    );
    let integer = chooser(five()).with_format(NumericFormat::I16);
    assert_eq!(choices(&integer, None).allowed, 0.02);
}

#[test]
fn only_the_worst_three_are_told() {
    let observations = [6.0; 4];
    let q = [7.0, 6.0, 8.0, 6.0, 9.0, 6.0, 10.0, 6.0];
    let found = choices(&chooser(golden(&observations, &q, &[])), None);
    assert_eq!(found.changed, 4);
    let rows: Vec<usize> = found.worst.iter().map(|change| change.row).collect();
    assert_eq!(rows, [3, 2, 1]);
    // spans 1, 2, 3 and 4 of which the mean is 2.5; 1 + 2 + 3 + 4 are given up, a quarter of it each
    assert_eq!((found.largest_loss, found.mean_loss), (4.0 / 2.5, 2.5 / 2.5));
}

#[test]
fn without_q_values_the_network_itself_in_binary64_says_what_is_given_up() {
    // its own Q are (5, 6) and (5, 3): the trainer's other actions would have given up 1 and 2, the network's give up nothing
    let found = choices(&chooser(golden(&[6.0, 3.0], &[], &[0, 1])), None);
    assert_eq!((found.changed, found.ties, found.mean_loss), (0, 2, 0.0));
    assert_eq!(found.operating_range, 1.5);
    assert!(found.kept());
    let plain = threshold("source = \"u\"", PLAIN, &[]);
    assert!(decisions(&plain, None).is_none(), "nothing without golden vectors");
}

fn acting(golden: Golden) -> Policy {
    let mut policy = actor();
    policy.golden = Some(golden);
    policy
}

fn with_duties(duties: &[f32]) -> Golden {
    Golden {
        duties: duties.to_vec(),
        ..golden(&[0.5, 0.5, 1.0], &[], &[])
    }
}

#[test]
fn duties_are_compared_as_shares_of_the_heads_range() {
    // 0.5, 0.5 and, clipped, 0.75 in the network
    let found = decisions(&acting(with_duties(&[0.5, 0.625, 0.75])), None).unwrap();
    assert_eq!(
        (found.remedy(), found.numeric_format()),
        ("golden_duty = 2.5e-1".into(), "f32")
    );
    assert!(!found.kept());
    let Decisions::Continuous(duties) = found else {
        panic!("a head without actions")
    };
    assert_eq!((duties.observations, duties.range), (3, 0.5));
    assert_eq!(
        (duties.largest, duties.mean),
        (0.25, 0.25 / 3.0),
        "0.125 of 0.5, and nothing twice"
    );
    assert_eq!(duties.allowed, 1e-4, "the tolerance of a real format");
    let worst = duties.worst.unwrap();
    assert_eq!((worst.row, worst.expected, worst.found), (1, 0.625, 0.5));
    assert_eq!(worst.observation, [0.5]);
    for (error, kept) in [(0.25, true), (0.249, false)] {
        let accepting = Golden {
            duty_error: Some(error),
            ..with_duties(&[0.5, 0.625, 0.75])
        };
        assert_eq!(decisions(&acting(accepting), None).unwrap().kept(), kept, "{error}");
    }
}

#[test]
fn a_duty_that_is_not_known_is_that_of_the_known_output_or_of_the_network() {
    // outputs 0.5, 0.625 and 2, which the clip makes 0.75 of
    let outputs = golden(&[0.5, 0.5, 1.0], &[0.5, 0.625, 2.0], &[]);
    let Decisions::Continuous(of_outputs) = decisions(&acting(outputs), None).unwrap() else {
        panic!("a head without actions")
    };
    assert_eq!((of_outputs.largest, of_outputs.worst.unwrap().row), (0.25, 1));
    let Decisions::Continuous(own) = decisions(&acting(golden(&[0.5, 0.125], &[], &[])), None).unwrap() else {
        panic!("a head without actions")
    };
    assert_eq!((own.largest, own.mean, own.observations), (0.0, 0.0, 2));
}

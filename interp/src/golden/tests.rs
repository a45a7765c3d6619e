use super::*;

fn golden() -> Golden {
    Golden {
        count: 2,
        outside: 0,
        observations: vec![0.0, 1.0],
        q_values: vec![1.0, -4.0, 2.0, 3.0],
        action_indices: vec![0, 1],
        duties: Vec::new(),
        law: Vec::new(),
        outputs: Vec::new(),
        tolerance: 1e-5,
        decisions: None,
        duty_error: None,
    }
}

fn judged(q: [f64; 4]) -> GoldenResult {
    judge_choices(&golden(), &[&q[..2], &q[2..]])
}

#[test]
fn a_network_that_is_far_off_is_not_called_rounded_however_wide_the_tolerance() {
    let result = |error: f64, tolerance: f64, equal: usize| GoldenResult {
        vectors: 2,
        actions_compared: 2,
        actions_equal: equal,
        worst_relative_error: Some(error),
        worst_duty_error: None,
        worst_gain_error: None,
        limits_range: None,
        output_error: None,
        activations: Vec::new(),
        tolerance,
        rounded: false,
        outputs: Vec::new(),
    };
    assert_eq!(result(2e-5, 1e-5, 2).hint(), ROUNDED);
    assert_eq!(result(2e-5, 1e-5, 1).hint(), MISREAD, "another decision");
    assert_eq!(result(0.5, 0.1, 2).hint(), MISREAD, "half of the largest Q value");
    assert_eq!(result(ROUNDING, 1e-9, 2).hint(), ROUNDED, "the end belongs to it");
}

#[test]
fn equal_answers_pass() {
    let result = judged([1.0, -4.0, 2.0, 3.0]);
    assert!(result.passed());
    assert_eq!((result.actions_equal, result.worst_relative_error), (2, Some(0.0)));
}

#[test]
fn error_is_relative_to_the_largest_q_of_its_vector() {
    assert_eq!(judged([1.5, -4.0, 2.0, 3.0]).worst_relative_error, Some(0.125));
}

#[test]
fn one_vector_is_judged_by_all_its_q_values() {
    let one = Golden {
        count: 1,
        q_values: vec![1.0, -4.0, 2.0],
        action_indices: vec![2],
        ..golden()
    };
    let result = judge_choices(&one, &[&[1.0, -4.0, 3.0]]);
    assert_eq!((result.actions_equal, result.worst_relative_error), (1, Some(0.25)));
}

#[test]
fn nan_and_missing_answers_do_not_pass() {
    assert!(!judged([f64::NAN, -4.0, 2.0, 3.0]).passed());
    assert!(!judge_choices(&golden(), &[&[1.0, -4.0]]).passed());
}

#[test]
fn another_action_does_not_pass() {
    let result = judged([1.0, -4.0, 3.0, 2.999_999_9]);
    assert_eq!(result.actions_equal, 1);
    assert!(!result.passed());
}

fn head() -> policy::Continuous {
    policy::Continuous {
        squash: policy::Squash::Clip(policy::Interval { low: 0.0, high: 1.0 }),
        scale: 0.5,
        offset: 0.25,
    }
}

/// Outputs .2 and .6 with the duties that the head makes of them.
fn duties() -> Golden {
    Golden {
        q_values: vec![0.2, 0.6],
        action_indices: Vec::new(),
        duties: vec![0.35, 0.55],
        ..golden()
    }
}

#[test]
fn the_error_of_a_duty_is_a_share_of_the_heads_range() {
    let error = |answers: [f64; 2]| judge_duties(&duties(), &head(), &[&answers[..1], &answers[1..]]);
    assert!(error([0.2, 0.6]).passed());
    let off = error([0.2, 0.7]);
    assert!(!off.passed());
    // .05 of a range of .5
    assert!((off.worst_duty_error.unwrap() - 0.1).abs() < 1e-6);
    assert_eq!(off.hint(), MISREAD_DUTY);
    let low = Golden {
        q_values: vec![-1.0, 0.6],
        duties: vec![0.25, 0.55],
        ..duties()
    };
    assert!(judge_duties(&low, &head(), &[&[-1.0], &[0.6]]).passed());
    assert!(
        !judge_duties(&low, &head(), &[&[f64::NAN], &[0.6]]).passed(),
        "no number is no end of the clip"
    );
    assert!(
        !judge_duties(&duties(), &head(), &[&[0.2]]).passed(),
        "a row is missing"
    );
    // cut off by the clip: the same duty, and so the same answer
    let saturated = Golden {
        q_values: vec![1.5, 3.0],
        duties: Vec::new(),
        ..duties()
    };
    assert!(judge_duties(&saturated, &head(), &[&[2.0], &[1.0]]).passed());
}

#[test]
fn right_outputs_with_other_duties_blame_scale_and_offset() {
    let golden = Golden {
        duties: vec![0.35, 0.65],
        ..duties()
    };
    let result = judge_duties(&golden, &head(), &[&[0.2], &[0.6]]);
    assert!(!result.passed());
    assert_eq!(result.hint(), SCALED);
}

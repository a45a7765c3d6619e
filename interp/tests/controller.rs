//! Whole controllers against sequences worked out by hand.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

mod common;

use common::{PLAIN, threshold};
use interp::Sample::{Code, Physical};
use interp::{Command, Controller, InputError, Sample, status};

const SOURCE: &str = "source = \"u\"";

fn good(u: f32) -> [Sample; 2] {
    [Physical(u), Physical(1.0)]
}

fn bad() -> [Sample; 2] {
    [Physical(f32::NAN), Physical(1.0)]
}

/// Bad as well, and equal to itself in a trace.
fn far() -> [Sample; 2] {
    [Physical(1e9), Physical(1.0)]
}

fn controller(feature: &str, rest: &str, files: &[(&str, &str)]) -> Controller<f32> {
    Controller::new(&threshold(feature, rest, files))
}

/// Duty and status of every step.
fn commands(controller: &mut Controller<f32>, steps: &[[Sample; 2]]) -> Vec<(f32, u32)> {
    steps
        .iter()
        .map(|samples| {
            let command = controller.step(samples).unwrap().command;
            (command.duty, command.status)
        })
        .collect()
}

#[test]
fn first_valid_step_primes_and_chooses_the_greedy_action() {
    let mut c = controller(SOURCE, PLAIN, &[]);
    let trace = c.step(&good(6.0)).unwrap();
    assert_eq!(
        trace.command,
        Command {
            duty: 0.75,
            duty_sim: 0.75,
            action_index: 1,
            status: status::PRIMED
        }
    );
    assert_eq!(trace.q_values.to_vec(), [5.0, 6.0]);
    let trace = c.step(&good(5.0)).unwrap();
    assert_eq!(
        trace.command,
        Command {
            duty: 0.25,
            duty_sim: 0.25,
            action_index: 0,
            status: 0
        },
        "tie: lowest index"
    );
}

#[test]
fn nothing_is_usable_before_the_first_valid_sample() {
    let mut c = controller(SOURCE, PLAIN, &[]);
    let trace = c.step(&bad()).unwrap();
    assert_eq!(trace.command.status, status::FALLBACK);
    assert_eq!((trace.command.duty, trace.command.duty_sim), (0.0625, 0.0625));
    // held u is 0 after reset, i is measured
    assert_eq!((trace.signals.as_slice(), trace.bad_count), ([0.0, 1.0].as_slice(), 1));
    assert_eq!(c.state().primed, 0);
}

#[test]
fn bad_samples_are_held_k_times_then_fall_back_then_prime_anew() {
    let mut c = controller(SOURCE, PLAIN, &[]);
    let held = (0.75, status::HELD);
    let fallback = (0.0625, status::FALLBACK);
    let steps = [
        good(6.0),
        bad(),
        bad(),
        bad(),
        bad(),
        bad(),
        good(6.0),
        bad(),
        good(1.0),
    ];
    let expected = [
        (0.75, status::PRIMED),
        held,
        held,
        fallback,
        fallback,
        fallback,
        (0.75, status::PRIMED),
        held,
        (0.25, 0),
    ];
    assert_eq!(commands(&mut c, &steps), expected);
}

#[test]
fn bad_count_saturates_at_k_plus_one_and_one_good_sample_clears_it() {
    let mut c = controller(SOURCE, PLAIN, &[]);
    let mut counts = vec![];
    for samples in [good(1.0), bad(), bad(), bad(), bad(), bad(), good(1.0), bad()] {
        c.step(&samples).unwrap();
        counts.push((c.state().bad_count, c.state().primed));
    }
    let expected = [(0, 1), (1, 1), (2, 1), (3, 0), (3, 0), (3, 0), (0, 1), (1, 1)];
    assert_eq!(counts, expected);
}

#[test]
fn one_bad_signal_holds_that_signal_only() {
    let mut c = controller("source = \"u + i\"", PLAIN, &[]);
    c.step(&[Physical(3.0), Physical(1.0)]).unwrap();
    let trace = c.step(&[Physical(11.0), Physical(2.0)]).unwrap();
    assert_eq!(trace.valid, [false, true]);
    assert_eq!(trace.measured, [11.0, 2.0], "as it came, held or not");
    assert_eq!(trace.observation[0], 5.0, "held 3 + new 2");
    assert_eq!(c.state().held, [3.0, 2.0]);
}

#[test]
fn delay_keeps_the_held_value_through_a_bad_sample_and_starts_anew_after_a_fallback() {
    let mut c = controller("source = \"u\"\nfilters = [{ delay = 2 }]", PLAIN, &[]);
    let mut seen = vec![];
    for samples in [
        good(1.0),
        good(2.0),
        bad(),
        good(4.0),
        bad(),
        bad(),
        bad(),
        good(8.0),
        good(9.0),
    ] {
        seen.push(c.step(&samples).unwrap().observation[0]);
    }
    // held: 1 2 2 4 4 4 4 8 9; the last bad one falls back: the state is not primed when 8 comes
    assert_eq!(seen, [1.0, 1.0, 1.0, 2.0, 2.0, 4.0, 4.0, 8.0, 8.0]);
}

#[test]
fn a_fallback_as_first_step_does_not_prime_the_filters() {
    let mut c = controller("source = \"u\"\nfilters = [{ delay = 1 }]", PLAIN, &[]);
    c.step(&bad()).unwrap();
    // the line was written (with the held 0) but is not read
    assert_eq!(c.step(&good(7.0)).unwrap().observation[0], 7.0);
    assert_eq!(c.step(&good(9.0)).unwrap().observation[0], 7.0);
}

#[test]
fn filters_in_a_chain_feed_each_other() {
    let mut c = controller(
        "source = \"u\"\nfilters = [{ delay = 1 }, \"backward_difference\"]",
        PLAIN,
        &[],
    );
    let mut seen = vec![];
    for u in [1.0, 2.0, 4.0, 4.0] {
        let trace = c.step(&good(u)).unwrap();
        seen.push((trace.features[0].filtered[0], trace.features[0].filtered[1]));
    }
    // T = 0.25: the difference is multiplied by 4
    assert_eq!(seen, [(1.0, 0.0), (1.0, 0.0), (2.0, 4.0), (4.0, 8.0)]);
    assert_eq!(c.state().memory, [4.0, 4.0]);
}

#[test]
fn previous_duty_is_before_and_previous_command_behind_the_limits() {
    let rest = "[limits]\nduty = [0.3125, 0.6875]\ninitial_duty = 0.5\n[fallback]\nduty = 0.0625\nhold = 0\n";
    let mut c = controller("source = \"8 * previous_duty - previous_command\"", rest, &[]);
    // 8 * 0.5 - 0.5 = 3.5 <= 5: action 0, 0.25 limited to 0.3125
    let first = c.step(&good(0.0)).unwrap();
    assert_eq!(
        (first.observation[0], first.command.duty_sim, first.command.duty),
        (3.5, 0.25, 0.3125)
    );
    assert_eq!(first.command.status, status::PRIMED | status::LIMITED);
    assert_eq!(c.step(&good(0.0)).unwrap().observation[0], 2.0 - 0.3125);
    // hold = 0: the first bad sample falls back, both previous duties are the fallback then
    c.step(&bad()).unwrap();
    assert_eq!(c.step(&good(0.0)).unwrap().observation[0], 0.5 - 0.0625);
}

#[test]
fn slew_limits_the_command_but_not_the_fallback() {
    let rest =
        "[limits]\nduty = [0.125, 0.875]\ninitial_duty = 0.5\nslew = 0.125\n[fallback]\nduty = 0.0625\nhold = 0\n";
    let mut c = controller(SOURCE, rest, &[]);
    let slewed = status::SLEW_LIMITED;
    assert_eq!(
        commands(
            &mut c,
            &[good(9.0), good(9.0), good(9.0), good(0.0), bad(), good(9.0), good(0.0)]
        ),
        [
            (0.625, status::PRIMED | slewed),
            (0.75, 0),
            (0.75, 0),
            (0.625, slewed),
            (0.0625, status::FALLBACK),
            (0.1875, status::PRIMED | slewed),
            (0.25, 0),
        ]
    );
}

#[test]
fn soft_start_rises_from_the_start_and_again_after_a_fallback() {
    let rest = "[limits]\nduty = [0.125, 0.875]\ninitial_duty = 0.5\nsoft_start = { from = 0.375, steps = 4 }\n\
                [fallback]\nduty = 0.0625\nhold = 0\n";
    let mut c = controller(SOURCE, rest, &[]);
    let soft = status::SOFT_START;
    // (0.875 - 0.375)/4 = 0.125 per step
    assert_eq!(
        commands(
            &mut c,
            &[
                good(9.0),
                good(9.0),
                good(0.0),
                good(9.0),
                good(9.0),
                bad(),
                good(9.0),
                good(9.0)
            ]
        ),
        [
            (0.375, status::PRIMED | soft),
            (0.5, soft),
            (0.25, 0),
            (0.75, 0),
            (0.75, 0),
            (0.0625, status::FALLBACK),
            (0.375, status::PRIMED | soft),
            (0.5, soft),
        ]
    );
    assert_eq!(c.state().soft_cap, Some(0.625));
}

#[test]
fn eval_changes_nothing_and_step_is_eval_then_commit() {
    let feature = "source = \"u\"\nfilters = [{ low_pass = { time_constant = 1.0 } }, { moving_average = 3 }]";
    let mut stepped = controller(feature, PLAIN, &[]);
    let mut committed = stepped.clone();
    for samples in [good(1.0), good(7.0), far(), good(3.0), far(), far(), far(), good(2.0)] {
        let before = committed.state_words();
        let evaluated = committed.eval(&samples).unwrap();
        assert_eq!(evaluated, committed.eval(&samples).unwrap());
        assert_eq!(committed.observe(&samples).unwrap(), evaluated.observation);
        assert_eq!(
            committed.q_values(&evaluated.observation.view()).unwrap(),
            evaluated.q_values
        );
        assert_eq!(committed.state_words(), before);
        committed.commit(&samples, &evaluated.command).unwrap();
        assert_eq!(stepped.step(&samples).unwrap(), evaluated);
        assert_eq!(stepped.state_words(), committed.state_words());
    }
}

#[test]
fn a_reused_trace_equals_a_new_one() {
    let mut c = controller("source = \"u\"\nfilters = [{ delay = 1 }]", PLAIN, &[]);
    let mut trace = c.blank_trace();
    for samples in [good(1.0), far(), good(9.0), far(), far(), far(), good(4.0)] {
        let fresh = c.eval(&samples).unwrap();
        c.step_into(&samples, &mut trace).unwrap();
        assert_eq!(trace, fresh);
    }
}

#[test]
fn commit_takes_the_duties_from_the_command_that_was_applied() {
    let mut c = controller(SOURCE, PLAIN, &[]);
    let command = Command {
        duty: 0.5,
        duty_sim: 0.625,
        action_index: 0,
        status: 0,
    };
    c.commit(&good(9.0), &command).unwrap();
    assert_eq!(
        (c.state().previous_duty, c.state().previous_command, c.state().primed),
        (0.625, 0.5, 1)
    );
}

#[test]
fn wrong_arguments_are_errors_and_change_nothing() {
    let mut c = controller(SOURCE, PLAIN, &[]);
    let before = c.state_words();
    assert_eq!(
        c.step(&[Physical(1.0)]).unwrap_err(),
        InputError::SampleCount { expected: 2, found: 1 }
    );
    assert_eq!(
        c.step(&[Physical(1.0), Code(1)]).unwrap_err(),
        InputError::PhysicalExpected { signal: 1 }
    );
    let wrong = c.q_values(&ndarray::aview1(&[0.0, 0.0])).unwrap_err();
    assert_eq!(wrong, InputError::ObservationLength { expected: 1, found: 2 });
    // each of several outputs: there is one
    assert_eq!(c.decide_each(&ndarray::aview1(&[5.0, 3.0])), None);
    assert_eq!(c.state_words(), before);
}

/// What a trainer commits step by step is what `step` does: the next one finds the same state.
#[test]
fn a_trace_that_is_committed_leaves_the_state_of_a_step() {
    let mut whole = controller(SOURCE, PLAIN, &[]);
    let mut parts = whole.clone();
    let mut trace = parts.blank_trace();
    for samples in [good(6.0), bad(), far(), good(5.0)] {
        let command = whole.step(&samples).unwrap().command;
        parts.eval_into(&samples, &mut trace).unwrap();
        assert_ne!(
            parts.state_words(),
            whole.state_words(),
            "nothing is kept before it is committed"
        );
        parts.commit_trace(&trace);
        assert_eq!(trace.command, command);
        assert_eq!(parts.state_words(), whole.state_words());
    }
}

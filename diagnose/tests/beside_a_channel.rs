//! Causes beside a channel that something else disturbs: cases of the generator of blind cases, which shares no code with the plant.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod folder;

use diagnose::findings::Verdict;
use folder::{findings, ids};

/// The counter of `step` is named in `folder`, and `channel` is set aside.
fn is_named(folder: &str, channel: &str, step: f64) {
    let findings = findings(folder, &["judge.csv"]);
    assert_eq!(findings.verdict, Verdict::MostlyExplained, "{}", findings.sentence);
    assert_eq!(ids(&findings), ["duty_quantisation"], "{}", findings.sentence);
    assert_eq!(findings.set_aside.as_ref().unwrap().channel, Some(channel));
    let found = &findings.causes[0].parameters["duty_lsb"];
    assert!(
        found.low < 1.0002 * step && found.high > 0.9998 * step,
        "{} to {}",
        found.low,
        found.high
    );
}

/// The voltmeter is off by the cube of what it shows, so that one record looks like one of another source; the current shows that it is none.
#[test]
fn a_voltage_that_looks_like_another_source_is_set_aside() {
    is_named("counter_beside_v_out", "v_o", 1.805_309e-2);
}

/// A current that creeps bends the instants of the load steps, and beside those no counter leads.
#[test]
fn a_creeping_current_does_not_hide_a_counter() {
    is_named("counter_beside_i_l", "i_l", 7.729_545e-3);
}

/// Ten levels of the duty, which a counter that cuts off fits a little better than the one that rounds, and with 5 ns of dead time better still. The
/// held-out record is five times as far from these as its noise.
#[test]
fn a_counter_that_rounds_is_tried_where_one_that_cuts_off_does_not_hold() {
    is_named("counter_cut_or_rounded", "i_o", 7.517_986e-3);
}

/// A voltmeter that picks up a hum: of all causes a line of the source bends to it most, and leaves nothing in the voltage, which is what has to be set
/// aside.
#[test]
fn a_channel_that_causes_bend_to_is_set_aside_where_they_leave_something_in_others() {
    let findings = findings("pickup", &["judge.csv"]);
    assert_eq!(findings.verdict, Verdict::MostlyExplained, "{}", findings.sentence);
    assert_eq!(ids(&findings), ["turn_off_delay"], "{}", findings.sentence);
    assert_eq!(findings.set_aside.as_ref().unwrap().channel, Some("v_o"));
    let delay = &findings.causes[0].parameters["turn_off_delay"];
    assert!(delay.low < 1.191_87e-7 && delay.high > 1.191_87e-7, "{delay:?}");
}

/// One cause is named in `folder` with the value that was hidden, and `channel` is set aside.
fn holds(folder: &str, channel: &str, id: &str, (name, hidden): (&str, f64)) {
    let findings = findings(folder, &["judge.csv"]);
    assert_eq!(findings.verdict, Verdict::MostlyExplained, "{}", findings.sentence);
    assert_eq!(ids(&findings), [id], "{}", findings.sentence);
    assert_eq!(findings.set_aside.as_ref().unwrap().channel, Some(channel));
    let found = &findings.causes[0].parameters[name];
    assert!(found.low < hidden && found.high > hidden, "{found:?}");
}

/// A current probe that is off by the cube of what it shows runs against a switch of more resistance, and hides it: with the switch the current of the
/// held-out record is 1.6 times as far off as without. The voltage comes to its noise.
#[test]
fn a_cause_that_the_disturbance_had_hidden_is_named() {
    holds("switch_beside_probe", "i_l", "r_ds_on", ("r_ds_on", 2.772_214e-2));
}

/// A voltage that stands still, whatever the duty is. It shows nothing of what the current does, and no cause holds in the held-out record either.
#[test]
fn a_voltage_that_stands_still_lets_no_cause_hold() {
    let findings = findings("voltage_that_stands_still", &["judge.csv"]);
    assert_eq!(findings.verdict, Verdict::Unexplained, "{}", findings.sentence);
}

/// Rows in another order than they were taken. With the load's current set aside the voltage alone says that a cable is there; that the source's voltage was
/// measured as well bears that out no more.
#[test]
fn rows_in_another_order_are_no_cable() {
    let findings = findings("permuted_rows", &["judge.csv"]);
    assert_eq!(findings.verdict, Verdict::Unexplained, "{}", findings.sentence);
}

/// An inductor current that creeps; the voltage shows the curve of the core by itself, and nothing of the creeping.
#[test]
fn the_curve_of_a_core_is_named_beside_a_current_that_creeps() {
    holds("core_beside_creep", "i_l", "l_saturation", ("i_sat", 12.117_19));
}

/// What a meter of the source picks up has another phase in each record, and is a line for that: no converter kicks it.
#[test]
fn what_the_meter_of_the_source_picks_up_is_set_aside() {
    holds("pickup_of_source", "v_in", "c_wrong", ("capacitance", 1.873_82e-6));
}

/// A measured voltage of the source, with structure by chance, and nothing but the output voltage beside it. That shows as much as if the source had
/// never been measured.
#[test]
fn beside_the_source_one_channel_is_enough() {
    holds(
        "low_pass_beside_source",
        "v_in",
        "sensor_low_pass",
        ("time_constant", 1.172e-5),
    );
}

/// A source of 33.39 V in the place of 31, which its meter shows, and a current that sticks. What looked like another source before any fit had left the voltage
/// without a witness, though the cause says the same.
#[test]
fn another_source_is_named_beside_a_current_that_sticks() {
    let findings = findings("source_beside_backlash", &["judge.csv"]);
    assert_eq!(findings.verdict, Verdict::MostlyExplained, "{}", findings.sentence);
    assert_eq!(ids(&findings), ["v_in_wrong"], "{}", findings.sentence);
    let v_in = &findings.causes[0].parameters["v_in"];
    assert!((v_in.value - 33.3857).abs() < 0.02, "{}", findings.sentence);
}
